"""First maps: from votes, grown quickly, and where none is clean, branched."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..._arrays import FloatArray, IntArray
from ._frame import Coarse, Frame
from ._refine import coarse_points, first_map, grown, orthogonal, reversed_share
from .voting import agreements, best_per_source

WIDTHS = (0.02, 0.03, 0.05)
FIRST = 20
# A quick look at every guess: samples, eigenfunctions, step.
QUICK = (500, 60, 8)
SAME = 0.1
# Two reflections agree along curves; one that agrees with a better one over more is that one, part of it flipped.
SHARED = 0.25
# Of two maps nearly as good, the one that moves more: limbs left where they are cost little distortion.
MOVES = 0.5
# A limb turned half about costs little distortion either, but leaves its faces on the wrong side.
FOLDS = 0.5
_SEEDS = 5
_FINALISTS = 5
# A reflection and the same with its trunk turned about are this near, and both may be among the guesses.
_ALIKE = 0.03
_FEWEST = 4
_TURNED = 10.0
# Of a map that turns half of the surface about; few samples see the best maps of bent people turn .55 to .7.
_HALF = 0.5
# A guess with less distortion and more reversed area needs no branching.
_CLEAN = (0.025, 0.85)
# Branching: samples, first size, last size, maps kept on the way.
_BRANCHING = (300, 6, 40, 8)
_SAME_POINTS = 0.9


def consistent_sets(
    frame: Frame, sources: IntArray, targets: IntArray, width: float
) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield sets of pairs that agree among themselves, one pair a source, from seeds no earlier set explains."""
    table = agreements(frame, sources, targets, width)
    starts = np.flatnonzero(np.diff(sources, prepend=-1))
    votes = np.maximum.reduceat(table, starts, axis=1)
    left = votes.sum(axis=1)
    chosen = best_per_source(sources, left, 0.5)
    yield sources[chosen], targets[chosen]
    for _ in range(_SEEDS):
        if left.max(initial=0.0) <= _FEWEST:
            return
        score = table[:, int(left.argmax())]
        for _round in range(4):
            chosen = best_per_source(sources, score, 0.3)
            score = table[:, chosen].mean(axis=1)
        yield sources[chosen], targets[chosen]
        left = np.where(score > 0.5 * score.max(), 0.0, left)
        left[chosen] = 0.0


@dataclass(frozen=True, eq=False)
class Guess:
    """A map between samples, and how bad it is; its first ``settled`` eigenfunctions are not left to chance."""

    matrix: FloatArray
    points: IntArray
    merit: float
    distortion: float
    reversed: float
    settled: int = FIRST


def distinct_guesses(coarse: Coarse, sources: IntArray, targets: IntArray, k: int) -> list[Guess]:
    """Refine every guess quickly; keep the best few that differ."""
    guesses = []
    if not len(sources):
        return []
    for width in WIDTHS:
        for a, b in consistent_sets(coarse.frame, sources, targets, width):
            if len(a) < _FEWEST:
                continue
            matrix = first_map(coarse, a, b, min(FIRST, k))
            matrix = grown(coarse, matrix, min(QUICK[1], k), QUICK[2])
            guesses.append(measured(coarse, matrix))
    guesses.sort(key=lambda guess: guess.merit)
    if guesses and not any(guess.merit < _TURNED / 2 for guess in guesses):
        guesses = sorted(guesses + _flipped(coarse, guesses, k), key=lambda guess: guess.merit)
    if guesses and not _clean(guesses[0]):
        guesses = sorted(
            guesses + _branched(coarse, _distinct(coarse, guesses), k), key=lambda guess: guess.merit
        )
    return _distinct(coarse, guesses)


def _clean(guess: Guess) -> bool:
    return guess.merit < _TURNED / 2 and guess.distortion < _CLEAN[0] and guess.reversed > _CLEAN[1]


def _distinct(coarse: Coarse, guesses: list[Guess]) -> list[Guess]:
    kept: list[Guess] = []
    for guess in guesses:
        if all(apart(coarse, guess.points, other.points) > _ALIKE for other in kept):
            kept.append(guess)
    return kept[:_FINALISTS]


def _branched(coarse: Coarse, guesses: list[Guess], k: int) -> list[Guess]:
    """Grow the first corner of guesses one eigenfunction at a time, with both signs of each new one tried.

    Which way about a limb goes shows only once the eigenfunctions reach it; growth alone settles it by chance
    (Ren et al. 2020 explore the same tree). The best few are kept at each size, and grown on all samples at the end.
    """
    samples, size, last, width = _BRANCHING
    few = coarse.first(samples)
    weighted = few.basis * few.weights[:, None]
    pool = [guess.matrix[:size, :size] for guess in guesses]
    while True:
        found: list[Guess] = []
        for matrix in pool:
            fitted = weighted[:, :size].T @ few.basis[coarse_points(few, matrix), :size]
            one = measured(few, orthogonal(fitted + fitted.T))
            if all((one.points == other.points).mean() < _SAME_POINTS for other in found):
                found.append(one)
        found = sorted(found, key=lambda guess: guess.merit)[:width]
        if size >= min(last, k):
            break
        size += 1
        pool = [matrix for guess in found for matrix in _extended(guess, few, weighted, size)]
    full = min(QUICK[1], k)
    finished = [
        measured(coarse, grown(coarse, guess.matrix, full, QUICK[2])) for guess in found[: width // 2]
    ]
    return [replace(guess, settled=size) for guess in finished]


def _extended(guess: Guess, coarse: Coarse, weighted: FloatArray, size: int) -> list[FloatArray]:
    """Return a map one larger: as its points say, and with the new eigenfunction kept or changed in sign."""
    fitted = weighted[:, :size].T @ coarse.basis[guess.points, :size]
    found = [orthogonal(fitted + fitted.T)]
    for sign in (1.0, -1.0):
        larger = np.pad(guess.matrix, (0, 1))
        larger[-1, -1] = sign
        found.append(larger)
    return found


def _flipped(coarse: Coarse, guesses: list[Guess], k: int) -> list[Guess]:
    """Refine the best guesses again from the negative of one eigenfunction's image, for each of the first.

    A limb's pairs say nothing of front and back: rotations and half-turned reflections keep them too.
    """
    found = []
    first = min(FIRST, k)
    for guess in guesses[:2]:
        for i in range(1, first):
            matrix = guess.matrix[:first, :first].copy()
            matrix[:, i] *= -1
            found.append(measured(coarse, grown(coarse, orthogonal(matrix), min(QUICK[1], k), QUICK[2])))
    return found


def measured(coarse: Coarse, matrix: FloatArray) -> Guess:
    """Merit of a map between samples: small where it distorts little, keeps signatures, and is its own inverse."""
    frame = coarse.frame
    points = coarse_points(coarse, matrix)
    image = coarse.samples[points]
    change = np.abs(coarse.distances - coarse.distances[np.ix_(points, points)])
    distortion = coarse.weights @ change @ coarse.weights
    gaps = np.minimum(frame.signature_gaps(coarse.samples, image) / max(frame.variation, 1e-300), 1)
    residual = coarse.weights @ gaps
    rows = np.arange(len(points))
    back = float(coarse.weights @ coarse.distances[points[points], rows])
    moved = float(coarse.weights @ coarse.distances[points, rows])
    turned = reversed_share(coarse, coarse, matrix, points)
    # What hardly moves, the identity, and what keeps the orientation come last.
    penalty = _TURNED * float(turned < _HALF) + _TURNED * float(moved < SAME)
    merit = distortion + residual + back + FOLDS * (1 - turned) - MOVES * moved + penalty
    return Guess(matrix, points, float(merit), float(distortion), turned)


def apart(coarse: Coarse, a: IntArray, b: IntArray) -> float:
    """Mean distance between the images of the samples under two maps."""
    embedding = coarse.frame.embedding[coarse.samples]
    return float(coarse.weights @ np.linalg.norm(embedding[a] - embedding[b], axis=1))
