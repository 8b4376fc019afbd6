"""Joint embedding: what is alike lands together, whichever set it comes from."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from pliant.errors import InputError
from pliant.spectral import joint_embedding


def features(n: int, seed: int, width: int = 4) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((n, width))


@given(seed=st.integers(0, 1000), neighbours=st.sampled_from([None, 8]))
def test_shuffled_copy_finds_itself(seed, neighbours):
    a = features(60, seed)
    order = np.random.default_rng(seed + 1).permutation(60)
    left, right = joint_embedding(a, a[order], 10, neighbours=neighbours)
    nearest = cdist(right, left).argmin(axis=1)
    assert (nearest == order).mean() > 0.95


def test_matches_the_formula():
    a, b = features(20, 0), features(30, 1)
    left, right = joint_embedding(a, b, 5, scale=1.0)
    both = np.vstack([a, b])
    affinity = np.exp(-(cdist(both, both) ** 2))
    root = np.sqrt(affinity.sum(axis=1))
    values, vectors = np.linalg.eigh(affinity / np.outer(root, root))
    expected = vectors[:, ::-1][:, 1:6]
    found = np.vstack([left, right])
    np.testing.assert_allclose(np.abs(np.sum(found * expected, axis=0)), 1, atol=1e-9)
    assert values[-1] == pytest.approx(1)
    assert left.shape == (20, 5)
    assert right.shape == (30, 5)


def test_random_walk_vectors():
    a, b = features(20, 0), features(30, 1)
    both = np.vstack([a, b])
    affinity = np.exp(-(cdist(both, both) ** 2))
    walk = affinity / affinity.sum(axis=1, keepdims=True)
    found = np.vstack(joint_embedding(a, b, 3, scale=1.0, normalisation="random-walk"))
    values = np.sort(np.linalg.eigvals(walk).real)[::-1][1:4]
    np.testing.assert_allclose(walk @ found, found * values, atol=1e-10)


@given(factor=st.floats(0.01, 100), seed=st.integers(0, 100))
def test_median_scale_forgets_the_unit(factor, seed):
    a, b = features(15, seed), features(12, seed + 1)
    one, other = joint_embedding(a, b, 3), joint_embedding(a * factor, b * factor, 3)
    np.testing.assert_allclose(other[0] @ other[1].T, one[0] @ one[1].T, atol=1e-6)


def test_sparse_solver_agrees_with_dense(monkeypatch):
    a, b = features(150, 0, 2), features(120, 1, 2)
    dense = joint_embedding(a, b, 6, neighbours=12)
    monkeypatch.setattr("pliant.spectral.joint._DENSE", 10)
    sparse = joint_embedding(a, b, 6, neighbours=12)
    for one, other in zip(dense, sparse, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-6)


def test_all_neighbours_make_the_full_affinity():
    a, b = features(30, 0), features(40, 1)
    full, every = joint_embedding(a, b, 5), joint_embedding(a, b, 5, neighbours=40)
    np.testing.assert_allclose(np.vstack(every), np.vstack(full), atol=1e-9)


def test_large_sets_run_on_neighbours():
    a, b = features(2500, 0, 3), features(2500, 1, 3)
    left, right = joint_embedding(a, b, 8)
    assert left.shape == right.shape == (2500, 8)
    again = joint_embedding(a, b, 8)
    assert left.tobytes() == again[0].tobytes()


def test_two_clusters_are_told_apart_by_the_first_coordinate():
    a = np.vstack([features(10, 0) * 0.1, features(10, 1) * 0.1 + 50])
    b = np.vstack([features(7, 2) * 0.1, features(9, 3) * 0.1 + 50])
    # The affinity between the clusters underflows to 0: the graph is in two pieces.
    left, right = joint_embedding(a, b, 1, scale=1.0)
    assert len(np.unique(np.sign(left[:10]))) == 1
    assert np.sign(left[0]) == np.sign(right[0])
    assert np.sign(left[10]) == np.sign(right[-1]) == -np.sign(left[0])


def test_unit_rows():
    left, right = joint_embedding(features(30, 0), features(20, 1), 6, unit_rows=True)
    np.testing.assert_allclose(np.linalg.norm(np.vstack([left, right]), axis=1), 1)


@pytest.mark.parametrize(
    ("a", "b", "options", "message"),
    [
        (np.ones((3, 2)), np.ones((3, 4)), {}, "one width, got 2 and 4"),
        (np.ones(3), np.ones((3, 4)), {}, "features_a must have shape"),
        (np.ones((3, 2)), np.zeros((0, 2)), {}, "features_b must have shape"),
        (features(3, 0), features(3, 0) * np.nan, {}, "3 of 3 rows are not finite"),
        (features(3, 0), features(3, 1), {"dim": 5}, r"dim must be 1\.\.4"),
        (features(3, 0), features(3, 1), {"dim": 0}, r"dim must be 1\.\.4"),
        (features(30, 0), features(30, 1), {"scale": -1.0}, "scale must be"),
        (features(30, 0), features(30, 1), {"scale": "mean"}, "scale must be"),
        (features(30, 0), features(30, 1), {"neighbours": 0}, "neighbours must be"),
        (features(30, 0), features(30, 1), {"normalisation": "none"}, "normalisation must be"),
        (np.ones((30, 2)), np.ones((30, 2)), {}, "all feature vectors are alike"),
    ],
)
def test_refusals(a, b, options, message):
    with pytest.raises(InputError, match=message):
        joint_embedding(a, b, **options)
