"""Size and shape in one prediction: shape is let in where subjects not trained on show that it adds something."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import expit
from sklearn.model_selection import KFold, StratifiedKFold

from .._arrays import FloatArray

# Inner folds within the training subjects, and how often they are drawn.
_FOLDS, _DRAWS = 5, 5
# Standard errors by which shape has to lower the loss: the 95 % interval of what it adds excludes 0.
_SURE = 1.96


class SizeAndShape:
    """Late fusion of a model of the first columns (size) and a model of the others (shape).

    Each is fitted by itself: put side by side, twenty words outvote a volume by their number. The prediction is
    (1 - w) times size's score plus w times shape's, w between 0 and 1 of least loss on training subjects held out in
    inner folds (stacking with weights that sum to 1: Wolpert 1992, Breiman 1996). Shape is let in only if the 95 %
    interval of what it takes off the held-out loss excludes 0: on a few dozen subjects a weight learned without
    such a rule costs more than shape is worth. Without two training subjects of either class nothing can be held
    out, and size alone is used.
    """

    def __init__(self, make: Callable[[int], Any], sizes: int, *, classify: bool, rng: int) -> None:
        self.make = make
        self.sizes = sizes
        self.classify = classify
        self.rng = rng

    def fit(self, X: FloatArray, y: FloatArray) -> SizeAndShape:
        """Fit both models and the weight of shape."""
        parts = X[:, : self.sizes], X[:, self.sizes :]
        self.models_ = [self.make(part.shape[1]).fit(part, y) for part in parts]
        draws = self._draws(y)
        self.weight_ = 0.0
        if draws:
            size, shape = (self._held_out(part, y, draws) for part in parts)
            self.weight_ = self._weight(size, shape, y)
        return self

    def predict(self, X: FloatArray) -> FloatArray:
        """Return (n,) percentages, or log odds of disease."""
        size, shape = self.models_
        found: FloatArray = self._score(size, X[:, : self.sizes])
        if self.weight_ > 0:
            found = (1 - self.weight_) * found + self.weight_ * self._score(shape, X[:, self.sizes :])
        return found

    def predict_proba(self, X: FloatArray) -> FloatArray:
        """Return (n, 2) chances of the classes."""
        ill = expit(self.predict(X))
        return np.column_stack([1 - ill, ill])

    def _score(self, fitted: Any, part: FloatArray) -> FloatArray:
        found: FloatArray = fitted.decision_function(part) if self.classify else fitted.predict(part)
        return found

    def _draws(self, y: FloatArray) -> list[list[tuple[Any, Any]]]:
        most = len(y) if not self.classify else int(np.unique(y, return_counts=True)[1].min())
        if most < 2:
            return []
        kind = StratifiedKFold if self.classify else KFold
        folds = min(_FOLDS, most)
        return [list(kind(folds, shuffle=True, random_state=self.rng + i).split(y, y)) for i in range(_DRAWS)]

    def _held_out(self, part: FloatArray, y: FloatArray, draws: list[list[tuple[Any, Any]]]) -> FloatArray:
        """(draws, n) scores of training subjects by models fitted without them."""
        out = np.empty((len(draws), len(y)))
        for row, splits in zip(out, draws, strict=True):
            for train, test in splits:
                row[test] = self._score(self.make(part.shape[1]).fit(part[train], y[train]), part[test])
        return out

    def _weight(self, size: FloatArray, shape: FloatArray, y: FloatArray) -> float:
        def losses(weight: float) -> FloatArray:
            return self._losses((1 - weight) * size + weight * shape, y)

        best = minimize_scalar(lambda weight: losses(weight).mean(), bounds=(0, 1), method="bounded").x
        gain = losses(0.0) - losses(best)
        admitted = gain.mean() > _SURE * gain.std(ddof=1) / np.sqrt(len(gain))
        return float(best) if admitted else 0.0

    def _losses(self, scores: FloatArray, y: FloatArray) -> FloatArray:
        """(n,) loss of each subject, the mean over draws; both classes weigh the same."""
        if not self.classify:
            squares: FloatArray = ((scores - y) ** 2).mean(axis=0)
            return squares
        ill = y > 0.5
        share = np.where(ill, ill.mean(), 1 - ill.mean())
        logs: FloatArray = np.logaddexp(0, np.where(ill, -scores, scores)).mean(axis=0) / (2 * share)
        return logs
