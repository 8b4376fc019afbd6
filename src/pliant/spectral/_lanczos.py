"""Block shift-invert Lanczos in the mass inner product, kept orthogonal in one pass of large products."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from .._arrays import FloatArray
from ._factor import LANES, Factor, Pencil
from ._panels import Panels
from ._sparse import product

BLOCK = 2 * LANES
# A direction with this share of its block's squared norm is rounding, not direction.
_LOST = 1e-12


@dataclass(frozen=True, eq=False)
class RitzPairs:
    """Approximate eigenpairs of a Krylov space, not yet formed.

    ``values`` ascend and are positive; ``estimates`` are relative residuals of the vectors that
    :meth:`KrylovSpace.vectors` forms from ``columns``.
    """

    values: FloatArray
    estimates: FloatArray
    columns: FloatArray


class KrylovSpace:
    """The Krylov space of (L - shift M)^-1 M, orthogonal to ``locked`` vectors, grown block by block."""

    def __init__(
        self,
        pencil: Pencil,
        factor: Factor,
        locked: list[FloatArray],
        panels: Panels,
        *,
        room: int,
        seed: int,
    ) -> None:
        self._pencil, self._factor, self._panels = pencil, factor, panels
        self._rng = np.random.default_rng(seed)
        self._first = self._end = sum(part.shape[1] for part in locked)
        # Columns lie one after the other: memory is touched only as far as the space grows.
        self._basis = np.empty((pencil.n, self._first + room), order="F")
        held = self._basis[:, : self._first]
        panels.each(lambda rows: _assign(held, rows, np.hstack([part[rows] for part in locked])))
        self._projected = np.zeros((0, 0))
        self._coupling = np.zeros((BLOCK, 0))
        start = self._rng.standard_normal((pencil.n, BLOCK))
        factor.solve(start, panels)
        self._orthogonalise(start)
        self._append(start, self._orthogonalise(start))

    @property
    def size(self) -> int:
        """Number of basis vectors the operator has been applied to."""
        return len(self._projected)

    @property
    def full(self) -> bool:
        """Whether there is no room for another block."""
        return bool(self._end + BLOCK > self._basis.shape[1])

    def grow(self) -> None:
        """Apply the operator to the last block, make the result orthogonal to all, and append it."""
        basis, panels, end = self._basis, self._panels, self._end
        last = basis[:, end - BLOCK : end]
        new = np.empty((self._pencil.n, BLOCK))
        panels.each(lambda rows: _assign(new, rows, self._weighed(last, rows)))
        self._factor.solve(new, panels)
        # The three-term recurrence first: what is left of older blocks is rounding, and one pass takes it out.
        before, back = basis[:, end - BLOCK - self._coupling.shape[1] : end - BLOCK], self._coupling.T
        diagonal = self._subtract(new, before, back, then=last)
        rest = self._subtract(new, last, diagonal, then=basis[:, :end])
        gram = self._subtract(new, basis[:, :end], rest, then=new)
        diagonal = diagonal + rest[-BLOCK:]
        self._extend(0.5 * (diagonal + diagonal.T))
        self._coupling = self._append(new, gram)

    def pairs(self) -> RitzPairs:
        """Return the Ritz pairs with positive values, ascending."""
        theta, columns = scipy.linalg.eigh(self._projected, check_finite=False, driver="evd")
        with np.errstate(divide="ignore"):
            values = self._factor.shift + 1 / theta
        keep = np.flatnonzero(np.isfinite(values) & (values > 0))
        keep = keep[np.argsort(values[keep], kind="stable")]
        theta, values, columns = theta[keep], values[keep], columns[:, keep]
        tails = self._coupling @ columns[-BLOCK:]
        estimates = np.linalg.norm(tails, axis=0) / (theta**2 * values)
        return RitzPairs(values, estimates, np.vstack([columns, tails / theta]))

    def vectors(self, pairs: RitzPairs, count: int) -> FloatArray:
        """Form the first Ritz vectors, (n, count), after one more application of the operator.

        That costs no solve, for the space already holds the next block, and takes out the high frequencies
        an interior Ritz vector carries (Ericsson & Ruhe 1980).
        """
        columns = np.ascontiguousarray(pairs.columns[:, :count])
        formed = np.empty((self._pencil.n, count))
        space = self._basis[:, self._first : self._end]
        self._panels.each(lambda rows: _assign(formed, rows, space[rows] @ columns))
        return formed

    def _weighed(self, tall: FloatArray, rows: slice) -> FloatArray:
        weights = self._pencil.weights
        return weights[rows] * tall[rows] if weights is not None else product(self._pencil.mass[rows], tall)

    def _products(self, left: FloatArray, new: FloatArray, change: Callable[[slice], None]) -> FloatArray:
        """Change ``new`` row chunk by row chunk, then return the mass products of ``left`` with it.

        Products are formed transposed, the narrow factor first: BLAS does that half again as fast.
        """
        if self._pencil.weights is None:
            # A full mass matrix looks across chunks: every one must have changed before.
            self._panels.each(change)
            return self._panels.total(lambda rows: self._weighed(new, rows).T @ left[rows]).T

        def work(rows: slice) -> FloatArray:
            change(rows)
            return self._weighed(new, rows).T @ left[rows]

        return self._panels.total(work).T

    def _subtract(
        self, new: FloatArray, basis: FloatArray, part: FloatArray, *, then: FloatArray
    ) -> FloatArray:
        """Take ``basis part`` out of ``new``; return the mass products of ``then`` with what is left."""
        turned = np.ascontiguousarray(part.T)

        def change(rows: slice) -> None:
            if part.size:
                new[rows] -= (turned @ basis[rows].T).T

        return self._products(then, new, change)

    def _transform(self, new: FloatArray, matrix: FloatArray) -> FloatArray:
        """Multiply a block from the right; return the mass products of the result with itself."""

        def change(rows: slice) -> None:
            new[rows] = new[rows] @ matrix

        return self._products(new, new, change)

    def _orthogonalise(self, new: FloatArray) -> FloatArray:
        """Make a block orthogonal to the whole basis; return its mass products with itself."""
        held = self._basis[:, : self._end]
        part = self._products(held, new, lambda rows: None)
        return self._subtract(new, held, part, then=new)

    def _extend(self, diagonal: FloatArray) -> None:
        m = self.size
        larger = np.zeros((m + BLOCK, m + BLOCK))
        larger[:m, :m] = self._projected
        larger[m:, m:] = diagonal
        if m:
            larger[m:, m - BLOCK : m] = self._coupling
            larger[m - BLOCK : m, m:] = self._coupling.T
        self._projected = larger

    def _append(self, new: FloatArray, gram: FloatArray) -> FloatArray:
        """Orthonormalise a block with the given products, append it and return R with ``old = new R``."""
        scale, turned = np.linalg.eigh(gram)
        if scale[0] > _LOST * scale[-1]:
            first = np.linalg.cholesky(gram).T
            again = self._transform(new, np.linalg.inv(first))
        else:
            first, again = self._replace_lost(new, scale, turned)
        # Twice is enough (Cholesky QR 2: Yamamoto, Nakatsukasa, Yanagisawa & Fukaya 2015).
        second = np.linalg.cholesky(again).T
        inverse = np.linalg.inv(second)
        into = self._basis[:, self._end : self._end + BLOCK]
        self._panels.each(lambda rows: _assign(into, rows, new[rows] @ inverse))
        self._end += BLOCK
        coupling: FloatArray = second @ first
        return coupling

    def _replace_lost(
        self, new: FloatArray, scale: FloatArray, turned: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Put random directions where a block lost rank: a whole invariant subspace has been found."""
        kept = scale > max(_LOST * scale[-1], np.finfo(float).tiny)
        sizes = np.sqrt(np.where(kept, scale, 1.0))
        self._transform(new, turned / sizes)
        new[:, ~kept] = self._rng.standard_normal((len(new), int((~kept).sum())))
        for _ in range(2):
            norms = np.sqrt(np.diag(self._orthogonalise(new)))
            gram = self._transform(new, np.diag(1 / norms))
        first: FloatArray = np.where(kept, sizes, 0.0)[:, None] * turned.T
        return first, gram


def _assign(into: FloatArray, rows: slice, values: FloatArray) -> None:
    into[rows] = values
