"""What a file holds, before it becomes a mesh, and how polygons become triangles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..._arrays import FloatArray, IntArray, as_indices
from ...errors import InputError, MeshError, first_indices


@dataclass(frozen=True, eq=False)
class Contents:
    """Points, polygons and per-vertex arrays as they stand in a file.

    Parameters
    ----------
    vertices : (n, 3) array or None
        Positions; None where the file holds per-vertex arrays only.
    corners : (sum of sizes,) int array
        Vertex numbers of all polygons, one after the other.
    sizes : (m,) int array
        Number of corners of each polygon.
    data : mapping of str to (n,) or (n, k) array
        Per-vertex arrays by name.
    notes : tuple of str
        What was left out or mended while reading, each to be reported.
    """

    vertices: FloatArray | None
    corners: IntArray
    sizes: IntArray
    data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def no_polygons() -> tuple[IntArray, IntArray]:
    """Return the corners and sizes of nothing."""
    return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)


def fan(corners: IntArray, sizes: IntArray) -> IntArray:
    """Split polygons into fans of triangles about their first corner; those under three corners vanish.

    Triangles follow the order of their polygons, each polygon's in the order of its corners.
    """
    if len(sizes) and (sizes == 3).all():
        return corners.reshape(-1, 3)
    starts = np.cumsum(sizes) - sizes
    pieces = np.maximum(sizes - 2, 0)
    first = np.repeat(starts, pieces)
    step = np.arange(int(pieces.sum())) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.column_stack([corners[first], corners[first + step + 1], corners[first + step + 2]])


def triangulated(polygons: Sequence[Sequence[int]] | NDArray[Any]) -> IntArray:
    """Split polygons into triangles, each a fan about its first corner.

    Right for convex polygons; a fan of a concave one may fold over. No vertex is added.

    Parameters
    ----------
    polygons : sequence of sequences of int, or (p, k) array
        Vertex numbers of each polygon in order around it, three or more.

    Returns
    -------
    (m, 3) ndarray of int64
        k - 2 triangles for a polygon of k corners, in the polygons' order.

    Raises
    ------
    MeshError
        If a polygon has fewer than three corners.

    Examples
    --------
    >>> triangulated([[0, 1, 2, 3], [4, 5, 6]]).tolist()
    [[0, 1, 2], [0, 2, 3], [4, 5, 6]]
    """
    sizes = np.fromiter((len(polygon) for polygon in polygons), dtype=np.int64, count=len(polygons))
    short = np.flatnonzero(sizes < 3)
    if short.size:
        message = (
            f"{short.size} polygons have fewer than three corners, first {first_indices(short)}; drop them"
        )
        raise MeshError(message)
    if not sizes.size:
        return np.empty((0, 3), dtype=np.int64)
    corners = np.concatenate([as_indices(polygon, "polygons") for polygon in polygons])
    return fan(corners, sizes)


def checked_arrays(arrays: Mapping[str, ArrayLike], n_vertices: int | None) -> dict[str, NDArray[Any]]:
    """Coerce per-vertex arrays and check that each has one row a vertex."""
    checked: dict[str, NDArray[Any]] = {}
    for name, values in arrays.items():
        array = np.asarray(values)
        if array.dtype.kind not in "fiub" or array.dtype.itemsize > 8:
            message = f"{name} must hold real numbers, got dtype {array.dtype}"
            raise InputError(message)
        if array.ndim not in (1, 2):
            message = f"{name} must have shape (n,) or (n, k), got {array.shape}"
            raise InputError(message)
        n_vertices = len(array) if n_vertices is None else n_vertices
        if len(array) != n_vertices:
            message = f"{name} must have one row a vertex, {n_vertices} of them, got {len(array)}"
            raise InputError(message)
        checked[name] = array
    return checked
