"""Shifts of edges over edges, and how far the shared part reaches."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from pliant.images import match_pair
from pliant.images.agreement import even_edges
from pliant.images.blur import edge_channels
from pliant.images.correlation import shifts
from pliant.images.extent import Shared, grown, shared_part
from pliant.images.registration import agreeing

pytest.importorskip("cv2")


def scene(seed=0, height=60, width=80):
    values = gaussian_filter(np.random.default_rng(seed).random((height, width)), 2)
    return (values - values.min()) / np.ptp(values)


def edges_of(grey):
    return even_edges(edge_channels(grey))


@pytest.mark.parametrize(("across", "down"), [(0, 0), (13, -9), (-20, 11), (6, 15)])
def test_shifts_find_where_a_crop_came_from(across, down):
    large = scene(1, 140, 180)
    first = large[30:90, 40:120]
    second = large[30 + down : 90 + down, 40 + across : 120 + across]
    found = shifts(edges_of(first), edges_of(second), np.eye(2))[0]
    assert np.allclose(found, [[1, 0, -across], [0, 1, -down], [0, 0, 1]], atol=0.6)


def test_shifts_keep_the_linear_part_and_no_two_are_alike():
    large = scene(2, 120, 160)
    half = large.reshape(60, 2, 80, 2).mean(axis=(1, 3))
    found = shifts(edges_of(half), edges_of(large), 2 * np.eye(2), count=4)
    assert np.allclose(found[0], [[2, 0, 0.5], [0, 2, 0.5], [0, 0, 1]], atol=1.5)
    for transform in found:
        assert np.allclose(transform[:2, :2], 2 * np.eye(2))
    places = np.array([t[:2, 2] for t in found])
    apart = np.linalg.norm(places[:, None] - places, axis=2) + 100 * np.eye(len(found))
    assert apart.min() >= 4


def test_no_edges_have_no_shifts():
    assert shifts(edges_of(np.full((40, 50), 0.5)), edges_of(scene()), np.eye(2)) == []


def test_a_row_of_like_houses_is_not_matched_one_house_off():
    """The houses are alike; only windows, at places of their own, tell which is which."""
    rng = np.random.default_rng(0)
    house = scene(5, 90, 60)
    row = np.tile(house, (1, 6))
    for k in range(18):
        x, y = 20 * k + rng.integers(0, 8), rng.integers(5, 65)
        row[y : y + 22, x : x + 12] = rng.uniform(0, 1)
    row = np.pad(row, ((50, 50), (0, 0)), constant_values=0.5)
    match = match_pair(row[:, :270], 1 - row[:, 90:])
    assert np.allclose(match.transform[:2, 2], [-90, 0], atol=5)


def block(height=80, width=100):
    evidence = np.zeros((height, width))
    evidence[30:60, 30:70] = 1.0
    return evidence


def test_a_box_grows_up_a_thin_spire_and_not_down_a_faint_ground():
    evidence = block()
    correlation = np.where(evidence > 0, 0.9, 0.0)
    correlation[20:30, 48:51] = 0.8
    correlation[60:75, 30:70] = 0.8
    lines = np.where(evidence > 0, 1.0, 0.3 * correlation)
    box, region = grown(Shared(evidence, lines, correlation), 0.95)
    assert box == (30, 20, 70, 60)
    assert region[30:60, 30:70].all()
    assert not region[:30].any()


def test_a_box_grows_past_strong_lines_on_every_side_but_not_without_end():
    evidence = block()
    lines = np.ones(evidence.shape)
    box, _ = grown(Shared(evidence, lines, lines), 0.95)
    assert box == (30 - 16, 30 - 12, 70 + 16, 60 + 12)
    still, _ = grown(Shared(evidence, 0 * lines, 0 * lines), 0.95)
    assert still == (30, 30, 70, 60)


def test_nothing_shared_is_an_empty_box():
    nothing = np.zeros((20, 30))
    box, region = grown(Shared(nothing, nothing, nothing), 0.9)
    assert box == (0, 0, 0, 0)
    assert not region.any()


def test_the_shared_part_is_where_two_images_agree():
    rng = np.random.default_rng(3)
    first, second = rng.random((2, 120, 160))
    first, second = (gaussian_filter(g, 2) for g in (first, second))
    second[40:80, 60:110] = first[40:80, 60:110]
    shared = shared_part(edges_of(first), edges_of(second), np.eye(3))
    assert shared.evidence[45:75, 65:105].mean() > 4 * shared.evidence[:30].mean()
    charged = shared_part(edges_of(first), edges_of(second), np.eye(3), np.full((120, 160), 1.0))
    assert charged.evidence.sum() < shared.evidence.sum()


def test_agreeing_counts_what_a_transform_explains():
    points = np.random.default_rng(0).uniform(0, 100, (10, 2))
    moved = points + np.array([3, 0])
    moved[7:] += 50
    consensus, inliers = agreeing(points, moved, np.array([[1.0, 0, 1], [0, 1, 0], [0, 0, 1]]), 4.0)
    assert inliers.tolist() == [True] * 7 + [False] * 3
    assert consensus == pytest.approx(7 * 0.75)
