"""Points of an embedding sorted into small cells, each with a local basis in which its points have few coordinates.

A smooth surface in a space of 200 dimensions is flat in the small: within a cell of 64 neighbours a dozen directions
carry all but a millionth of every offset. What is left is kept as a bound, so that a caller knows how far a
distance taken from the few coordinates may be off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arrays import FloatArray, IntArray
from .._kernels import summing_kernel

__all__ = ["CELL", "Cells", "sorted_cells"]

# A constant of the compiled kernels: loops of known length run in vector registers.
CELL = 64
# Cells are cut along the widest of the leading coordinates; the later ones are small: they fall like 1 / lambda.
_LEADING = 16


@dataclass(frozen=True, eq=False)
class Cells:
    """Points in cells of :data:`CELL`, the last one filled up with points at infinity.

    Parameters
    ----------
    order : (n,) array of int
        The point at each place.
    points : (n, m) array of float
        In that order.
    frames : (c, 1 + rank, m) array of float
        Of each cell the centre and an orthonormal basis (zero rows where fewer directions do).
    coordinates : (c, rank, CELL) array of float
        Of each point about its centre in that basis.
    squares : (c, CELL) array of float
        Squared distance of each point from the centre; inf for what fills up.
    residuals : (c, CELL) array of float
        Distance of each point from the space its cell's basis spans.
    reaches : (c,) array of float
        Distance of the farthest point of each cell from its centre.
    """

    order: IntArray
    points: FloatArray
    frames: FloatArray
    coordinates: FloatArray
    squares: FloatArray
    residuals: FloatArray
    reaches: FloatArray

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.reaches)

    def filled(self, values: FloatArray) -> FloatArray:
        """Return values of the points, (n, s), as (c, s, CELL) in the order of the cells, 0 where it is filled up."""
        table = np.zeros((self.count * CELL, values.shape[1]))
        table[: len(values)] = values[self.order]
        by_cell: FloatArray = table.reshape(self.count, CELL, -1).transpose(0, 2, 1).copy()
        return by_cell

    def spacings(self, neighbours: int, panel: slice) -> FloatArray:
        """Return the root mean square distance of each point of some cells, in order, from its k nearest."""
        n = len(self.points)
        count = min(neighbours, n - 1)
        start, stop = panel.start * CELL, min(panel.stop * CELL, n)
        found = np.zeros(stop - start)
        if count < 1:
            return found
        centres = self.frames[:, 0]
        squares = (self.points[start:stop] ** 2).sum(axis=1)[:, None] + (centres**2).sum(axis=1)
        apart2 = squares - 2 * (self.points[start:stop] @ centres.T)
        # What rounding may have taken away is given back: a bound must stay one.
        gaps = np.sqrt(np.maximum(apart2 - 1e-13 * squares, 0.0)) - self.reaches * (1 + 1e-12)
        _nearest_spacing(self.points, start, gaps, count, found)
        return found


def sorted_cells(points: FloatArray, rank: int) -> Cells:
    """Sort points into cells and find each cell's basis. Cost: n log n, then n m rank."""
    order = _order(points)
    placed = np.ascontiguousarray(points[order])
    return Cells(order, placed, *_frames(placed, rank))


def _order(points: FloatArray) -> IntArray:
    """Halve along the widest leading coordinate, at multiples of CELL, until a cell is left."""
    leading = points[:, :_LEADING]
    order = np.arange(len(points))
    pending = [(0, len(points))]
    while pending:
        start, end = pending.pop()
        if end - start <= CELL:
            continue
        members = order[start:end]
        values = leading[members]
        along = values[:, int(np.var(values, axis=0).argmax())]
        half = (-(-len(members) // CELL) // 2) * CELL
        order[start:end] = members[np.argpartition(along, half - 1)]
        pending += [(start, start + half), (start + half, end)]
    return order


@summing_kernel
def _frames(points: Any, rank: Any) -> Any:
    """Pivoted Gram-Schmidt in each cell: the point that is worst described gives the next direction."""
    n, m = points.shape
    count = (n + CELL - 1) // CELL
    frames = np.zeros((count, rank + 1, m))
    coordinates = np.zeros((count, rank, CELL))
    squares = np.full((count, CELL), np.inf)
    residuals = np.zeros((count, CELL))
    reaches = np.zeros(count)
    rest = np.zeros((CELL, m))
    left = np.zeros(CELL)
    for cell in range(count):
        start = cell * CELL
        size = min(CELL, n - start)
        for j in range(size):
            frames[cell, 0] += points[start + j] / size
        for j in range(size):
            rest[j] = points[start + j] - frames[cell, 0]
            left[j] = (rest[j] * rest[j]).sum()
            squares[cell, j] = left[j]
        reaches[cell] = np.sqrt(left[:size].max())
        for i in range(rank):
            pivot = left[:size].argmax()
            # Below this a direction would be rounding noise.
            if left[pivot] <= 1e-28 * reaches[cell] ** 2:
                break
            frames[cell, i + 1] = rest[pivot] / np.sqrt(left[pivot])
            for j in range(size):
                along = (rest[j] * frames[cell, i + 1]).sum()
                coordinates[cell, i, j] = along
                rest[j] -= along * frames[cell, i + 1]
                left[j] = (rest[j] * rest[j]).sum()
        # The floor stands for rounding in the coordinates themselves.
        residuals[cell, :size] = np.sqrt(left[:size]) + 1e-14 * reaches[cell]
    return frames, coordinates, squares, residuals, reaches


@summing_kernel
def _nearest_spacing(points: Any, first: Any, gaps: Any, count: Any, found: Any) -> None:
    """Search the own cell, then every cell that may hold a nearer point than the k-th so far."""
    n, m = points.shape
    best = np.empty(count)
    for i in range(len(found)):
        row = first + i
        best[:] = np.inf
        own = row // CELL
        for turn in range(gaps.shape[1] + 1):
            cell = own if turn == 0 else turn - 1
            if turn > 0 and (cell == own or (gaps[i, cell] > 0 and gaps[i, cell] ** 2 > best[count - 1])):
                continue
            for other in range(cell * CELL, min((cell + 1) * CELL, n)):
                if other == row:
                    continue
                total = 0.0
                for at in range(0, m, 16):
                    for u in range(at, min(at + 16, m)):
                        offset = points[row, u] - points[other, u]
                        total += offset * offset
                    if total >= best[count - 1]:
                        break
                if total < best[count - 1]:
                    place = count - 1
                    while place > 0 and best[place - 1] > total:
                        best[place] = best[place - 1]
                        place -= 1
                    best[place] = total
        found[i] = np.sqrt(best.sum() / count)
