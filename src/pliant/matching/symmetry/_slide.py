"""Whether a reflection is one of a continuum: turned within a repeated eigenvalue, it stays turned."""

from __future__ import annotations

import numpy as np

from ..._arrays import FloatArray
from ._frame import Coarse
from ._guesses import measured
from ._refine import grown, orthogonal

# No two of them a symmetry of one regular polygon apart.
_ANGLES = (0.35, 0.8, 1.25)
_PAIRS = 12
_REPEATED = 0.02
_KEPT = 0.25
# Distortion of a map that is as good as another; the spacing of some hundred samples alone makes .02 to .03.
_AS_GOOD, _NOISE = 1.3, 0.035
# Samples and eigenfunctions of slow growth.
_FEW, _SLOW = 300, 16


def slides(coarse: Coarse, matrix: FloatArray, k: int, step: int) -> bool:
    """Turn a reflection by arbitrary angles and refine it: on a surface of revolution the angles stay.

    On a surface with a few reflections, of however many folds, it snaps back to one of them, or gets stuck where it
    distorts more.
    """
    mirrored = repeated_pairs(coarse, matrix)
    if not mirrored:
        return False
    pair = slice(mirrored[0], mirrored[0] + 2)
    most = max(_AS_GOOD * measured(coarse, matrix[:k, :k]).distortion, _NOISE)
    for angle in _ANGLES:
        start = turned(matrix, mirrored[0], angle)
        refined = grown(coarse, start, k, step)
        if np.abs(refined[pair, pair] - start[pair, pair]).max() > _KEPT:
            return False
        if measured(coarse, refined).distortion > most:
            return False
    return True


def slowly_grown(coarse: Coarse, corner: FloatArray, k: int) -> FloatArray:
    """Grow a first corner one eigenfunction at a time: a mirror turned in two functions says little of the third."""
    return grown(coarse.first(_FEW), corner, min(_SLOW, k), 1) if len(corner) < _SLOW else corner[:k, :k]


def turned(matrix: FloatArray, first: int, angle: float) -> FloatArray:
    """Return a map's first corner, up to a pair of eigenfunctions, with its mirror turned in that pair."""
    turn = np.eye(first + 2)
    turn[first:, first:] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return orthogonal(turn @ matrix[: first + 2, : first + 2] @ turn.T)


def repeated_pairs(coarse: Coarse, matrix: FloatArray) -> list[int]:
    """Places of the first eigenvalues that come twice and in whose two functions a map is a mirror."""
    values = coarse.frame.spectrum.values[: _PAIRS + 2]
    gaps = np.diff(values[1:]) / values[2:]
    repeated = [int(i) + 1 for i in np.flatnonzero(gaps < _REPEATED)]
    # Where the pair keeps its sign, or both change it, turning changes nothing.
    return [i for i in repeated if np.linalg.det(matrix[i : i + 2, i : i + 2]) < -0.5]
