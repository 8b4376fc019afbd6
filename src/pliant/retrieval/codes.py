"""Binary codes learned without labels: random hyperplanes, iterative quantisation, spectral hashing."""

from __future__ import annotations

from typing import Self

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray
from ..errors import InputError
from ._coder import Coder, LinearCoder, principal_axes

__all__ = ["IterativeQuantization", "LocalitySensitiveHashing", "SpectralHashing"]


class LocalitySensitiveHashing(LinearCoder):
    """Sides of random hyperplanes through the mean (Charikar 2002).

    Parameters
    ----------
    bits : int
        Length of the codes, a multiple of 8. There is no upper limit.
    rng : int or Generator
        Seed of the planes.

    Attributes
    ----------
    weights_ : (d, bits) array of float
        Normals of the planes.
    offsets_ : (bits,) array of float

    Notes
    -----
    The share of bits in which two codes differ estimates the angle between the rows, seen from the mean, over pi.

    Examples
    --------
    >>> X = np.random.default_rng(0).normal(size=(100, 5))
    >>> LocalitySensitiveHashing(bits=64).fit(X).transform(X).shape
    (100, 8)
    """

    def __init__(self, bits: int = 128, *, rng: int | np.random.Generator = 0) -> None:
        self.bits = bits
        self.rng = rng

    def fit(self, X: ArrayLike, y: object = None) -> Self:
        """Draw the planes; of (n, d) X only the mean is used, of y nothing.

        Raises
        ------
        InputError
            If X cannot be used or bits is not a multiple of 8.
        """
        table = self._checked(X)
        normals = np.random.default_rng(self.rng).normal(size=(table.shape[1], self.bits))
        self._set_planes(table.mean(axis=0), normals)
        return self


class IterativeQuantization(LinearCoder):
    """Principal components, turned so that their signs lose least (ITQ; Gong & Lazebnik 2011).

    Parameters
    ----------
    bits : int
        Length of the codes, a multiple of 8. Where the data span fewer dimensions r, the rotation is replaced by an
        r x bits matrix with orthonormal rows, fitted in the same way.
    rounds : int
        Alternations of signs and rotation.
    rng : int or Generator
        Seed of the first rotation.

    Attributes
    ----------
    weights_ : (d, bits) array of float
    offsets_ : (bits,) array of float

    Notes
    -----
    Cost: one SVD of (n, d), then ``rounds`` products of (n, bits) with (bits, bits). Same objective and update as
    ``faiss.ITQTransform``, which refuses bits beyond d.

    Examples
    --------
    >>> X = np.random.default_rng(0).normal(size=(100, 20))
    >>> IterativeQuantization(bits=16).fit(X).transform(X).shape
    (100, 2)
    """

    def __init__(self, bits: int = 128, *, rounds: int = 50, rng: int | np.random.Generator = 0) -> None:
        self.bits = bits
        self.rounds = rounds
        self.rng = rng

    def fit(self, X: ArrayLike, y: object = None) -> Self:
        """Learn from (n, d) X; y is not used.

        Raises
        ------
        InputError
            If X cannot be used or an option is out of range.
        """
        table = self._checked(X)
        mean, axes = principal_axes(table, self.bits)
        turn = quantising_rotation((table - mean) @ axes, self.bits, self.rounds, self.rng)
        self._set_planes(mean, axes @ turn)
        return self


def quantising_rotation(
    scores: FloatArray, bits: int, rounds: int, rng: int | np.random.Generator
) -> FloatArray:
    """Return the (r, bits) matrix R with orthonormal rows that brings ``scores @ R`` near its signs.

    Alternates B = sign(V R) and the R that minimises |B - V R| (orthogonal Procrustes).
    """
    if rounds < 1:
        message = f"rounds must be 1 or more, got {rounds}"
        raise InputError(message)
    start = np.random.default_rng(rng).normal(size=(bits, scores.shape[1]))
    turn = np.linalg.qr(start)[0].T
    for _ in range(rounds):
        signs = np.where(scores @ turn > 0, 1.0, -1.0)
        left, _, right = scipy.linalg.svd(scores.T @ signs, full_matrices=False)
        turn = left @ right
    return turn


class SpectralHashing(Coder):
    """Signs of the eigenfunctions of a box around the principal components (Weiss, Torralba & Fergus 2008).

    Parameters
    ----------
    bits : int
        Length of the codes, a multiple of 8. Principal axes taken: at most as many.

    Attributes
    ----------
    mean_ : (d,) array of float
    axes_ : (d, r) array of float
        Principal axes.
    lower_ : (r,) array of float
        Lower end of the box along each.
    frequencies_ : (bits,) array of float
        Half-waves of each bit per unit of length, times pi.
    axis_of_bit_ : (bits,) array of int

    Notes
    -----
    Bits go to the eigenfunctions of smallest eigenvalue, (modes / side)^2, over all axes. Cost: one SVD of (n, d).

    Examples
    --------
    >>> X = np.random.default_rng(0).normal(size=(100, 20)) * np.linspace(1, 5, 20)
    >>> SpectralHashing(bits=32).fit(X).transform(X).shape
    (100, 4)
    """

    _state = ("mean_", "axes_", "lower_", "frequencies_", "axis_of_bit_")

    def __init__(self, bits: int = 128) -> None:
        self.bits = bits

    def fit(self, X: ArrayLike, y: object = None) -> Self:
        """Learn from (n, d) X; y is not used.

        Raises
        ------
        InputError
            If X cannot be used or bits is not a multiple of 8.
        """
        table = self._checked(X)
        self.mean_, self.axes_ = principal_axes(table, self.bits)
        scores = (table - self.mean_) @ self.axes_
        self.lower_ = scores.min(axis=0)
        sides = np.ptp(scores, axis=0)
        frequencies = np.arange(1, self.bits + 1)[:, None] / sides
        lowest = np.argsort(frequencies, axis=None, kind="stable")[: self.bits]
        self.frequencies_ = np.pi * frequencies.ravel()[lowest]
        self.axis_of_bit_ = lowest % len(sides)
        return self

    def _bits(self, table: FloatArray) -> BoolArray:
        along = ((table - self.mean_) @ self.axes_ - self.lower_)[:, self.axis_of_bit_]
        waves: BoolArray = np.cos(self.frequencies_ * along) > 0
        return waves
