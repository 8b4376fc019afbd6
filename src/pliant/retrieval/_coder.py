"""What all binary codes share: checks, packing, and state as plain arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin

from .._arrays import BoolArray, FloatArray, IntArray, as_floats
from ..errors import InputError, first_indices
from .bits import Codes, pack_bits

__all__ = ["Coder", "LinearCoder", "class_numbers", "principal_axes"]


class Coder(TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """A scikit-learn transformer from rows of numbers to packed binary codes.

    A kind of code states the names of its fitted arrays in ``_state`` and computes bits in ``_bits``.
    """

    #: Whether ``fit`` uses the classes, so that a drawing of a picture is one more example of its class.
    learns_from_labels: ClassVar[bool] = False
    _state: ClassVar[tuple[str, ...]] = ()
    bits: int

    def transform(self, X: ArrayLike) -> Codes:
        """Return the codes of rows.

        Parameters
        ----------
        X : (m, d) array_like of float
            As wide as in ``fit``.

        Returns
        -------
        (m, bits / 8) array of uint8
            Bit j of a code is bit ``j % 8``, counted from the lowest, of byte ``j // 8``.

        Raises
        ------
        InputError
            If it is not fitted, the width differs, or a value is not finite.
        """
        if not hasattr(self, self._state[0]):
            message = f"this {type(self).__name__} is not fitted yet: call fit first"
            raise InputError(message)
        table = finite_rows(X)
        if table.shape[1] != self.n_features_in_:
            message = f"X must have {self.n_features_in_} columns as in fit, got {table.shape[1]}"
            raise InputError(message)
        return pack_bits(self._bits(table))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return the fitted arrays by name, for a file."""
        return {name: np.asarray(getattr(self, name)) for name in (*self._state, "n_features_in_")}

    def with_state(self, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Take fitted arrays from :meth:`state`; the inverse of it."""
        missing = [name for name in (*self._state, "n_features_in_") if name not in arrays]
        if missing:
            message = f"{type(self).__name__} needs the arrays {', '.join(missing)}; the model is damaged"
            raise InputError(message)
        for name in self._state:
            setattr(self, name, np.asarray(arrays[name]))
        self.n_features_in_ = int(arrays["n_features_in_"])
        return self

    def _bits(self, table: FloatArray) -> BoolArray:
        raise NotImplementedError

    def _checked(self, X: ArrayLike) -> FloatArray:
        """Check what every ``fit`` is given."""
        if self.bits < 8 or self.bits % 8:
            message = f"bits must be a positive multiple of 8, got {self.bits}"
            raise InputError(message)
        table = finite_rows(X)
        if len(table) < 2 or np.all(table == table[0]):
            message = f"codes are learned from two rows or more that differ, got {len(table)}"
            raise InputError(message)
        self.n_features_in_ = table.shape[1]
        return table

    def _checked_with_labels(self, X: ArrayLike, y: ArrayLike | None) -> tuple[FloatArray, IntArray, int]:
        table = self._checked(X)
        classes, numbers = class_numbers(y, len(table))
        if len(classes) < 2:
            raise InputError("codes that separate classes need two classes or more, got 1")
        return table, numbers, len(classes)


class LinearCoder(Coder):
    """Codes whose bits are sides of hyperplanes: ``x @ weights_ + offsets_ > 0``."""

    _state = ("weights_", "offsets_")
    weights_: FloatArray
    offsets_: FloatArray

    def _bits(self, table: FloatArray) -> BoolArray:
        sides: BoolArray = table @ self.weights_ + self.offsets_ > 0
        return sides

    def _set_planes(self, mean: FloatArray, weights: FloatArray) -> None:
        self.weights_ = np.ascontiguousarray(weights)
        self.offsets_ = -mean @ self.weights_


def finite_rows(X: ArrayLike) -> FloatArray:
    """Coerce to (n, d) float64, finite."""
    table = as_floats(X, "X")
    if table.ndim != 2 or not table.shape[1]:
        message = f"X must have shape (n, d), got {table.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(table).all(axis=1))
    if bad.size:
        message = f"X: {bad.size} of {len(table)} rows are not finite, first at {first_indices(bad)}"
        raise InputError(message)
    return table


def class_numbers(y: ArrayLike | None, count: int) -> tuple[NDArray[Any], IntArray]:
    """Return the classes, sorted, and the number of each row's class."""
    if y is None:
        raise InputError("these codes are learned with labels: give y")
    labels = np.asarray(y)
    if labels.shape != (count,):
        message = f"y must have one label a row, shape ({count},), got {labels.shape}"
        raise InputError(message)
    classes, numbers = np.unique(labels, return_inverse=True)
    return classes, numbers.astype(np.int64)


def principal_axes(table: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the mean and up to ``count`` principal axes as columns, by falling variance, signs fixed.

    Axes along which nothing varies are left out.
    """
    mean = table.mean(axis=0)
    _, spread, axes = scipy.linalg.svd(table - mean, full_matrices=False)
    rank = int(np.count_nonzero(spread > 1e-10 * spread[0]))
    kept: FloatArray = axes[: min(count, rank)].T
    return mean, kept * np.where(kept[np.abs(kept).argmax(axis=0), np.arange(kept.shape[1])] < 0, -1.0, 1.0)
