"""Coercion of arrays at the boundary: one dtype, C order, read-only."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError, first_indices

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only, C-ordered version of an array that nobody else can write to."""
    owned = np.array(array, order="C", copy=True) if array.flags.writeable else np.ascontiguousarray(array)
    owned.setflags(write=False)
    return owned


def as_floats(values: ArrayLike, name: str) -> FloatArray:
    """Coerce to float64, refusing what is not numeric."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        message = f"{name} must be an array of numbers: {error}"
        raise InputError(message) from error


def as_indices(values: ArrayLike, name: str) -> IntArray:
    """Coerce to int64, refusing floats that are not whole numbers and unsigned values past int64."""
    array = np.asarray(values)
    if array.dtype == np.bool_ or not np.issubdtype(array.dtype, np.number) or np.iscomplexobj(array):
        if array.size == 0:
            return np.zeros(array.shape, dtype=np.int64)
        message = f"{name} must be whole numbers, got dtype {array.dtype}"
        raise InputError(message)
    if np.issubdtype(array.dtype, np.floating):
        bad = np.flatnonzero(~(np.isfinite(array) & (array == np.floor(array))).ravel())
        if bad.size:
            message = f"{name} must be whole numbers: {bad.size} are not, first at {first_indices(bad)}"
            raise InputError(message)
    return array.astype(np.int64)


def vertex_indices(values: ArrayLike, n_vertices: int, name: str = "vertices") -> IntArray:
    """Coerce a scalar or a list of vertex numbers to (s,) int64 and check their range."""
    indices = np.atleast_1d(as_indices(values, name)).ravel()
    bad = np.flatnonzero((indices < 0) | (indices >= n_vertices))
    if bad.size:
        message = (
            f"{name}: {bad.size} of {indices.size} are outside 0..{n_vertices - 1}, "
            f"first {first_indices(indices[bad])}"
        )
        raise InputError(message)
    return indices


def vertex_values(values: ArrayLike, n_vertices: int, name: str) -> FloatArray:
    """Coerce one finite number a vertex to (n,) float64."""
    array = as_floats(values, name)
    if array.shape != (n_vertices,):
        message = f"{name} must have one value a vertex, shape ({n_vertices},), got {array.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        message = f"{name}: {bad.size} values are not finite, first at vertices {first_indices(bad)}"
        raise InputError(message)
    return array
