"""Gaussian weights of the mesh Laplacian of Belkin, Sun & Wang 2008."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .._arrays import FloatArray
from ..errors import InputError
from ._sparse import CsrArray, as_csr, diagonal_matrix, row_sums, symmetric_matrix

# Weights under this share of a vertex's own are dropped: what they add up to is 1e-4 of the whole.
_NEGLIGIBLE = 1e-5
# Past this many entries the matrix takes more than 4 GB.
_MOST_ENTRIES = 250_000_000


def belkin_stiffness(points: FloatArray, areas: FloatArray, bandwidth: float) -> CsrArray:
    """Return D - W with W_ij = a_i a_j exp(-|p_i - p_j|^2 / 4h) / (4 pi h^2), (n, n).

    Parameters
    ----------
    points : (n, 3) array of float
    areas : (n,) array of float
    bandwidth : float
        h, a squared length.
    """
    n = len(points)
    reach = float(np.sqrt(-4 * bandwidth * np.log(_NEGLIGIBLE)))
    tree = cKDTree(points)
    expected = int(tree.query_ball_point(points[:: max(1, n // 200)], reach, return_length=True).mean() * n)
    if expected > _MOST_ENTRIES:
        message = (
            f"bandwidth {bandwidth:.3g} reaches {expected // n} vertices from each of {n}, "
            f"{expected:.2g} entries in all; choose a smaller one"
        )
        raise InputError(message)
    pairs = tree.query_pairs(reach, output_type="ndarray")
    i, j = pairs[:, 0], pairs[:, 1]
    squared = np.einsum("ij,ij->i", points[i] - points[j], points[i] - points[j])
    scale = 1 / (4 * np.pi * bandwidth**2)
    weights = scale * areas[i] * areas[j] * np.exp(-squared / (4 * bandwidth))
    both = symmetric_matrix(i, j, weights, n)
    return as_csr(diagonal_matrix(row_sums(both)) - both)
