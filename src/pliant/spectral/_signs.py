"""The sign rule of eigenvectors."""

from __future__ import annotations

import numpy as np

from .._arrays import FloatArray
from .._kernels import kernel

# Entries this close to the largest one count as large: rounding must not choose between mirror images.
_TIE = 1e-6


def fix_signs(vectors: FloatArray) -> None:
    """Make the first of each column's largest entries positive, in place, (n, k)."""
    largest = np.maximum(vectors.max(axis=0), -vectors.min(axis=0))
    _flip(vectors, (1 - _TIE) * largest)


@kernel
def _flip(vectors: FloatArray, large: FloatArray) -> None:
    n, k = vectors.shape
    signs = np.zeros(k)
    left = k
    for i in range(n):
        if left == 0:
            break
        for c in range(k):
            if signs[c] == 0 and abs(vectors[i, c]) >= large[c]:
                signs[c] = 1.0 if vectors[i, c] > 0 else -1.0
                left -= 1
    for i in range(n):
        for c in range(k):
            vectors[i, c] *= signs[c]
