"""Whether a reflection is one of a continuum: turned within a repeated eigenvalue, it stays turned."""

from __future__ import annotations

import numpy as np

from ..._arrays import FloatArray
from ._frame import Coarse
from ._refine import grown, orthogonal

# No two of them a symmetry of one regular polygon apart.
_ANGLES = (0.35, 0.8, 1.25)
_PAIRS = 12
_REPEATED = 0.02
_KEPT = 0.2


def slides(coarse: Coarse, matrix: FloatArray, k: int, step: int) -> bool:
    """Turn a reflection by arbitrary angles and refine it: on a surface of revolution the angles stay.

    On a surface with a few reflections, of however many folds, it snaps back to one of them.
    """
    values = coarse.frame.spectrum.values[: _PAIRS + 2]
    gaps = np.diff(values[1:]) / values[2:]
    repeated = [int(i) + 1 for i in np.flatnonzero(gaps < _REPEATED)]
    # Where the pair keeps its sign, or both change it, turning changes nothing.
    mirrored = [i for i in repeated if np.linalg.det(matrix[i : i + 2, i : i + 2]) < -0.5]
    if not mirrored:
        return False
    pair = slice(mirrored[0], mirrored[0] + 2)
    size = mirrored[0] + 2
    for angle in _ANGLES:
        turn = np.eye(size)
        turn[pair, pair] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        turned = orthogonal(turn @ matrix[:size, :size] @ turn.T)
        refined = grown(coarse, turned, k, step)
        if np.abs(refined[pair, pair] - turned[pair, pair]).max() > _KEPT:
            return False
    return True
