"""A metric for any signature, learned without labels from perturbed copies of the shape itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, TransformerMixin

from .._arrays import FloatArray, IntArray, as_floats
from ..errors import InputError, first_indices
from ..mesh import Mesh
from ..mesh.perturb import Kind, perturbed

__all__ = ["Whitener", "perturbed_differences"]

# What a signature should not see, at moderate strength.
_DEFAULT_KINDS: tuple[Kind, ...] = ("isometry", "noise", "sampling")
_Pair: TypeAlias = tuple[ArrayLike, ArrayLike, ArrayLike]


class Whitener(TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Scale a signature so that what should not matter has unit variance in every direction.

    Differences between signatures of the same point, on two versions of a shape, are noise. Their second
    moment C is learned; ``transform`` multiplies by ``C^(-1/2)``, after which L2 is the Mahalanobis distance
    of that noise.

    Parameters
    ----------
    shrinkage : float
        Share of the average variance mixed into C, in [0, 1]: ``(1 - s) C + s tr(C) / d``. At 0 directions
        that never varied would count without limit; at 1 nothing but the scale changes.

    Attributes
    ----------
    matrix_ : (d, d) array of float
        What signatures are multiplied by; symmetric.
    n_features_in_ : int
        Width d of the signature.

    Notes
    -----
    Cost: N d^2 + d^3. With fewer differences than dimensions only shrinkage keeps it sane: raise it.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> noise = rng.normal(size=(500, 2)) * [10.0, 0.1]
    >>> white = Whitener(shrinkage=0.0).fit(noise).transform(noise)
    >>> (white**2).mean(axis=0).round(6)
    array([1., 1.])
    """

    def __init__(self, shrinkage: float = 1e-3) -> None:
        self.shrinkage = shrinkage

    def fit(self, X: ArrayLike | Sequence[_Pair], y: object = None) -> Self:
        """Learn from differences, or from pairs of signatures with their correspondence.

        Parameters
        ----------
        X : (N, d) array_like of float, or list of (a, b, correspondence)
            Differences; or for each pair the (n_a, d) signature of one version, the (n_b, d) of another, and for
            each row of b the row of a that is the same point (-1 where there is none).
        y : None
            Not used.

        Raises
        ------
        InputError
            If shapes do not fit, a value is not finite, there is no difference, or they are all 0.
        """
        if not 0 <= self.shrinkage <= 1:
            message = f"shrinkage must be in [0, 1], got {self.shrinkage}"
            raise InputError(message)
        differences = _stacked(X)
        moment = differences.T @ differences / len(differences)
        level = float(np.trace(moment)) / len(moment)
        if not level > 0:
            raise InputError("all differences are 0: there is nothing to whiten")
        values, vectors = np.linalg.eigh(
            (1 - self.shrinkage) * moment + self.shrinkage * level * np.eye(len(moment))
        )
        # Rounding must not turn a direction without noise into one that outweighs all.
        values = np.maximum(values, 1e-14 * values[-1])
        self.matrix_ = (vectors / np.sqrt(values)) @ vectors.T
        self.n_features_in_ = len(moment)
        return self

    def transform(self, X: ArrayLike) -> FloatArray:
        """Return signatures, (n, d), in the learned metric.

        Raises
        ------
        InputError
            If it is not fitted or the width differs.
        """
        if not hasattr(self, "matrix_"):
            raise InputError("this Whitener is not fitted yet: call fit first")
        table = as_floats(X, "X")
        if table.ndim != 2 or table.shape[1] != self.n_features_in_:
            message = f"X must have {self.n_features_in_} columns as in fit, got shape {table.shape}"
            raise InputError(message)
        white: FloatArray = table @ self.matrix_
        return white


def perturbed_differences(
    mesh: Mesh,
    describe: Callable[[Mesh], ArrayLike],
    *,
    kinds: Sequence[Kind] = _DEFAULT_KINDS,
    strength: int = 2,
    rng: np.random.Generator | int = 0,
) -> FloatArray:
    """Return differences between a shape's signature and those of perturbed copies of it.

    Parameters
    ----------
    mesh : Mesh
    describe : callable
        Takes a mesh and returns its (n, d) signature.
    kinds : sequence of str
        Perturbations, as :func:`pliant.mesh.perturb.perturbed` knows them: pose, noise and sampling by
        default.
    strength : int
        1 to 5.
    rng : int or numpy.random.Generator
        Seed; the same one gives the same bytes.

    Returns
    -------
    (N, d) array of float
        What :meth:`Whitener.fit` takes: a row for every vertex of every copy.

    Raises
    ------
    InputError
        If no kind is given or a signature has the wrong number of rows.

    Notes
    -----
    Cost: one ``describe`` more than there are kinds.

    Examples
    --------
    >>> from pliant import eigenbasis, hks, shapes
    >>> def describe(mesh):
    ...     return np.log(hks(eigenbasis(mesh, 20), n_times=8))
    >>> ball = shapes.ellipsoid([1, 1.5, 2], 2)
    >>> perturbed_differences(ball, describe, kinds=["noise"]).shape
    (162, 8)
    """
    if not kinds:
        raise InputError("perturbed_differences needs at least one kind of perturbation")
    generator = np.random.default_rng(rng)
    original = _described(mesh, describe)
    rows = []
    for kind in kinds:
        copy = perturbed(mesh, kind, strength=strength, rng=generator)
        rows.append(_described(copy.mesh, describe) - original[copy.source])
    return np.concatenate(rows)


def _described(mesh: Mesh, describe: Callable[[Mesh], ArrayLike]) -> FloatArray:
    signature = as_floats(describe(mesh), "signature")
    if signature.ndim != 2 or len(signature) != mesh.n_vertices:
        message = f"describe must return {mesh.n_vertices} rows, one a vertex; got shape {signature.shape}"
        raise InputError(message)
    return signature


def _stacked(X: ArrayLike | Sequence[_Pair]) -> FloatArray:
    if isinstance(X, (list, tuple)) and len(X) and isinstance(X[0], tuple) and len(X[0]) == 3:
        differences = np.concatenate([_difference(*pair) for pair in X])
    else:
        differences = as_floats(X, "X")  # type: ignore[arg-type]
    if differences.ndim != 2 or not differences.size:
        message = f"differences must be (N, d) with one row or more, got shape {differences.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(differences).all(axis=1))
    if bad.size:
        message = f"differences: {bad.size} rows are not finite, first {first_indices(bad)}"
        raise InputError(message)
    return differences


def _difference(a: ArrayLike, b: ArrayLike, correspondence: ArrayLike) -> FloatArray:
    first, second = as_floats(a, "a"), as_floats(b, "b")
    same: IntArray = np.asarray(correspondence)
    if first.ndim != 2 or second.ndim != 2 or first.shape[1] != second.shape[1]:
        message = f"a and b must be (n, d) of one width, got {first.shape} and {second.shape}"
        raise InputError(message)
    fits = same.shape == (len(second),) and np.issubdtype(same.dtype, np.integer)
    if not fits or not ((same >= -1) & (same < len(first))).all():
        message = f"correspondence must name a row of a, or -1, for each of {len(second)} rows of b"
        raise InputError(message)
    known = same >= 0
    difference: FloatArray = second[known] - first[same[known]]
    return difference
