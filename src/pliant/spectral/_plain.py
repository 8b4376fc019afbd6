"""Eigenpairs by other people's solvers: LAPACK where dense is cheap, ARPACK where no factor is to be had."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy.sparse.linalg import ArpackError, eigsh

from .._arrays import FloatArray
from ..errors import NumericalError
from ._sparse import CsrArray, diagonal_matrix


def dense_pairs(stiffness: CsrArray, mass: CsrArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the first eigenvalues (count,) and mass-orthonormal eigenvectors (n, count)."""
    values, vectors = scipy.linalg.eigh(
        stiffness.toarray(), mass.toarray(), subset_by_index=(0, count - 1), check_finite=False
    )
    return values, vectors


def factorless_pairs(stiffness: CsrArray, mass: CsrArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the first eigenpairs by Lanczos on M^-1/2 L M^-1/2 as it is, without a factor; lumped mass only.

    The mesh Laplacian's spectrum piles up at 1/h, far from the smallest values, so that they are the easy end.
    """
    n = stiffness.shape[0]
    root = np.sqrt(mass.diagonal())
    scaling = diagonal_matrix(1 / root)
    scaled = scaling @ stiffness @ scaling
    start = np.random.default_rng(0).standard_normal(n)
    krylov = min(n - 1, 2 * count + 100)
    try:
        values, vectors = eigsh(scaled, count, which="SA", v0=start, ncv=krylov, tol=1e-13)
    except (ArpackError, RuntimeError) as error:
        message = f"the eigensolver failed on {n} vertices for {count} eigenpairs: {error}"
        raise NumericalError(message) from error
    order = np.argsort(values)
    return values[order], vectors[:, order] / root[:, None]
