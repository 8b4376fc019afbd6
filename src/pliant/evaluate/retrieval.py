"""Retrieval by codes: is the label right that the nearest give, over many numbers of neighbours (section 6.5.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import BoolArray, FloatArray, as_floats, frozen
from ..errors import InputError

__all__ = ["DEFAULT_NEIGHBOURS", "RetrievalScores", "crossed_interval", "retrieval_scores"]

#: 1, 6, 11, ..., 96 neighbours, over which the dissertation averages.
DEFAULT_NEIGHBOURS = tuple(range(1, 97, 5))
_BLOCK = 256
# Votes are sums of shares of a place: differences below this are rounding.
_EQUAL = 1e-9


@dataclass(frozen=True, eq=False)
class RetrievalScores:
    """How well a database ordered by distance answers queries.

    Attributes
    ----------
    neighbours : tuple of int
        Numbers k of neighbours.
    label : (m, k) array of float
        For each query and k: 1 where the most frequent class among the neighbours is the query's, 0 where not; equal
        shares where classes tie to the end.
    share : (m, k) array of float
        Share of the k neighbours that are of the query's class.
    average : (m,) array of float
        Average precision of the whole ranking.
    queries : (m,) array
        Label of each query.
    """

    neighbours: tuple[int, ...]
    label: FloatArray
    share: FloatArray
    average: FloatArray
    queries: NDArray[np.generic]

    def __post_init__(self) -> None:
        for name in ("label", "share", "average", "queries"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def by_class(self) -> dict[str, float]:
        """Return each class's share of queries given the right label, averaged over k."""
        each = self.label.mean(axis=1)
        return {str(c): float(each[self.queries == c].mean()) for c in np.unique(self.queries)}

    @property
    def precision(self) -> float:
        """Share of queries given the right label, averaged over k and then over classes."""
        return float(np.mean(list(self.by_class().values())))


def retrieval_scores(
    distances: ArrayLike,
    query_labels: ArrayLike,
    database_labels: ArrayLike,
    *,
    neighbours: Sequence[int] = DEFAULT_NEIGHBOURS,
) -> RetrievalScores:
    """Score distances from queries to a database, whatever order the database is in.

    Ties are the rule with Hamming distances, so each has a rule that does not depend on the order of the database.
    Where items are equally far at the k-th place, they share the places that are left. Of classes with equally many
    votes the one whose voters are nearer in sum gives the label; of those still equal each is taken with the same
    chance.

    Parameters
    ----------
    distances : (m, n) array_like of float
        From each query to each item of the database.
    query_labels : (m,) array_like
    database_labels : (n,) array_like
        Of the same kind. A query of a class that the database lacks can only be wrong.
    neighbours : sequence of int
        Numbers of neighbours; one beyond n counts as n.

    Returns
    -------
    RetrievalScores

    Raises
    ------
    InputError
        If shapes do not fit, a distance is not finite, or there are no queries, no database, or no neighbours.

    Notes
    -----
    In the average precision all items of one distance count at the precision reached with all of them. With more
    neighbours than the database has items of a class the label can still be right, the share cannot stay high. Cost:
    m n log n.

    Examples
    --------
    >>> scores = retrieval_scores([[1, 2, 9]], ["cat"], ["cat", "dog", "dog"], neighbours=[1, 2, 3])
    >>> scores.label.tolist(), scores.share.round(2).tolist()
    ([[1.0, 1.0, 0.0]], [[1.0, 0.5, 0.33]])
    """
    table, queries, database = _checked(distances, query_labels, database_labels)
    counts = tuple(int(k) for k in neighbours)
    if not counts or min(counts) < 1:
        message = f"neighbours must be numbers of 1 or more, got {counts}"
        raise InputError(message)
    classes, numbers = np.unique(np.concatenate([database, queries]), return_inverse=True)
    members = np.eye(len(classes))[numbers[: len(database)]]
    own = numbers[len(database) :]
    label, share = np.empty((len(table), len(counts))), np.empty((len(table), len(counts)))
    average = np.empty(len(table))
    for start in range(0, len(table), _BLOCK):
        part = slice(start, start + _BLOCK)
        for j, k in enumerate(counts):
            label[part, j], share[part, j] = _vote(table[part], members, own[part], min(k, len(database)))
        average[part] = _average_precision(table[part], members[:, own[part]].T > 0)
    return RetrievalScores(counts, label, share, average, queries)


def crossed_interval(
    values: ArrayLike, *, confidence: float = 0.95, draws: int = 10_000, rng: int | np.random.Generator = 0
) -> tuple[float, float]:
    """Return a bootstrap interval of the mean of a table, drawing whole rows and whole columns.

    Parameters
    ----------
    values : (splits, classes) array_like of float
        Both are samples: of the splits that could have been drawn, and of the classes that could have been met. For a
        comparison of two methods, their differences.
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
        If the table is not finite or has fewer than two columns.

    Notes
    -----
    Wider than it need be, by the part of the spread that rows and columns share (McCullagh 2000). With a single row the
    spread of splits is not in it.

    Examples
    --------
    >>> low, high = crossed_interval([[0.2, 0.4, 0.6], [0.3, 0.5, 0.7]])
    >>> 0.2 <= low < 0.45 < high <= 0.7
    True
    """
    table = as_floats(values, "values")
    if table.ndim != 2 or table.shape[1] < 2 or not table.size or not np.isfinite(table).all():
        message = (
            f"values must be a finite table (splits, classes) of two classes or more, got shape {table.shape}"
        )
        raise InputError(message)
    generator = np.random.default_rng(rng)
    rows, columns = table.shape
    row_counts = generator.multinomial(rows, np.full(rows, 1 / rows), size=draws)
    column_counts = generator.multinomial(columns, np.full(columns, 1 / columns), size=draws)
    means = np.einsum("ij,ij->i", row_counts @ table, column_counts) / (rows * columns)
    tail = 50 * (1 - confidence)
    low, high = np.percentile(means, [tail, 100 - tail])
    return float(low), float(high)


def _checked(
    distances: ArrayLike, query_labels: ArrayLike, database_labels: ArrayLike
) -> tuple[FloatArray, NDArray[np.generic], NDArray[np.generic]]:
    table = as_floats(distances, "distances")
    queries, database = np.asarray(query_labels), np.asarray(database_labels)
    if queries.ndim != 1 or database.ndim != 1 or table.shape != (len(queries), len(database)):
        message = (
            f"distances must be (queries, database) with a label for each, got {table.shape}, {queries.shape} and "
            f"{database.shape}"
        )
        raise InputError(message)
    if not table.size or not np.isfinite(table).all():
        raise InputError("distances must be finite, from one query or more to one item or more")
    return table, queries, database


def _vote(
    distances: FloatArray, members: FloatArray, own: NDArray[np.intp], k: int
) -> tuple[FloatArray, FloatArray]:
    """Return the chance of the right label by k neighbours, and the share of them that are right."""
    last = np.partition(distances, k - 1, axis=1)[:, k - 1 : k]
    nearer, level = distances < last, distances == last
    left = k - nearer.sum(axis=1, keepdims=True)
    places = nearer + level * (left / level.sum(axis=1, keepdims=True))
    votes = places @ members
    far = (places * distances) @ members
    winners: BoolArray = votes >= votes.max(axis=1, keepdims=True) - _EQUAL
    nearest = np.where(winners, far, np.inf)
    winners &= nearest <= nearest.min(axis=1, keepdims=True) * (1 + _EQUAL) + _EQUAL
    rows = np.arange(len(own))
    return winners[rows, own] / winners.sum(axis=1), votes[rows, own] / k


def _average_precision(distances: FloatArray, right: BoolArray) -> FloatArray:
    order = np.argsort(distances, axis=1, kind="stable")
    sorted_right = np.take_along_axis(right, order, axis=1)
    along = np.take_along_axis(distances, order, axis=1)
    found = np.cumsum(sorted_right, axis=1)
    # The precision at the last item of each distance, for all items of it.
    ends = np.column_stack([along[:, 1:] != along[:, :-1], np.ones(len(along), dtype=bool)])
    places = np.where(ends, np.arange(along.shape[1]), along.shape[1])
    last = np.minimum.accumulate(places[:, ::-1], axis=1)[:, ::-1]
    precision = np.take_along_axis(found, last, axis=1) / (last + 1)
    total = found[:, -1]
    sums = (precision * sorted_right).sum(axis=1)
    means: FloatArray = np.divide(sums, total, out=np.zeros(len(total)), where=total > 0)
    return means
