"""A chest of simple bodies around an analytic ventricle, painted voxel by voxel into CT numbers."""

from __future__ import annotations

import numpy as np

from .._arrays import BoolArray, FloatArray
from .._kernels import kernel
from ._ventricle_kernels import blood_distance, cone_distance, wall_distance

# What is behind everything, HU. Kinds of body; the first three columns of a row are kind, HU, unevenness.
_LUNG = -830.0
HALF_SPACE, CONE, ELLIPSOID, MUSCLE, RIGHT_BLOOD, LEFT_BLOOD = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0


@kernel
def _ellipsoid(x: float, y: float, z: float, row: FloatArray) -> float:
    u, v, t = (x - row[0]) / row[3], (y - row[1]) / row[4], (z - row[2]) / row[5]
    q = np.sqrt(u * u + v * v + t * t)
    if q < 1e-9:
        return -float(min(row[3], row[4], row[5]))
    return float((q - 1.0) * q / np.sqrt((u / row[3]) ** 2 + (v / row[4]) ** 2 + (t / row[5]) ** 2))


@kernel
def _body_distance(
    kind: float,
    x: float,
    y: float,
    z: float,
    row: FloatArray,
    wall: FloatArray,
    ridges: FloatArray,
    muscles: FloatArray,
    offset: float,
) -> float:
    if kind == HALF_SPACE:
        return float(row[3] - (x * row[0] + y * row[1] + z * row[2]))
    if kind == CONE:
        return cone_distance(x, y, z, row)
    if kind == ELLIPSOID:
        return _ellipsoid(x, y, z, row)
    if kind == MUSCLE:
        # Thickness at the base and at the apex, and the height it ends at.
        thick = row[1] + (row[0] - row[1]) * min(1.0, max(0.0, 1 + z / 60.0))
        return float(max(wall_distance(x, y, z, wall)[0] - thick, z - row[2]))
    if kind == RIGHT_BLOOD:
        return float(max(_ellipsoid(x, y, z, row), row[6] - wall_distance(x, y, z, wall)[0], z - row[7]))
    return max(blood_distance(x, y, z, wall, ridges, muscles, offset), z)


@kernel
def _wave(x: float, y: float, z: float, waves: FloatArray) -> float:
    """Return a smooth function of unit variance."""
    total = 0.0
    for w in range(waves.shape[0]):
        total += np.cos(waves[w, 0] * x + waves[w, 1] * y + waves[w, 2] * z + waves[w, 3])
    return float(total / np.sqrt(0.5 * waves.shape[0]))


@kernel
def paint(
    values: FloatArray,
    left: BoolArray,
    right: BoolArray,
    first: int,
    last: int,
    affine: FloatArray,
    bodies: FloatArray,
    bounds: FloatArray,
    waves: FloatArray,
    wall: FloatArray,
    ridges: FloatArray,
    muscles: FloatArray,
    offset: float,
) -> None:
    """Paint bodies in order into the slabs first..last of a volume and mark both ventricles' blood.

    ``affine`` takes voxel indices to the heart frame. A voxel takes part of a body's value by how far its centre lies
    inside. ``bounds``: (b, 4) centres and squared radii of spheres around the bodies. ``waves``: (w, 4) wave vectors
    and phases of the unevenness.
    """
    width = np.sqrt(affine[0, 0] ** 2 + affine[1, 0] ** 2 + affine[2, 0] ** 2)
    for i in range(first, last):
        for j in range(values.shape[1]):
            for k in range(values.shape[2]):
                x = affine[0, 0] * i + affine[0, 1] * j + affine[0, 2] * k + affine[0, 3]
                y = affine[1, 0] * i + affine[1, 1] * j + affine[1, 2] * k + affine[1, 3]
                z = affine[2, 0] * i + affine[2, 1] * j + affine[2, 2] * k + affine[2, 3]
                value, clear = 0.0, 1.0
                # From the front to the back, as far as anything shows through.
                for b in range(bodies.shape[0] - 1, -1, -1):
                    dx, dy, dz = x - bounds[b, 0], y - bounds[b, 1], z - bounds[b, 2]
                    if dx * dx + dy * dy + dz * dz > bounds[b, 3]:
                        continue
                    kind = bodies[b, 0]
                    distance = _body_distance(kind, x, y, z, bodies[b, 3:], wall, ridges, muscles, offset)
                    if kind == LEFT_BLOOD:
                        left[i, j, k] = distance < 0
                    if kind == RIGHT_BLOOD and bodies[b, 2] > 0:
                        right[i, j, k] = distance < 0
                    part = min(1.0, max(0.0, 0.5 - distance / width))
                    if part == 0:
                        continue
                    shade = 1.0 if bodies[b, 2] == 0 else 1.0 + bodies[b, 2] * _wave(x, y, z, waves)
                    value += clear * part * bodies[b, 1] * shade
                    clear *= 1 - part
                    if clear < 1e-6:
                        break
                values[i, j, k] = value + clear * _LUNG
