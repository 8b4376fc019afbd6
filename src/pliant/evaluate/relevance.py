"""How well boxes found in pairs of images fit the true ones: relevance, false area, repeatability (section 6.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats, frozen
from ..errors import InputError, first_indices

__all__ = [
    "RelevanceScores",
    "area_under_roc",
    "box_overlaps",
    "mean_interval",
    "relevance_scores",
    "transform_error",
]

# Points along each side of the grid on which two transforms are compared.
_GRID = 9


@dataclass(frozen=True, eq=False)
class RelevanceScores:
    """Scores of pairs of found boxes against true ones, one entry a pair.

    Attributes
    ----------
    relevance : (n,) array of float
        R (eq. 6.6): common area over the area of found and true together, pooled over both images. The text's
        "TN" is what everyone calls false negatives.
    false_share : (n,) array of float
        FPR as the dissertation reports it: found and not true, over the same denominator.
    repeatability : (n,) array of float
        R1 (eq. 6.10): found and true, over found, pooled over both images. 0 where nothing was found.
    overlap1, overlap2 : (n,) array of float
        Intersection over union in each image alone.
    """

    relevance: FloatArray
    false_share: FloatArray
    repeatability: FloatArray
    overlap1: FloatArray
    overlap2: FloatArray

    def means(self, groups: Sequence[str]) -> dict[str, dict[str, float]]:
        """Return mean relevance and false share of each group of pairs.

        Parameters
        ----------
        groups : sequence of str
            Group of each pair: its kind, or the monument it shows.

        Returns
        -------
        dict of str to dict
            ``{"group": {"mrs": ..., "fpr": ..., "pairs": ...}}``, groups in alphabetical order.

        Raises
        ------
        InputError
            If there is not one group a pair.
        """
        labels = np.asarray(groups)
        if labels.shape != self.relevance.shape:
            message = f"groups must be one a pair, {self.relevance.size}, got shape {labels.shape}"
            raise InputError(message)
        chosen = {str(group): labels == group for group in np.unique(labels)}
        return {
            group: {
                "mrs": float(self.relevance[here].mean()),
                "fpr": float(self.false_share[here].mean()),
                "pairs": int(here.sum()),
            }
            for group, here in chosen.items()
        }


def relevance_scores(
    found1: ArrayLike, found2: ArrayLike, true1: ArrayLike, true2: ArrayLike
) -> RelevanceScores:
    """Compare boxes found in pairs of images with the true ones.

    Parameters
    ----------
    found1, found2, true1, true2 : (n, 4) array_like of float
        Boxes x0, y0, x1, y1 in pixels, x1 and y1 exclusive, of the first and the second image of each pair. A
        found box may be empty (x1 = x0); a true one may not.

    Returns
    -------
    RelevanceScores

    Raises
    ------
    InputError
        If shapes differ, a box is turned inside out or not finite, or a true box is empty.

    Notes
    -----
    Areas of both images are added in pixels, as eq. 6.6-6.10 do, so the larger image counts more. R + FPR is 1
    where nothing true is missed.

    Examples
    --------
    >>> scores = relevance_scores([[0, 0, 10, 10]], [[0, 0, 5, 10]], [[0, 0, 10, 10]], [[0, 0, 10, 10]])
    >>> scores.relevance.tolist(), scores.repeatability.tolist()
    ([0.75], [1.0])
    """
    boxes = [_boxes(b, n) for b, n in zip((found1, found2), ("found1", "found2"), strict=True)]
    truths = [_boxes(b, n) for b, n in zip((true1, true2), ("true1", "true2"), strict=True)]
    if len({b.shape for b in (*boxes, *truths)}) != 1:
        message = f"one box a pair is needed in each list, got {[len(b) for b in (*boxes, *truths)]}"
        raise InputError(message)
    for truth, name in zip(truths, ("true1", "true2"), strict=True):
        empty = np.flatnonzero(_areas(truth) <= 0)
        if empty.size:
            message = f"{name}: {empty.size} of {len(truth)} boxes are empty, first {first_indices(empty)}"
            raise InputError(message)
    common = [_common(b, t) for b, t in zip(boxes, truths, strict=True)]
    found = [_areas(b) for b in boxes]
    union = [f + _areas(t) - c for f, t, c in zip(found, truths, common, strict=True)]
    hit, all_found, all_union = (np.add(*areas) for areas in (common, found, union))
    return RelevanceScores(
        relevance=frozen(hit / all_union),
        false_share=frozen((all_found - hit) / all_union),
        repeatability=frozen(np.divide(hit, all_found, out=np.zeros(len(boxes[0])), where=all_found > 0)),
        overlap1=frozen(common[0] / union[0]),
        overlap2=frozen(common[1] / union[1]),
    )


def box_overlaps(boxes: ArrayLike) -> FloatArray:
    """Return the intersection over union of every two of the boxes found by repeated runs.

    Parameters
    ----------
    boxes : (r, 4) array_like of float
        One box a run.

    Returns
    -------
    (r (r - 1) / 2,) array of float
        0 where one of the two is empty, 1 where both are.

    Raises
    ------
    InputError
        If there are fewer than two boxes.

    Examples
    --------
    >>> box_overlaps([[0, 0, 2, 2], [0, 0, 2, 2], [0, 0, 1, 2]]).tolist()
    [1.0, 0.5, 0.5]
    """
    runs = _boxes(boxes, "boxes")
    if len(runs) < 2:
        message = f"overlap between runs needs two boxes or more, got {len(runs)}"
        raise InputError(message)
    i, j = np.triu_indices(len(runs), 1)
    common = _common(runs[i], runs[j])
    union = _areas(runs[i]) + _areas(runs[j]) - common
    return np.divide(common, union, out=np.ones(len(i)), where=union > 0)


def transform_error(found: ArrayLike | None, true: ArrayLike, box1: ArrayLike, size2: ArrayLike) -> float:
    """Return how far a transform takes the points of a box from where they belong.

    Parameters
    ----------
    found, true : (3, 3) array_like of float
        Take pixels of the first image to the second. ``found`` may be None.
    box1 : (4,) array_like of float
        The true box in the first image: a grid of 9 x 9 points in it is compared, but for those that ``true``
        takes outside the second image.
    size2 : (2,) array_like of int
        Width and height of the second image.

    Returns
    -------
    float
        Mean distance over the diagonal of the second image; inf without a transform; NaN where no point lands
        in the second image.

    Raises
    ------
    InputError
        If shapes are wrong.

    Examples
    --------
    >>> import numpy as np
    >>> shift = np.array([[1.0, 0, 5], [0, 1, 0], [0, 0, 1]])
    >>> transform_error(shift, np.eye(3), [0, 0, 20, 20], [30, 40])
    0.1
    """
    if found is None:
        return float("inf")
    matrices = [as_floats(m, n) for m, n in ((found, "found"), (true, "true"))]
    if any(m.shape != (3, 3) for m in matrices):
        message = f"transforms must have shape (3, 3), got {[m.shape for m in matrices]}"
        raise InputError(message)
    box, size = _boxes(np.atleast_2d(as_floats(box1, "box1")), "box1")[0], as_floats(size2, "size2")
    x, y = np.meshgrid(np.linspace(box[0], box[2], _GRID), np.linspace(box[1], box[3], _GRID))
    grid = np.column_stack([x.ravel(), y.ravel(), np.ones(x.size)])
    there, here = ((grid @ m.T)[:, :2] / (grid @ m.T)[:, 2:] for m in matrices)
    inside = ((here >= 0) & (here < size)).all(axis=1)
    if not inside.any():
        return float("nan")
    return float(np.linalg.norm(there - here, axis=1)[inside].mean() / np.hypot(*size))


def area_under_roc(scores_true: ArrayLike, scores_false: ArrayLike) -> float:
    """Return the chance that a true pair scores above a false one, ties counting half.

    Parameters
    ----------
    scores_true, scores_false : (n,), (m,) array_like of float

    Returns
    -------
    float

    Raises
    ------
    InputError
        If one of the two is empty.

    Examples
    --------
    >>> area_under_roc([3, 4], [1, 3])
    0.875
    """
    true, false = (
        as_floats(scores_true, "scores_true").ravel(),
        as_floats(scores_false, "scores_false").ravel(),
    )
    if not true.size or not false.size:
        message = f"scores of both kinds are needed, got {true.size} true and {false.size} false"
        raise InputError(message)
    difference = true[:, None] - false
    return float((difference > 0).mean() + 0.5 * (difference == 0).mean())


def mean_interval(
    values: ArrayLike,
    groups: Sequence[str],
    *,
    confidence: float = 0.95,
    draws: int = 10_000,
    rng: int | np.random.Generator = 0,
) -> tuple[float, float]:
    """Return a bootstrap interval of a mean over pairs, drawing whole groups.

    Parameters
    ----------
    values : (n,) array_like of float
        One a pair; for a comparison of two methods, their differences.
    groups : sequence of str
        What was sampled: the monument of each pair. Several pairs of one monument say little more than one.
    confidence : float
        Of the interval, from the percentiles of the draws.
    draws : int
        Bootstrap samples.
    rng : int or Generator
        Seed.

    Returns
    -------
    low, high : float

    Raises
    ------
    InputError
        If there is not one group a value, or fewer than two groups.

    Examples
    --------
    >>> low, high = mean_interval([1.0, 2.0, 3.0, 4.0], ["a", "b", "c", "d"])
    >>> 1.0 <= low < 2.5 < high <= 4.0
    True
    """
    array = as_floats(values, "values")
    labels, inverse = np.unique(np.asarray(groups), return_inverse=True)
    if array.shape != (len(groups),) or len(labels) < 2:
        message = f"values must be one a pair in two groups or more, got shape {array.shape} in {len(labels)} groups"
        raise InputError(message)
    sums, counts = np.bincount(inverse, weights=array), np.bincount(inverse)
    drawn = np.random.default_rng(rng).integers(len(labels), size=(draws, len(labels)))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    tail = 50 * (1 - confidence)
    low, high = np.percentile(means, [tail, 100 - tail])
    return float(low), float(high)


def _boxes(boxes: ArrayLike, name: str) -> FloatArray:
    array = as_floats(boxes, name)
    if array.ndim != 2 or array.shape[1] != 4:
        message = f"{name} must be boxes of shape (n, 4), got {array.shape}"
        raise InputError(message)
    fine = np.isfinite(array).all(axis=1) & (array[:, 2] >= array[:, 0]) & (array[:, 3] >= array[:, 1])
    bad = np.flatnonzero(~fine)
    if bad.size:
        message = (
            f"{name}: {bad.size} of {len(array)} boxes are not x0 <= x1, y0 <= y1, first {first_indices(bad)}"
        )
        raise InputError(message)
    return array


def _areas(boxes: FloatArray) -> FloatArray:
    areas: FloatArray = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    return areas


def _common(one: FloatArray, two: FloatArray) -> FloatArray:
    low, high = np.maximum(one[:, :2], two[:, :2]), np.minimum(one[:, 2:], two[:, 2:])
    areas: FloatArray = np.prod(np.maximum(high - low, 0), axis=1)
    return areas
