"""Sums over the balls around every point of an embedding, for many radii at once, exactly and in little memory."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from threadpoolctl import threadpool_limits

from .._arrays import FloatArray
from .._parallel import ordered_map
from ._ball_kernels import PATCH_RANK, POINT_RANK, add_ball_sums, add_gaussian_sums
from ._cells import CELL, Cells, sorted_cells

__all__ = ["Counting", "ball_sums"]

Counting: TypeAlias = Literal["points", "patches", "gaussian"]

# Cells a panel: their products with all others stay near the processor.
_PANEL = 8
# In a regular triangulation a vertex has six neighbours at a distance l and a share sqrt(3) / 2 l^2 of the surface:
# the disc of that area has this radius in units of l. For points strewn at random it is right to 2 per cent.
_NEIGHBOURS = 6
_DISC = float(np.sqrt(np.sqrt(3) / (2 * np.pi)))


def ball_sums(
    points: FloatArray,
    weights: FloatArray,
    radii: FloatArray,
    *,
    counting: Counting = "points",
    n_jobs: int | None = None,
    progress: bool = False,
) -> FloatArray:
    """Sum weights over the ball of each radius around each point.

    The points are sorted into cells of 64. A cell that lies within a ball or beyond it counts as one sum.
    Inside the cells that a sphere cuts, squared distances come from a few coordinates a cell, with a bound on
    what is left out; where the bound cannot tell, all m coordinates are used.

    Parameters
    ----------
    points : (n, m) array of float
        Samples of a surface.
    weights : (n, 2) array of float
        Two weights a point, 0 or more.
    radii : (r,) array of float
        Ascending, positive.
    counting : {"points", "patches", "gaussian"}
        ``"points"``: a point counts if its distance is at most the radius. ``"patches"``: a point stands for
        a disc of the surface of radius s = 0.525 (root mean square distance of its six nearest), and counts by
        the share ``(r - d + s) / (2 s)`` of it, at least 0 and at most 1; the centre itself by
        ``(r / s)^2``. ``"gaussian"``: a point within the ball counts by ``exp(-d^2 / (2 (r / 3)^2))``.
    n_jobs : int, optional
        Threads; the answer is the same bytes for any number.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    (n, r, 2) array of float

    Notes
    -----
    The answer is that of comparing every pair in float64: up to the order of summation (1e-13 relative) for
    points, where a pair whose distance equals a radius to within rounding may fall on either side; to
    1e-5 for patches (1e-7 as a rule), to 1e-9 for Gaussian weights.

    Memory is n (m + 4 r) numbers. Gaussian sums need every distance and an exponential for every point of
    every ball, and take ten times as long as the others.

    Examples
    --------
    >>> points = np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]])
    >>> ball_sums(points, np.ones((3, 2)), np.array([1.0, 2.0]))[:, :, 0]
    array([[2., 2.],
           [2., 3.],
           [1., 2.]])
    """
    cells = sorted_cells(points, POINT_RANK if counting == "points" else PATCH_RANK)
    table = cells.filled(weights)
    # Threads work on panels of their own; BLAS threads inside them would only get in the way.
    with threadpool_limits(1, user_api="blas"):
        if counting == "gaussian":
            placed = _gaussian(cells, table, radii, n_jobs, progress)
        else:
            placed = _panels(cells, table, radii, counting == "patches", n_jobs, progress)
    sums = np.empty_like(placed)
    sums[cells.order] = placed
    return sums


def _panels(
    cells: Cells,
    table: FloatArray,
    radii: FloatArray,
    patches: bool,
    n_jobs: int | None,
    progress: bool,
) -> FloatArray:
    n, step = len(cells.order), cells.frames.shape[1]
    frames = cells.frames.reshape(-1, cells.points.shape[1])
    own = np.einsum("cim,cm->ci", cells.frames, cells.frames[:, 0])
    spread = _spread(cells, n_jobs) if patches else np.zeros(n)
    spreads = np.full((cells.count, CELL), spread[-1])
    spreads.ravel()[:n] = spread
    partial, whole = np.zeros((2, n, len(radii), 2))
    totals = table.sum(axis=2)
    fixed = (own, cells.points, cells.coordinates, cells.squares, cells.residuals, cells.reaches)
    # A slope of inf, for points without extent, is never used.
    with np.errstate(divide="ignore"):
        shares = (spreads, 0.5 / spreads, table, totals)

    def add(first: int) -> None:
        panel = (first, min(first + _PANEL, cells.count))
        gram = frames[panel[0] * step : panel[1] * step] @ frames.T
        add_ball_sums(panel, (gram, *fixed, *shares), radii, patches, (partial, whole))

    starts = range(0, cells.count, _PANEL)
    for _ in ordered_map(add, starts, n_jobs, description="ball sums", progress=progress):
        pass
    partial += np.cumsum(whole, axis=1, out=whole)
    return partial


def _spread(cells: Cells, n_jobs: int | None) -> FloatArray:
    """Return the radius of the disc each point stands for."""
    panels = [slice(first, min(first + _PANEL, cells.count)) for first in range(0, cells.count, _PANEL)]
    found = ordered_map(lambda panel: cells.spacings(_NEIGHBOURS, panel), panels, n_jobs)
    spread: FloatArray = _DISC * np.concatenate(list(found))
    # Points that coincide, or a lone point, have no extent: as good as none.
    return np.maximum(spread, 1e-9 * max(float(spread.max()), 1e-200))


def _gaussian(
    cells: Cells, table: FloatArray, radii: FloatArray, n_jobs: int | None, progress: bool
) -> FloatArray:
    points = cells.points
    norms = np.einsum("nm,nm->n", points, points)
    sums = np.zeros((len(points), len(radii), 2))

    def add(cell: int) -> None:
        gram = points[cell * CELL : (cell + 1) * CELL] @ points.T
        add_gaussian_sums(cell, gram, norms, points, table, radii, sums)

    for _ in ordered_map(add, range(cells.count), n_jobs, description="ball sums", progress=progress):
        pass
    return sums
