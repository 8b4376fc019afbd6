"""Key components: closed forms, limbs of a figure through poses, order of areas, refusals."""

from __future__ import annotations

import numpy as np
import pytest

import pliant
from pliant import InputError, shapes
from pliant.matching import key_components


def test_polar_caps_are_two_components():
    sphere = shapes.icosphere(4)
    height = sphere.vertices[:, 2]
    caps = key_components(sphere, descriptor=np.where(height > 0.8, 1.0, np.where(height < -0.7, 0.9, 0.0)))
    assert len(caps) == 2
    assert set(caps[0]) == set(np.flatnonzero(height < -0.7))
    assert set(caps[1]) == set(np.flatnonzero(height > 0.8))
    np.testing.assert_allclose(caps.areas, [2 * np.pi * 0.3, 2 * np.pi * 0.2], rtol=0.05)
    assert (caps.distinctive == (caps.labels >= 0)).all()


def test_more_clusters_tell_kinds_apart():
    sphere = shapes.icosphere(3)
    height = sphere.vertices[:, 2]
    bands = np.select([height > 0.8, height > 0.6], [2.0, 1.0], 0.0)
    found = key_components(sphere, descriptor=bands, clusters=3)
    assert len(found) == 2
    assert set(found.clusters) == {0, 1, 2}


def test_specks_are_dropped():
    sphere = shapes.icosphere(3)
    spots = (sphere.vertices[:, 2] > 0.7).astype(float)
    spots[np.argmin(sphere.vertices[:, 2])] = 1
    assert len(key_components(sphere, descriptor=spots, least_area=0)) == 2
    kept = key_components(sphere, descriptor=spots, least_area=0.01)
    assert len(kept) == 1
    assert not kept.distinctive[np.argmin(sphere.vertices[:, 2])]


def test_components_follow_the_figure_through_poses():
    figure = shapes.quadruped(2000)
    rest = key_components(figure.mesh)
    parts = {figure.part_names[np.bincount(figure.parts[rest[i]]).argmax()] for i in range(len(rest))}
    assert {"head", "tail", "left front leg", "right hind leg"} <= parts
    for pose in ("walk", "sit"):
        moved = key_components(figure.posed(pose).mesh)
        overlap = (rest.distinctive & moved.distinctive).sum() / (rest.distinctive | moved.distinctive).sum()
        assert overlap > 0.85
    mirrored = rest.distinctive[figure.symmetry]
    assert (mirrored == rest.distinctive).mean() > 0.98


def test_seed_scale_and_order_do_not_matter():
    mesh = shapes.quadruped(1000).mesh
    first = key_components(mesh)
    assert key_components(mesh).labels.tobytes() == first.labels.tobytes()
    assert (key_components(mesh.scaled(50), rng=9).labels == first.labels).all()


def test_two_clusters_of_numbers_are_the_best_of_all_cuts():
    sphere = shapes.icosphere(2)
    values = np.random.default_rng(4).normal(size=162) ** 3
    found = key_components(sphere, descriptor=values, least_area=0)

    def scatter(high):
        groups = (high, ~high)
        return sum(
            np.cov(values[g], aweights=sphere.vertex_areas[g], ddof=0) * sphere.vertex_areas[g].sum()
            for g in groups
        )

    cuts = [scatter(values > cut) for cut in np.sort(values)[2:-2]]
    assert scatter(found.clusters == 1) <= min(cuts) * (1 + 1e-9)


def test_refusals():
    sphere = shapes.icosphere(2)
    with pytest.raises(InputError, match="same everywhere"):
        key_components(sphere, descriptor=np.ones(162))
    with pytest.raises(InputError, match="shape"):
        key_components(sphere, descriptor=np.ones(5))
    with pytest.raises(InputError, match="NaN"):
        key_components(sphere, descriptor=np.full(162, np.nan))
    with pytest.raises(InputError, match="clusters"):
        key_components(sphere, descriptor=sphere.vertices, clusters=1)
    with pytest.raises(InputError, match="least_area"):
        key_components(sphere, descriptor=sphere.vertices, least_area=1)
    with pytest.raises(InputError, match="spectrum has 642"):
        key_components(sphere, spectrum=pliant.eigenbasis(shapes.icosphere(3), 20))
    with pytest.raises(IndexError, match="no number 7"):
        key_components(sphere, descriptor=sphere.vertices[:, 2] > 0)[7]
