"""Eigenpairs by other people's solvers: LAPACK where dense is cheap, ARPACK where no factor is to be had."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy.sparse.linalg import ArpackError, eigsh

from .._arrays import FloatArray
from ..errors import NumericalError
from ._sparse import CsrArray


def dense_pairs(stiffness: CsrArray, mass: CsrArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the first eigenvalues (count,) and mass-orthonormal eigenvectors (n, count)."""
    values, vectors = scipy.linalg.eigh(
        stiffness.toarray(), mass.toarray(), subset_by_index=(0, count - 1), check_finite=False
    )
    return values, vectors


def arpack_pairs(
    stiffness: CsrArray, mass: CsrArray, count: int, *, shift: float, tol: float
) -> tuple[FloatArray, FloatArray]:
    """Return the first eigenpairs by shift-invert Lanczos from a fixed start."""
    n = stiffness.shape[0]
    start = np.random.default_rng(0).standard_normal(n)
    try:
        values, vectors = eigsh(stiffness, count, mass, sigma=shift, v0=start, tol=tol)
    except (ArpackError, RuntimeError) as error:
        message = f"the eigensolver failed on {n} vertices for {count} eigenpairs: {error}"
        raise NumericalError(message) from error
    order = np.argsort(values)
    return values[order], vectors[:, order]
