"""How much a landmark's surroundings vary over a cohort, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, IntArray, as_floats, frozen
from ..errors import InputError
from ._sites import FEWEST, checked_histograms, extreme, nan_percentiles, spearman

__all__ = [
    "Variability",
    "mean_absolute_deviation",
    "variability",
]


@dataclass(frozen=True, eq=False)
class Variability:
    """Cumulative mean absolute deviation of each site over a cohort (Fig. 2.11, 2.12).

    A site that fewer than three subjects have is NaN throughout.

    Parameters
    ----------
    mad : (sites,) array of float
        Mean over subjects of the deviation from the site's mean histogram; see :func:`mean_absolute_deviation`.
    low, high : (sites,) array of float
        Bootstrap interval over subjects.
    p_regular, p_variable : (sites,) array of float
        Permutation p-values, one-sided, of varying less or more than the cohort's sites do; not corrected for
        their number.
    regular, variable : (k,) array of int
        The sites of the bottom and of the top percentile, most extreme first.
    regular_frequency, variable_frequency : (sites,) array of float
        How often each site is among them over bootstrap cohorts.
    n_subjects : (sites,) array of int
        Subjects that have the site.
    rank_stability : float
        Mean Spearman correlation of the rankings from two random halves of the subjects; NaN below 6 subjects.
    """

    mad: FloatArray
    low: FloatArray
    high: FloatArray
    p_regular: FloatArray
    p_variable: FloatArray
    regular: IntArray
    variable: IntArray
    regular_frequency: FloatArray
    variable_frequency: FloatArray
    n_subjects: IntArray
    rank_stability: float

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            if name != "rank_stability":
                object.__setattr__(self, name, frozen(getattr(self, name)))


def mean_absolute_deviation(histograms: ArrayLike, *, edges: ArrayLike | None = None) -> FloatArray:
    """Cumulative mean absolute deviation over subjects of each site's histogram.

    Parameters
    ----------
    histograms : (subjects, sites, bins) array_like of float
        NaN throughout where a subject lacks a site.
    edges : (bins + 1,) array_like of float, optional
        The bins' edges. Without them deviations of the bins are summed: 0 where all are alike, at most 2, and no larger
        once histograms no longer overlap. With them the cumulative histograms are compared and the area between
        them taken, in the field's unit: how far values move (Wasserstein-1), however far that is.

    Returns
    -------
    (sites,) array of float
        NaN where fewer than three subjects have the site.

    Raises
    ------
    InputError
        If the array has another shape, or a histogram is NaN in part; if the edges do not fit or ascend.

    Notes
    -----
    With edges a histogram that moves by d has a deviation of d from where it was, if d is more than a bin; use many
    bins (30) that reach beyond most values (``percentile=99.9``).

    References
    ----------
    Dissertation, section 2.8, for the sum over bins; Vallender 1974 for distances between distributions on a line.

    Examples
    --------
    >>> moves = [[[1, 0, 0]], [[0, 0, 1]], [[1, 0, 0]], [[0, 0, 1]]]
    >>> mean_absolute_deviation(moves).tolist(), mean_absolute_deviation(moves, edges=[0, 5, 10, 15]).tolist()
    ([1.0], [5.0])
    """
    values, present = checked_histograms(histograms)
    return _mad(_compared(values, edges), present)


def variability(
    histograms: ArrayLike,
    *,
    edges: ArrayLike | None = None,
    percentile: float = 5.0,
    confidence: float = 0.95,
    resamples: int = 1000,
    rng: np.random.Generator | int | None = None,
) -> Variability:
    """Rank sites by how much their histograms vary over subjects, with the uncertainty of the ranking.

    Parameters
    ----------
    histograms : (subjects, sites, bins) array_like of float
        Over common bins. NaN throughout where a subject lacks a site.
    edges : (bins + 1,) array_like of float, optional
        The bins' edges: deviations are then how far values move; see :func:`mean_absolute_deviation`.
    percentile : float
        Share of the sites called regular, and called variable, in percent; at least one site each.
    confidence : float
        Nominal coverage of the intervals.
    resamples : int
        Bootstrap cohorts, and permutations.
    rng : numpy.random.Generator or int, optional
        Seed.

    Returns
    -------
    Variability

    Raises
    ------
    InputError
        If the array does not fit, or has fewer than three subjects.

    Notes
    -----
    The subject is the unit of resampling. Deviations in a bootstrap cohort are from its own mean and scaled by
    sqrt(n / (n - 1)), which takes off the shrinkage that resampling adds; intervals are percentiles, and below
    ten subjects they cover less often than they say. The null of the permutation test is that all sites vary alike:
    each subject's deviations change places among the sites. Sites that are neighbours are not independent, which makes
    the test of many sites together too sure; that of one site holds.

    References
    ----------
    Dissertation, section 2.8, Fig. 2.11, 2.12.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> spread = np.linspace(0.1, 2, 20)[:, None]
    >>> found = variability(rng.normal(size=(15, 20, 4)) * spread, rng=0, resamples=100)
    >>> int(found.regular[0]), bool(found.rank_stability > 0.8)
    (0, True)
    """
    values, present = checked_histograms(histograms)
    if not 0 < percentile <= 50 or not 0 < confidence < 1 or resamples < 1:
        message = (
            "percentile must lie in (0, 50], confidence in (0, 1) and resamples be at least 1; "
            f"got {percentile}, {confidence}, {resamples}"
        )
        raise InputError(message)
    values = _compared(values, edges)
    generator = np.random.default_rng(rng)
    mad = _mad(values, present)
    count = max(1, round(percentile / 100 * int(np.isfinite(mad).sum())))
    drawn = _bootstrap(values, present, resamples, generator)
    tail = 50 * (1 - confidence)
    low, high = nan_percentiles(drawn, [tail, 100 - tail])
    p_regular, p_variable = _permuted(values, present, mad, resamples, generator)
    return Variability(
        mad=mad, low=low, high=high, p_regular=p_regular, p_variable=p_variable,
        regular=extreme(mad, count), variable=extreme(-mad, count),
        regular_frequency=_frequency(drawn, count), variable_frequency=_frequency(-drawn, count),
        n_subjects=present.sum(axis=0), rank_stability=_split_halves(values, present, generator),
    )  # fmt: skip


def _compared(values: FloatArray, edges: ArrayLike | None) -> FloatArray:
    """Return what is subtracted between subjects: the bins, or the cumulative histograms times the bins' widths."""
    if edges is None:
        return values
    limits = as_floats(edges, "edges")
    if limits.shape != (values.shape[2] + 1,) or not (np.diff(limits) > 0).all():
        message = f"edges must be {values.shape[2] + 1} ascending numbers for {values.shape[2]} bins"
        raise InputError(message)
    widths = np.diff(limits)
    # What is below a bin's end has to move half of this bin and half of the next to get beyond both.
    steps = 0.5 * (widths[:-1] + widths[1:])
    cumulative: FloatArray = np.cumsum(values, axis=2)[..., :-1] * steps
    return cumulative


def _deviations(values: FloatArray, present: BoolArray, weights: FloatArray | None = None) -> FloatArray:
    """(subjects, sites) summed absolute deviation from the site's (weighted) mean, 0 where missing."""
    weight = present * (np.ones(len(values)) if weights is None else weights)[:, None]
    total = np.maximum(weight.sum(axis=0), 1e-300)
    filled = np.where(present[..., None], values, 0.0)
    mean = np.einsum("st,stb->tb", weight, filled) / total[:, None]
    deviations: FloatArray = np.abs(filled - mean).sum(axis=2) * present
    return deviations


def _mad(values: FloatArray, present: BoolArray, weights: FloatArray | None = None) -> FloatArray:
    weight = present * (np.ones(len(values)) if weights is None else weights)[:, None]
    total = weight.sum(axis=0)
    distinct = (weight > 0).sum(axis=0)
    summed = (_deviations(values, present, weights) * weight).sum(axis=0)
    enough = distinct >= (FEWEST if weights is None else 2)
    mad: FloatArray = np.divide(summed, total, out=np.full(len(total), np.nan), where=enough)
    return mad


def _bootstrap(
    values: FloatArray, present: BoolArray, resamples: int, rng: np.random.Generator
) -> FloatArray:
    n = len(values)
    times = rng.multinomial(n, np.full(n, 1 / n), resamples).astype(float)
    drawn = np.stack([_mad(values, present, weights) for weights in times])
    has = np.maximum(present.sum(axis=0), 2)
    drawn[:, present.sum(axis=0) < FEWEST] = np.nan
    scaled: FloatArray = drawn * np.sqrt(has / (has - 1))
    return scaled


def _permuted(
    values: FloatArray, present: BoolArray, mad: FloatArray, resamples: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """One-sided p-values under deviations that change places among a subject's sites."""
    deviations = _deviations(values, present)
    counts = np.maximum(present.sum(axis=0), 1)
    below, above = np.ones(len(mad)), np.ones(len(mad))
    for _ in range(resamples):
        mixed = np.zeros_like(deviations)
        for subject, has in enumerate(present):
            mixed[subject, has] = rng.permutation(deviations[subject, has])
        null = mixed.sum(axis=0) / counts
        below += null <= mad + 1e-15
        above += null >= mad - 1e-15
    missing = np.isnan(mad)
    p = np.stack([below, above]) / (resamples + 1)
    p[:, missing] = np.nan
    return p[0], p[1]


def _split_halves(
    values: FloatArray, present: BoolArray, rng: np.random.Generator, splits: int = 50
) -> float:
    n = len(values)
    if n < 2 * FEWEST:
        return float("nan")
    found = []
    for _ in range(splits):
        order = rng.permutation(n)
        halves = [_mad(values[part], present[part]) for part in (order[: n // 2], order[n // 2 :])]
        both = np.isfinite(halves[0]) & np.isfinite(halves[1])
        if both.sum() >= FEWEST:
            found.append(spearman(halves[0][both], halves[1][both]))
    return float(np.nanmean(found)) if np.isfinite(found).any() else float("nan")


def _frequency(drawn: FloatArray, count: int) -> FloatArray:
    hits = np.bincount(np.concatenate([extreme(row, count) for row in drawn]), minlength=drawn.shape[1])
    frequency: FloatArray = hits / len(drawn)
    return frequency
