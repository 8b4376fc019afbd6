"""Ball sums against comparing every pair."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from pliant.descriptors import ball_sums
from pliant.descriptors._cells import CELL, sorted_cells


def brute(points: np.ndarray, weights: np.ndarray, radii: np.ndarray, counting: str) -> np.ndarray:
    distances = cdist(points, points)
    share = [np.zeros_like(distances)] * len(radii)
    if counting == "points":
        share = [distances <= r for r in radii]
    elif counting == "gaussian":
        share = [np.exp(-(distances**2) / (2 * (r / 3) ** 2)) * (distances <= r) for r in radii]
    else:
        near = np.sort(distances, axis=1)[:, 1 : min(7, len(points))]
        spread = np.sqrt(np.sqrt(3) / (2 * np.pi) * (near**2).mean(axis=1))
        share = []
        for r in radii:
            table = np.clip((r - distances + spread) / (2 * spread), 0, 1)
            table[np.diag_indices(len(points))] = np.minimum((r / spread) ** 2, 1)
            share.append(table)
    return np.stack([table @ weights for table in share], axis=1)


def sheet(n: int, seed: int, dims: int = 40) -> np.ndarray:
    """A curved surface in many dimensions whose coordinates fall as an eigenbasis makes them."""
    rng = np.random.default_rng(seed)
    flat = rng.uniform(-1, 1, size=(n, 2))
    waves = rng.normal(size=(2, dims)) * np.sqrt(np.arange(1, dims + 1))
    return np.cos(flat @ waves + rng.uniform(0, 6, dims)) / np.arange(1, dims + 1)


@pytest.mark.parametrize(("counting", "rtol"), [("points", 1e-12), ("patches", 1e-5), ("gaussian", 1e-9)])
@pytest.mark.parametrize("n", [1, 5, 63, 64, 65, 700])
def test_agree_with_every_pair(counting: str, rtol: float, n: int) -> None:
    points, rng = sheet(n, n), np.random.default_rng(1)
    weights = rng.uniform(0, 1, size=(n, 2))
    radii = np.geomspace(0.01, 3, 17)
    if counting == "patches" and n < 2:
        return
    found = ball_sums(points, weights, radii, counting=counting)
    np.testing.assert_allclose(found, brute(points, weights, radii, counting), rtol=rtol, atol=1e-14)


@given(
    n=st.integers(2, 300),
    dims=st.integers(1, 30),
    seed=st.integers(0, 10**6),
    radii=st.lists(st.floats(0.01, 5), min_size=1, max_size=6, unique=True),
)
def test_agree_with_every_pair_on_clouds(n: int, dims: int, seed: int, radii: list[float]) -> None:
    # Clouds are nothing like surfaces: twelve coordinates leave much out, and most pairs need all of them.
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, dims))
    weights = rng.uniform(0, 1, size=(n, 2))
    steps = np.sort(radii)
    np.testing.assert_allclose(
        ball_sums(points, weights, steps), brute(points, weights, steps, "points"), rtol=1e-12, atol=1e-14
    )
    found = ball_sums(points, weights, steps, counting="patches")
    np.testing.assert_allclose(found, brute(points, weights, steps, "patches"), rtol=1e-4, atol=1e-10)


def test_distances_that_equal_a_radius_exactly_are_inside() -> None:
    grid = np.stack(np.meshgrid(np.arange(12.0), np.arange(12.0)), axis=-1).reshape(-1, 2)
    radii = np.array([1.0, 2.0, 5.0, 13.0])
    ones = np.ones((len(grid), 2))
    np.testing.assert_array_equal(ball_sums(grid, ones, radii), brute(grid, ones, radii, "points"))


def test_points_that_coincide() -> None:
    points = np.repeat(sheet(20, 3), 10, axis=0)
    weights = np.ones((200, 2))
    radii = np.array([1e-9, 0.3, 2.0])
    np.testing.assert_array_equal(ball_sums(points, weights, radii), brute(points, weights, radii, "points"))
    assert np.isfinite(ball_sums(points, weights, radii, counting="patches")).all()


def test_far_from_the_origin_nothing_is_lost() -> None:
    points, weights = sheet(300, 5), np.ones((300, 2))
    radii = np.geomspace(0.02, 2, 8)
    there = ball_sums(points + 50.0, weights, radii)
    np.testing.assert_array_equal(there, brute(points + 50.0, weights, radii, "points"))


@pytest.mark.parametrize("counting", ["points", "patches", "gaussian"])
def test_same_bytes_for_any_number_of_threads(counting: str) -> None:
    points = sheet(2000, 9)
    weights = np.random.default_rng(0).uniform(size=(2000, 2))
    radii = np.geomspace(0.05, 2, 9)
    one = ball_sums(points, weights, radii, counting=counting, n_jobs=1)
    three = ball_sums(points, weights, radii, counting=counting, n_jobs=3)
    assert one.tobytes() == three.tobytes()


def test_cells_bound_what_they_leave_out() -> None:
    points = sheet(500, 2)
    cells = sorted_cells(points, 6)
    assert sorted(cells.order) == list(range(500))
    for cell in range(cells.count):
        members = cells.points[cell * CELL : (cell + 1) * CELL]
        size = len(members)
        rebuilt = cells.frames[cell, 0] + cells.coordinates[cell].T[:size] @ cells.frames[cell, 1:]
        left = np.linalg.norm(members - rebuilt, axis=1)
        assert (left <= cells.residuals[cell, :size] + 1e-15).all()
        assert (np.linalg.norm(members - cells.frames[cell, 0], axis=1) <= cells.reaches[cell] + 1e-15).all()


def test_spacings_are_those_of_the_six_nearest() -> None:
    points = sheet(400, 6)
    cells = sorted_cells(points, 6)
    found = cells.spacings(6, slice(0, cells.count))
    near = np.sort(cdist(cells.points, cells.points), axis=1)[:, 1:7]
    np.testing.assert_allclose(found, np.sqrt((near**2).mean(axis=1)), rtol=1e-12)
