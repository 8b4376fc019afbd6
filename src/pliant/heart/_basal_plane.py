"""The basal plane: the narrowest cut through the blood between the left ventricle and what it opens into."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy import ndimage

from .._arrays import BoolArray, FloatArray
from ._chambers import STEP, Chambers

# Radius of the disc that is looked at, range along the axis and of tilts, in mm and degrees.
_RADIUS, _RANGE, _TILT = 36.0, (-16.0, 12.0), 30.0
# The neck is compared with cuts this far inside, in mm; narrower by this share is as sure as it gets.
_INSIDE, _SURE = (-28.0, -12.0), 0.35


def basal_plane(chambers: Chambers) -> tuple[FloatArray, FloatArray, float]:
    """Return (point, unit normal from the apex towards the base, confidence 0 to 1).

    Without blood beyond the ventricle (a volume that ends at the valves) the plane lies past its last voxel and the
    confidence is 0.
    """
    middle = chambers.points(chambers.ventricle).mean(axis=0)
    if not chambers.beyond.any():
        return _past_the_end(chambers, middle)
    contact = ndimage.binary_dilation(chambers.ventricle) & chambers.beyond
    mouth = chambers.points(contact).mean(axis=0)
    axis = (mouth - middle) / np.linalg.norm(mouth - middle)
    blood = chambers.ventricle | chambers.beyond
    shift, normal = _narrowest(blood, chambers.corner, mouth, axis, np.arange(*_RANGE, 2.0), _TILT, 6.0)
    point = mouth + shift * normal
    shift, normal = _narrowest(blood, chambers.corner, point, normal, np.arange(-3.0, 3.1, 1.0), 4.0, 2.0)
    point = point + shift * normal
    point = _in_the_middle(chambers, blood, point, normal)
    below = [_area(blood, chambers.corner, point + t * normal, normal) for t in np.arange(*_INSIDE, 4.0)]
    narrowing = 1 - _area(blood, chambers.corner, point, normal) / max(float(np.median(below)), 1.0)
    sure = float(np.clip(narrowing / _SURE, 0, 1)) * float(np.clip(chambers.wall_share / 0.65, 0, 1))
    return point, normal, sure


def _past_the_end(chambers: Chambers, middle: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    points = chambers.points(chambers.ventricle) - middle
    axis = np.linalg.svd(points[:: max(1, len(points) // 5000)], full_matrices=False)[2][0]
    return middle + (float((points @ axis).max()) + 2 * STEP) * axis, axis, 0.0


def across(normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors that span the plane normal to a unit vector."""
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    return first, np.cross(normal, first)


def _disc() -> FloatArray:
    line = np.arange(-_RADIUS, _RADIUS + STEP, STEP)
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(grid[np.hypot(grid[:, 0], grid[:, 1]) <= _RADIUS])


def _held(blood: BoolArray, corner: FloatArray, point: FloatArray, normal: FloatArray) -> FloatArray:
    """(k, 3) points of a disc that lie in blood."""
    first, second = across(normal)
    disc = _disc()
    points = point + disc[:, :1] * first + disc[:, 1:] * second
    at = np.rint((points - corner) / STEP).astype(int)
    inside: BoolArray = np.asarray(((at >= 0) & (at < blood.shape)).all(axis=1))
    inside[inside] = blood[tuple(at[inside].T)]
    return np.asarray(points[inside])


def _area(blood: BoolArray, corner: FloatArray, point: FloatArray, normal: FloatArray) -> float:
    return len(_held(blood, corner, point, normal)) * STEP**2


def _narrowest(
    blood: BoolArray,
    corner: FloatArray,
    point: FloatArray,
    axis: FloatArray,
    shifts: FloatArray,
    tilt: float,
    every: float,
) -> tuple[float, FloatArray]:
    """Return the shift along its normal and the normal of the plane that cuts the least blood, tilts held back."""
    first, second = across(axis)
    tangents = np.tan(np.radians(np.arange(-tilt, tilt + every / 2, every)))
    best = (np.inf, 0.0, axis)
    for a, b in product(tangents, tangents):
        normal = axis + a * first + b * second
        normal /= np.linalg.norm(normal)
        dearer = 1 + 0.5 * (a * a + b * b)
        for shift in shifts:
            cost = dearer * _area(blood, corner, point + shift * normal, normal)
            if 0 < cost < best[0]:
                best = (cost, float(shift), normal)
    return best[1], best[2]


def _in_the_middle(chambers: Chambers, blood: BoolArray, point: FloatArray, normal: FloatArray) -> FloatArray:
    """Move a plane's point to the middle of the ventricle's section just below it."""
    held = _held(blood, chambers.corner, point - 6.0 * normal, normal)
    if not len(held):
        return point
    middle = held.mean(axis=0)
    return np.asarray(middle - ((middle - point) @ normal) * normal)
