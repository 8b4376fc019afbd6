"""Binary codes as bytes: packing, unpacking, Hamming distances."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import BoolArray
from ..errors import InputError

__all__ = ["Codes", "hamming_distances", "pack_bits", "unpack_bits"]

Codes: TypeAlias = NDArray[np.uint8]


def pack_bits(bits: ArrayLike) -> Codes:
    """Pack rows of bits into bytes: bit j of a code is bit ``j % 8``, counted from the lowest, of byte ``j // 8``.

    Parameters
    ----------
    bits : (n, b) array_like of bool
        b a multiple of 8.

    Returns
    -------
    (n, b / 8) array of uint8
        As faiss's binary indexes take them.

    Raises
    ------
    InputError
        If b is not a positive multiple of 8.

    Examples
    --------
    >>> pack_bits([[1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0]]).tolist()
    [[1, 2]]
    """
    table = np.asarray(bits) != 0
    if table.ndim != 2 or table.shape[1] == 0 or table.shape[1] % 8:
        message = f"bits must have shape (n, b) with b a multiple of 8, got {table.shape}"
        raise InputError(message)
    return np.packbits(table, axis=1, bitorder="little")


def unpack_bits(codes: ArrayLike) -> BoolArray:
    """Return the bits of packed codes; the inverse of :func:`pack_bits`.

    Parameters
    ----------
    codes : (n, b / 8) array_like of uint8

    Returns
    -------
    (n, b) array of bool

    Raises
    ------
    InputError
        If the codes are not rows of bytes.

    Examples
    --------
    >>> unpack_bits([[3]]).astype(int).tolist()
    [[1, 1, 0, 0, 0, 0, 0, 0]]
    """
    return np.unpackbits(_bytes(codes, "codes"), axis=1, bitorder="little").astype(bool)


def hamming_distances(queries: ArrayLike, database: ArrayLike) -> NDArray[np.int32]:
    """Return the number of bits in which every query differs from every code of a database.

    Parameters
    ----------
    queries : (m, b / 8) array_like of uint8
        Packed codes.
    database : (n, b / 8) array_like of uint8
        Packed codes of the same length.

    Returns
    -------
    (m, n) array of int32

    Raises
    ------
    InputError
        If the codes are not rows of bytes, or of different lengths.

    Notes
    -----
    One matrix product of bits as -1 and 1: exact, 4 m n bytes. For a large database use an index.

    Examples
    --------
    >>> hamming_distances([[0], [255]], [[1], [254]]).tolist()
    [[1, 7], [7, 1]]
    """
    one, two = unpack_bits(queries), unpack_bits(database)
    if one.shape[1] != two.shape[1]:
        message = f"codes must be of one length, got {one.shape[1]} and {two.shape[1]} bits"
        raise InputError(message)
    # Sums of at most 2^24 units are exact in float32.
    product = _signed(one) @ _signed(two).T
    differing: NDArray[np.int32] = ((one.shape[1] - product) / 2).astype(np.int32)
    return differing


def _signed(bits: BoolArray) -> NDArray[np.float32]:
    return np.where(bits, np.float32(1), np.float32(-1))


def _bytes(codes: ArrayLike, name: str) -> Codes:
    table: NDArray[Any] = np.asarray(codes)
    whole = table.dtype.kind in "iu" and (not table.size or (table.min() >= 0 and table.max() <= 255))
    if table.ndim != 2 or table.shape[1] == 0 or not whole:
        message = f"{name} must be bytes of shape (n, b / 8), got {table.dtype} of shape {table.shape}"
        raise InputError(message)
    return table.astype(np.uint8)
