"""L - shift M in nested-dissection order: its factor, its inertia, and solves for many right sides at once."""

from __future__ import annotations

import warnings
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import pymetis
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from .._arrays import BoolArray, FloatArray, IntArray
from .._kernels import kernel
from ..errors import NumericalError
from ._panels import Panels
from ._sparse import CsrArray, as_csr
from .laplacian import Laplacian

_Compressed: TypeAlias = tuple[NDArray[np.int32], NDArray[np.int32], FloatArray]

# Lanes solved together: a row of them fills one cache line.
LANES = 8
# A factor with entries below this is as good as a positive definite one, for all that can be told later.
_STEADY = 250.0
_NUDGES = (0.97, 1.03, 0.94)


class Pencil:
    """Stiffness and mass with rows and columns in nested-dissection order.

    ``order[r]`` is the vertex of row r; ``weights`` is the mass as a column where it is diagonal.
    """

    def __init__(self, operator: Laplacian) -> None:
        self.order = dissection_order(operator.stiffness)
        self.stiffness = _permuted(operator.stiffness, self.order)
        self.mass = _permuted(operator.mass, self.order)
        self.n = operator.n_vertices
        self.weights = self.mass.diagonal()[:, None] if operator.lumped else None

    def factor(self, shift: float) -> Factor:
        """Factor L - shift M; moves the shift a little where it meets an eigenvalue exactly."""
        for nudge in (0.0, 1e-7, 3e-5):
            moved = shift * (1 + nudge)
            matrix = sp.csc_array(self.stiffness - moved * self.mass)
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    factors = splu(
                        matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
                    )
            except RuntimeError:
                continue
            factor = Factor(factors, moved)
            if factor.sound:
                return factor
        message = f"L - s M could not be factored near s = {shift:.6g}"
        raise NumericalError(message)

    def steady(self, factor: Factor) -> Factor:
        """Return a factor at nearly the same shift in which elimination does not magnify rounding.

        Without pivoting an indefinite factor is good at most shifts and poor at some; a few are tried.
        """
        best = factor
        for nudge in _NUDGES:
            if best.growth <= _STEADY:
                break
            other = self.factor(factor.shift * nudge)
            best = min(best, other, key=lambda factor: factor.growth)
        return best


class Factor:
    """A factored shift: L - shift M = C D C^T with C unit lower triangular.

    ``below`` counts the eigenvalues under the shift (Sylvester's law of inertia), one for each row with a
    ``negative`` pivot; ``growth`` is the largest entry of C.
    """

    def __init__(self, factors: Any, shift: float) -> None:
        self.shift = shift
        self._lower = factors.L
        pivots: FloatArray = factors.U.diagonal()
        with np.errstate(divide="ignore"):
            self._inverse = 1 / pivots
        # Pivoting off the diagonal would make the inertia meaningless; it happens only at a zero pivot.
        self.sound = bool(np.isfinite(self._inverse).all() and np.array_equal(factors.perm_r, factors.perm_c))
        self.negative: BoolArray = pivots < 0
        self.below = int(np.count_nonzero(self.negative))

    @cached_property
    def growth(self) -> float:
        """Largest magnitude in the triangular factor; rounding grows with its square at worst."""
        return float(np.abs(self._lower.data).max())

    @cached_property
    def _triangles(self) -> tuple[_Compressed, _Compressed]:
        columns = self._lower.tocsc()
        columns.sort_indices()
        rows = columns.tocsr()
        return (rows.indptr, rows.indices, rows.data), (columns.indptr, columns.indices, columns.data)

    def solve(self, sides: FloatArray, panels: Panels) -> None:
        """Solve in place for (n, b) right sides, b a multiple of :data:`LANES`."""
        rows, columns, inverse = *self._triangles, self._inverse
        lanes = range(0, sides.shape[1], LANES)
        panels.run(lambda lane: _solve_lanes(*rows, *columns, inverse, sides, lane), lanes)


def dissection_order(matrix: CsrArray) -> IntArray:
    """Return a nested-dissection order of a symmetric sparsity pattern, (n,)."""
    n = matrix.shape[0]
    rows = np.repeat(np.arange(n), np.diff(matrix.indptr))
    off = rows != matrix.indices
    starts = np.concatenate([[0], np.cumsum(np.bincount(rows[off], minlength=n))])
    adjacency = pymetis.CSRAdjacency(starts.astype(np.int32), matrix.indices[off].astype(np.int32))
    order, _ = pymetis.nested_dissection(adjacency)
    return np.asarray(order, dtype=np.int64)


def _permuted(matrix: CsrArray, order: IntArray) -> CsrArray:
    moved = as_csr(matrix[order][:, order])
    moved.sort_indices()
    return moved


@kernel
def _solve_lanes(
    row_start: NDArray[np.int32],
    row_index: NDArray[np.int32],
    row_value: FloatArray,
    start: NDArray[np.int32],
    index: NDArray[np.int32],
    value: FloatArray,
    inverse: FloatArray,
    sides: FloatArray,
    lane: int,
) -> None:
    """Gather four known rows at a time: one store for four multiply-adds."""
    n = len(inverse)
    for i in range(n):
        x = sides[i, lane : lane + LANES]
        p, end = row_start[i], row_start[i + 1] - 1
        while p + 4 <= end:
            a = sides[row_index[p], lane : lane + LANES]
            b = sides[row_index[p + 1], lane : lane + LANES]
            c = sides[row_index[p + 2], lane : lane + LANES]
            d = sides[row_index[p + 3], lane : lane + LANES]
            va, vb, vc, vd = row_value[p], row_value[p + 1], row_value[p + 2], row_value[p + 3]
            for k in range(LANES):
                x[k] -= va * a[k] + vb * b[k] + vc * c[k] + vd * d[k]
            p += 4
        while p < end:
            a = sides[row_index[p], lane : lane + LANES]
            va = row_value[p]
            for k in range(LANES):
                x[k] -= va * a[k]
            p += 1
    for i in range(n - 1, -1, -1):
        x = sides[i, lane : lane + LANES]
        pivot = inverse[i]
        for k in range(LANES):
            x[k] *= pivot
        p, end = start[i] + 1, start[i + 1]
        while p + 4 <= end:
            a = sides[index[p], lane : lane + LANES]
            b = sides[index[p + 1], lane : lane + LANES]
            c = sides[index[p + 2], lane : lane + LANES]
            d = sides[index[p + 3], lane : lane + LANES]
            va, vb, vc, vd = value[p], value[p + 1], value[p + 2], value[p + 3]
            for k in range(LANES):
                x[k] -= va * a[k] + vb * b[k] + vc * c[k] + vd * d[k]
            p += 4
        while p < end:
            a = sides[index[p], lane : lane + LANES]
            va = value[p]
            for k in range(LANES):
                x[k] -= va * a[k]
            p += 1
