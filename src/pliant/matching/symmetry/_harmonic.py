"""Maps made smooth and their own inverse: where growth by eigenfunctions turned part of a surface the wrong way."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..._arrays import FloatArray, IntArray
from ._frame import Coarse
from ._guesses import Guess, measured
from ._refine import grown, nearest_points, orthogonal

# Weight of the map's Dirichlet energy, with eigenvalues in units of the twentieth.
_STIFFNESS = 0.3
_UNIT = 20
_EMBEDDED = 100
_ROUNDS = 20
_SETTLED = 0.995
# Growth after smoothing starts near its end: from further back it would leave again.
_LAST_PART = 0.95
# Times that a map is smoothed and sharpened; it stands still when so many samples keep their image.
_MENDINGS = 4
_STILL = 0.97


def harmonic_points(coarse: Coarse, points: IntArray) -> IntArray:
    """Alternate smooth places of the samples' images with the samples nearest to them (Ezuz et al. 2019).

    Places, in the biharmonic embedding, have a small Dirichlet energy and are near the image of their sample and near
    the samples whose image it is: limbs that are carried well draw what lies between them along, where eigenfunctions
    of a pose that is no isometry give each part its own way.
    """
    spectrum = coarse.frame.spectrum
    scaled = spectrum.values / spectrum.values[min(_UNIT, spectrum.k - 1)]
    embedding = coarse.basis[:, 1:_EMBEDDED] / spectrum.values[1:_EMBEDDED]
    # Positions and energy in one unit, whatever the surface's size and shape.
    embedding /= np.sqrt(coarse.weights @ (embedding**2).sum(axis=1))
    weights, rows = coarse.weights, np.arange(len(points))
    for _ in range(_ROUNDS):
        # From the image of a sample, and from the samples whose image it is.
        both = sp.csr_array((weights, (rows, points)), shape=(len(rows),) * 2)
        pulled: FloatArray = np.asarray(both @ embedding + both.T @ embedding)
        total = weights + np.bincount(points, weights=weights, minlength=len(points))
        system = (coarse.basis * total[:, None]).T @ coarse.basis + np.diag(_STIFFNESS * scaled)
        places = coarse.basis @ np.linalg.solve(system, coarse.basis.T @ pulled)
        before, points = points, nearest_points(places, embedding)
        if (points == before).mean() > _SETTLED:
            break
    return points


def smoothed(coarse: Coarse, matrix: FloatArray, points: IntArray, step: int) -> FloatArray:
    """Return a functional map made harmonic and sharpened again."""
    k = len(matrix)
    basis = coarse.basis[:, : max(2, int(_LAST_PART * k))]
    fitted = (basis * coarse.weights[:, None]).T @ basis[harmonic_points(coarse, points)]
    return grown(coarse, orthogonal(fitted + fitted.T), k, step, symmetric=True)


def mended(coarse: Coarse, guess: Guess, step: int) -> Guess:
    """Smooth and sharpen a map a few times and return the best on the way: on a good one, the first stands still."""
    best = guess
    for _ in range(_MENDINGS):
        matrix = smoothed(coarse, guess.matrix, guess.points, step)
        before, guess = guess.points, measured(coarse, matrix)
        if guess.merit < best.merit:
            best = guess
        if (guess.points == before).mean() > _STILL:
            break
    return best
