"""The left ventricle as an implicit function, point by point.

Heart frame, in mm: x towards the septum, y towards the anterior wall, z towards the base; z = 0 is the basal plane.
The wall without trabeculae is an ellipsoid below its widest level and a blunter one above it.
"""

from __future__ import annotations

import numpy as np

from .._arrays import FloatArray
from .._kernels import inlined_kernel, kernel

# Ridges fall below a ten-thousandth of their height this many widths, or lengths, from their middle line.
_REACH_ACROSS, _REACH_ALONG = 4.3, 1.75


@kernel
def wall_distance(x: float, y: float, z: float, wall: FloatArray) -> tuple[float, float]:
    """Return (first-order signed distance to the smooth wall, level q): negative inside, q = 1 on the wall.

    ``wall``: semi-axes a, b, semi-axis below and above the widest level, height of that level.
    """
    a, b, below, above, level = wall[0], wall[1], wall[2], wall[3], wall[4]
    c = below if z < level else above
    u, v, t = x / a, y / b, (z - level) / c
    q = np.sqrt(u * u + v * v + t * t)
    if q < 1e-9:
        return -min(a, b), q
    slope = np.sqrt((u / a) ** 2 + (v / b) ** 2 + (t / c) ** 2) / q
    return (q - 1.0) / slope, q


@kernel
def ridge_height(x: float, y: float, z: float, ridges: FloatArray) -> float:
    """Return how far trabeculae stand out at a point of the smooth wall, in mm.

    A row of ``ridges``: middle (3), unit vector across (3), along (3), height, width (Gaussian sigma), length.
    """
    total = 0.0
    for i in range(ridges.shape[0]):
        dx, dy, dz = x - ridges[i, 0], y - ridges[i, 1], z - ridges[i, 2]
        width, length = ridges[i, 10], ridges[i, 11]
        along = dx * ridges[i, 6] + dy * ridges[i, 7] + dz * ridges[i, 8]
        if abs(along) > _REACH_ALONG * length:
            continue
        across = dx * ridges[i, 3] + dy * ridges[i, 4] + dz * ridges[i, 5]
        if abs(across) > _REACH_ACROSS * width or dx * dx + dy * dy + dz * dz > 4 * length * length:
            continue
        p = (along / length) ** 2
        height = ridges[i, 9] * np.exp(-0.5 * (across / width) ** 2 - p * p)
        square = height * height
        total += square * square
    # The fourth-power mean lets strands cross without piling up.
    return float(np.sqrt(np.sqrt(total)))


@kernel
def cone_distance(x: float, y: float, z: float, cone: FloatArray) -> float:
    """Return the signed distance to a capsule whose radius changes linearly: ends (3), (3), radii."""
    ax, ay, az = cone[3] - cone[0], cone[4] - cone[1], cone[5] - cone[2]
    px, py, pz = x - cone[0], y - cone[1], z - cone[2]
    t = (px * ax + py * ay + pz * az) / (ax * ax + ay * ay + az * az)
    t = min(1.0, max(0.0, t))
    dx, dy, dz = px - t * ax, py - t * ay, pz - t * az
    return float(np.sqrt(dx * dx + dy * dy + dz * dz) - (cone[6] + t * (cone[7] - cone[6])))


@inlined_kernel
def _smooth_maximum(a: float, b: float, width: float) -> float:
    k = max(width - abs(a - b), 0.0)
    return max(a, b) + k * k / (4.0 * width)


@kernel
def blood_distance(
    x: float, y: float, z: float, wall: FloatArray, ridges: FloatArray, muscles: FloatArray, offset: float
) -> float:
    """Return the implicit function of the blood pool: negative in blood, its unit about a mm near the surface."""
    smooth, q = wall_distance(x, y, z, wall)
    value = smooth - offset
    if q > 0.3 and value > -9.0 and value < 6.0:
        level = wall[4]
        value += ridge_height(x / q, y / q, level + (z - level) / q, ridges)
    for i in range(muscles.shape[0]):
        value = _smooth_maximum(value, -cone_distance(x, y, z, muscles[i]), 2.0)
    return value


@kernel
def blood_distances(
    points: FloatArray, wall: FloatArray, ridges: FloatArray, muscles: FloatArray, offset: float
) -> FloatArray:
    """Return :func:`blood_distance` at (n, 3) points."""
    values = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        values[i] = blood_distance(points[i, 0], points[i, 1], points[i, 2], wall, ridges, muscles, offset)
    return values
