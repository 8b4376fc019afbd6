"""First guesses of further reflections of a surface that has one: its signs, its folds, and what follows from both."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from ..._arrays import FloatArray, IntArray
from ._frame import Coarse
from ._guesses import SAME, SHARED, Guess, measured
from ._refine import grown, orthogonal
from ._slide import repeated_pairs, slowly_grown, turned

# Eigenfunctions whose signs are tried: reflections through two or three planes differ in one of the first few.
_SIGNED = 5
# Angles that a mirror is turned by within a repeated pair, over half a turn: enough for a dozen folds.
_ANGLES = 24
# What may be a reflection: it turns the surface about and distorts little, for so few samples.
_MERIT, _DISTORTION = 5.0, 0.06
# Samples of the first look.
_FEW = 300
_MOST = 8


def further_guesses(coarse: Coarse, found: Sequence[FloatArray]) -> list[FloatArray]:
    """Return first corners of functional maps that may be reflections too, given those found.

    Each reflection with the signs of its first eigenfunctions changed, or turned within its first repeated
    eigenvalue; and each carried along by another, which closes the group.
    """
    guesses: list[FloatArray] = []
    for matrix in found[:1]:
        guesses += _signed(matrix)
        guesses += _turned(coarse, matrix)
    guesses += [a @ b @ a for a in found for b in found if a is not b]
    return guesses


def _signed(matrix: FloatArray) -> list[FloatArray]:
    size = min(_SIGNED, len(matrix) - 1) + 1
    corner = matrix[:size, :size]
    patterns = list(product((1.0, -1.0), repeat=size - 1))[1:]
    return [orthogonal(corner * np.array([1.0, *signs])) for signs in patterns]


def _turned(coarse: Coarse, matrix: FloatArray) -> list[FloatArray]:
    pairs = repeated_pairs(coarse, matrix)
    angles = np.pi * np.arange(1, _ANGLES) / _ANGLES
    return [turned(matrix, pairs[0], float(angle)) for angle in angles] if pairs else []


def new_guesses(
    coarse: Coarse, found: Sequence[FloatArray], places: Sequence[IntArray], k: int, step: int
) -> list[Guess]:
    """Grow the guesses of further reflections and keep what is a good map, unlike those found and one another."""
    few = coarse.first(_FEW)
    kept: list[Guess] = []
    grew = []
    for first in further_guesses(coarse, found):
        corner = slowly_grown(coarse, first, k)
        slow = measured(few, corner)
        if slow.merit <= _MERIT and slow.distortion <= 2 * _DISTORTION:
            grew.append(measured(coarse, grown(coarse, corner, k, step)))
    for guess in sorted(grew, key=lambda one: one.merit):
        if guess.merit > _MERIT or guess.distortion > _DISTORTION:
            continue
        if all(_shared(coarse, guess.points, o) < SHARED for o in [*places, *(g.points for g in kept)]):
            kept.append(guess)
    return kept[:_MOST]


def _shared(coarse: Coarse, a: IntArray, b: IntArray) -> float:
    """Share of the area where two maps agree."""
    embedding = coarse.frame.embedding[coarse.samples]
    near = np.linalg.norm(embedding[a] - embedding[b], axis=1) < SAME
    return float(coarse.weights[near].sum())
