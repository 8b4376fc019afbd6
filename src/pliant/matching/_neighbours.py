"""Exact nearest rows in hundreds of dimensions: single precision to sift, double precision to decide."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import KDTree

from .._arrays import FloatArray, IntArray
from .._kernels import kernel

# Measured on embeddings of surfaces: a tree wins up to here, a blocked matrix product beyond.
_TREE_DIMENSIONS = 8
_ROWS, _COLUMNS = 512, 4096
_CHUNK = 128
_ROUNDING = 2.0**-23


def nearest_rows(points: FloatArray, queries: FloatArray) -> IntArray:
    """Return, for each row of ``queries``, the number of the nearest row of ``points`` (Euclidean).

    Products in float32 sift; whatever comes within their rounding of the smallest so far is measured in
    float64. So the answer is that of float64, whatever the BLAS does. Of rows equally near, the first.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    queries = np.ascontiguousarray(queries, dtype=np.float64)
    if points.shape[1] <= _TREE_DIMENSIONS and len(points) > _ROWS:
        return _by_tree(points, queries)
    # Shifting both leaves distances alone and makes the numbers that cancel smaller.
    centre = points.mean(axis=0)
    left, right = points - centre, queries - centre
    squares = np.einsum("ij,ij->i", left, left)
    lengths = np.sqrt(np.einsum("ij,ij->i", right, right))
    longest = float(np.sqrt(squares.max()))
    # |p|^2 - 2 p.q as one product.
    left = np.column_stack([left, squares]).astype(np.float32)
    right = np.column_stack([-2 * right, np.ones(len(right))]).astype(np.float32)
    # Worst rounding of |p|^2 - 2 p.q over d terms, of the cast to float32 of either side included.
    slack = _ROUNDING * (points.shape[1] + 8) * longest * (longest + 2 * lengths)
    found = np.empty(len(queries), dtype=np.int64)
    for top in range(0, len(queries), _ROWS):
        rows = slice(top, top + _ROWS)
        best = np.full(len(right[rows]), np.inf)
        sifted = np.full(len(best), np.inf)
        chosen = np.zeros(len(best), dtype=np.int64)
        for first in range(0, len(left), _COLUMNS):
            columns = slice(first, first + _COLUMNS)
            sieve = right[rows] @ left[columns].T
            _take(sieve, slack[rows], points, queries, top, first, sifted, best, chosen)
        found[rows] = chosen
    return found


def _by_tree(points: FloatArray, queries: FloatArray) -> IntArray:
    answer: Any = KDTree(points).query(queries, k=2)
    distances, found = answer
    tied = np.flatnonzero(distances[:, 1] <= distances[:, 0] * (1 + 1e-12))
    nearest: IntArray = found[:, 0].astype(np.int64)
    for i in tied:
        # The tree leaves open which of several equally near points it gives.
        nearest[i] = ((points - queries[i]) ** 2).sum(axis=1).argmin()
    return nearest


@kernel
def _take(
    sieve: Any,
    slack: Any,
    points: Any,
    queries: Any,
    top: Any,
    first: Any,
    sifted: Any,
    best: Any,
    chosen: Any,
) -> None:
    """Improve the best so far of each query with one block of float32 values."""
    rows, columns = sieve.shape
    for i in range(rows):
        for start in range(0, columns, _CHUNK):
            stop = min(start + _CHUNK, columns)
            limit = np.float32(sifted[i] + slack[i])
            # Counting runs in vector registers; few chunks have anything to look at.
            hits = np.int32(0)
            for j in range(start, stop):
                hits += np.int32(sieve[i, j] <= limit)
            if hits == 0:
                continue
            for j in range(start, stop):
                if sieve[i, j] > sifted[i] + slack[i]:
                    continue
                sifted[i] = min(sifted[i], sieve[i, j])
                total = 0.0
                for c in range(points.shape[1]):
                    step = points[first + j, c] - queries[top + i, c]
                    total += step * step
                    if total > best[i]:
                        break
                if total < best[i]:
                    best[i] = total
                    chosen[i] = first + j
