"""Binary codes learned with labels, to compare with: canonical correlation with ITQ, and a classifier's answer."""

from __future__ import annotations

from typing import Literal, Self, TypeAlias, get_args

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, IntArray
from ..errors import InputError
from ._coder import Coder, LinearCoder, principal_axes
from ._planes import PlaneTrainer
from .codes import quantising_rotation

__all__ = ["CCAIterativeQuantization", "ClassifierCodes"]

Extension: TypeAlias = Literal["frame", "pca"]


class CCAIterativeQuantization(LinearCoder):
    """Directions most correlated with the labels, turned so that their signs lose least (Gong & Lazebnik 2011).

    Canonical correlation analysis between the rows and their classes (one indicator a class) has at most C - 1
    directions. Longer codes need an extension, which the paper does not give.

    Parameters
    ----------
    bits : int
        Length of the codes, a multiple of 8.
    regularisation : float
        Added to the covariance of the rows, times its mean diagonal.
    extension : {"frame", "pca"}
        Past the C - 1 directions. "frame": the rotation becomes a (C - 1) x bits matrix with orthonormal rows, fitted
        in the same way, so that every bit is learned with labels. "pca": principal components of what the
        directions leave of the rows are added, each as long as the shortest direction.
    rounds : int
        Alternations of signs and rotation.
    rng : int or Generator
        Seed of the first rotation.

    Attributes
    ----------
    weights_ : (d, bits) array of float
    offsets_ : (bits,) array of float
    correlations_ : (r,) array of float
        Canonical correlations, falling.

    Notes
    -----
    Directions are weighted with their correlation, as the authors' program does. Cost: d^3 + n d^2.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> y = np.repeat([0, 1, 2], 20)
    >>> X = rng.normal(size=(3, 8))[y] + rng.normal(size=(60, 8))
    >>> CCAIterativeQuantization(bits=16).fit(X, y).transform(X).shape
    (60, 2)
    """

    learns_from_labels = True

    def __init__(
        self,
        bits: int = 128,
        *,
        regularisation: float = 2.0,
        extension: Extension = "frame",
        rounds: int = 50,
        rng: int | np.random.Generator = 0,
    ) -> None:
        self.bits = bits
        self.regularisation = regularisation
        self.extension = extension
        self.rounds = rounds
        self.rng = rng

    def fit(self, X: ArrayLike, y: ArrayLike | None = None) -> Self:
        """Learn from (n, d) X and the class of each row, (n,) y.

        Raises
        ------
        InputError
            If X or y cannot be used, there is one class only, or an option is out of range.
        """
        if not self.regularisation > 0 or self.extension not in get_args(Extension):
            message = (
                f"regularisation must be positive and extension one of {', '.join(get_args(Extension))}, got "
                f"{self.regularisation} and {self.extension!r}"
            )
            raise InputError(message)
        table, classes, n_classes = self._checked_with_labels(X, y)
        mean = table.mean(axis=0)
        rows = table - mean
        directions, self.correlations_ = _canonical(rows, classes, n_classes, self.regularisation)
        directions = directions[:, : self.bits]
        if self.extension == "pca" and directions.shape[1] < self.bits:
            directions = _extended(rows, directions, self.bits)
        turn = quantising_rotation(rows @ directions, self.bits, self.rounds, self.rng)
        self._set_planes(mean, directions @ turn)
        return self


def _canonical(
    rows: FloatArray, classes: IntArray, n_classes: int, regularisation: float
) -> tuple[FloatArray, FloatArray]:
    """Return directions (d, r), each weighted with its correlation, and the correlations."""
    count, width = rows.shape
    sizes = np.bincount(classes, minlength=n_classes)
    means = np.zeros((n_classes, width))
    np.add.at(means, classes, rows)
    # Covariance of the rows with indicators of the classes, these brought to unit covariance (up to their mean).
    cross = (means / np.sqrt(sizes)[:, None]).T / np.sqrt(count)
    covariance = rows.T @ rows / count
    level = regularisation * float(np.trace(covariance)) / width
    solved = scipy.linalg.solve(covariance + level * np.eye(width), cross, assume_a="pos")
    squares, mixes = scipy.linalg.eigh(cross.T @ solved)
    order = np.argsort(-squares, kind="stable")
    kept = order[squares[order] > 1e-10 * squares[order[0]]][: n_classes - 1]
    correlations = np.sqrt(squares[kept])
    mixes = mixes[:, kept] * np.where(mixes[np.abs(mixes[:, kept]).argmax(axis=0), kept] < 0, -1.0, 1.0)
    # solved @ mix / correlation has unit (regularised) variance; the weight cancels the division.
    return solved @ mixes, correlations


def _extended(rows: FloatArray, directions: FloatArray, bits: int) -> FloatArray:
    scores = rows @ directions
    fitted, *_ = scipy.linalg.lstsq(scores, rows)
    rest = rows - scores @ fitted
    if not np.any(np.abs(rest) > 1e-10 * np.abs(rows).max()):
        return directions
    _, axes = principal_axes(rest, bits - directions.shape[1])
    least = float(scores.std(axis=0).min())
    added = axes - directions @ (fitted @ axes)
    spread = (rows @ added).std(axis=0)
    return np.column_stack([directions, added * (least / spread)])


class ClassifierCodes(Coder):
    """The answer of a linear classifier as a code: one random codeword a class.

    Rows said to be of one class get one code, so distances rank classes and nothing inside or beyond them. What a
    method of codes does not do better than this, a classifier does (Sablayrolles et al. 2017).

    Parameters
    ----------
    bits : int
        Length of the codes, a multiple of 8.
    cost : float
        Weight of the losses of the SVMs, one a class against the rest, for rows of mean square length 1.
    rng : int or Generator
        Seed of the codewords and of the order in which rows are visited.

    Attributes
    ----------
    weights_ : (d, C) array of float
    offsets_ : (C,) array of float
    codewords_ : (C, bits) array of bool
        All different.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> y = np.repeat([0, 1, 2], 20)
    >>> X = 3 * rng.normal(size=(3, 8))[y] + rng.normal(size=(60, 8))
    >>> len(np.unique(ClassifierCodes(bits=16).fit(X, y).transform(X), axis=0))
    3
    """

    learns_from_labels = True
    _state = ("weights_", "offsets_", "codewords_")

    def __init__(self, bits: int = 128, *, cost: float = 1.0, rng: int | np.random.Generator = 0) -> None:
        self.bits = bits
        self.cost = cost
        self.rng = rng

    def fit(self, X: ArrayLike, y: ArrayLike | None = None) -> Self:
        """Learn from (n, d) X and the class of each row, (n,) y.

        Raises
        ------
        InputError
            If X or y cannot be used, there is one class only, there are too few bits to tell the classes apart, or
            cost is not positive.
        """
        if not self.cost > 0:
            message = f"cost must be positive, got {self.cost}"
            raise InputError(message)
        table, classes, n_classes = self._checked_with_labels(X, y)
        generator = np.random.default_rng(self.rng)
        self.codewords_ = _codewords(n_classes, self.bits, generator)
        trainer = PlaneTrainer(table, self.cost, generator)
        trainer.fit(np.where(classes[:, None] == np.arange(n_classes), 1.0, -1.0))
        self.weights_, self.offsets_ = trainer.in_input_units()
        return self

    def _bits(self, table: FloatArray) -> BoolArray:
        chosen: BoolArray = self.codewords_[(table @ self.weights_ + self.offsets_).argmax(axis=1)]
        return chosen


def _codewords(n_classes: int, bits: int, rng: np.random.Generator) -> BoolArray:
    """Draw a codeword a class, all different."""
    if bits < 63 and n_classes > 2**bits:
        message = (
            f"{bits} bits are too few for {n_classes} classes; {8 * -(-n_classes.bit_length() // 8)} will do"
        )
        raise InputError(message)
    words = rng.random((n_classes, bits)) < 0.5
    while len(np.unique(words, axis=0)) < n_classes:
        _, first = np.unique(words, axis=0, return_index=True)
        again = np.setdiff1d(np.arange(n_classes), first)
        words[again] = rng.random((len(again), bits)) < 0.5
    return words
