"""Pictures as bags of visual words: descriptors of their edges, counted by the nearest word."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.cluster import MiniBatchKMeans

from .._arrays import BoolArray, FloatArray
from ..errors import InputError, PliantWarning, first_indices
from ..images.blur import geometric_blur
from ..images.matching import unusable
from ..images.picture import as_picture
from ..images.views import view

__all__ = ["Description", "Vocabulary", "describe_picture"]

Floats32: TypeAlias = NDArray[np.float32]

_POINTS = 600
_LEAST_POINTS = 8
_BATCH = 4096
# Descriptors of no picture in particular that a word is thought to have met before the first real one.
_PRIOR = 20.0


class Description(NamedTuple):
    """Descriptors of a picture and where they are.

    Attributes
    ----------
    descriptors : (n, d) array of float32
    positions : (n, 2) array of float
        x and y in pixels of the source, centres at whole numbers.
    """

    descriptors: Floats32
    positions: FloatArray


def describe_picture(
    picture: Any, *, mask: Any = None, points: int = _POINTS, rng: int | np.random.Generator = 0
) -> Description:
    """Describe a picture by geometric blur at points drawn from its edges.

    Parameters
    ----------
    picture : Picture, str, Path, or array_like
        See :func:`pliant.images.as_picture`.
    mask : file or (h, w) array_like, optional
        What is picture and what is fill.
    points : int
        Points wanted. A picture has room for fewer where its edges are few: points keep 5 px apart, the picture brought
        to about 170 x 170.
    rng : int or Generator
        Seed of the points. The same seed gives the same bytes.

    Returns
    -------
    Description
        Descriptors (n, 204) and positions (n, 2), in the order drawn, so that the first few are a smaller draw.

    Raises
    ------
    InputError
        If the picture cannot be used, is under 16 pixels a side, or has edges for fewer than 8 points.

    Notes
    -----
    Cost: about 35 ms, reading a JPEG included. Source: sections 6.3.1 and 6.4.2.

    Examples
    --------
    >>> picture = np.random.default_rng(0).random((60, 80))
    >>> describe_picture(picture, points=50).descriptors.shape
    (50, 204)
    """
    if points < _LEAST_POINTS:
        message = f"points must be {_LEAST_POINTS} or more, got {points}"
        raise InputError(message)
    loaded = as_picture(picture, mask=mask)
    reason = unusable(loaded).replace("image 1", "the picture")
    if reason:
        raise InputError(reason)
    seen = view(loaded, points, np.random.default_rng(rng))
    if len(seen.points) < _LEAST_POINTS:
        message = f"the picture has edges for only {len(seen.points)} points; it is (nearly) of one colour"
        raise InputError(message)
    descriptors = geometric_blur(seen.edges, seen.points).astype(np.float32)
    return Description(descriptors, seen.points_in_source(seen.points.astype(np.float64)))


class Vocabulary(TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Visual words: centres of clusters of descriptors; pictures become histograms of them.

    Parameters
    ----------
    n_words : int
        Number of words. Fewer are made, with a warning, where there are fewer different descriptors.
    sample : int
        Descriptors that words are learned from at most, drawn evenly from all that are given: bounds the memory.
    consistency : float
        Power to which the words' consistency is raised before it weighs their counts; 0 leaves it out.
    rng : int or Generator
        Seed of the sample and the clusters.

    Attributes
    ----------
    words_ : (n_words, d) array of float32
    weights_ : (n_words,) array of float
        What counts are multiplied by: 1 on average over all descriptors of ``fit``.
    n_features_in_ : int
        Length d of a descriptor.

    Notes
    -----
    Words are learned by mini-batch k-means. A histogram is divided by its sum and its root is taken, so that its length
    is 1 and the product of two is the Bhattacharyya coefficient. Cost of a picture: n d n_words.

    References
    ----------
    Section 6.4.1 of the dissertation.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> pictures = [rng.random((40, 6)) for _ in range(5)]
    >>> histograms = Vocabulary(n_words=10).fit(pictures).transform(pictures)
    >>> histograms.shape, (histograms**2).sum(axis=1).round(6).tolist()
    ((5, 10), [1.0, 1.0, 1.0, 1.0, 1.0])
    """

    def __init__(
        self,
        n_words: int = 1000,
        *,
        sample: int = 100_000,
        consistency: float = 1.0,
        rng: int | np.random.Generator = 0,
    ) -> None:
        self.n_words = n_words
        self.sample = sample
        self.consistency = consistency
        self.rng = rng

    def fit(
        self,
        X: Iterable[ArrayLike],
        y: object = None,
        *,
        consistent: Sequence[ArrayLike] | None = None,
        shared: Iterable[ArrayLike] | None = None,
    ) -> Self:
        """Learn words, and how much each is worth.

        Parameters
        ----------
        X : iterable of (n_i, d) array_like of float
            Descriptors of each picture.
        y : None
            Not used.
        consistent : sequence of (n_i,) array_like of bool, optional
            Which descriptors were found again in another picture of the same class. Given, words are learned from these
            alone, and a word weighs as much as the share of its descriptors that were found again. Otherwise from
            all, and all words weigh the same.
        shared : iterable of (n_i, d) array_like of float, optional
            Descriptors to learn words from instead: what pairs of pictures share. Gone through once.

        Raises
        ------
        InputError
            If descriptors are not finite tables of one width, flags do not fit, or there is nothing to learn from.

        Notes
        -----
        Words of what pairs share are nearer to what a class repeats than words of single descriptors, each of which
        also holds what only its own picture shows around the point.
        """
        self._check_options()
        rng = np.random.default_rng(self.rng)
        # A sequence may read its tables when asked for them: they are gone through one by one, never all held.
        given = X if isinstance(X, Sequence) else list(X)
        flags = None if consistent is None else list(consistent)
        if flags is not None and len(flags) != len(given):
            message = f"consistent must have one entry a picture, {len(given)}, got {len(flags)}"
            raise InputError(message)
        examples = _flagged(given, flags) if shared is None else _flagged(shared, None)
        kept = _sampled(examples, self.sample, rng)
        if not len(kept):
            raise InputError("there is no descriptor to learn words from")
        self.n_features_in_ = kept.shape[1]
        self.words_ = _clustered(kept, self.n_words, int(rng.integers(2**31)))
        self.weights_ = np.ones(len(self.words_))
        if flags is not None and self.consistency > 0:
            self.weights_ = self._learned_weights(_flagged(given, flags))
        return self

    def transform(self, X: Iterable[ArrayLike]) -> FloatArray:
        """Return the histogram of each picture's descriptors.

        Parameters
        ----------
        X : iterable of (n_i, d) array_like of float

        Returns
        -------
        (m, n_words) array of float
            Rows of length 1; 0 for a picture without descriptors.

        Raises
        ------
        InputError
            If it is not fitted or descriptors do not fit.
        """
        if not hasattr(self, "words_"):
            raise InputError("this Vocabulary is not fitted yet: call fit first")
        counts = [self._counts(table) for table in _tables(X, self.n_features_in_)]
        weighted = np.array(counts).reshape(len(counts), len(self.words_)) * self.weights_
        total = weighted.sum(axis=1, keepdims=True)
        roots: FloatArray = np.sqrt(np.divide(weighted, total, out=np.zeros_like(weighted), where=total > 0))
        return roots

    def nearest_words(self, descriptors: ArrayLike) -> NDArray[np.int64]:
        """Return the number of the word nearest to each of (n, d) descriptors."""
        table = next(_tables([descriptors], self.n_features_in_))
        offsets = 0.5 * np.einsum("ij,ij->i", self.words_, self.words_)
        nearest: NDArray[np.int64] = (table @ self.words_.T - offsets).argmax(axis=1)
        return nearest

    def state(self) -> dict[str, NDArray[Any]]:
        """Return the fitted arrays by name, for a file."""
        return {"words_": self.words_, "weights_": self.weights_}

    def with_state(self, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Take fitted arrays from :meth:`state`; the inverse of it."""
        if not {"words_", "weights_"} <= set(arrays):
            raise InputError("Vocabulary needs the arrays words_ and weights_; the model is damaged")
        self.words_ = np.asarray(arrays["words_"], dtype=np.float32)
        self.weights_ = np.asarray(arrays["weights_"], dtype=np.float64)
        self.n_features_in_ = self.words_.shape[1]
        return self

    def _counts(self, table: Floats32) -> NDArray[np.int64]:
        return np.bincount(self.nearest_words(table), minlength=len(self.words_))

    def _learned_weights(self, flagged: Iterable[tuple[Floats32, BoolArray]]) -> FloatArray:
        met, again = np.zeros(len(self.words_)), np.zeros(len(self.words_))
        for table, flag in flagged:
            nearest = self.nearest_words(table)
            met += np.bincount(nearest, minlength=len(met))
            again += np.bincount(nearest[flag], minlength=len(met))
        usual = again.sum() / met.sum()
        weights = ((again + _PRIOR * usual) / (met + _PRIOR)) ** self.consistency
        scaled: FloatArray = weights * (met.sum() / (met * weights).sum())
        return scaled

    def _check_options(self) -> None:
        if self.n_words < 1 or self.sample < 1 or not self.consistency >= 0:
            message = (
                f"n_words and sample must be 1 or more and consistency not negative, got n_words={self.n_words}, "
                f"sample={self.sample}, consistency={self.consistency}"
            )
            raise InputError(message)


def _tables(X: Iterable[ArrayLike], width: int | None) -> Iterator[Floats32]:
    for number, given in enumerate(X):
        try:
            table = np.asarray(given, dtype=np.float32)
        except (TypeError, ValueError) as error:
            message = f"descriptors of picture {number} are not numbers: {error}"
            raise InputError(message) from error
        if table.ndim != 2 or (width is not None and table.shape[1] != width):
            message = (
                f"descriptors of picture {number} must have shape (n, {width or 'd'}), got {table.shape}"
            )
            raise InputError(message)
        bad = np.flatnonzero(~np.isfinite(table).all(axis=1))
        if bad.size:
            message = (
                f"picture {number}: {bad.size} descriptors are not finite, first at {first_indices(bad)}"
            )
            raise InputError(message)
        width = table.shape[1]
        yield table


def _flagged(
    X: Iterable[ArrayLike], consistent: Sequence[ArrayLike] | None
) -> Iterator[tuple[Floats32, BoolArray]]:
    """Yield each picture's descriptors with what says which were found again; all of them where nothing does."""
    for number, table in enumerate(_tables(X, None)):
        if consistent is None:
            yield table, np.ones(len(table), dtype=bool)
            continue
        flags = np.asarray(consistent[number]) != 0
        if flags.shape != (len(table),):
            message = (
                f"consistent must have one flag a descriptor: picture {number} has {len(table)} descriptors and "
                f"flags of shape {flags.shape}"
            )
            raise InputError(message)
        yield table, flags


def _sampled(flagged: Iterable[tuple[Floats32, BoolArray]], most: int, rng: np.random.Generator) -> Floats32:
    """Stack the flagged descriptors, or an even draw of them: those of the smallest random keys."""
    held: list[Floats32] = []
    keys: list[FloatArray] = []
    waiting = 0
    for table, flags in flagged:
        held.append(table[flags])
        keys.append(rng.random(len(held[-1])))
        waiting += len(held[-1])
        if waiting > 2 * most:
            held, keys, waiting = _trimmed(held, keys, most)
    held, _, _ = _trimmed(held, keys, most)
    return held[0]


def _trimmed(
    held: list[Floats32], keys: list[FloatArray], most: int
) -> tuple[list[Floats32], list[FloatArray], int]:
    rows = np.concatenate(held) if held else np.zeros((0, 1), dtype=np.float32)
    order = np.concatenate([np.zeros(0), *keys])
    if len(rows) > most:
        chosen = np.sort(np.argpartition(order, most - 1)[:most])
        rows, order = rows[chosen], order[chosen]
    return [rows], [order], len(rows)


def _clustered(descriptors: Floats32, n_words: int, seed: int) -> Floats32:
    different = len(np.unique(descriptors, axis=0)) if len(descriptors) < 20 * n_words else n_words
    if different < n_words:
        message = (
            f"{different} different descriptors make {different} words, not {n_words}; use more pictures or "
            "fewer words"
        )
        warnings.warn(message, PliantWarning, stacklevel=3)
    clusters = MiniBatchKMeans(
        min(n_words, different), batch_size=_BATCH, n_init=1, max_iter=20, random_state=seed
    )
    return np.asarray(clusters.fit(descriptors).cluster_centers_, dtype=np.float32)
