"""Sparse matrices with one type: CSR, float64."""

from __future__ import annotations

from typing import Any, TypeAlias, cast

import numpy as np
import scipy.sparse as sp

from .._arrays import FloatArray, IntArray

CsrArray: TypeAlias = "sp.csr_array[np.float64, tuple[int, int]]"


def as_csr(matrix: Any) -> CsrArray:
    """Coerce any sparse matrix to CSR in float64; it shares memory where it can."""
    return cast("CsrArray", sp.csr_array(matrix, dtype=np.float64))


def diagonal_matrix(values: FloatArray) -> CsrArray:
    """Return the (n, n) matrix with the given diagonal, (n,)."""
    n = len(values)
    entries: Any = (np.asarray(values, dtype=np.float64), np.arange(n), np.arange(n + 1))
    return cast("CsrArray", sp.csr_array(entries, shape=(n, n)))


def symmetric_matrix(i: IntArray, j: IntArray, weights: FloatArray, n: int) -> CsrArray:
    """Return the (n, n) matrix with each weight added at (i, j) and at (j, i)."""
    entries: Any = (np.tile(weights, 2), (np.concatenate([i, j]), np.concatenate([j, i])))
    return as_csr(sp.coo_array(entries, shape=(n, n)))


def product(matrix: CsrArray, dense: FloatArray) -> FloatArray:
    """Return the matrix times a dense (n,) or (n, d) array."""
    return cast("FloatArray", matrix @ dense)


def row_sums(matrix: CsrArray) -> FloatArray:
    """Return the sum of each row, (n,)."""
    return np.asarray(matrix.sum(axis=1), dtype=np.float64)
