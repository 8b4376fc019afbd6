"""Bags of features: how often each word of a learned vocabulary occurs on a surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.cluster import KMeans
from sklearn.utils.validation import check_is_fitted

from .._arrays import FloatArray, IntArray, as_floats
from ..errors import InputError, first_indices
from .features import FEATURE_BLOCKS

__all__ = ["BagOfFeatures", "ColumnHistograms", "Weighting"]

Weighting: TypeAlias = Literal["blocks", "plain"]


class BagOfFeatures(TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Turn sets of feature rows into histograms over a vocabulary learned by k-means.

    Parameters
    ----------
    words : int
        Size of the vocabulary; the dissertation takes 20.
    weighting : {"blocks", "plain"}
        ``"plain"``: every column has variance 1, so that ten columns of one kind outvote a single one.
        ``"blocks"``: every kind of number (see ``blocks``) has variance 1 in total.
    columns : sequence of int, optional
        Use these columns only, as (0, 1, 2) for shape index, curvedness and orientation.
    blocks : mapping of str to slice, optional
        Columns of each kind; :data:`pliant.heart.FEATURE_BLOCKS` by default. Columns in none are kinds of their own.
    most_points : int
        Rows drawn at random to learn from, where there are more.
    rng : int
        Seed of the draw and of k-means.

    Attributes
    ----------
    centres_ : (words, d) array of float
        The words, in scaled columns.
    mean_, scale_ : (d,) array of float
        What columns are moved and divided by.

    Notes
    -----
    An estimator of scikit-learn's kind: put it in a pipeline, so that vocabulary and scaling are learned inside each
    fold. An input is a sequence of (m_i, d) arrays, one a subject, or one (n, m, d) array. Cost: about 0.2 s for 20
    words from 8,000 rows of 23.

    References
    ----------
    Dissertation, section 5.4.3.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> bags = [rng.normal(i % 2, 1, (100, 23)) for i in range(6)]
    >>> histograms = BagOfFeatures(words=5).fit_transform(bags)
    >>> histograms.shape, bool(np.allclose(histograms.sum(axis=1), 1))
    ((6, 5), True)
    """

    def __init__(
        self,
        words: int = 20,
        *,
        weighting: Weighting = "blocks",
        columns: Sequence[int] | None = None,
        blocks: Mapping[str, slice] | None = None,
        most_points: int = 8_000,
        rng: int = 0,
    ) -> None:
        self.words = words
        self.weighting = weighting
        self.columns = columns
        self.blocks = blocks
        self.most_points = most_points
        self.rng = rng

    def fit(self, X: Sequence[ArrayLike], y: Any = None) -> BagOfFeatures:
        """Learn scaling and vocabulary.

        Parameters
        ----------
        X : sequence of (m_i, d) array_like
            One set of rows a subject, all finite.
        y : ignored

        Returns
        -------
        BagOfFeatures

        Raises
        ------
        InputError
            If there are fewer rows than words, or rows do not fit.
        """
        if self.weighting not in ("blocks", "plain"):
            message = f'weighting must be "blocks" or "plain", got {self.weighting!r}'
            raise InputError(message)
        bags = checked_bags(X)
        rows = np.concatenate(bags)
        self.n_features_in_ = rows.shape[1]
        rng = np.random.default_rng(self.rng)
        if len(rows) > self.most_points:
            rows = rows[np.sort(rng.choice(len(rows), self.most_points, replace=False))]
        if not 2 <= self.words <= len(rows):
            message = f"words must be 2 or more and at most the {len(rows)} rows, got {self.words}"
            raise InputError(message)
        chosen = self._columns()
        self.mean_ = rows[:, chosen].mean(axis=0)
        deviation = rows[:, chosen].std(axis=0)
        # A column that never changes says nothing; dividing by its zero would say too much.
        self.scale_ = np.where(deviation > 1e-12, deviation, np.inf) * self._crowding(chosen)
        means = KMeans(self.words, n_init=2, random_state=int(rng.integers(2**31)))
        self.centres_ = means.fit((rows[:, chosen] - self.mean_) / self.scale_).cluster_centers_
        return self

    def words_of(self, rows: ArrayLike) -> IntArray:
        """Return the (m,) nearest word of each row of an (m, d) array."""
        check_is_fitted(self)
        scaled = (as_floats(rows, "rows")[:, self._columns()] - self.mean_) / self.scale_
        squares = (self.centres_**2).sum(axis=1) - 2 * scaled @ self.centres_.T
        nearest: IntArray = squares.argmin(axis=1)
        return nearest

    def transform(self, X: Sequence[ArrayLike]) -> FloatArray:
        """Return (n, words) shares of each word; rows sum to 1.

        Raises
        ------
        InputError
            If rows do not fit what was learned from.
        """
        check_is_fitted(self)
        bags = checked_bags(X, self.n_features_in_)
        counts = [np.bincount(self.words_of(bag), minlength=self.words) / len(bag) for bag in bags]
        return np.array(counts)

    def _columns(self) -> IntArray:
        if self.columns is None:
            return np.arange(self.n_features_in_)
        chosen = np.asarray(list(self.columns), dtype=np.int64)
        if not chosen.size or chosen.min() < 0 or chosen.max() >= self.n_features_in_:
            message = f"columns must be numbers from 0 to {self.n_features_in_ - 1}, got {chosen.tolist()}"
            raise InputError(message)
        return chosen

    def _crowding(self, chosen: IntArray) -> FloatArray:
        """Return the root of the number of chosen columns of each column's kind, 1 where all count alike."""
        if self.weighting == "plain":
            return np.ones(len(chosen))
        kind = -1 - np.arange(self.n_features_in_)
        for i, block in enumerate((FEATURE_BLOCKS if self.blocks is None else self.blocks).values()):
            kind[block] = i
        kinds = kind[chosen]
        crowding: FloatArray = np.sqrt((kinds[:, None] == kinds).sum(axis=1))
        return crowding


class ColumnHistograms(TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Histogram each column by itself, over bins that hold equal shares of what was learned from.

    Parameters
    ----------
    bins : int
        Bins a column.
    columns : sequence of int, optional
        Use these columns only; (0,) is the shape index.

    Attributes
    ----------
    edges_ : (columns, bins - 1) array of float
        Inner edges of the bins.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> ColumnHistograms(bins=4, columns=(0, 2)).fit_transform([rng.random((50, 3)), rng.random((60, 3))]).shape
    (2, 8)
    """

    def __init__(self, bins: int = 20, *, columns: Sequence[int] | None = None) -> None:
        self.bins = bins
        self.columns = columns

    def fit(self, X: Sequence[ArrayLike], y: Any = None) -> ColumnHistograms:
        """Learn the edges from sets of rows."""
        if self.bins < 2:
            message = f"bins must be 2 or more, got {self.bins}"
            raise InputError(message)
        rows = np.concatenate(checked_bags(X))
        self.n_features_in_ = rows.shape[1]
        chosen = list(range(rows.shape[1]) if self.columns is None else self.columns)
        inner = np.linspace(0, 1, self.bins + 1)[1:-1]
        self.columns_ = chosen
        self.edges_ = np.quantile(rows[:, chosen], inner, axis=0).T
        return self

    def transform(self, X: Sequence[ArrayLike]) -> FloatArray:
        """Return (n, columns * bins) shares, column by column."""
        check_is_fitted(self)
        found = []
        for bag in checked_bags(X, self.n_features_in_):
            shares = [
                np.bincount(np.searchsorted(edges, bag[:, column], side="right"), minlength=self.bins)
                / len(bag)
                for column, edges in zip(self.columns_, self.edges_, strict=True)
            ]
            found.append(np.concatenate(shares))
        return np.array(found)


def checked_bags(X: Sequence[ArrayLike], width: int | None = None) -> list[FloatArray]:
    """Return sets of rows as float64, refusing what is empty, ragged or not finite."""
    bags = [as_floats(bag, f"X[{i}]") for i, bag in enumerate(X)]
    if not bags:
        raise InputError("X is empty: give one (m, d) array a subject")
    columns = bags[0].shape[-1] if width is None else width
    bad = [i for i, bag in enumerate(bags) if bag.ndim != 2 or not len(bag) or bag.shape[1] != columns]
    if bad:
        message = (
            f"{len(bad)} of {len(bags)} subjects lack rows of {columns} numbers, first {first_indices(bad)}"
        )
        raise InputError(message)
    bad = [i for i, bag in enumerate(bags) if not np.isfinite(bag).all()]
    if bad:
        message = (
            f"{len(bad)} of {len(bags)} subjects have numbers that are not finite, first {first_indices(bad)}"
        )
        raise InputError(message)
    return bags
