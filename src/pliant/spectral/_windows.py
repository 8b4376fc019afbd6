"""All eigenpairs below a cut, window by window, each window proved complete by inertia.

Sylvester's law: the factor of L - s M has as many negative pivots as there are eigenvalues below s.
"""

from __future__ import annotations

import numpy as np

from .._arrays import FloatArray
from .._progress import Advance
from ..errors import NumericalError
from ._factor import Factor, Pencil
from ._lanczos import BLOCK, KrylovSpace, RitzPairs
from ._panels import Panels

# A window's shift lies this share of the way up; the values below it converge for nearly nothing.
_FIRST_SHIFT, _NEXT_SHIFT = 0.55, 0.7
# Past this many pairs keeping one space orthogonal costs more than starting another.
_WIDEST = 320
# Krylov vectors needed for each wanted pair, before the first look at what has converged.
_VECTORS_PER_PAIR = 2.2
# Estimates fall by about this factor from block to block.
_FALL = 5.0
# Estimates are in the mass's norm, residuals in the Euclidean one.
_SAFETY = 0.2
# Neighbouring eigenvalues closer than this are one cluster, and a cut must not go through it.
_GAP = 1e-7
_MOST_EXTRA = 64


class WindowSolver:
    """Eigenpairs in ascending order, found window by window; rows are the pencil's."""

    def __init__(
        self, pencil: Pencil, kernel_vectors: FloatArray, area: float, tol: float, panels: Panels
    ) -> None:
        self._pencil, self._panels, self._tol = pencil, panels, tol
        self._zeros = self._found = kernel_vectors.shape[1]
        self._values = [np.zeros(self._zeros)]
        self._vectors = [kernel_vectors]
        self._density = area / (4 * np.pi)
        self._cut = 0.0

    def solve(self, k: int, advance: Advance) -> tuple[FloatArray, FloatArray]:
        """Return the first k eigenvalues (k,) and mass-orthonormal eigenvectors (n, k)."""
        windows = -(-(k - self._found) // _WIDEST)
        while self._found < k:
            start = self._found
            self._window(-(-(k - start) // max(windows, 1)))
            windows -= 1
            advance(min(self._found, k) - start)
        values = np.concatenate(self._values)
        order = np.argsort(values, kind="stable")[:k]
        vectors = np.empty((self._pencil.n, k))
        every = self._vectors

        def gather(rows: slice) -> None:
            vectors[rows] = np.hstack([part[rows] for part in every])[:, order]

        self._panels.each(gather)
        return values[order], vectors

    def _window(self, want: int) -> None:
        factor = self._factor_inside(want)
        for _attempt in range(8):
            pairs, space = self._sweep(factor, want)
            cuts = _cuts(pairs, want, _SAFETY * self._tol)
            if not cuts:
                break
            for count in cuts[:3]:
                cut = 0.5 * (pairs.values[count - 1] + pairs.values[count])
                missing = self._pencil.factor(cut).below - self._found - count
                if not missing:
                    self._accept(pairs, space, count)
                    self._cut = cut
                    return
            # Copies of a repeated eigenvalue are missing: keep what is there and look for what is not.
            self._accept(pairs, space, cuts[-1])
            want = max(missing, 1)
        message = (
            f"the eigensolver did not converge past {self._found} pairs at tol={self._tol:.1e}; raise tol, or "
            "look for sliver triangles (see pliant.check_up)"
        )
        raise NumericalError(message)

    def _accept(self, pairs: RitzPairs, space: KrylovSpace, count: int) -> None:
        self._vectors.append(space.vectors(pairs, count))
        self._values.append(pairs.values[:count])
        self._found += count

    def _factor_inside(self, want: int) -> Factor:
        """Factor at a shift with a fitting number of the wanted values below it."""
        first = self._found == self._zeros
        target = (_FIRST_SHIFT if first else _NEXT_SHIFT) * want
        shift = self._cut + target / (self._density if first else self._found / self._cut)
        low, high = self._cut, np.inf
        for _ in range(30):
            factor = self._pencil.factor(shift)
            inside = factor.below - self._found
            if 0.6 * target - 2 <= inside <= 1.3 * target + 2:
                break
            if inside > target:
                high = shift
            else:
                low = shift
            faster = self._cut + (shift - self._cut) * min(max(target / max(inside, 1), 1.3), 4.0)
            shift = 0.5 * (low + high) if np.isfinite(high) else faster
        return self._pencil.steady(factor)

    def _sweep(self, factor: Factor, want: int) -> tuple[RitzPairs, KrylovSpace]:
        """Grow a Krylov space until the first ``want`` pairs and a gap after them have converged."""
        tol, inside = _SAFETY * self._tol, factor.below - self._found
        room = min(self._pencil.n - self._found - BLOCK, 6 * want + 40 * BLOCK) // BLOCK * BLOCK
        space = KrylovSpace(
            self._pencil, factor, self._vectors, self._panels, room=room, seed=len(self._vectors)
        )
        look = int(_VECTORS_PER_PAIR * want) + 3 * BLOCK
        while True:
            while space.size < look and not space.full:
                space.grow()
            pairs = space.pairs()
            worst = _worst(pairs, want, inside, factor.shift)
            if space.full or (worst <= tol and _cuts(pairs, want, tol)):
                return pairs, space
            steps = np.log(max(worst / tol, 1.0)) / np.log(_FALL) if np.isfinite(worst) else 6
            look = space.size + BLOCK * int(np.clip(np.ceil(steps), 1, 6))


def _worst(pairs: RitzPairs, want: int, inside: int, shift: float) -> float:
    """Return the largest estimate of the wanted pairs; infinite while fewer lie below the shift than should."""
    if len(pairs.values) <= want or np.count_nonzero(pairs.values < shift) < inside:
        return np.inf
    return float(pairs.estimates[:want].max())


def _cuts(pairs: RitzPairs, want: int, tol: float) -> list[int]:
    """Return numbers of pairs, ``want`` or more, that end in converged pairs before a gap; widest gap first."""
    bad = np.flatnonzero(pairs.estimates > tol)
    converged = int(bad[0]) if bad.size else len(pairs.values)
    last = min(converged, len(pairs.values) - 1, want + _MOST_EXTRA)
    counts = np.arange(want, last + 1)
    if not counts.size:
        return []
    below, above = pairs.values[counts - 1], pairs.values[counts]
    gaps = (above - below) / above
    # The value above the gap need not have converged to tol, but must be known better than the gap is wide.
    known = pairs.estimates[counts] ** 2 < 0.01 * gaps
    fit = (gaps > _GAP) & known
    order = np.argsort(-gaps[fit], kind="stable")
    return [int(c) for c in counts[fit][order]]
