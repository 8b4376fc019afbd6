"""Functional maps: directions, recovery of exact maps, refinement, agreement with pyFM, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.distance import cdist

import pliant
from pliant import InputError, eigenbasis, shapes
from pliant.matching import (
    FunctionalMap,
    fmap_from_points,
    functional_map,
    icp_refine,
    point_map,
    zoomout,
)
from pliant.matching._neighbours import nearest_rows


@pytest.fixture(scope="module")
def figure():
    return shapes.quadruped(1500)


@pytest.fixture(scope="module")
def spectrum(figure):
    return eigenbasis(figure.mesh, 60)


@pytest.fixture(scope="module")
def shuffled(figure):
    """The figure with its vertices in another order; ``new_of_old[i]`` is where vertex i went."""
    n = figure.mesh.n_vertices
    old_of_new = np.random.default_rng(0).permutation(n)
    new_of_old = np.argsort(old_of_new)
    mesh = pliant.Mesh(figure.mesh.vertices[old_of_new], new_of_old[figure.mesh.faces])
    return mesh, old_of_new, eigenbasis(mesh, 60)


def test_point_maps_and_functional_maps_go_opposite_ways(figure, spectrum):
    """a and b differ in size and in numbers, so that nothing transposed could pass."""
    coarse = shapes.quadruped(1000)
    other = eigenbasis(coarse.mesh, 25)
    p_ba = cdist(coarse.mesh.vertices, figure.mesh.vertices).argmin(axis=1)
    fmap = fmap_from_points(p_ba, spectrum, other, k=(40, 25))
    assert fmap.matrix.shape == (25, 40)
    height = spectrum.reconstruct(spectrum.project(figure.mesh.vertices[:, 1])[:40])
    carried = fmap.transfer(height)
    assert carried.shape == (coarse.mesh.n_vertices,)
    assert np.abs(carried - height[p_ba]).mean() < 0.02 * np.ptp(height)
    assert point_map(fmap).shape == (coarse.mesh.n_vertices,)
    assert point_map(fmap).max() > coarse.mesh.n_vertices


def test_identity_is_recovered_exactly(spectrum):
    everyone = np.arange(spectrum.n_vertices)
    fmap = fmap_from_points(everyone, spectrum, spectrum)
    np.testing.assert_allclose(fmap.matrix, np.eye(60), atol=1e-8)
    assert (point_map(fmap) == everyone).all()


def test_permutation_is_recovered_exactly(spectrum, shuffled):
    _mesh, old_of_new, other = shuffled
    fmap = fmap_from_points(old_of_new, spectrum, other)  # b = shuffled: its vertex i is old_of_new[i] of a
    np.testing.assert_allclose(np.abs(fmap.matrix), np.eye(60), atol=1e-5)
    assert (point_map(fmap) == old_of_new).all()


def test_size_does_not_matter_to_points(figure, spectrum):
    large = eigenbasis(figure.mesh.scaled(7), 60)
    everyone = np.arange(spectrum.n_vertices)
    up, down = fmap_from_points(everyone, spectrum, large), fmap_from_points(everyone, large, spectrum)
    assert (point_map(up) == everyone).all()
    assert (point_map(down) == everyone).all()
    # A function and its carried copy have the same values, so coefficients grow with the length unit.
    np.testing.assert_allclose(np.abs(np.diag(up.matrix)), 7, rtol=1e-6)
    np.testing.assert_allclose(up.transfer(spectrum.vectors[:, 3]), spectrum.vectors[:, 3], atol=1e-6)


def test_descriptors_that_tell_points_apart_give_the_map(spectrum, shuffled, figure):
    _mesh, old_of_new, other = shuffled
    places = figure.mesh.vertices
    functions = np.column_stack([places, np.sin(9 * places), np.cos(7 * places), np.sin(15 * places)])
    fmap = functional_map(spectrum, other, functions, functions[old_of_new], k=10, laplacian_weight=1e-3)
    truth = fmap_from_points(old_of_new, spectrum, other, k=10)
    assert fmap.matrix.shape == (10, 10)
    np.testing.assert_allclose(fmap.matrix, truth.matrix, atol=0.02)
    swapped = functional_map(other, spectrum, functions[old_of_new], functions, k=10, laplacian_weight=1e-3)
    np.testing.assert_allclose(swapped.matrix, truth.matrix.T, atol=0.02)


def test_minimiser_satisfies_the_normal_equations(spectrum, shuffled, figure):
    """With all three terms, from an independent dense least-squares solve."""
    _mesh, old_of_new, other = shuffled
    f = figure.mesh.vertices + 0.1
    g = f[old_of_new]
    k_a, k_b, weight, commute = 6, 5, 0.3, 0.7
    found = functional_map(
        spectrum, other, f, g, k=(k_a, k_b), laplacian_weight=weight, descriptor_weight=commute
    )
    squares = ((f * (spectrum.mass @ f)).sum(axis=0) + (g * (other.mass @ g)).sum(axis=0)) / (
        2 * spectrum.area
    )
    f, g = f / np.sqrt(3 * squares), g / np.sqrt(3 * squares)
    Pa, Pb = spectrum.vectors[:, :k_a], other.vectors[:, :k_b]
    A, B = Pa.T @ (spectrum.mass @ f) / spectrum.area**0.5, Pb.T @ (other.mass @ g) / other.area**0.5
    La, Lb = np.diag(spectrum.values[:k_a]), np.diag(other.values[:k_b])
    top = max(La.max(), Lb.max())
    eye_a, eye_b = np.eye(k_a), np.eye(k_b)
    rows = [np.kron(eye_b, A.T), weight**0.5 / top * (np.kron(eye_b, La) - np.kron(Lb, eye_a))]
    for i in range(3):
        X, Y = Pa.T @ (spectrum.mass @ (f[:, i : i + 1] * Pa)), Pb.T @ (other.mass @ (g[:, i : i + 1] * Pb))
        rows.append(commute**0.5 * (np.kron(eye_b, X.T) - np.kron(Y, eye_a)))
    right = np.concatenate([B.ravel(), np.zeros(sum(len(r) for r in rows[1:]))])
    expected = np.linalg.lstsq(np.vstack(rows), right, rcond=None)[0].reshape(k_b, k_a)
    np.testing.assert_allclose(found.matrix, expected, atol=1e-6)


def test_refinements_repair_a_spoilt_map(spectrum):
    everyone = np.arange(spectrum.n_vertices)
    noise = np.random.default_rng(1).normal(size=(12, 12))
    spoilt = FunctionalMap(np.eye(12) + 0.1 * noise, spectrum, spectrum)
    wrong = (point_map(spoilt) != everyone).mean()
    assert wrong > 0.5
    orthogonal = icp_refine(spoilt).matrix
    np.testing.assert_allclose(orthogonal @ orthogonal.T, np.eye(12), atol=1e-9)
    for samples in (None, 300):
        refined = zoomout(spoilt, samples=samples, step=4)
        assert refined.matrix.shape == (60, 60)
        assert (point_map(refined) == everyone).mean() > 0.95


def test_zoomout_between_bases_of_different_size(figure, spectrum):
    other = eigenbasis(figure.posed("walk").mesh, 25)
    start = fmap_from_points(np.arange(spectrum.n_vertices), spectrum, other, k=(9, 8))
    assert zoomout(start, k=40, step=6).matrix.shape == (25, 40)
    assert zoomout(start, k=9).matrix.shape == (9, 9)


def test_zoomout_agrees_with_pyfm():
    spectral = pytest.importorskip("pyFM.spectral")
    refine = pytest.importorskip("pyFM.refine")
    figure = shapes.quadruped(1000)
    meshes = [figure.mesh, figure.posed("walk").mesh]
    a, b = (eigenbasis(mesh.scaled(mesh.area**-0.5), 40) for mesh in meshes)
    start = fmap_from_points(np.arange(figure.mesh.n_vertices), a, b, k=10)
    noisy = FunctionalMap(start.matrix + 0.05 * np.random.default_rng(2).normal(size=(10, 10)), a, b)
    theirs = refine.zoomout_refine(noisy.matrix, a.vectors, b.vectors, nit=15, step=2, A2=b.mass)
    ours = zoomout(noisy, k=40, step=2).matrix
    np.testing.assert_allclose(ours, theirs, atol=1e-9)
    assert (point_map(noisy) == spectral.FM_to_p2p(noisy.matrix, a.vectors, b.vectors)).all()


@given(
    hnp.arrays(np.float64, st.tuples(st.integers(1, 30), st.just(9)), elements=st.integers(-5, 5)),
    hnp.arrays(np.float64, st.tuples(st.integers(1, 20), st.just(9)), elements=st.integers(-5, 5)),
)
def test_nearest_rows_ties_go_to_the_first(points, queries):
    assert (nearest_rows(points, queries) == cdist(queries, points, "sqeuclidean").argmin(axis=1)).all()


@pytest.mark.parametrize("dimension", [3, 8, 9, 40])
def test_nearest_rows_are_those_of_double_precision(dimension):
    """Candidates closer together than float32 can tell, far from the origin, over several blocks."""
    rng = np.random.default_rng(dimension)
    points = 100 + np.repeat(rng.normal(size=(2500, dimension)), 2, axis=0)
    points[1::2] += 1e-7 * rng.normal(size=(2500, dimension))
    queries = points[rng.permutation(5000)[:700]] + 1e-8 * rng.normal(size=(700, dimension))
    expected = ((queries[:, None] - points[None, :]) ** 2).sum(axis=2).argmin(axis=1)
    assert (nearest_rows(points, queries) == expected).all()


def test_refusals(spectrum, figure):
    n = spectrum.n_vertices
    f = figure.mesh.vertices
    with pytest.raises(InputError, match="3 descriptors and b 2"):
        functional_map(spectrum, spectrum, f, f[:, :2])
    with pytest.raises(InputError, match=r"1\.\.60.*got 61"):
        functional_map(spectrum, spectrum, f, f, k=61)
    with pytest.raises(InputError, match=r"shape \(1500, d\)"):
        functional_map(spectrum, spectrum, f[:-1], f)
    with pytest.raises(InputError, match="every descriptor is 0"):
        functional_map(spectrum, spectrum, 0 * f, 0 * f)
    with pytest.raises(InputError, match="laplacian_weight"):
        functional_map(spectrum, spectrum, f, f, laplacian_weight=-1)
    bad = f.copy()
    bad[7] = np.nan
    with pytest.raises(InputError, match=r"descriptors_b: 1 rows hold NaN.*\[7\]"):
        functional_map(spectrum, spectrum, f, bad)
    with pytest.raises(InputError, match="for each vertex of b"):
        fmap_from_points(np.arange(n - 1), spectrum, spectrum)
    with pytest.raises(InputError, match="outside"):
        fmap_from_points(np.full(n, n), spectrum, spectrum)
    with pytest.raises(InputError, match="compute more"):
        FunctionalMap(np.eye(61), spectrum, spectrum)
    with pytest.raises(InputError, match="finite"):
        FunctionalMap(np.full((3, 3), np.nan), spectrum, spectrum)
    small = FunctionalMap(np.eye(5), spectrum, spectrum)
    for options, words in (({"k": 4}, "k must be"), ({"k": 61}, "k must be"), ({"step": 0}, "step")):
        with pytest.raises(InputError, match=words):
            zoomout(small, **options)
    with pytest.raises(InputError, match="samples must be at least"):
        zoomout(small, samples=10)
    with pytest.raises(InputError, match="steps"):
        icp_refine(small, steps=0)
