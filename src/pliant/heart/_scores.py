"""Scores of predictions, their intervals over subjects and their nulls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._arrays import BoolArray, FloatArray, IntArray
from ._crossval import Problem

# Subjects of each class below which a bootstrap's interval means nothing. Draws of m subjects that are all predicted
# rightly agree always: a model that is right four times in five shows an interval of no width with .8^m, for 10
# one time in nine, for 3 every other time.
FEWEST_FOR_INTERVAL = 10


@dataclass(frozen=True)
class Score:
    """A number with its uncertainty.

    Parameters
    ----------
    value : float
        What was measured.
    low, high : float
        95 % interval of a bootstrap over subjects; NaN where either class has fewer than 10 subjects, too few for an
        interval to mean anything.
    null : float
        95th percentile of the same number with labels shuffled; NaN without shuffles.
    p : float
        Share of shuffles, the true order among them, that do as well; NaN without shuffles.
    """

    value: float
    low: float
    high: float
    null: float
    p: float


def balanced_accuracy(predicted: FloatArray, target: FloatArray) -> float:
    """Mean over repeats of the mean of both classes' shares classified rightly."""
    ill = target > 0.5
    right = (predicted > 0.5) == ill
    return float(0.5 * (right[:, ill].mean() + right[:, ~ill].mean()))


def correlation(predicted: FloatArray, target: FloatArray) -> float:
    """Mean over repeats of Pearson's r; NaN where a prediction never changes."""
    return float(_correlations(predicted[:, None, :], np.broadcast_to(target, (1, len(target)))).mean())


def score_draws(predicted: FloatArray, problem: Problem, kind: str, resamples: int, rng: int) -> FloatArray:
    """(resamples,) scores of subjects drawn anew within their classes; the same draws for the same seed."""
    drawn = _draws(problem.diseased, resamples, rng)
    if kind == "per cent":
        found: FloatArray = _correlations(predicted[:, drawn], problem.percent[drawn]).mean(axis=0)
        return found
    right = ((predicted > 0.5) == problem.diseased)[:, drawn].mean(axis=0)
    ill = problem.diseased[drawn]
    shares: FloatArray = 0.5 * (
        (right * ill).sum(axis=1) / ill.sum(axis=1) + (right * ~ill).sum(axis=1) / (~ill).sum(axis=1)
    )
    return shares


def scored(value: float, draws: FloatArray, null: FloatArray) -> Score:
    """Gather a score from its value, bootstrap draws and shuffles."""
    low, high = np.nanpercentile(draws, [2.5, 97.5]) if np.isfinite(draws).any() else (np.nan, np.nan)
    known = null[np.isfinite(null)]
    edge = float(np.percentile(known, 95)) if known.size else float("nan")
    p = (1 + int((known >= value).sum())) / (1 + len(known)) if known.size else float("nan")
    return Score(value, float(low), float(high), edge, p)


def interval_cautions(problems: Sequence[Problem]) -> tuple[str, ...]:
    """Name the problems whose scores have no interval; nothing where all have one."""
    small = [problem for problem in problems if not enough_for_interval(problem)]
    if not small:
        return ()
    listed = ", ".join(f"{p.name} {int(p.diseased.sum())} of {len(p.diseased)}" for p in small[:5])
    more = ", ..." if len(small) > 5 else ""
    least = FEWEST_FOR_INTERVAL
    return (
        f"too few subjects for an interval to mean anything in {len(small)} of {len(problems)} units (diseased: "
        f"{listed}{more}): it takes {least} with and {least} without disease; scores may be luck, read them beside "
        "the null and p",
    )


def enough_for_interval(problem: Problem) -> bool:
    """Whether both classes have subjects enough."""
    ill = int(problem.diseased.sum())
    return min(ill, len(problem.diseased) - ill) >= FEWEST_FOR_INTERVAL


def area(predicted: FloatArray, diseased: BoolArray) -> float:
    """Mean over repeats of the area under the receiver operating characteristic."""
    return float(_wins(predicted, diseased).mean())


def area_draws(predicted: FloatArray, diseased: BoolArray, resamples: int, rng: int) -> FloatArray:
    """(resamples,) areas under the characteristic, for the draws of :func:`score_draws`."""
    drawn = _draws(diseased, resamples, rng)
    counts = np.zeros((resamples, len(diseased)))
    np.add.at(counts, (np.arange(resamples)[:, None], drawn), 1.0)
    ill, well = counts[:, diseased], counts[:, ~diseased]
    found: FloatArray = ((ill @ _wins(predicted, diseased)) * well).mean(axis=1) / ill.shape[1]
    return found


def area_difference(
    pairs: Sequence[tuple[FloatArray, FloatArray, Problem]], resamples: int, rng: int
) -> tuple[float, float, float]:
    """Mean over units of the difference between two predictions' areas, and its 95 % interval."""
    total = np.zeros(resamples)
    value = 0.0
    for one, two, problem in pairs:
        value += area(one, problem.diseased) - area(two, problem.diseased)
        total += area_draws(one, problem.diseased, resamples, rng)
        total -= area_draws(two, problem.diseased, resamples, rng)
    low, high = np.percentile(total / len(pairs), [2.5, 97.5])
    return value / len(pairs), float(low), float(high)


def difference_interval(
    pairs: Sequence[tuple[FloatArray, FloatArray, Problem, str]], resamples: int, rng: int
) -> tuple[float, float, float]:
    """Mean over units of the difference between two predictions' scores, and its 95 % interval."""
    total = np.zeros(resamples)
    value = 0.0
    for one, two, problem, kind in pairs:
        measure = correlation if kind == "per cent" else balanced_accuracy
        target = problem.percent if kind == "per cent" else problem.diseased.astype(np.float64)
        value += measure(one, target) - measure(two, target)
        total += score_draws(one, problem, kind, resamples, rng) - score_draws(
            two, problem, kind, resamples, rng
        )
    low, high = np.nanpercentile(total / len(pairs), [2.5, 97.5])
    return value / len(pairs), float(low), float(high)


def _wins(predicted: FloatArray, diseased: BoolArray) -> FloatArray:
    """(ill, well) share of repeats in which the one is ranked above the other, ties counting half."""
    difference = predicted[:, diseased, None] - predicted[:, None, ~diseased]
    wins: FloatArray = ((difference > 0) + 0.5 * (difference == 0)).mean(axis=0)
    return wins


def _draws(diseased: BoolArray, resamples: int, rng: int) -> IntArray:
    generator = np.random.default_rng(rng)
    groups = [np.flatnonzero(diseased), np.flatnonzero(~diseased)]
    return np.concatenate(
        [group[generator.integers(len(group), size=(resamples, len(group)))] for group in groups], axis=1
    )


def _correlations(predicted: FloatArray, target: FloatArray) -> FloatArray:
    """(repeats, draws) Pearson's r of (repeats, draws, n) and (draws, n)."""
    x = predicted - predicted.mean(axis=-1, keepdims=True)
    y = target - target.mean(axis=-1, keepdims=True)
    scale = np.sqrt((x**2).sum(axis=-1) * (y**2).sum(axis=-1))
    found: FloatArray = np.divide(
        (x * y).sum(axis=-1), scale, out=np.full(scale.shape, np.nan), where=scale > 0
    )
    return found
