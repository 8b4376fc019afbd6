"""Curvature and geodesic context as signatures."""

from __future__ import annotations

import numpy as np
import pytest

import pliant
from pliant import curvature_signature, geodesic_context


def test_curvature_of_a_sphere() -> None:
    found = curvature_signature(pliant.shapes.icosphere(4, radius=3.0), scales=[3.0])
    np.testing.assert_allclose(found[:, 0], np.arcsinh(np.sqrt(4 * np.pi)), rtol=0.02)
    np.testing.assert_allclose(found[:, 1], 1, atol=0.02)


def test_curvature_does_not_see_size_place_or_numbering() -> None:
    mesh = pliant.shapes.bumpy_sphere(3, rng=0)
    order = np.random.default_rng(0).permutation(mesh.n_vertices)
    other = pliant.Mesh(5 * mesh.vertices[order] + 2, np.argsort(order)[mesh.faces])
    np.testing.assert_allclose(curvature_signature(other), curvature_signature(mesh)[order], atol=1e-6)


def test_turning_inside_out_mirrors_the_shape_index() -> None:
    mesh = pliant.shapes.bumpy_sphere(3, rng=0)
    out, inside = curvature_signature(mesh), curvature_signature(mesh.flipped())
    np.testing.assert_allclose(inside[:, 1::2], -out[:, 1::2], atol=1e-9)
    np.testing.assert_allclose(inside[:, ::2], out[:, ::2], atol=1e-9)


def test_flat_places_are_zero() -> None:
    found = curvature_signature(pliant.shapes.grid(6, 6))
    np.testing.assert_allclose(found, 0, atol=1e-6)


def test_context_by_hand() -> None:
    # A strip of a path: distances along it are whole numbers.
    mesh = pliant.shapes.grid(9, 2)
    samples = [0, 5, 11]
    found = geodesic_context(mesh, samples, bins=5)
    distances = pliant.geodesic_distances(mesh, samples)
    for vertex in (0, 7, 13):
        expected, _ = np.histogram(distances[:, vertex] / distances[:, vertex].max(), bins=5, range=(0, 1))
        np.testing.assert_allclose(found[vertex], expected / 3)


def test_context_counts_only_what_can_be_reached() -> None:
    one = pliant.shapes.icosphere(1)
    both = pliant.Mesh(
        np.concatenate([one.vertices, one.vertices + 9]),
        np.concatenate([one.faces, one.faces + one.n_vertices]),
    )
    found = geodesic_context(both, [0, 3], bins=4)
    np.testing.assert_allclose(found[:42].sum(axis=1), 1)
    np.testing.assert_array_equal(found[42:], 0)


def test_refusals() -> None:
    mesh = pliant.shapes.icosphere(1)
    for scales in ([], [0.0], [-1.0], [np.nan]):
        with pytest.raises(pliant.InputError, match="scales"):
            curvature_signature(mesh, scales=scales)
    with pytest.raises(pliant.InputError, match="samples"):
        geodesic_context(mesh, [99])
    with pytest.raises(pliant.InputError, match="one sample"):
        geodesic_context(mesh, [])
    with pytest.raises(pliant.InputError, match="bins"):
        geodesic_context(mesh, [0], bins=0)
