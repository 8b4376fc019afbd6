"""The two older ways that Pliant's reflections are measured against: each does what its paper says it can."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pliant import eigenbasis, geodesic_distances, shapes
from pliant.bench.symmetry import eigenfunction_signs, symmetry_factored
from pliant.matching.symmetry import reversed_area


@pytest.fixture(scope="module")
def figure():
    return shapes.quadruped(1500)


@pytest.fixture(scope="module")
def spectrum(figure):
    return eigenbasis(figure.mesh, 80)


def test_signs_find_a_mirror_that_is_exact(figure, spectrum):
    image = eigenfunction_signs(figure.mesh, spectrum)
    assert (image == figure.symmetry).mean() > 0.99


def test_signs_do_not_depend_on_those_of_the_basis(figure, spectrum):
    signs = np.random.default_rng(0).choice([-1.0, 1.0], spectrum.k)
    turned = replace(spectrum, vectors=spectrum.vectors * signs)
    assert np.array_equal(
        eigenfunction_signs(figure.mesh, spectrum), eigenfunction_signs(figure.mesh, turned)
    )


def test_signs_reflect_an_ellipsoid_through_one_of_its_planes():
    mesh = shapes.ellipsoid([1, 0.8, 0.5], 3)
    image = mesh.vertices[eigenfunction_signs(mesh, eigenbasis(mesh, 60), k=10)]
    signs = np.sign((image * mesh.vertices).sum(axis=0))
    assert -1 in signs
    assert np.abs(image - signs * mesh.vertices).max() < 0.15


def test_signs_turn_nothing_about_where_a_pose_mixes_eigenfunctions(figure):
    bent = figure.posed(figure.random_pose(rng=2)).mesh
    image = eigenfunction_signs(bent, eigenbasis(bent, 80))
    assert reversed_area(bent, image) < 0.3
    assert reversed_area(bent, figure.symmetry) == pytest.approx(1)


def test_the_factored_embedding_pairs_points_with_their_mirror_images(figure, spectrum):
    points, images = symmetry_factored(figure.mesh, spectrum, samples=120)
    truth = figure.symmetry[points]
    distances = geodesic_distances(figure.mesh, truth) / figure.mesh.area**0.5
    rows = np.arange(len(points))
    # Points near the mirror's line have no partner apart from themselves.
    apart = distances[rows, points] > 0.2
    spacing = np.median(np.sort(distances[:, points], axis=1)[:, 1])
    assert apart.sum() > 50
    assert np.median(distances[rows, images][apart]) < 1.5 * spacing
    assert np.isin(images, points).all()
    assert (images != points).all()
