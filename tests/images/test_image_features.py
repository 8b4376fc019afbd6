"""Edges, points, geometric blur and the joint embedding: closed forms and laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from pliant.errors import InputError
from pliant.images import edge_channels, edge_points, embed_pair, geometric_blur, mutual_matches
from pliant.images.blur import RADII, SAMPLES

pytest.importorskip("cv2")


def scene(height=120, width=160, seed=0):
    values = gaussian_filter(np.random.default_rng(seed).random((height, width)), 3)
    return (values - values.min()) / np.ptp(values)


@pytest.mark.parametrize("angle", [0, 20, 45, 80, 90, 135])
def test_channels_hold_the_orientation_of_an_edge(angle):
    y, x = np.mgrid[:80, :80]
    theta = np.deg2rad(angle)
    ramp = np.cos(theta) * (x - 40) + np.sin(theta) * (y - 40)
    edges = edge_channels(1 / (1 + np.exp(-ramp)))
    shares = edges.channels[:, 30:50, 30:50].sum(axis=(1, 2))
    expected = np.array([max(0, 1 - min(abs(angle / 45 - k), 4 - abs(angle / 45 - k))) for k in range(4)])
    assert np.allclose(shares / shares.sum(), expected, atol=0.03)


def test_channels_add_up_to_the_strength_and_ignore_the_sign_of_contrast():
    grey = scene()
    edges, negative = edge_channels(grey), edge_channels(1 - grey)
    assert np.allclose(edges.channels.sum(axis=0), edges.strength, rtol=1e-5, atol=1e-7)
    assert np.allclose(edges.channels, negative.channels, atol=1e-5)


def test_fill_makes_no_edges():
    grey, mask = scene(), np.ones((120, 160), dtype=bool)
    mask[:, :50] = False
    padded = np.where(mask, grey, 0.0)
    edges = edge_channels(padded, mask=mask)
    assert edges.strength[:, :52].max() == 0
    open_ = edge_channels(padded)
    assert edges.strength[:, 52:56].mean() < 0.3 * open_.strength[:, 48:52].mean()


@given(st.integers(0, 2**32), st.floats(0, 12), st.integers(1, 80))
def test_points_keep_their_distance_and_lie_on_edges(seed, spacing, count):
    strength = np.zeros((60, 70))
    strength[10:50, 20:60] = scene(40, 40)
    points = edge_points(strength, count, spacing=spacing, rng=seed)
    assert len(points) <= count
    assert (strength[points[:, 1], points[:, 0]] > 0).all()
    apart = np.linalg.norm(points[:, None] - points[None], axis=2) + np.eye(len(points)) * 1e9
    assert (apart >= max(spacing, 1)).all()
    assert np.array_equal(points, edge_points(strength, count, spacing=spacing, rng=seed))


def test_points_are_drawn_in_proportion_to_the_edges():
    strength = np.ones((200, 200))
    strength[:, 100:] = 3.0
    points = edge_points(strength, 4000, spacing=0, rng=0)
    assert (points[:, 0] >= 100).mean() == pytest.approx(0.75, abs=0.03)


def test_blur_samples_what_the_reference_says():
    """One channel impulse: the descriptor is the Gaussian of each ring's width, at each ring's offsets."""
    from pliant.images import EdgeChannels

    channels = np.zeros((2, 201, 201))
    channels[0, 100, 100] = 1.0
    edges = EdgeChannels(channels, channels.sum(axis=0), np.ones((201, 201), dtype=bool))
    point = np.array([[104.0, 97.0]])
    found = geometric_blur(edges, point, normalise="none").reshape(-1, 2)
    expected = []
    for radius, count in zip(RADII, SAMPLES, strict=True):
        sigma = 0.5 * radius + 1
        for k in range(count):
            turn = 2 * np.pi * k / count
            at = np.rint(point[0] + radius * np.array([np.cos(turn), np.sin(turn)]))
            squared = ((at - 100) ** 2).sum()
            expected.append(np.exp(-squared / (2 * sigma**2)) / (2 * np.pi * sigma**2))
    assert np.allclose(found[:, 0], expected, rtol=0.05, atol=2e-6)
    assert not found[:, 1].any()


def test_blur_moves_with_the_image_and_ignores_contrast():
    grey = scene(200, 240)
    points = np.array([[110.0, 100.0], [130.0, 95.0]])
    here = geometric_blur(edge_channels(grey), points)
    shifted = geometric_blur(edge_channels(np.roll(grey, (6, -9), axis=(0, 1))), np.add(points, [-9, 6]))
    assert np.abs(here - shifted).max() < 0.02
    faint = geometric_blur(edge_channels(0.1 * grey + 0.4), points)
    assert np.allclose(here, faint, atol=1e-4)


@pytest.mark.parametrize(("normalise", "power"), [("hellinger", 2), ("l2", 2)])
def test_normalised_descriptors_have_length_1(normalise, power):
    found = geometric_blur(edge_channels(scene()), [[80, 60], [10, 10]], normalise=normalise)
    assert np.allclose((found**power).sum(axis=1), 1)


def test_blur_of_nothing_is_zero_and_no_points_are_fine():
    edges = edge_channels(np.full((50, 60), 0.5))
    assert not geometric_blur(edges, [[30, 20]]).any()
    assert geometric_blur(edges, np.zeros((0, 2))).shape == (0, 204)


def test_bad_options_are_named():
    edges = edge_channels(scene())
    with pytest.raises(InputError, match="1 of 2 points are outside"):
        geometric_blur(edges, [[5, 5], [500, 5]])
    with pytest.raises(InputError, match="normalise"):
        geometric_blur(edges, [[5, 5]], normalise="l1")
    with pytest.raises(InputError, match="mask"):
        edge_channels(scene(), mask=np.ones((3, 3)))
    with pytest.raises(InputError, match="none negative"):
        edge_points(-np.ones((5, 5)), 3)


def test_embedding_does_not_depend_on_unit_or_order():
    rng = np.random.default_rng(0)
    one, two = rng.random((40, 12)), rng.random((35, 12))
    a, b = embed_pair(one, two, 10)
    scaled = embed_pair(7 * one, 7 * two, 10)
    apart = np.linalg.norm(a[:, None] - b[None], axis=2)
    assert np.allclose(apart, np.linalg.norm(scaled[0][:, None] - scaled[1][None], axis=2), atol=1e-8)
    order = rng.permutation(40)
    c, d = embed_pair(one[order], two, 10)
    assert np.allclose(apart[order], np.linalg.norm(c[:, None] - d[None], axis=2), atol=1e-8)
    assert np.allclose(np.linalg.norm(a, axis=1), 1)


def test_mutual_matches_find_a_hidden_permutation():
    rng = np.random.default_rng(3)
    one = rng.random((50, 6))
    order = rng.permutation(50)
    pairs, distances = mutual_matches(one, one[order] + rng.normal(0, 1e-3, (50, 6)))
    assert len(pairs) == 50
    assert (order[pairs[:, 1]] == pairs[:, 0]).all()
    assert (np.diff(distances) >= 0).all()
    empty, none = mutual_matches(np.zeros((0, 6)), one)
    assert empty.shape == (0, 2)
    assert none.shape == (0,)


def test_embedding_of_equal_features_is_refused():
    with pytest.raises(InputError, match="alike"):
        embed_pair(np.ones((5, 3)), np.ones((5, 3)), 2)
    with pytest.raises(InputError, match="three points"):
        embed_pair(np.ones((1, 3)), np.ones((1, 3)), 2)
