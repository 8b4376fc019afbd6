"""Where two groups differ, and how far two rankings of the same sites agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from .._arrays import BoolArray, FloatArray, as_floats, frozen
from ..errors import InputError
from ._sites import checked_histograms, extreme, nan_percentiles, spearman

__all__ = ["GroupComparison", "RankAgreement", "compare_groups", "false_discovery_rates", "rank_agreement"]


@dataclass(frozen=True, eq=False)
class GroupComparison:
    """Where two groups differ.

    Parameters
    ----------
    distance : (sites,) array of float
        Euclidean distance between the groups' mean histograms; NaN where a group has fewer than two subjects.
    p : (sites,) array of float
        Permutation p-value.
    q : (sites,) array of float
        The same as false discovery rate over the sites (Benjamini & Hochberg 1995).
    names : tuple of str
        The two groups.
    """

    distance: FloatArray
    p: FloatArray
    q: FloatArray
    names: tuple[str, str]

    def __post_init__(self) -> None:
        for name in ("distance", "p", "q"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, eq=False)
class RankAgreement:
    """How far two rankings of the same sites agree.

    Parameters
    ----------
    spearman, low, high : float
        Rank correlation and its bootstrap interval over sites.
    p : float
        Two-sided permutation p-value.
    bottom, top : float
        Share of the lowest and of the highest sites that the two have in common.
    n_sites : int
        Sites that both have.
    """

    spearman: float
    low: float
    high: float
    p: float
    bottom: float
    top: float
    n_sites: int


def compare_groups(
    histograms: ArrayLike,
    groups: ArrayLike,
    *,
    permutations: int = 5000,
    rng: np.random.Generator | int | None = None,
) -> GroupComparison:
    """Test at each site whether two groups' mean histograms differ, by permuting subjects.

    Parameters
    ----------
    histograms : (subjects, sites, bins) array_like of float
        Over common bins. NaN throughout where a subject lacks a site.
    groups : (subjects,) array_like
        A label for each subject; two different ones.
    permutations : int
        Random relabellings; the smallest p-value possible is 1 / (permutations + 1).
    rng : numpy.random.Generator or int, optional
        Seed.

    Returns
    -------
    GroupComparison

    Raises
    ------
    InputError
        If there are not exactly two groups of two subjects or more.

    Notes
    -----
    Whole subjects change places, so that what sites of one subject share stays together. Cost is linear in
    permutations, sites and subjects: a second for 100 sites, 31 subjects and 5,000 permutations.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> values = rng.normal(size=(20, 3, 4))
    >>> values[10:, 1] += 3
    >>> found = compare_groups(values, ["a"] * 10 + ["b"] * 10, permutations=200, rng=0)
    >>> (found.q < 0.05).tolist()
    [False, True, False]
    """
    values, present = checked_histograms(histograms)
    labels = np.asarray(groups)
    names = np.unique(labels.astype(str))
    if labels.shape != (len(values),) or len(names) != 2:
        message = (
            f"groups must name two groups, one label for each of {len(values)} subjects; got {names.tolist()}"
        )
        raise InputError(message)
    second = labels.astype(str) == names[1]
    if min(second.sum(), (~second).sum()) < 2:
        raise InputError("each group needs two subjects or more")
    if permutations < 1:
        message = f"permutations must be at least 1, got {permutations}"
        raise InputError(message)
    generator = np.random.default_rng(rng)
    distance = _group_distances(values, present, second[None])[0]
    reached = np.ones(len(distance))
    shuffled = np.stack([generator.permutation(second) for _ in range(permutations)])
    for block in np.array_split(shuffled, max(1, permutations // 100)):
        found = _group_distances(values, present, block)
        # A relabelling that leaves a group without the site tells nothing: it counts against a difference.
        reached += (~(found < distance - 1e-12)).sum(axis=0)
    p = np.where(np.isfinite(distance), reached / (permutations + 1), np.nan)
    return GroupComparison(distance, p, false_discovery_rates(p), (str(names[0]), str(names[1])))


def rank_agreement(
    first: ArrayLike,
    second: ArrayLike,
    *,
    percentile: float = 5.0,
    confidence: float = 0.95,
    resamples: int = 1000,
    rng: np.random.Generator | int | None = None,
) -> RankAgreement:
    """Compare two measurements of the same sites: left against right, or variability against curvature's or a truth.

    Parameters
    ----------
    first, second : (sites,) array_like of float
        NaN where missing; a site counts where both have it.
    percentile : float
        Size of the bottom and top sets, in percent of the sites.
    confidence, resamples, rng
        Of the bootstrap over sites and the permutation test.

    Returns
    -------
    RankAgreement

    Raises
    ------
    InputError
        If the shapes differ, or fewer than four sites are left.

    Examples
    --------
    >>> found = rank_agreement(np.arange(40), np.arange(40) ** 2, rng=0, resamples=50)
    >>> found.spearman, found.top
    (1.0, 1.0)
    """
    a, b = as_floats(first, "first"), as_floats(second, "second")
    if a.ndim != 1 or a.shape != b.shape:
        message = f"first and second must have one value a site, got shapes {a.shape} and {b.shape}"
        raise InputError(message)
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    if len(a) < 4:
        message = f"only {len(a)} sites have both values; a rank correlation needs four"
        raise InputError(message)
    generator = np.random.default_rng(rng)
    whole = spearman(a, b)
    draws = generator.integers(0, len(a), (resamples, len(a)))
    tail = 50 * (1 - confidence)
    low, high = nan_percentiles(np.array([[spearman(a[d], b[d])] for d in draws]), [tail, 100 - tail])
    null = np.array([spearman(a, generator.permutation(b)) for _ in range(resamples)])
    p = (1 + int((np.abs(null) >= abs(whole) - 1e-12).sum())) / (resamples + 1)
    count = max(1, round(percentile / 100 * len(a)))
    bottom = np.isin(extreme(a, count), extreme(b, count)).mean()
    top = np.isin(extreme(-a, count), extreme(-b, count)).mean()
    return RankAgreement(whole, float(low[0]), float(high[0]), p, float(bottom), float(top), len(a))


def false_discovery_rates(p: ArrayLike) -> FloatArray:
    """Adjust p-values for their number by the step-up rule of Benjamini & Hochberg 1995.

    Parameters
    ----------
    p : (k,) array_like of float
        NaN where missing.

    Returns
    -------
    (k,) array of float
        NaN where missing.

    Examples
    --------
    >>> false_discovery_rates([0.01, 0.04, 0.03]).round(3).tolist()
    [0.03, 0.04, 0.04]
    """
    values = as_floats(p, "p")
    rates = np.full(values.shape, np.nan)
    known = np.isfinite(values)
    if known.any():
        rates[known] = stats.false_discovery_control(values[known])
    return rates


def _group_distances(values: FloatArray, present: BoolArray, second: BoolArray) -> FloatArray:
    """(labellings, sites) distance of group means; NaN where a group has fewer than two subjects."""
    filled = np.where(present[..., None], values, 0.0)
    means, enough = [], np.ones((len(second), values.shape[1]), dtype=bool)
    for member in (~second, second):
        count = member.astype(float) @ present
        enough &= count >= 2
        total = np.einsum("ps,stb->ptb", member.astype(float), filled, optimize=True)
        means.append(total / np.maximum(count, 1)[..., None])
    distance: FloatArray = np.where(enough, np.linalg.norm(means[0] - means[1], axis=2), np.nan)
    return distance
