"""Farthest point sampling, in any embedding and along a surface."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, as_floats, vertex_indices
from .._kernels import kernel
from ..errors import InputError, first_indices
from ..geodesic import GeodesicHierarchy
from ..mesh import Mesh

__all__ = ["farthest_points"]

DistanceFunction: TypeAlias = Callable[[int], ArrayLike]


def farthest_points(
    space: Mesh | ArrayLike | DistanceFunction,
    count: int,
    *,
    start: int | None = None,
    rng: int | np.random.Generator | None = None,
) -> IntArray:
    """Choose points far from one another: each next one is the farthest from those before it.

    Parameters
    ----------
    space : (n, d) array_like of float, Mesh or callable
        Points of a Euclidean embedding; or a mesh, whose vertices are sampled by geodesic distance along its
        edges; or a function that takes a point's number and returns its distances to all n points.
    count : int
        How many, from 1 to n.
    start : int, optional
        The first point. By default the one farthest from the mean: of an embedding its rows' mean, of a mesh
        its centre of area. With a function, the point farthest from point 0.
    rng : int or numpy.random.Generator, optional
        Draw the first point at random instead.

    Returns
    -------
    (count,) array of int
        In the order chosen. Ties go to the smaller number. Any first part of it is itself such a sample.

    Raises
    ------
    InputError
        If ``count`` or ``start`` is out of range, a distance is negative or NaN, or there are fewer distinct
        points than ``count``.

    Notes
    -----
    Cost n d count for an embedding, one sweep of the mesh a point otherwise. Pieces of a disconnected mesh
    are infinitely far apart, so each gets a point before any gets its second.

    The default start of a mesh moves with its pose; ``start`` or an embedding that bending
    leaves alone avoid that.

    Examples
    --------
    >>> import numpy as np
    >>> farthest_points(np.array([[0.0], [1.0], [4.0], [10.0]]), 3)
    array([3, 0, 2])
    """
    if start is not None and rng is not None:
        raise InputError("give start or rng, not both")
    if isinstance(space, Mesh):
        n = space.n_vertices
        solver = GeodesicHierarchy(space)
        outermost = _outermost(space.vertices, space.vertex_areas)
        return _by_function(lambda i: solver.distances([i])[0], n, count, _first(start, rng, n, outermost))
    if callable(space):
        distances = _checked_row(space(0), None)
        n = len(distances)
        return _by_function(space, n, count, _first(start, rng, n, int(distances.argmax())))
    points = _embedding(space)
    first = _first(start, rng, len(points), _outermost(points, np.ones(len(points))))
    _check_count(count, len(points))
    chosen, reached = _by_embedding(points, int(count), first)
    _check_distinct(chosen, reached)
    found: IntArray = chosen
    return found


def _embedding(space: ArrayLike) -> FloatArray:
    points = as_floats(space, "space")
    if points.ndim != 2 or not points.size:
        message = (
            f"an embedding must have shape (n, d) with a point and a dimension at least, got {points.shape}"
        )
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        message = f"space: {bad.size} points are not finite, first {first_indices(bad)}"
        raise InputError(message)
    return np.ascontiguousarray(points)


def _outermost(points: FloatArray, weights: FloatArray) -> int:
    total = weights.sum()
    mean = (weights @ points) / total if total > 0 else points.mean(axis=0)
    return int(((points - mean) ** 2).sum(axis=1).argmax())


def _first(start: int | None, rng: int | np.random.Generator | None, n: int, default: int) -> int:
    if start is not None:
        return int(vertex_indices(start, n, "start")[0])
    if rng is not None:
        return int(np.random.default_rng(rng).integers(n))
    return default


def _check_count(count: int, n: int) -> None:
    if isinstance(count, bool) or int(count) != count or not 1 <= count <= n:
        message = f"count must be a whole number 1..{n}, the number of points; got {count}"
        raise InputError(message)


def _check_distinct(chosen: IntArray, reached: int) -> None:
    if reached < len(chosen):
        message = f"there are only {reached} distinct points, {len(chosen)} were asked for; ask for fewer"
        raise InputError(message)


def _checked_row(values: ArrayLike, n: int | None) -> FloatArray:
    row = as_floats(values, "distances")
    if row.ndim != 1 or not row.size or (n is not None and len(row) != n):
        message = f"a distance function must return one distance a point, got shape {row.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~(row >= 0))
    if bad.size:
        message = f"distances: {bad.size} are negative or NaN, first at points {first_indices(bad)}"
        raise InputError(message)
    return row


def _by_function(distances_from: DistanceFunction, n: int, count: int, first: int) -> IntArray:
    _check_count(count, n)
    nearest = np.full(n, np.inf)
    chosen = np.full(int(count), first, dtype=np.int64)
    for i in range(int(count)):
        if i:
            chosen[i] = nearest.argmax()
            if nearest[chosen[i]] == 0:
                _check_distinct(chosen, i)
        nearest = np.minimum(nearest, _checked_row(distances_from(int(chosen[i])), n))
        nearest[chosen[i]] = 0
    return chosen


@kernel
def _by_embedding(points: Any, count: Any, first: Any) -> Any:
    """Return indices, and how many were reached before every point was a copy of a chosen one."""
    n, d = points.shape
    nearest = np.full(n, np.inf)
    chosen = np.full(count, first, np.int64)
    for i in range(1, count + 1):
        centre = points[chosen[i - 1]]
        far, farthest = -1.0, 0
        for j in range(n):
            total = 0.0
            for c in range(d):
                step = points[j, c] - centre[c]
                total += step * step
                if total >= nearest[j]:
                    break
            if total < nearest[j]:
                nearest[j] = total
            if nearest[j] > far:
                far, farthest = nearest[j], j
        if i == count:
            break
        if far == 0.0:
            return chosen, i
        chosen[i] = farthest
    return chosen, count
