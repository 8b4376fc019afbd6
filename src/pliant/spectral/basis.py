"""The eigenbasis of a Laplacian: choice of solver, checks, order and signs."""

from __future__ import annotations

import os
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray
from ..errors import InputError, NumericalError
from ..mesh import Mesh
from ._plain import arpack_pairs, dense_pairs
from ._sparse import CsrArray, product
from .laplacian import Laplacian, LaplacianKind, laplacian
from .spectrum import Spectrum

__all__ = ["eigenbasis"]

PathLike: TypeAlias = "str | os.PathLike[str]"

# Up to here LAPACK on the full matrices is as fast as anything.
_DENSE = 500
# Entries this close to the largest one count as large: rounding must not choose between mirror images.
_TIE = 1e-6


def eigenbasis(
    surface: Mesh | Laplacian | ArrayLike,
    k: int = 200,
    *,
    kind: LaplacianKind = "cotan",
    tol: float = 1e-8,
    cache: PathLike | None = None,
) -> Spectrum:
    """Compute the first k eigenpairs of the Laplace-Beltrami operator."""
    operator = surface if isinstance(surface, Laplacian) else laplacian(surface, kind)
    n = operator.n_vertices
    if not 1 <= k < n:
        message = f"k must be 1..{n - 1}, fewer than the {n} vertices; got {k}"
        raise InputError(message)
    stiffness, mass = operator.stiffness, operator.mass
    pieces, labels = operator.components()
    kernel = _indicators(labels, pieces, mass)
    if k <= pieces:
        vectors = kernel[:, :k]
        return _spectrum(operator, np.zeros(k), vectors)
    if n <= _DENSE or 2 * k > n:
        values, vectors = dense_pairs(stiffness, mass, k)
    else:
        shift = -0.01 * 4 * np.pi / operator.area
        values, vectors = arpack_pairs(stiffness, mass, k, shift=shift, tol=0)
    values = np.concatenate([np.zeros(pieces), values[pieces:]])
    vectors = np.hstack([kernel, vectors[:, pieces:]])
    spectrum = _spectrum(operator, values, vectors)
    worst = float(spectrum.residuals.max())
    if worst > tol:
        message = f"eigenpairs reached a relative residual of {worst:.1e}, not {tol:.1e}; raise tol"
        raise NumericalError(message)
    return spectrum


def _indicators(labels: IntArray, pieces: int, mass: CsrArray) -> FloatArray:
    indicators = np.zeros((len(labels), pieces))
    indicators[np.arange(len(labels)), labels] = 1
    areas = np.einsum("ij,ij->j", indicators, product(mass, indicators))
    normalised: FloatArray = indicators / np.sqrt(areas)
    return normalised


def _spectrum(operator: Laplacian, values: FloatArray, vectors: FloatArray) -> Spectrum:
    vectors = vectors * _signs(vectors)
    weighted = product(operator.mass, vectors)
    gap = np.linalg.norm(product(operator.stiffness, vectors) - weighted * values, axis=0)
    positive = values[values > 0]
    scale = np.where(values > 0, values, positive[0] if positive.size else 1.0)
    residuals = gap / (scale * np.linalg.norm(weighted, axis=0))
    return Spectrum(values, vectors, operator.mass, residuals)


def _signs(vectors: FloatArray) -> FloatArray:
    """Return the sign of each column's first entry that is as large as any."""
    size = np.abs(vectors)
    first = np.argmax(size >= (1 - _TIE) * size.max(axis=0), axis=0)
    signs: FloatArray = np.where(vectors[first, np.arange(vectors.shape[1])] < 0, -1.0, 1.0)
    return signs
