"""Hit rate: the true counterpart of a point among the few per cent that look most like it (section 3.5.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist

from .._arrays import FloatArray, IntArray, as_floats, as_indices, frozen, vertex_indices
from ..errors import InputError, first_indices
from ._checks import point_map_of

__all__ = ["DEFAULT_FRACTIONS", "HitRates", "hit_rate", "mean_hit_rates"]

# Up to one per cent of the candidates, as in Fig. 3.5 to 3.7.
DEFAULT_FRACTIONS = tuple(round(0.0005 * i, 4) for i in range(1, 21))

_BLOCK = 1 << 22


@dataclass(frozen=True, eq=False, repr=False)
class HitRates:
    """Ranks of true counterparts, and the hit rates that follow from them.

    Parameters
    ----------
    ranks : (s,) array of int
        For each reference point the rank of its true counterpart among all candidates, from 1. Candidates
        exactly as near count as before it, so a descriptor that cannot tell points apart earns nothing.
    n_candidates : int
        Number of points that compete.
    fractions : (f,) array of float
        Shares of the candidates that are looked at.
    symmetric_ranks : (s,) array of int or None
        The better of the ranks of the counterpart and of its mirror image, where a symmetry was given.
    n_missing : int
        Points left out because they have no counterpart.

    Examples
    --------
    >>> rates = HitRates([1, 3, 250], 1000, [0.001, 0.01])
    >>> rates
    HitRates(3 points among 1000: 0.333 at 0.1 %, 0.667 at 1 %)
    >>> rates.at(0.003)
    0.6666666666666666
    """

    ranks: IntArray
    n_candidates: int
    fractions: FloatArray
    symmetric_ranks: IntArray | None = None
    n_missing: int = 0

    def __post_init__(self) -> None:
        ranks = as_indices(self.ranks, "ranks")
        if ranks.ndim != 1 or not ranks.size or ranks.min() < 1 or ranks.max() > self.n_candidates:
            message = f"ranks must be one or more whole numbers from 1 to {self.n_candidates}"
            raise InputError(message)
        object.__setattr__(self, "ranks", frozen(ranks))
        object.__setattr__(self, "fractions", frozen(_checked_fractions(self.fractions)))
        if self.symmetric_ranks is not None:
            mirrored = as_indices(self.symmetric_ranks, "symmetric_ranks")
            if mirrored.shape != ranks.shape or (mirrored > ranks).any() or mirrored.min() < 1:
                raise InputError("symmetric_ranks must be 1 or more and never above ranks")
            object.__setattr__(self, "symmetric_ranks", frozen(mirrored))

    def __repr__(self) -> str:
        ends = (float(self.fractions[0]), float(self.fractions[-1]))
        text = ", ".join(f"{self.at(f):.3f} at {100 * f:g} %" for f in dict.fromkeys(ends))
        return f"HitRates({len(self.ranks)} points among {self.n_candidates}: {text})"

    @property
    def rates(self) -> FloatArray:
        """(f,) share of the points whose counterpart is among the nearest fraction."""
        return _rates(self.ranks, self.fractions, self.n_candidates)

    @property
    def symmetric_rates(self) -> FloatArray | None:
        """(f,) the same, a mirror image counting as well; None where no symmetry was given."""
        if self.symmetric_ranks is None:
            return None
        return _rates(self.symmetric_ranks, self.fractions, self.n_candidates)

    def at(self, fraction: float, *, symmetric: bool = False) -> float:
        """Return the hit rate at a fraction of the candidates.

        Parameters
        ----------
        fraction : float
            In (0, 1]; at least one candidate is always looked at.
        symmetric : bool
            Let a mirror image count.

        Raises
        ------
        InputError
            If the fraction is out of range, or no symmetry was given.
        """
        ranks = self._chosen(symmetric)
        return float(_rates(ranks, _checked_fractions([fraction]), self.n_candidates)[0])

    def interval(
        self,
        *,
        confidence: float = 0.95,
        symmetric: bool = False,
        repeats: int = 1000,
        rng: np.random.Generator | int = 0,
    ) -> FloatArray:
        """Return bootstrap bounds of the rates over the points: (2, f), lower and upper.

        Parameters
        ----------
        confidence : float
            Coverage of the percentile interval.
        symmetric : bool
            Of the rates in which mirror images count.
        repeats : int
            Number of resamples of the points.
        rng : int or numpy.random.Generator
            Seed.
        """
        ranks = self._chosen(symmetric)
        hits = (ranks[:, None] <= _limits(self.fractions, self.n_candidates)).astype(np.float64)
        return _percentiles(hits, confidence, repeats, rng)

    def _chosen(self, symmetric: bool) -> IntArray:
        if not symmetric:
            return self.ranks
        if self.symmetric_ranks is None:
            raise InputError("no symmetry was given to hit_rate: there are no symmetric rates")
        return self.symmetric_ranks


def hit_rate(
    descriptors_a: ArrayLike,
    descriptors_b: ArrayLike,
    truth: ArrayLike,
    *,
    points: ArrayLike | None = None,
    fractions: ArrayLike = DEFAULT_FRACTIONS,
    symmetry: ArrayLike | None = None,
) -> HitRates:
    """Rank the true counterpart of each reference point among all points of another shape, by descriptor.

    Parameters
    ----------
    descriptors_a : (n_a, d) or (n_a,) array_like of float
        Of the shape that carries the reference points. Compared by L2.
    descriptors_b : (n_b, d) or (n_b,) array_like of float
        Of the shape that is searched.
    truth : (n_a,) array_like of int
        The point of b that each point of a is; -1 where there is none.
    points : (s,) array_like of int, optional
        Reference points, vertices of a: drawn at random, or farthest points. All by default. Those without
        counterpart are left out and counted.
    fractions : (f,) array_like of float
        Shares of the candidates to look at, ascending: 0.05 to 1 % by default.
    symmetry : (n_b,) array_like of int, optional
        The mirror image of each point of b (-1 where there is none): the symmetric answer is then reported
        as well.

    Returns
    -------
    HitRates

    Raises
    ------
    InputError
        If shapes do not fit, a value is not finite, an index is out of range, or no point has a counterpart.

    Notes
    -----
    Cost: s n_b d, in blocks.

    Examples
    --------
    >>> a = np.arange(1000.0)
    >>> hit_rate(a, a + 0.2, np.arange(1000), points=[3, 500], fractions=[0.001])
    HitRates(2 points among 1000: 1.000 at 0.1 %)
    """
    a, b = _table(descriptors_a, "descriptors_a"), _table(descriptors_b, "descriptors_b")
    if a.shape[1] != b.shape[1]:
        message = f"descriptors must have the same width, got {a.shape[1]} and {b.shape[1]} columns"
        raise InputError(message)
    target = point_map_of(truth, len(a), len(b), "truth")
    chosen = np.arange(len(a)) if points is None else vertex_indices(points, len(a), "points")
    known = chosen[target[chosen] >= 0]
    if not known.size:
        message = f"none of the {chosen.size} points has a counterpart in truth"
        raise InputError(message)
    mirror = None if symmetry is None else point_map_of(symmetry, len(b), len(b), "symmetry")
    ranks, mirrored = _ranks(a[known], b, target[known], mirror)
    fractions = as_floats(fractions, "fractions")
    return HitRates(ranks, len(b), fractions, mirrored, int(chosen.size - known.size))


def mean_hit_rates(
    results: Sequence[HitRates],
    *,
    symmetric: bool = False,
    confidence: float = 0.95,
    repeats: int = 1000,
    rng: np.random.Generator | int = 0,
) -> tuple[FloatArray, FloatArray]:
    """Average hit rates over pairs of shapes, every pair counting alike.

    Parameters
    ----------
    results : sequence of HitRates
        With the same fractions.
    symmetric : bool
        Let mirror images count.
    confidence, repeats, rng
        Of the bootstrap, which draws pairs: points of one pair are not independent of each other.

    Returns
    -------
    (f,) array, (2, f) array
        Mean rates, and the lower and upper bound. With few pairs the interval is too narrow; one pair has none (NaN).

    Raises
    ------
    InputError
        If there is no result or fractions differ.

    Examples
    --------
    >>> one, two = HitRates([1, 9], 10, [0.1]), HitRates([1, 1], 10, [0.1])
    >>> mean_hit_rates([one, two])[0]
    array([0.75])
    """
    if not results:
        raise InputError("mean_hit_rates needs at least one result")
    fractions = results[0].fractions
    if any(not np.array_equal(result.fractions, fractions) for result in results):
        raise InputError("results must have the same fractions to be averaged")
    each = np.stack([_rates(result._chosen(symmetric), fractions, result.n_candidates) for result in results])
    if len(each) == 1:
        return each[0], np.full((2, len(fractions)), np.nan)
    return each.mean(axis=0), _percentiles(each, confidence, repeats, rng)


def _ranks(
    rows: FloatArray, candidates: FloatArray, target: IntArray, mirror: IntArray | None
) -> tuple[IntArray, IntArray | None]:
    ranks = np.empty(len(rows), dtype=np.int64)
    mirrored = None if mirror is None else np.empty(len(rows), dtype=np.int64)
    step = max(1, _BLOCK // len(candidates))
    for start in range(0, len(rows), step):
        block = slice(start, start + step)
        distances = cdist(rows[block], candidates, "sqeuclidean")
        at = np.arange(len(distances))
        ranks[block] = (distances <= distances[at, target[block]][:, None]).sum(axis=1)
        if mirror is not None and mirrored is not None:
            image = mirror[target[block]]
            other = (distances <= distances[at, image][:, None]).sum(axis=1)
            mirrored[block] = np.where(image >= 0, np.minimum(ranks[block], other), ranks[block])
    return ranks, mirrored


def _limits(fractions: FloatArray, n: int) -> FloatArray:
    # A fraction such as 0.003 of 1000 must give 3 in spite of rounding.
    limits: FloatArray = np.maximum(np.floor(fractions * n * (1 + 1e-12)), 1)
    return limits


def _rates(ranks: IntArray, fractions: FloatArray, n: int) -> FloatArray:
    rates: FloatArray = (ranks[:, None] <= _limits(fractions, n)).mean(axis=0)
    return rates


def _percentiles(
    rows: FloatArray, confidence: float, repeats: int, rng: np.random.Generator | int
) -> FloatArray:
    if not 0 < confidence < 1 or repeats < 1:
        message = f"confidence must be in (0, 1) and repeats 1 or more, got {confidence} and {repeats}"
        raise InputError(message)
    draws = np.random.default_rng(rng).integers(0, len(rows), size=(repeats, len(rows)))
    means = np.stack([rows[draw].mean(axis=0) for draw in draws])
    tail = 50 * (1 - confidence)
    bounds: FloatArray = np.percentile(means, [tail, 100 - tail], axis=0)
    return bounds


def _checked_fractions(values: ArrayLike) -> FloatArray:
    fractions = np.atleast_1d(as_floats(values, "fractions"))
    good = fractions.ndim == 1 and fractions.size > 0 and bool(((fractions > 0) & (fractions <= 1)).all())
    if not good or (np.diff(fractions) <= 0).any():
        raise InputError("fractions must be ascending numbers in (0, 1]")
    return fractions


def _table(values: ArrayLike, name: str) -> FloatArray:
    table = as_floats(values, name)
    table = table[:, None] if table.ndim == 1 else table
    if table.ndim != 2 or not table.size:
        message = f"{name} must be (n, d) with a row a point, got shape {table.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(table).all(axis=1))
    if bad.size:
        message = f"{name}: {bad.size} rows are not finite, first {first_indices(bad)}; leave them out"
        raise InputError(message)
    return table
