"""Map error: how far along the surface the points of a map lie from where they belong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, as_floats, as_indices, frozen, vertex_indices
from ..errors import InputError, MeshError
from ..geodesic import GeodesicHierarchy
from ..geodesic.graph import GraphKind
from ..mesh import Mesh
from ._checks import point_map_of

__all__ = ["DEFAULT_THRESHOLDS", "MapError", "map_error"]

# Where curves of map error are drawn in print.
DEFAULT_THRESHOLDS = tuple(round(0.005 * i, 4) for i in range(51))

_SOURCES = 512


@dataclass(frozen=True, eq=False, repr=False)
class MapError:
    """Errors of a map of points, in units of the square root of the target's area.

    Parameters
    ----------
    errors : (s,) array of float
        Geodesic distance from each mapped point to the truth; inf on another piece of the surface.
    thresholds : (t,) array of float
        Errors at which the curve is read.
    mirrored : (s,) array of float or None
        Distances to the mirror image of the truth, where a symmetry was given; NaN where it is not known.
    points : (s,) array of int
        Which entries of the map the errors belong to.
    n_missing : int
        Points left out because they have no truth.

    Examples
    --------
    >>> error = MapError([0.0, 0.1], [0.05, 0.2], None, [0, 1])
    >>> error
    MapError(2 points, mean 0.0500)
    >>> error.curve
    array([0.5, 1. ])
    """

    errors: FloatArray
    thresholds: FloatArray
    mirrored: FloatArray | None
    points: IntArray
    n_missing: int = 0

    def __post_init__(self) -> None:
        errors = as_floats(self.errors, "errors")
        if errors.ndim != 1 or not errors.size or not (errors >= 0).all():
            raise InputError("errors must be one or more numbers of 0 or more")
        thresholds = as_floats(self.thresholds, "thresholds")
        if thresholds.ndim != 1 or not thresholds.size or not (thresholds >= 0).all():
            raise InputError("thresholds must be one or more numbers of 0 or more")
        object.__setattr__(self, "errors", frozen(errors))
        object.__setattr__(self, "thresholds", frozen(thresholds))
        object.__setattr__(self, "points", frozen(as_indices(self.points, "points")))
        if self.mirrored is not None:
            object.__setattr__(self, "mirrored", frozen(as_floats(self.mirrored, "mirrored")))

    def __repr__(self) -> str:
        either = "" if self.mirrored is None else f", {self.symmetric_mean:.4f} up to the symmetry"
        return f"MapError({len(self.errors)} points, mean {self.mean:.4f}{either})"

    @property
    def mean(self) -> float:
        """Mean error."""
        return float(self.errors.mean())

    @property
    def curve(self) -> FloatArray:
        """(t,) share of the points whose error is at most each threshold."""
        return _curve(self.errors, self.thresholds)

    @property
    def symmetric_errors(self) -> FloatArray | None:
        """(s,) errors against the truth or against its mirror image, whichever suits the whole map.

        One choice for all points: a map that is right on one half and mirrored on the other is wrong.
        """
        if self.mirrored is None:
            return None
        known = ~np.isnan(self.mirrored)
        flipped = known.any() and self.mirrored[known].mean() < self.errors[known].mean()
        return frozen(np.where(known, self.mirrored, self.errors) if flipped else self.errors)

    @property
    def symmetric_mean(self) -> float | None:
        """Mean of :attr:`symmetric_errors`."""
        errors = self.symmetric_errors
        return None if errors is None else float(errors.mean())

    @property
    def symmetric_curve(self) -> FloatArray | None:
        """(t,) the curve of :attr:`symmetric_errors`."""
        errors = self.symmetric_errors
        return None if errors is None else _curve(errors, self.thresholds)

    @property
    def pointwise_errors(self) -> FloatArray | None:
        """(s,) errors against the truth or its mirror image, whichever is nearer, point by point.

        The most lenient reading: it does not see halves that are swapped.
        """
        return None if self.mirrored is None else frozen(np.fmin(self.errors, self.mirrored))


def map_error(
    p_ba: ArrayLike,
    truth: ArrayLike,
    mesh_a: Mesh,
    *,
    symmetry: ArrayLike | None = None,
    samples: int | None = None,
    rng: int | np.random.Generator = 0,
    thresholds: ArrayLike = DEFAULT_THRESHOLDS,
    graph: GraphKind = "refined",
    n_jobs: int | None = None,
    progress: bool = False,
) -> MapError:
    """Measure a map of points from b to a against the truth.

    Parameters
    ----------
    p_ba : (m,) array_like of int
        Where the map sends each point: a vertex of a. The points are the vertices of b, or any list of them
        (``p_ba[list_of_b]`` beside ``list_of_a``).
    truth : (m,) array_like of int
        Where each belongs, a vertex of a; -1 where that is not known.
    mesh_a : Mesh
        The surface the map leads to.
    symmetry : (n_a,) array_like of int, optional
        Mirror image of each vertex of a, -1 where there is none: errors against the mirrored truth are then
        reported as well.
    samples : int, optional
        Measure only so many points, drawn at random without repetition. All by default.
    rng : int or numpy.random.Generator
        Seed of the draw.
    thresholds : (t,) array_like of float
        Where to read the curve: 0 to 0.25 by default.
    graph : {"edges", "refined"}
        Where geodesics run, see :func:`pliant.edge_graph`.
    n_jobs : int, optional
        Threads; all by default.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    MapError
        In units of the square root of the area of ``mesh_a``.

    Raises
    ------
    InputError
        If shapes do not fit, an index is out of range, or no point has a truth.
    MeshError
        If the mesh has no area.

    Notes
    -----
    Cost: one geodesic sweep for every distinct vertex of truth. Paths of the graph are a few per
    cent longer than on the surface, so errors err on the large side.

    The protocol is that of Kim, Lipman & Funkhouser, Blended intrinsic maps, ACM TOG 30(4), 2011.

    Examples
    --------
    >>> from pliant import shapes
    >>> strip = shapes.grid(2, 11)
    >>> import numpy as np
    >>> exact = np.arange(strip.n_vertices)
    >>> map_error(exact, exact, strip)
    MapError(22 points, mean 0.0000)
    """
    if not mesh_a.area > 0:
        raise MeshError("the mesh has no area to measure errors by; see pliant.check_up(mesh)")
    n = mesh_a.n_vertices
    mapped = vertex_indices(p_ba, n, "p_ba")
    target = point_map_of(truth, len(mapped), n, "truth")
    known = np.flatnonzero(target >= 0)
    if not known.size:
        message = f"none of the {len(mapped)} points has a truth"
        raise InputError(message)
    chosen = _drawn(known, samples, rng)
    targets, unit = target[chosen], mesh_a.area**0.5
    if symmetry is not None:
        targets = np.concatenate([targets, point_map_of(symmetry, n, n, "symmetry")[targets]])
    there = np.tile(mapped[chosen], len(targets) // len(chosen))
    found = np.full(len(targets), np.nan)
    solver = GeodesicHierarchy(mesh_a, graph)
    for block in _by_target(targets):
        sources, rows = np.unique(targets[block], return_inverse=True)
        found[block] = solver.distances(sources, n_jobs=n_jobs, progress=progress)[rows, there[block]] / unit
    errors, mirrored = found[: len(chosen)], found[len(chosen) :]
    return MapError(
        errors,
        as_floats(thresholds, "thresholds"),
        None if symmetry is None else mirrored,
        chosen,
        len(mapped) - known.size,
    )


def _by_target(targets: IntArray) -> Iterator[IntArray]:
    """Yield pairs in blocks of few distinct targets, so that no n x n distances are held."""
    order = np.argsort(targets, kind="stable")
    order = order[targets[order] >= 0]
    changes = np.concatenate([[0], np.cumsum(np.diff(targets[order]) != 0)])
    for start in range(0, int(changes[-1]) + 1 if len(order) else 0, _SOURCES):
        yield order[(changes >= start) & (changes < start + _SOURCES)]


def _drawn(known: IntArray, samples: int | None, rng: int | np.random.Generator) -> IntArray:
    if samples is None:
        return known
    if isinstance(samples, bool) or int(samples) != samples or samples < 1:
        message = f"samples must be a whole number of 1 or more, got {samples}"
        raise InputError(message)
    if samples >= len(known):
        return known
    return np.sort(np.random.default_rng(rng).choice(known, int(samples), replace=False))


def _curve(errors: FloatArray, thresholds: FloatArray) -> FloatArray:
    shares = np.searchsorted(np.sort(errors), thresholds, side="right") / len(errors)
    return frozen(np.asarray(shares, dtype=np.float64))
