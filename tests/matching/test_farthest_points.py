"""Farthest point sampling: definition, order, ties, starts, meshes, functions, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.distance import cdist

import pliant
from pliant import InputError, shapes
from pliant.matching import farthest_points


def _by_definition(distances: np.ndarray, count: int, first: int) -> list[int]:
    chosen = [first]
    while len(chosen) < count:
        chosen.append(int(distances[chosen].min(axis=0).argmax()))
    return chosen


@given(
    hnp.arrays(
        np.float64,
        st.tuples(st.integers(4, 25), st.integers(1, 4)),
        elements=st.integers(-30, 30),
        unique=True,
    )
)
def test_each_next_point_is_the_farthest(points):
    found = farthest_points(points, 4, start=2)
    assert found.tolist() == _by_definition(cdist(points, points), 4, 2)


def test_a_first_part_of_a_sample_is_a_sample():
    points = np.random.default_rng(0).normal(size=(200, 5))
    assert (farthest_points(points, 50)[:20] == farthest_points(points, 20)).all()


def test_default_start_is_the_point_farthest_from_the_mean_whatever_the_order():
    rng = np.random.default_rng(1)
    points = rng.normal(size=(60, 3))
    order = rng.permutation(60)
    there = farthest_points(points, 12)
    here = farthest_points(points[order], 12)
    assert there[0] == ((points - points.mean(axis=0)) ** 2).sum(axis=1).argmax()
    assert (order[here] == there).all()


def test_random_start_follows_the_seed():
    points = np.random.default_rng(2).normal(size=(500, 2))
    first = {int(farthest_points(points, 1, rng=seed)[0]) for seed in range(20)}
    assert len(first) > 10
    assert (farthest_points(points, 9, rng=3) == farthest_points(points, 9, rng=3)).all()


def test_a_mesh_is_sampled_by_geodesic_distance():
    mesh = shapes.human(1000, pose="sit").mesh
    distances = pliant.geodesic_distances(mesh, np.arange(mesh.n_vertices))
    found = farthest_points(mesh, 12, start=5)
    assert found.tolist() == _by_definition(distances, 12, 5)
    assert (farthest_points(lambda i: distances[i], 12, start=5) == found).all()


def test_every_piece_of_a_mesh_gets_a_point_first():
    ball = shapes.icosphere(1)
    n = ball.n_vertices
    parts = [ball.vertices + np.array([9 * i, 0, 0]) for i in range(4)]
    mesh = pliant.Mesh(np.vstack(parts), np.vstack([ball.faces + i * n for i in range(4)]))
    assert sorted(farthest_points(mesh, 4) // n) == [0, 1, 2, 3]


@pytest.mark.parametrize("count", [0, -1, 4, 1.5, True])
def test_count_must_fit(count):
    with pytest.raises(InputError, match=r"1\.\.3"):
        farthest_points(np.eye(3), count)


def test_refusals_name_what_is_wrong():
    points = np.zeros((4, 2))
    with pytest.raises(InputError, match="only 1 distinct"):
        farthest_points(points, 2)
    with pytest.raises(InputError, match="only 1 distinct"):
        farthest_points(lambda i: np.zeros(3), 2)
    points[2, 1] = np.nan
    with pytest.raises(InputError, match=r"not finite, first \[2\]"):
        farthest_points(points, 2)
    with pytest.raises(InputError, match="start or rng"):
        farthest_points(np.eye(3), 2, start=0, rng=0)
    with pytest.raises(InputError, match="start"):
        farthest_points(np.eye(3), 2, start=3)
    with pytest.raises(InputError, match="shape"):
        farthest_points(np.zeros(5), 2)
    with pytest.raises(InputError, match="negative or NaN"):
        farthest_points(lambda i: [0.0, -1.0], 2)
