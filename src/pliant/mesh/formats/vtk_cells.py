"""VTK cells that are pieces of a surface, told apart from those that are not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..._arrays import IntArray
from ...errors import FileFormatError, MeshError, first_indices

TRIANGLE, STRIP, POLYGON, PIXEL, QUAD = 5, 6, 7, 8, 9
_SURFACE = (TRIANGLE, STRIP, POLYGON, PIXEL, QUAD)
_POINTS_AND_LINES = (0, 1, 2, 3, 4, 21, 35, 68)


def surface_polygons(
    connectivity: IntArray, ends: IntArray, types: NDArray[np.integer]
) -> tuple[IntArray, IntArray, tuple[str, ...]]:
    """Corners and sizes of the polygons among cells, and notes on what is left out.

    Parameters
    ----------
    connectivity : (c,) int array
        Vertex numbers of all cells, one after the other.
    ends : (m,) int array
        Where each cell ends in ``connectivity``.
    types : (m,) int array
        VTK cell types.
    """
    sizes = np.diff(ends, prepend=0)
    bad = np.flatnonzero((sizes < 0) | (ends > len(connectivity)))
    if bad.size or len(types) != len(ends):
        message = (
            f"{bad.size} of {len(ends)} cells reach outside the list of corners, first {first_indices(bad)}; "
            f"{len(types)} cell types are given"
        )
        raise FileFormatError(message)
    connectivity = connectivity[: ends[-1]] if len(ends) else connectivity[:0]
    surface = np.isin(types, _SURFACE)
    flat = np.isin(types, _POINTS_AND_LINES)
    volume = int((~surface & ~flat).sum())
    if volume and not surface.any():
        message = f"{volume} volume or higher-order cells and no surface: extract the surface first"
        raise MeshError(message)
    notes = []
    if flat.any():
        notes.append(f"{int(flat.sum())} point and line cells are left out")
    if volume:
        notes.append(f"{volume} volume or higher-order cells are left out")
    return (*_flattened(connectivity, sizes, types, surface), tuple(notes))


def _flattened(
    connectivity: IntArray, sizes: IntArray, types: NDArray[np.integer], keep: NDArray[np.bool_]
) -> tuple[IntArray, IntArray]:
    if keep.all() and not np.isin(types, (STRIP, PIXEL)).any():
        return connectivity, sizes
    cells = np.split(connectivity, np.cumsum(sizes)[:-1])
    pieces: list[IntArray] = []
    for number in np.flatnonzero(keep):
        cell = cells[number]
        if types[number] == STRIP:
            pieces += _strip(cell)
        elif types[number] == PIXEL and len(cell) == 4:
            pieces.append(cell[[0, 1, 3, 2]])
        else:
            pieces.append(cell)
    lengths = np.fromiter(map(len, pieces), dtype=np.int64, count=len(pieces))
    return np.concatenate(pieces) if pieces else connectivity[:0], lengths


def _strip(cell: IntArray) -> list[IntArray]:
    # Every second triangle of a strip is wound the other way.
    return [cell[[k, k + 1, k + 2] if k % 2 == 0 else [k + 1, k, k + 2]] for k in range(len(cell) - 2)]
