"""Compiled loops of the ball sums: one panel of cells against all cells."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._kernels import inlined_kernel, summing_kernel
from ._cells import CELL

__all__ = ["PATCH_RANK", "POINT_RANK", "add_ball_sums", "add_gaussian_sums"]

# Coordinates a cell. Points need only enough to tell inside from outside; shares of patches need digits.
POINT_RANK = 12
PATCH_RANK = 24

# Rounding of a squared distance put together from products, as a share of the squares it is made of.
_ROUNDING = 1e-13
# Relative error allowed in the distance of a patch: it becomes that of the ball's area, twice at most.
_DISTANCE_ERROR = 1e-5


@inlined_kernel
def _first_beyond(radii: Any, start: Any, stop: Any, value: Any) -> Any:
    """First radius from start on that is not below the value."""
    while start < stop and radii[start] < value:
        start += 1
    return start


@summing_kernel
def _exact(points: Any, row: Any, other: Any) -> Any:
    total = 0.0
    for u in range(points.shape[1]):
        offset = points[row, u] - points[other, u]
        total += offset * offset
    return total


@summing_kernel
def _settle(found: Any, points: Any, row: Any, cell: Any, limit: Any, doubt: Any) -> None:
    """Replace squared distances that are too near a limit to tell by exact ones."""
    unsure = 0
    for t in range(CELL):
        unsure += 1 if abs(found[t] - limit) <= doubt else 0
    if unsure == 0:
        return
    for t in range(CELL):
        if abs(found[t] - limit) <= doubt:
            found[t] = _exact(points, row, cell * CELL + t)


@summing_kernel
def _within(found: Any, weights: Any, cell: Any, limit: Any) -> Any:
    """Weights of the points within the limit."""
    sum0 = 0.0
    sum1 = 0.0
    for t in range(CELL):
        inside = 1.0 if found[t] <= limit else 0.0
        sum0 += inside * weights[cell, 0, t]
        sum1 += inside * weights[cell, 1, t]
    return sum0, sum1


@summing_kernel
def _rooted(found: Any, points: Any, row: Any, cell: Any, spreads: Any, doubt: Any) -> None:
    """Turn squared distances into distances; those whose error would show are taken exactly."""
    # An error of e in d^2 is one of e / (2 d) in d. Within a patch's own extent its digits matter no more.
    bound = doubt / (2 * _DISTANCE_ERROR)
    unsure = 0
    for t in range(CELL):
        unsure += 1 if max(found[t], spreads[cell, t] * spreads[cell, t]) < bound else 0
    if unsure:
        for t in range(min(CELL, len(points) - cell * CELL)):
            if max(found[t], spreads[cell, t] * spreads[cell, t]) < bound:
                found[t] = _exact(points, row, cell * CELL + t)
    for t in range(CELL):
        found[t] = np.sqrt(max(found[t], 0.0))


@summing_kernel
def _covered(found: Any, weights: Any, slopes: Any, cell: Any, radius: Any) -> Any:
    """Weights of the patches, each by the share of it that is within the radius."""
    sum0 = 0.0
    sum1 = 0.0
    for t in range(CELL):
        share = min(max(0.5 + (radius - found[t]) * slopes[cell, t], 0.0), 1.0)
        sum0 += share * weights[cell, 0, t]
        sum1 += share * weights[cell, 1, t]
    return sum0, sum1


@summing_kernel
def add_ball_sums(panel: Any, cells: Any, radii: Any, patches: Any, sums: Any) -> None:
    """Add the weights of all points, or patches, in the balls around the points of a panel of cells.

    A cell that lies beyond radius i - 1 and within radius i goes to ``whole[:, i]`` as one sum; one that a
    radius cuts is counted point by point into ``partial[:, i]``. The sum over the ball i is
    ``partial[:, i] + whole[:, : i + 1].sum()``.
    """
    gram, own, points, coordinates, _, _, reaches, spreads, _, _, totals = cells
    whole = sums[1]
    step = coordinates.shape[1] + 1
    scratch = (np.empty(CELL), np.empty((CELL, step - 1)), np.empty(CELL))
    for a in range(panel[0], panel[1]):
        at_a = (a - panel[0]) * step
        for b in range(len(reaches)):
            floor = _ROUNDING * (own[a, 0] + own[b, 0])
            apart2 = max(own[a, 0] + own[b, 0] - 2 * gram[at_a, b * step], 0.0)
            margin = reaches[b] + spreads[b].max()
            reach = reaches[a] + margin + np.sqrt(floor)
            low = _first_beyond(radii, 0, len(radii), np.sqrt(apart2) - reach)
            high = _first_beyond(radii, low, len(radii), np.sqrt(apart2) + reach)
            if low < high:
                span = (floor, margin, low, high)
                _add_pair(a, b, at_a, apart2, span, cells, radii, patches, scratch, sums)
            elif high < len(radii):
                for row in range(a * CELL, min((a + 1) * CELL, len(points))):
                    whole[row, high, 0] += totals[b, 0]
                    whole[row, high, 1] += totals[b, 1]


@summing_kernel
def _add_pair(
    a: Any,
    b: Any,
    at_a: Any,
    apart2: Any,
    span: Any,
    cells: Any,
    radii: Any,
    patches: Any,
    scratch: Any,
    sums: Any,
) -> None:
    """Count the points of cell b that are in the balls around those of cell a."""
    gram, own, points, coordinates, squares, residuals, reaches, spreads, slopes, weights, totals = cells
    base, rows, found = scratch
    partial, whole = sums
    floor, margin, low, high = span
    apart = np.sqrt(apart2)
    _bases(gram, own, coordinates, squares, a, at_a, b, apart2, base)
    _offsets(gram, own, coordinates, a, at_a, b, rows)
    worst = residuals[b].max()
    for j in range(min(CELL, len(points) - a * CELL)):
        row = a * CELL + j
        off = 2 * apart * residuals[a, j] + floor
        far = np.sqrt(max(base[j], 0.0) + off) + margin
        first = _first_beyond(radii, low, high, np.sqrt(max(base[j] - off, 0.0)) - margin)
        last = _first_beyond(radii, first, high, far)
        if last < len(radii):
            whole[row, last, 0] += totals[b, 0]
            whole[row, last, 1] += totals[b, 1]
        if first == last:
            continue
        doubt = 2 * (residuals[a, j] * (apart + reaches[b]) + worst * far) + floor
        if patches:
            _patch_squares(base[j], rows[j], squares, coordinates, b, found)
            _rooted(found, points, row, b, spreads, doubt)
            if a == b:
                _add_centre(row, j, b, spreads, weights, radii, first, last, partial)
                found[j] = np.inf
        else:
            _point_squares(base[j], rows[j], squares, coordinates, b, found)
        for i in range(first, last):
            if patches:
                sum0, sum1 = _covered(found, weights, slopes, b, radii[i])
            else:
                _settle(found, points, row, b, radii[i] * radii[i], doubt)
                sum0, sum1 = _within(found, weights, b, radii[i] * radii[i])
            partial[row, i, 0] += sum0
            partial[row, i, 1] += sum1


@summing_kernel
def _add_centre(
    row: Any, j: Any, cell: Any, spreads: Any, weights: Any, radii: Any, first: Any, last: Any, partial: Any
) -> None:
    """Add the share of the disc around the centre itself, which fills from the middle."""
    for i in range(first, last):
        share = min(radii[i] / spreads[cell, j], 1.0) ** 2
        partial[row, i, 0] += share * weights[cell, 0, j]
        partial[row, i, 1] += share * weights[cell, 1, j]


@summing_kernel
def _point_squares(start: Any, row: Any, squares: Any, coordinates: Any, b: Any, found: Any) -> None:
    """Squared distances of one point from all points of cell b."""
    for t in range(CELL):
        value = start + squares[b, t]
        for i in range(POINT_RANK):
            value += row[i] * coordinates[b, i, t]
        found[t] = value


@summing_kernel
def _patch_squares(start: Any, row: Any, squares: Any, coordinates: Any, b: Any, found: Any) -> None:
    """Squared distances likewise, from more coordinates: the number must be known to the compiler."""
    for t in range(CELL):
        value = start + squares[b, t]
        for i in range(PATCH_RANK):
            value += row[i] * coordinates[b, i, t]
        found[t] = value


@summing_kernel
def _bases(
    gram: Any, own: Any, coordinates: Any, squares: Any, a: Any, at_a: Any, b: Any, apart2: Any, base: Any
) -> None:
    """Squared distances of the points of cell a from the centre of cell b."""
    rank = coordinates.shape[1]
    for j in range(CELL):
        base[j] = apart2 + squares[a, j]
    for i in range(rank):
        slope = 2 * (own[a, 1 + i] - gram[at_a + 1 + i, b * (rank + 1)])
        for j in range(CELL):
            base[j] += slope * coordinates[a, i, j]


@summing_kernel
def _offsets(gram: Any, own: Any, coordinates: Any, a: Any, at_a: Any, b: Any, rows: Any) -> None:
    """Fill in what each coordinate about the centre of b adds to squared distances from each point of a."""
    rank = coordinates.shape[1]
    at_b = b * (rank + 1)
    column = np.empty(CELL)
    for i in range(rank):
        slope = -2 * (gram[at_a, at_b + 1 + i] - own[b, 1 + i])
        for j in range(CELL):
            column[j] = slope
        for s in range(rank):
            slope = -2 * gram[at_a + 1 + s, at_b + 1 + i]
            for j in range(CELL):
                column[j] += slope * coordinates[a, s, j]
        for j in range(CELL):
            rows[j, i] = column[j]


@inlined_kernel
def _decay(exponent: Any) -> Any:
    """Return exp(-exponent) for 0 <= exponent <= 4.5, in plain arithmetic that vectorises."""
    x = -exponent / 8
    value = 1.0 + x / 13
    value = 1.0 + x / 12 * value
    value = 1.0 + x / 11 * value
    value = 1.0 + x / 10 * value
    value = 1.0 + x / 9 * value
    value = 1.0 + x / 8 * value
    value = 1.0 + x / 7 * value
    value = 1.0 + x / 6 * value
    value = 1.0 + x / 5 * value
    value = 1.0 + x / 4 * value
    value = 1.0 + x / 3 * value
    value = 1.0 + x / 2 * value
    value = 1.0 + x * value
    value *= value
    value *= value
    return value * value


@summing_kernel
def add_gaussian_sums(
    cell: Any, gram: Any, norms: Any, points: Any, weights: Any, radii: Any, partial: Any
) -> None:
    """Add the weights of all points in the balls around one cell's points, each times exp(-4.5 (d / r)^2).

    ``gram`` holds the products of the cell's points with all points, ``norms`` every point's square.
    """
    n = len(points)
    found = np.empty(CELL)
    for j in range(min(CELL, n - cell * CELL)):
        row = cell * CELL + j
        for b in range(len(weights)):
            size = min(CELL, n - b * CELL)
            found[:] = np.inf
            for t in range(size):
                found[t] = norms[row] + norms[b * CELL + t] - 2 * gram[j, b * CELL + t]
            doubt = _ROUNDING * (norms[row] + norms[b * CELL : b * CELL + size].max())
            nearest = found.min() - doubt
            for i in range(len(radii)):
                limit = radii[i] * radii[i]
                if nearest > limit:
                    continue
                _settle(found, points, row, b, limit, doubt)
                sum0 = 0.0
                sum1 = 0.0
                for t in range(CELL):
                    weight = _decay(4.5 * min(max(found[t] / limit, 0.0), 1.0))
                    weight = weight if found[t] <= limit else 0.0
                    sum0 += weight * weights[b, 0, t]
                    sum1 += weight * weights[b, 1, t]
                partial[row, i, 0] += sum0
                partial[row, i, 1] += sum1
