"""Marching tetrahedra over a narrow band of a regular lattice, for the half-space x >= 0.

Every cell is cut into six tetrahedra around its long diagonal (Freudenthal), so the triangles form a
manifold whatever the signs, with one boundary: the curve where the surface meets the plane x = 0, whose
vertices have x = 0 exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np

from ..._arrays import FloatArray, IntArray

_BLOCK = 8
_CELL = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def half_surface(
    field: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray, spacing: float
) -> tuple[FloatArray, IntArray]:
    """Zero level of a 1-Lipschitz field over the box from ``low`` (its x is 0) to ``high``, wound outwards."""
    first = np.floor(np.array([0.0, low[1], low[2]]) / spacing).astype(np.int64) - 1
    first[0] = 0
    counts = np.ceil((high / spacing - first + 1) / _BLOCK).astype(np.int64)
    corners = first + _BLOCK * np.stack(np.unravel_index(np.arange(counts.prod()), counts), axis=1)
    middle = (corners.astype(np.float64) + _BLOCK / 2) * spacing
    corners = corners[np.abs(field(middle)) <= spacing * _BLOCK / 2 * np.sqrt(3)]
    cells, values = _mixed_cells(field, corners, spacing)
    return _march(cells, values, spacing)


def _mixed_cells(
    field: Callable[[FloatArray], FloatArray], corners: IntArray, spacing: float
) -> tuple[IntArray, FloatArray]:
    side = np.arange(_BLOCK + 1)
    offsets = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    nodes = corners[:, None] + offsets
    places = nodes.reshape(-1, 3).astype(np.float64) * spacing
    values = field(places).reshape(len(corners), *(3 * [_BLOCK + 1]))
    cut = slice(0, _BLOCK), slice(1, _BLOCK + 1)
    at_corners = np.stack([values[:, cut[i], cut[j], cut[k]] for i, j, k in _CELL], axis=-1)
    inside = at_corners < 0
    mixed = inside.any(axis=-1) & ~inside.all(axis=-1)
    block, i, j, k = np.nonzero(mixed)
    return corners[block] + np.stack([i, j, k], axis=1), at_corners[mixed]


def _march(cells: IntArray, values: FloatArray, spacing: float) -> tuple[FloatArray, IntArray]:
    base = cells.min(axis=0)
    spans = cells.max(axis=0) - base + 2
    strides = np.array([spans[1] * spans[2], spans[2], 1])
    numbers = ((cells - base)[:, None] + _CELL) @ strides
    corners = np.concatenate([_triangles(numbers[:, tet], values[:, tet]) for tet in _tetrahedra()])
    ends = corners[..., :2].astype(np.int64)
    keys = ends[..., 0] * strides[0] * spans[0] + ends[..., 1]
    _, first, faces = np.unique(keys.ravel(), return_index=True, return_inverse=True)
    ends = ends.reshape(-1, 2)[first]
    share = corners[..., 2].ravel()[first, None]
    a, b = ((base + np.stack(np.unravel_index(ends[:, i], spans), axis=1)) * spacing for i in (0, 1))
    return a + share * (b - a), faces.reshape(-1, 3)


def _tetrahedra() -> list[list[int]]:
    """Corners of the six tetrahedra of a cell, each positively oriented."""
    out = []
    for axes in permutations(range(3)):
        steps = np.cumsum([np.zeros(3, np.int64), *np.eye(3, dtype=np.int64)[list(axes)]], axis=0)
        tet = [int(number) for number in steps @ [4, 2, 1]]
        odd = np.linalg.det(np.eye(3)[list(axes)]) < 0
        out.append([tet[0], tet[1], tet[3], tet[2]] if odd else tet)
    return out


def _triangles(nodes: IntArray, values: FloatArray) -> FloatArray:
    """Triangles of one tetrahedron in every cell; a corner is (lower node, higher node, share of the way)."""
    inside = values < 0
    pieces = []
    for a, b, c, d in ((0, 1, 2, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 2, 1, 0)):
        for alone, turned in ((True, (b, c, d)), (False, (d, c, b))):
            chosen = (inside[:, a] == alone) & (inside[:, [b, c, d]] != alone).all(axis=1)
            pieces.append([_crossing(nodes[chosen], values[chosen], a, other) for other in turned])
    for a, b, c, d in ((0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2), (2, 3, 0, 1), (3, 1, 0, 2), (1, 2, 0, 3)):
        chosen = inside[:, a] & inside[:, b] & ~inside[:, c] & ~inside[:, d]
        ring = [_crossing(nodes[chosen], values[chosen], *edge) for edge in ((a, c), (a, d), (b, d), (b, c))]
        pieces += [[ring[0], ring[1], ring[2]], [ring[0], ring[2], ring[3]]]
    return np.concatenate([np.stack(piece, axis=1) for piece in pieces])


def _crossing(nodes: IntArray, values: FloatArray, a: int, b: int) -> FloatArray:
    swap = nodes[:, a] > nodes[:, b]
    low, high = np.where(swap, b, a), np.where(swap, a, b)
    rows = np.arange(len(nodes))
    at_low, at_high = values[rows, low], values[rows, high]
    share = np.clip(at_low / (at_low - at_high), 0.05, 0.95)
    return np.stack([nodes[rows, low], nodes[rows, high], share], axis=1)
