"""The implicit surface of a figure: a smooth union of round cones, negative inside.

The field of one round cone is its signed distance (I. Quilez, "Distance functions"), the union is the cubic
polynomial minimum. A paired limb joins its mirror image first, by a minimum that does not care about
order: so the field is mirror-symmetric and smooth across the plane x = 0, and is only ever evaluated
at x >= 0. Every step keeps it 1-Lipschitz, which the polygoniser's search relies on.
"""

from __future__ import annotations

import math

import numpy as np

from ..._arrays import FloatArray
from ..._kernels import kernel
from ._body import Flesh

_FAR = 1e9
_PAIR_BLEND = 0.012
_DIFFERENCE = 1e-5


def field(points: FloatArray, flesh: Flesh) -> FloatArray:
    """Value of the field at points with x >= 0, (n, 3) -> (n,)."""
    values: FloatArray = _values(np.ascontiguousarray(points), flesh.solids, flesh.limbs)
    return values


def projected(points: FloatArray, flesh: Flesh, *, step: float, rounds: int = 1) -> FloatArray:
    """Move points to the zero level along the gradient, by Newton steps never longer than ``step``.

    Columns after the third are kept.
    """
    moved = points.copy()
    _project(moved, step, rounds, flesh.solids, flesh.limbs)
    return moved


def blob_distances(points: FloatArray, flesh: Flesh) -> FloatArray:
    """Value of every blob alone at every point, (n, 3) -> (n, blobs)."""
    values: FloatArray = _blob_values(np.ascontiguousarray(points), flesh.solids)
    return values


def local_radius(points: FloatArray, flesh: Flesh, *, softness: float) -> FloatArray:
    """Radius of the limb around each point, averaged over blobs no further than about ``softness``."""
    radii: FloatArray = _local_radii(np.ascontiguousarray(points), softness, flesh.solids)
    return radii


@kernel
def _round_cone(solids: FloatArray, i: int, x: float, y: float, z: float) -> float:
    x, y, z = x * solids[i, 8], y * solids[i, 9], z * solids[i, 10]
    ax, ay, az = solids[i, 0], solids[i, 1], solids[i, 2]
    bx, by, bz = solids[i, 3] - ax, solids[i, 4] - ay, solids[i, 5] - az
    px, py, pz = x - ax, y - ay, z - az
    r1, r2, depth = solids[i, 6], solids[i, 7], solids[i, 11]
    length2 = bx * bx + by * by + bz * bz
    drop = r1 - r2
    slope2 = length2 - drop * drop
    if slope2 <= 1e-12:
        if r1 >= r2:
            return float(depth * (math.sqrt(px * px + py * py + pz * pz) - r1))
        qx, qy, qz = px - bx, py - by, pz - bz
        return float(depth * (math.sqrt(qx * qx + qy * qy + qz * qz) - r2))
    inverse = 1.0 / length2
    along = px * bx + py * by + pz * bz
    beyond = along - length2
    cx, cy, cz = px * length2 - bx * along, py * length2 - by * along, pz * length2 - bz * along
    across2 = cx * cx + cy * cy + cz * cz
    along2, beyond2 = along * along * length2, beyond * beyond * length2
    turn = drop * abs(drop) * across2
    if math.copysign(slope2 * beyond2, beyond) > turn:
        return float(depth * (math.sqrt(across2 + beyond2) * inverse - r2))
    if math.copysign(slope2 * along2, along) < turn:
        return float(depth * (math.sqrt(across2 + along2) * inverse - r1))
    return float(depth * ((math.sqrt(across2 * slope2 * inverse) + along * drop) * inverse - r1))


@kernel
def _smooth_min(a: float, b: float, k: float) -> float:
    low = min(a, b)
    if k <= 0.0:
        return low
    overlap = 1.0 - abs(a - b) / k
    if overlap <= 0.0:
        return low
    return low - overlap * overlap * overlap * k / 6.0


@kernel
def _limb_value(solids: FloatArray, limbs: FloatArray, limb: int, x: float, y: float, z: float) -> float:
    value = _FAR
    for i in range(int(limbs[limb, 0]), int(limbs[limb, 1])):
        value = _smooth_min(value, _round_cone(solids, i, x, y, z), limbs[limb, 2])
    return value


@kernel
def _gap(limbs: FloatArray, limb: int, x: float, y: float, z: float) -> float:
    """Lower bound of a limb's field from the ball around it; blends lower the field a little."""
    dx, dy, dz = x - limbs[limb, 5], y - limbs[limb, 6], z - limbs[limb, 7]
    gap = math.sqrt(dx * dx + dy * dy + dz * dz) - limbs[limb, 8]
    return float(limbs[limb, 9] * gap - 2.0 * limbs[limb, 2])


@kernel
def _paired_value(solids: FloatArray, limbs: FloatArray, limb: int, x: float, y: float, z: float) -> float:
    one = _limb_value(solids, limbs, limb, x, y, z)
    if limbs[limb, 4] > 0.0 and _gap(limbs, limb, -x, y, z) < one + _PAIR_BLEND:
        one = _smooth_min(one, _limb_value(solids, limbs, limb, -x, y, z), _PAIR_BLEND)
    return one


@kernel
def _value(solids: FloatArray, limbs: FloatArray, x: float, y: float, z: float) -> float:
    nearest, least, widest = 0, _FAR, 0.0
    for limb in range(len(limbs)):
        gap = _gap(limbs, limb, x, y, z)
        widest = max(widest, limbs[limb, 3])
        if gap < least:
            nearest, least = limb, gap
    # No union exceeds one of its members: what is further than that by the widest blend is never felt.
    bound = _paired_value(solids, limbs, nearest, x, y, z)
    felt = bound + widest + _PAIR_BLEND
    total = _FAR
    for limb in range(len(limbs)):
        if limb == nearest:
            total = _smooth_min(total, bound, limbs[limb, 3])
        elif _gap(limbs, limb, x, y, z) <= felt:
            total = _smooth_min(total, _paired_value(solids, limbs, limb, x, y, z), limbs[limb, 3])
    return total


@kernel
def _values(points: FloatArray, solids: FloatArray, limbs: FloatArray) -> FloatArray:
    values = np.empty(len(points))
    for i in range(len(points)):
        values[i] = _value(solids, limbs, points[i, 0], points[i, 1], points[i, 2])
    return values


@kernel
def _project(points: FloatArray, step: float, rounds: int, solids: FloatArray, limbs: FloatArray) -> None:
    h = _DIFFERENCE
    for i in range(len(points)):
        for _ in range(rounds):
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            # Four corners of a tetrahedron give the value and the gradient to second order.
            f0 = _value(solids, limbs, x + h, y + h, z + h)
            f1 = _value(solids, limbs, x + h, y - h, z - h)
            f2 = _value(solids, limbs, x - h, y + h, z - h)
            f3 = _value(solids, limbs, x - h, y - h, z + h)
            # A vertex of the mirror plane stays on it.
            gx = 0.0 if x == 0.0 else (f0 + f1 - f2 - f3) / (4 * h)
            gy = (f0 - f1 + f2 - f3) / (4 * h)
            gz = (f0 - f1 - f2 + f3) / (4 * h)
            steep = max(gx * gx + gy * gy + gz * gz, 1e-3)
            t = -(f0 + f1 + f2 + f3) / (4 * steep)
            longest = abs(t) * math.sqrt(steep)
            if longest > step:
                t *= step / longest
            points[i, 0] += t * gx
            points[i, 1] += t * gy
            points[i, 2] += t * gz


@kernel
def _blob_values(points: FloatArray, solids: FloatArray) -> FloatArray:
    values = np.empty((len(points), len(solids)))
    for i in range(len(points)):
        for j in range(len(solids)):
            values[i, j] = _round_cone(solids, j, points[i, 0], points[i, 1], points[i, 2])
    return values


@kernel
def _local_radii(points: FloatArray, softness: float, solids: FloatArray) -> FloatArray:
    out = np.empty(len(points))
    for i in range(len(points)):
        total, weights = 0.0, 0.0
        for j in range(len(solids)):
            value = _round_cone(solids, j, points[i, 0], points[i, 1], points[i, 2])
            along, length2 = 0.0, 0.0
            for axis in range(3):
                b = solids[j, 3 + axis] - solids[j, axis]
                along += (points[i, axis] * solids[j, 8 + axis] - solids[j, axis]) * b
                length2 += b * b
            t = min(1.0, max(0.0, along / max(length2, 1e-12)))
            weight = math.exp(-max(value, -softness) / softness)
            total += weight * (solids[j, 6] + t * (solids[j, 7] - solids[j, 6])) * solids[j, 11]
            weights += weight
        out[i] = total / max(weights, 1e-300)
    return out
