"""Block shift-invert Lanczos in the mass inner product, kept orthogonal in one pass of large products."""

from __future__ import annotations

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
        for _ in range(2):
            self._orthogonalise(start)
        self._append(start)

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
        if self.size:
            before, back = basis[:, end - 2 * BLOCK : end - BLOCK], self._coupling.T
            panels.each(lambda rows: _subtract(new, before, back, rows))
        diagonal = panels.total(lambda rows: last[rows].T @ self._weighed(new, rows))
        panels.each(lambda rows: _subtract(new, last, diagonal, rows))
        rest = self._orthogonalise(new)
        diagonal = diagonal + rest[-BLOCK:]
        self._extend(0.5 * (diagonal + diagonal.T))
        self._coupling = self._append(new)

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

    def _orthogonalise(self, new: FloatArray) -> FloatArray:
        held = self._basis[:, : self._end]
        part = self._panels.total(lambda rows: held[rows].T @ self._weighed(new, rows))
        self._panels.each(lambda rows: _subtract(new, held, part, rows))
        return part

    def _extend(self, diagonal: FloatArray) -> None:
        m = self.size
        larger = np.zeros((m + BLOCK, m + BLOCK))
        larger[:m, :m] = self._projected
        larger[m:, m:] = diagonal
        if m:
            larger[m:, m - BLOCK : m] = self._coupling
            larger[m - BLOCK : m, m:] = self._coupling.T
        self._projected = larger

    def _append(self, new: FloatArray) -> FloatArray:
        """Orthonormalise a block, append it and return R with ``old = new R``."""
        gram = self._gram(new)
        scale, turned = np.linalg.eigh(gram)
        if scale[0] > _LOST * scale[-1]:
            first = np.linalg.cholesky(gram).T
            self._transform(new, np.linalg.inv(first))
        else:
            first = self._replace_lost(new, scale, turned)
        second = np.linalg.cholesky(self._gram(new)).T
        self._transform(new, np.linalg.inv(second))
        into = self._basis[:, self._end : self._end + BLOCK]
        self._panels.each(lambda rows: _assign(into, rows, new[rows]))
        self._end += BLOCK
        coupling: FloatArray = second @ first
        return coupling

    def _replace_lost(self, new: FloatArray, scale: FloatArray, turned: FloatArray) -> FloatArray:
        """Put random directions where a block lost rank: a whole invariant subspace has been found."""
        kept = scale > max(_LOST * scale[-1], np.finfo(float).tiny)
        sizes = np.sqrt(np.where(kept, scale, 1.0))
        self._transform(new, turned / sizes)
        new[:, ~kept] = self._rng.standard_normal((len(new), int((~kept).sum())))
        for _ in range(2):
            self._orthogonalise(new)
            norms = np.sqrt(np.diag(self._gram(new)))
            self._transform(new, np.diag(1 / norms))
        first: FloatArray = np.where(kept, sizes, 0.0)[:, None] * turned.T
        return first

    def _gram(self, new: FloatArray) -> FloatArray:
        return self._panels.total(lambda rows: new[rows].T @ self._weighed(new, rows))

    def _transform(self, new: FloatArray, matrix: FloatArray) -> None:
        self._panels.each(lambda rows: _assign(new, rows, new[rows] @ matrix))


def _assign(into: FloatArray, rows: slice, values: FloatArray) -> None:
    into[rows] = values


def _subtract(into: FloatArray, basis: FloatArray, part: FloatArray, rows: slice) -> None:
    into[rows] -= basis[rows] @ part
