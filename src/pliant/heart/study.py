"""What the endocardium's shape says of stenosis: three scenarios, honest references, two baselines always shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, frozen
from .._parallel import ordered_map
from ..errors import InputError
from ._crossval import (
    CLASSIFIERS,
    REGRESSORS,
    Classifier,
    Folds,
    Problem,
    Regressor,
    inputs_by_fold,
    predictions,
    shuffled_scores,
    splits_of,
)
from ._problems import problems_of, refuse_options
from ._scores import (
    Score,
    area,
    area_difference,
    balanced_accuracy,
    correlation,
    difference_interval,
    enough_for_interval,
    interval_cautions,
    score_draws,
    scored,
)
from ._study_inputs import BASELINES, POINTS, SIZE, WITH_SIZE, bags_of, baselines_of, size_of
from .bag import BagOfFeatures
from .features import SegmentFeatures

__all__ = ["HeartStudy", "Scenario", "StudyRow", "heart_study"]

Scenario: TypeAlias = Literal["global", "segment", "territory"]


@dataclass(frozen=True, eq=False)
class StudyRow:
    """How well one method, with one model, predicts one thing.

    Parameters
    ----------
    unit : str
        ``"all"``, a territory, or ``"segment 7"``.
    method : str
        ``"bag of features"``, or a baseline.
    model : str
        Classifier or regressor.
    kind : {"class", "per cent"}
        What is predicted. Of a class, ``score`` is balanced accuracy; of a percentage, Pearson's r.
    score : Score
        Value, 95 % interval over subjects, the null's upper 95 % and p.
    accuracy : float
        Share of subjects classified rightly; NaN for percentages.
    auc : float
        Area under the receiver operating characteristic; NaN for percentages.
    predicted : (repeats, n) array of float
        Chance of disease, or per cent, of each subject by models that have not seen it.
    """

    unit: str
    method: str
    model: str
    kind: Literal["class", "per cent"]
    score: Score
    accuracy: float
    auc: float
    predicted: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "predicted", frozen(self.predicted))


@dataclass(frozen=True, eq=False, repr=False)
class HeartStudy:
    """All rows of a study, and the truth they were held against.

    Parameters
    ----------
    scenario : {"global", "segment", "territory"}
        What was asked.
    rows : tuple of StudyRow
        Unit by unit, method by method, model by model; baselines last.
    problems : mapping of str to Problem
        The truth of each unit.
    settings : mapping
        What made it.

    Notes
    -----
    A unit with fewer than 10 subjects in either class gets no interval, and :attr:`cautions` says so.
    """

    scenario: Scenario
    rows: tuple[StudyRow, ...]
    problems: Mapping[str, Problem]
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"HeartStudy({self.scenario}, {len(self.problems)} units, {len(self.rows)} rows)"

    @property
    def cautions(self) -> tuple[str, ...]:
        """What to know before the scores are believed; empty where there is nothing."""
        return interval_cautions(list(self.problems.values()))

    def row(self, unit: str, method: str, model: str) -> StudyRow:
        """Return one row.

        Raises
        ------
        InputError
            If there is none of these names.
        """
        for found in self.rows:
            if (found.unit, found.method, found.model) == (unit, method, model):
                return found
        message = f"the study has no row of {unit}, {method}, {model}"
        raise InputError(message)

    def mean_score(self, method: str, model: str) -> float:
        """Return the mean score of a method and model over units."""
        return float(np.mean([self.row(unit, method, model).score.value for unit in self.problems]))

    def above(
        self,
        method: str,
        baseline: str,
        *,
        model: str,
        baseline_model: str,
        measure: Literal["score", "auc"] = "score",
        resamples: int = 2000,
        rng: int = 0,
    ) -> tuple[float, float, float]:
        """Compare a method with a baseline on the same subjects, the mean over units.

        Parameters
        ----------
        method, model, baseline, baseline_model : str
            Names of two rows.
        measure : {"score", "auc"}
            Balanced accuracy or r; or the area under the receiver operating characteristic, of classifiers.
        resamples, rng : int
            Bootstrap draws, and their seed.

        Returns
        -------
        difference, low, high : float
            Of the scores, with the 95 % interval of a bootstrap over subjects that draws both alike.

        Raises
        ------
        InputError
            If there is no such row, or an area is asked of percentages.
        """
        pairs = []
        for unit, problem in self.problems.items():
            one, two = self.row(unit, method, model), self.row(unit, baseline, baseline_model)
            pairs.append((one.predicted, two.predicted, problem, one.kind))
        if measure == "auc":
            if any(kind == "per cent" for *_, kind in pairs):
                message = f"an area under the curve needs classifiers, {model} predicts percentages"
                raise InputError(message)
            return area_difference([pair[:3] for pair in pairs], resamples, rng)
        return difference_interval(pairs, resamples, rng)

    def table(self) -> list[dict[str, Any]]:
        """Return a dictionary a row, in the layout of Tables 5.4 to 5.9, numbers rounded to three digits."""
        return [_record(row, self.problems[row.unit]) for row in self.rows]


def heart_study(
    features: Sequence[SegmentFeatures],
    stenosis: ArrayLike | None = None,
    *,
    diseased: ArrayLike | None = None,
    scenario: Scenario = "territory",
    methods: Mapping[str, Any] | None = None,
    classifiers: Sequence[Classifier] = CLASSIFIERS,
    regressors: Sequence[Regressor] = REGRESSORS,
    threshold: float = 70.0,
    folds: Folds = 10,
    repeats: int = 3,
    permutations: int = 100,
    resamples: int = 1000,
    rng: int = 0,
    n_jobs: int | None = None,
    progress: bool = False,
) -> HeartStudy:
    """Predict disease and per cent of stenosis from the shape of the endocardium.

    Parameters
    ----------
    features : sequence of SegmentFeatures
        One a subject, see :func:`endocardial_features`.
    stenosis : (n, 3) array_like, optional
        Per cent, of the territories LAD, LCX and RCA.
    diseased : (n,) array_like of bool, optional
        Instead of ``stenosis``: a label a subject, for the global scenario without percentages.
    scenario : {"global", "segment", "territory"}
        One bag a subject; a study for each segment, of the stenosis of its territory; or one for each territory.
        Globally a subject is diseased if any territory is, and its percentage is the largest.
    methods : mapping of str to transformer, optional
        What turns sets of rows into inputs; ``{"bag of features": BagOfFeatures()}`` by default. Each is fitted anew
        inside every fold.
    classifiers, regressors : sequence of str
        ``"perceptron"`` (one hidden layer, section 5.5) and ``"logistic"`` (its regularised reference);
        ``"linear"`` (least squares, section 5.5) and ``"ridge"``.
    threshold : float
        Per cent from which a territory is diseased.
    folds : int or "leave-one-out"
        Of the cross-validation; fewer where a class has fewer subjects.
    repeats : int
        How often the folds are drawn; once for leave-one-out.
    permutations : int
        Shuffles of the labels for the null, 20 at most for the perceptron and with size. 0 leaves it out.
    resamples : int
        Bootstrap draws of subjects.
    rng : int
        Seed of folds, vocabularies, shuffles and draws.
    n_jobs : int, optional
        Threads, over units.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    HeartStudy

    Raises
    ------
    InputError
        If labels are missing or do not fit, a unit has fewer than two subjects of either class (it is named), or an
        option is unknown.

    Notes
    -----
    Vocabulary, scaling and model see the training subjects of a fold only. Two baselines come with every study: the
    mean curvedness of the unit (``"roughness"``) and the volume of the cavity, each alone, by logistic and linear
    regression. Shares of words know no size, so globally each method has a second line, its name and ``" and
    size"``, by logistic or ridge regression: a model of the logarithms of volume and sphericity, to which the
    method's score is added with the weight that does best on training subjects held out, if the 95 % interval of
    what it adds to size excludes 0; and that model is a line of its own. Scores are means over repeats; intervals
    draw subjects within classes, and the null repeats the whole procedure but for the vocabulary, which sees no
    labels. Least squares with 20 inputs on a few dozen subjects gives sizeable r on nothing in leave-one-out and in
    single folds alike: read it beside its null.

    About 25 s a unit for 64 subjects on one core with the perceptron, 8 s without; globally 70 s more for size.

    References
    ----------
    Dissertation, section 5.5, Tables 5.4 to 5.9.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant.heart import SegmentFeatures
    >>> rng = np.random.default_rng(0)
    >>> percent = rng.uniform(0, 100, (16, 3)).round()
    >>> def subject(level):
    ...     values, segments = rng.normal(level / 25, 1, (17 * 20, 23)), np.repeat(np.arange(1, 18), 20)
    ...     return SegmentFeatures(values, segments, segments, np.full(18, level), np.ones(18), 100.0)
    >>> found = heart_study([subject(p.max()) for p in percent], percent, scenario="global",
    ...                     classifiers=("logistic",), regressors=("ridge",), folds=4, repeats=1, permutations=0)
    >>> bool(found.row("all", "bag of features", "ridge").score.value > 0.5)
    True
    """
    problems = problems_of(len(features), stenosis, diseased, scenario, threshold)
    refuse_options(classifiers, regressors, permutations, repeats, folds)
    used: Mapping[str, Any] = methods or {"bag of features": BagOfFeatures(rng=rng)}
    taken = set(used) & {*BASELINES, SIZE, *(f"{name}{WITH_SIZE}" for name in used)}
    if taken:
        message = f"methods may not be named as a baseline is: {', '.join(sorted(taken))}"
        raise InputError(message)
    setup = _Setup(used, tuple(classifiers), tuple(regressors), folds, repeats, permutations, resamples, rng)
    size = size_of(features) if scenario == "global" else None

    def work(problem: Problem) -> list[StudyRow]:
        return setup.rows(problem, features, POINTS[scenario], size)

    parts = ordered_map(work, problems, n_jobs, description="units", progress=progress)
    rows = tuple(row for part in parts for row in part)
    settings = {
        "subjects": len(features), "threshold": threshold, "folds": folds, "repeats": repeats,
        "permutations": permutations, "resamples": resamples, "seed": rng, "points a subject": POINTS[scenario],
        "methods": {name: repr(method) for name, method in used.items()},
    }  # fmt: skip
    return HeartStudy(scenario, rows, {problem.name: problem for problem in problems}, settings)


@dataclass(frozen=True)
class _Setup:
    """All that decides how a unit is studied."""

    methods: Mapping[str, Any]
    classifiers: tuple[Classifier, ...]
    regressors: tuple[Regressor, ...]
    folds: Folds
    repeats: int
    permutations: int
    resamples: int
    seed: int

    def rows(
        self, problem: Problem, features: Sequence[SegmentFeatures], points: int, size: FloatArray | None
    ) -> list[StudyRow]:
        """Return a row for each method and model, the baselines last."""
        splits = splits_of(problem.diseased, self.folds, self.repeats, np.random.default_rng(self.seed))
        bags = bags_of(features, problem.segments, points, self.seed)
        found = []
        for name, method in self.methods.items():
            inputs = inputs_by_fold(method, bags, splits)
            found += self._scored(problem, name, inputs, splits, (self.classifiers, self.regressors))
            if size is not None:
                both = [[np.hstack([size, own]) for own in repeat] for repeat in inputs]
                models: Any = (("logistic",), ("ridge",))
                found += self._scored(problem, name + WITH_SIZE, both, splits, models, sizes=size.shape[1])
        baselines = baselines_of(features, problem.segments)
        if size is not None and size.shape[1] == 2:
            baselines[SIZE] = size
        for name, column in baselines.items():
            if np.isfinite(column).all():
                inputs = inputs_by_fold(None, column, splits)
                found += self._scored(problem, name, inputs, splits, (("logistic",), ("linear",)))
        return found

    def _scored(
        self,
        problem: Problem,
        method: str,
        inputs: list[list[FloatArray]],
        splits: Any,
        models: tuple[tuple[Classifier, ...], tuple[Regressor, ...]],
        *,
        sizes: int = 0,
    ) -> list[StudyRow]:
        rows = []
        for name in (*models[0], *(models[1] if problem.graded else ())):
            kind: Literal["class", "per cent"] = "class" if name in CLASSIFIERS else "per cent"
            target = problem.diseased.astype(np.float64) if kind == "class" else problem.percent
            predicted = predictions(name, inputs, target, splits, self.seed, sizes)
            measure = balanced_accuracy if kind == "class" else correlation
            order = np.random.default_rng(self.seed)
            null = shuffled_scores(name, inputs, target, splits, self.permutations, order, measure, sizes)
            count = self.resamples if enough_for_interval(problem) else 0
            draws = score_draws(predicted, problem, kind, count, self.seed)
            score = scored(measure(predicted, target), draws, null)
            rows.append(_row(problem, method, name, kind, score, predicted))
        return rows


def _row(
    problem: Problem,
    method: str,
    name: str,
    kind: Literal["class", "per cent"],
    score: Score,
    predicted: FloatArray,
) -> StudyRow:
    accuracy = auc = float("nan")
    if kind == "class":
        accuracy = float(((predicted > 0.5) == problem.diseased).mean())
        auc = area(predicted, problem.diseased)
    return StudyRow(problem.name, method, name, kind, score, accuracy, auc, predicted)


def _record(row: StudyRow, problem: Problem) -> dict[str, Any]:
    score = row.score

    def short(value: float) -> float | None:
        return None if not np.isfinite(value) else round(float(value), 3)

    record: dict[str, Any] = {
        "unit": row.unit, "method": row.method, "model": row.model, "subjects": len(problem.diseased),
        "diseased": int(problem.diseased.sum()),
    }  # fmt: skip
    if row.kind == "class":
        record |= {
            "accuracy": short(row.accuracy),
            "balanced accuracy": short(score.value),
            "auc": short(row.auc),
        }
    else:
        record |= {"r": short(score.value), "R2": short(score.value * abs(score.value))}
    return record | {
        "low": short(score.low), "high": short(score.high), "null 95 %": short(score.null), "p": short(score.p)
    }  # fmt: skip
