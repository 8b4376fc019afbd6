"""Predictions for subjects that a model has not seen, and what the same model predicts of shuffled labels."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from sklearn.base import clone
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import LinearRegression, LogisticRegression, RidgeCV
from sklearn.model_selection import LeaveOneOut, StratifiedKFold
from sklearn.neural_network import MLPClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from .._arrays import BoolArray, FloatArray, IntArray
from ._fusion import SizeAndShape

Classifier: TypeAlias = Literal["perceptron", "logistic"]
Regressor: TypeAlias = Literal["linear", "ridge"]
Folds: TypeAlias = "int | Literal['leave-one-out']"
Split: TypeAlias = tuple[IntArray, IntArray]
CLASSIFIERS: tuple[Classifier, ...] = get_args(Classifier)
REGRESSORS: tuple[Regressor, ...] = get_args(Regressor)

# A perceptron, or a fusion with its inner folds, takes a tenth of a second to train: fewer shuffles for its null.
SLOW_SHUFFLES = 20


@dataclass(frozen=True, eq=False)
class Problem:
    """One thing to be predicted: of which segments, in per cent (NaN where nobody knows), and diseased or not."""

    name: str
    segments: tuple[int, ...]
    percent: FloatArray
    diseased: BoolArray

    @property
    def graded(self) -> bool:
        """Whether there is a percentage to regress."""
        return bool(np.isfinite(self.percent).all())


def model(name: Classifier | Regressor, inputs: int, samples: int, rng: int, *, sizes: int = 0) -> Any:
    """Return a new model that scales its inputs by what it is fitted to; the first ``sizes`` inputs apart.

    The perceptron has one hidden layer of half as many units as inputs and classes together, sigmoids, learning rate
    0.3 and momentum 0.2 (section 5.5).
    """
    if sizes:
        return SizeAndShape(
            lambda columns: model(name, columns, samples, rng), sizes, classify=name in CLASSIFIERS, rng=rng
        )
    if name == "perceptron":
        last: Any = MLPClassifier(
            (max(2, (inputs + 2) // 2),), activation="logistic", solver="sgd", learning_rate_init=0.3, momentum=0.2,
            batch_size=min(8, samples), max_iter=150, random_state=rng,
        )  # fmt: skip
    elif name == "logistic":
        last = LogisticRegression(C=0.3, class_weight="balanced", max_iter=1000)
    elif name == "linear":
        last = LinearRegression()
    else:
        last = RidgeCV(np.logspace(-1, 4, 11))
    return make_pipeline(StandardScaler(), last)


def splits_of(diseased: BoolArray, folds: Folds, repeats: int, rng: np.random.Generator) -> list[list[Split]]:
    """Return for each repeat the (train, test) pairs; strata keep the share of diseased subjects in each fold."""
    blank = np.zeros((len(diseased), 1))
    if folds == "leave-one-out":
        return [list(LeaveOneOut().split(blank))]
    most = min(int(folds), int(min(diseased.sum(), (~diseased).sum())))
    seeds = rng.integers(2**31, size=repeats)
    return [
        list(StratifiedKFold(most, shuffle=True, random_state=int(seed)).split(blank, diseased))
        for seed in seeds
    ]


def inputs_by_fold(
    method: Any, bags: Sequence[FloatArray] | FloatArray, splits: Sequence[Sequence[Split]]
) -> list[list[FloatArray]]:
    """Return (n, inputs) for each fold, of all subjects, by what was learned from its training subjects only."""
    if isinstance(bags, np.ndarray):
        return [[bags for _ in repeat] for repeat in splits]
    return [
        [clone(method).fit([bags[i] for i in train]).transform(bags) for train, _ in repeat]
        for repeat in splits
    ]


def predictions(
    name: Classifier | Regressor,
    inputs: Sequence[Sequence[FloatArray]],
    target: FloatArray,
    splits: Sequence[Sequence[Split]],
    rng: int,
    sizes: int = 0,
) -> FloatArray:
    """(repeats, n) chance of disease, or per cent, of each subject by a model fitted without it."""
    out = np.empty((len(splits), len(target)))
    classify = name in CLASSIFIERS
    with warnings.catch_warnings():
        # A perceptron that has not settled after its epochs is what the published setting gives.
        warnings.simplefilter("ignore", ConvergenceWarning)
        for row, repeat, matrices in zip(out, splits, inputs, strict=True):
            for (train, test), matrix in zip(repeat, matrices, strict=True):
                wanted = target[train]
                if classify and len(np.unique(wanted)) < 2:
                    row[test] = wanted[0]
                    continue
                fitted = model(name, matrix.shape[1], len(train), rng, sizes=sizes).fit(matrix[train], wanted)
                row[test] = (
                    fitted.predict_proba(matrix[test])[:, 1] if classify else fitted.predict(matrix[test])
                )
    return out


def shuffled_scores(
    name: Classifier | Regressor,
    inputs: Sequence[Sequence[FloatArray]],
    target: FloatArray,
    splits: Sequence[Sequence[Split]],
    shuffles: int,
    rng: np.random.Generator,
    score: Any,
    sizes: int = 0,
) -> FloatArray:
    """(shuffles,) scores of the whole procedure with the labels shuffled; the first repeat's folds."""
    count = min(shuffles, SLOW_SHUFFLES) if sizes or name == "perceptron" else shuffles
    found = np.empty(count)
    for i in range(count):
        moved = rng.permutation(target)
        found[i] = score(predictions(name, inputs[:1], moved, splits[:1], 0, sizes), moved)
    return found
