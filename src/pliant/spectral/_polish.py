"""Inverse iteration on the pairs a shifted solver leaves short of the tolerance."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from .._arrays import FloatArray
from ._factor import LANES, Pencil
from ._panels import Panels
from ._sparse import product
from .laplacian import Laplacian

_ROUNDS = 2


def polish(
    operator: Laplacian, values: FloatArray, vectors: FloatArray, zeros: int, last: int, panels: Panels
) -> tuple[FloatArray, FloatArray]:
    """Improve the eigenpairs from the first positive one to number ``last``.

    Solves with L + s M, s small, which is positive definite: rounding does not grow, and errors in all
    directions of larger eigenvalue shrink. The low pairs of a large shift need it, for whom rounding at
    the scale of the shift is not small.

    Parameters
    ----------
    operator : Laplacian
    values : (k,) array of float
        Ascending; the first ``zeros`` are 0 and exact.
    vectors : (n, k) array of float
    zeros, last : int
    panels : Panels
    """
    pencil = Pencil(operator)
    factor = pencil.factor(-values[zeros])
    constants = vectors[:, :zeros]
    count = last + 1 - zeros
    block = vectors[:, zeros : last + 1]
    for _ in range(_ROUNDS):
        sides = np.zeros((pencil.n, -(-count // LANES) * LANES))
        sides[:, :count] = product(operator.mass, block)[pencil.order]
        factor.solve(sides, panels)
        block = np.empty_like(block)
        block[pencil.order] = sides[:, :count]
        block -= constants @ (constants.T @ product(operator.mass, block))
        energy = block.T @ product(operator.stiffness, block)
        gram = block.T @ product(operator.mass, block)
        found, turn = scipy.linalg.eigh(0.5 * (energy + energy.T), 0.5 * (gram + gram.T))
        block = block @ turn
    # The higher vectors give way: their errors along low ones do not show in their own residuals.
    above = vectors[:, last + 1 :]
    above = above - block @ (block.T @ product(operator.mass, above))
    better = np.hstack([constants, block, above])
    return np.concatenate([values[:zeros], found, values[last + 1 :]]), better
