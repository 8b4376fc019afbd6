"""What a study is asked: units, labels and percentages, checked before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, as_floats
from ..errors import InputError, first_indices
from ._crossval import CLASSIFIERS, REGRESSORS, Folds, Problem
from .segments import TERRITORIES


def problems_of(
    count: int, stenosis: ArrayLike | None, diseased: ArrayLike | None, scenario: str, threshold: float
) -> list[Problem]:
    if scenario not in ("global", "segment", "territory"):
        message = f'scenario must be "global", "segment" or "territory", got {scenario!r}'
        raise InputError(message)
    if (stenosis is None) == (diseased is None):
        raise InputError("give stenosis, three percentages a subject, or diseased, a label a subject")
    everything = tuple(range(1, 18))
    if stenosis is None:
        if scenario != "global":
            message = f"the {scenario} scenario needs the stenosis of each territory, not one label a subject"
            raise InputError(message)
        labels = _checked_labels(diseased, count)
        problems = [Problem("all", everything, np.full(count, np.nan), labels)]
    else:
        percent = _checked_percent(stenosis, count)
        by_unit: dict[str, tuple[tuple[int, ...], FloatArray]] = {}
        for i, (territory, segments) in enumerate(TERRITORIES.items()):
            by_unit[territory] = (segments, percent[:, i])
        if scenario == "segment":
            of = {s: values for segments, values in by_unit.values() for s in segments}
            by_unit = {f"segment {s}": ((s,), of[s]) for s in everything}
        elif scenario == "global":
            by_unit = {"all": (everything, percent.max(axis=1))}
        problems = [Problem(name, s, values, values >= threshold) for name, (s, values) in by_unit.items()]
    for problem in problems:
        ill = int(problem.diseased.sum())
        if min(ill, count - ill) < 2:
            message = (
                f"{problem.name}: {ill} of {count} subjects are diseased; two of either class are needed to learn "
                "and to test"
            )
            raise InputError(message)
    return problems


def _checked_percent(stenosis: ArrayLike, count: int) -> FloatArray:
    percent = as_floats(stenosis, "stenosis")
    if percent.shape != (count, 3):
        message = f"stenosis must be ({count}, 3), LAD, LCX and RCA of each subject, got {percent.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~((percent >= 0) & (percent <= 100)).all(axis=1))
    if bad.size:
        message = (
            f"stenosis of {bad.size} subjects is missing or not 0 to 100, first subjects {first_indices(bad)}"
        )
        raise InputError(message)
    return percent


def _checked_labels(diseased: ArrayLike | None, count: int) -> BoolArray:
    labels = as_floats([] if diseased is None else diseased, "diseased")
    if labels.shape != (count,) or not np.isin(labels, (0, 1)).all():
        bad = np.flatnonzero(~np.isin(labels, (0, 1)))
        message = (
            f"diseased must be 0 or 1 for each of {count} subjects; wrong or missing at {first_indices(bad)}"
        )
        raise InputError(message)
    return labels.astype(bool)


def refuse_options(
    classifiers: Sequence[str], regressors: Sequence[str], permutations: int, repeats: int, folds: Folds
) -> None:
    unknown = [*(set(classifiers) - set(CLASSIFIERS)), *(set(regressors) - set(REGRESSORS))]
    if unknown:
        message = f"models are {', '.join((*CLASSIFIERS, *REGRESSORS))}; got {', '.join(sorted(unknown))}"
        raise InputError(message)
    if (
        permutations < 0
        or repeats < 1
        or not (folds == "leave-one-out" or (isinstance(folds, int) and folds >= 2))
    ):
        message = (
            'permutations must be 0 or more, repeats 1 or more, folds 2 or more or "leave-one-out"; '
            f"got {permutations}, {repeats} and {folds!r}"
        )
        raise InputError(message)
