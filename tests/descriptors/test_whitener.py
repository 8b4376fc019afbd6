"""The learned metric."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

import pliant
from pliant import Whitener
from pliant.descriptors import perturbed_differences


@pytest.fixture
def noise() -> np.ndarray:
    rng = np.random.default_rng(0)
    return rng.normal(size=(4000, 5)) @ rng.normal(size=(5, 5))


def test_noise_becomes_white(noise: np.ndarray) -> None:
    white = Whitener(shrinkage=0.0).fit(noise).transform(noise)
    np.testing.assert_allclose(white.T @ white / len(white), np.eye(5), atol=1e-9)


def test_full_shrinkage_only_scales(noise: np.ndarray) -> None:
    matrix = Whitener(shrinkage=1.0).fit(noise).matrix_
    np.testing.assert_allclose(matrix, matrix[0, 0] * np.eye(5), atol=1e-12)


def test_distances_are_those_of_mahalanobis_in_any_coordinates(noise: np.ndarray) -> None:
    change = np.random.default_rng(1).normal(size=(5, 5))
    pair = np.random.default_rng(2).normal(size=(2, 5))
    here = Whitener(shrinkage=0.0).fit(noise).transform(pair)
    there = Whitener(shrinkage=0.0).fit(noise @ change).transform(pair @ change)
    assert np.linalg.norm(here[0] - here[1]) == pytest.approx(np.linalg.norm(there[0] - there[1]), rel=1e-8)


def test_pairs_are_the_same_as_their_differences(noise: np.ndarray) -> None:
    a = np.random.default_rng(3).normal(size=(4000, 5))
    order = np.random.default_rng(4).permutation(4000)
    b = a[order] + noise
    same = order.copy()
    same[:10] = -1
    by_pair = Whitener().fit([(a, b, same)]).matrix_
    np.testing.assert_allclose(by_pair, Whitener().fit(noise[10:]).matrix_, rtol=1e-9)


def test_directions_without_noise_stay_finite() -> None:
    flat = np.zeros((50, 3))
    flat[:, 0] = np.random.default_rng(0).normal(size=50)
    assert np.isfinite(Whitener(shrinkage=0.0).fit(flat).matrix_).all()


def test_is_an_estimator(noise: np.ndarray) -> None:
    pipeline = make_pipeline(FunctionTransformer(), Whitener(shrinkage=0.1))
    assert pipeline.fit_transform(noise).shape == noise.shape
    copy = clone(Whitener(shrinkage=0.25))
    assert copy.shrinkage == 0.25
    assert not hasattr(copy, "matrix_")


def test_helps_to_find_points_again() -> None:
    # A signature of one good column drowned by four that change from copy to copy.
    rng = np.random.default_rng(0)
    good = rng.normal(size=(800, 1))
    a, b, c = (np.hstack([good, 30 * rng.normal(size=(800, 4))]) for _ in range(3))
    same = np.arange(800)
    metric = Whitener(shrinkage=1e-7).fit([(a, b, same)])
    plain = pliant.hit_rate(a, c, same).at(0.01)
    learned = pliant.hit_rate(metric.transform(a), metric.transform(c), same).at(0.01)
    assert learned > plain + 0.2


def test_copies_of_a_shape_give_differences() -> None:
    mesh = pliant.shapes.ellipsoid([1, 1.4, 2], 3)

    def describe(shape: pliant.Mesh) -> np.ndarray:
        return np.log(pliant.hks(pliant.eigenbasis(shape, 20), n_times=6))

    found = perturbed_differences(mesh, describe, kinds=["noise", "sampling"], rng=3)
    assert found.shape[0] > mesh.n_vertices
    assert (
        found.tobytes() == perturbed_differences(mesh, describe, kinds=["noise", "sampling"], rng=3).tobytes()
    )
    assert 0 < np.abs(found).max() < 1
    np.testing.assert_array_equal(
        perturbed_differences(mesh, describe, kinds=["noise"], strength=0), np.zeros((mesh.n_vertices, 6))
    )


def test_refusals(noise: np.ndarray) -> None:
    with pytest.raises(pliant.InputError, match="shrinkage"):
        Whitener(shrinkage=2.0).fit(noise)
    with pytest.raises(pliant.InputError, match="all differences are 0"):
        Whitener().fit(np.zeros((4, 2)))
    with pytest.raises(pliant.InputError, match="not finite"):
        Whitener().fit(np.array([[np.nan, 1.0]]))
    with pytest.raises(pliant.InputError, match="one row or more"):
        Whitener().fit(np.zeros((0, 3)))
    with pytest.raises(pliant.InputError, match="not fitted"):
        Whitener().transform(noise)
    with pytest.raises(pliant.InputError, match="5 columns"):
        Whitener().fit(noise).transform(noise[:, :2])
    with pytest.raises(pliant.InputError, match="one width"):
        Whitener().fit([(noise, noise[:, :3], np.arange(len(noise)))])
    with pytest.raises(pliant.InputError, match="correspondence"):
        Whitener().fit([(noise, noise, np.arange(len(noise)) + 1)])
    with pytest.raises(pliant.InputError, match="at least one kind"):
        perturbed_differences(pliant.shapes.icosphere(1), lambda mesh: mesh.vertices, kinds=[])
    with pytest.raises(pliant.InputError, match="42 rows"):
        perturbed_differences(pliant.shapes.icosphere(1), lambda mesh: np.zeros((3, 2)), kinds=["noise"])
