"""Arrays of quaternions, real part first, and their real 4 x 4 blocks."""

from __future__ import annotations

import numpy as np

from .._arrays import FloatArray

__all__ = ["conjugate", "imaginary", "left_blocks", "product"]


def imaginary(vectors: FloatArray) -> FloatArray:
    """(..., 4) quaternions without a real part from (..., 3) vectors."""
    return np.concatenate([np.zeros((*vectors.shape[:-1], 1)), vectors], axis=-1)


def conjugate(q: FloatArray) -> FloatArray:
    """(..., 4) conjugates."""
    turned: FloatArray = q * np.array([1.0, -1.0, -1.0, -1.0])
    return turned


def product(p: FloatArray, q: FloatArray) -> FloatArray:
    """(..., 4) Hamilton products."""
    real = p[..., :1] * q[..., :1] - (p[..., 1:] * q[..., 1:]).sum(axis=-1, keepdims=True)
    vector = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([real, vector], axis=-1)


def left_blocks(q: FloatArray) -> FloatArray:
    """(..., 4, 4) matrices that multiply a quaternion from the left."""
    a, b, c, d = np.moveaxis(q, -1, 0)
    rows = [[a, -b, -c, -d], [b, a, -d, c], [c, d, a, -b], [d, -c, b, a]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
