"""The chest around a phantom's ventricle: what is joined to it, what lies beside it, and the scanner."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .._arrays import BoolArray, FloatArray
from .._parallel import ordered_map
from ._scene_kernels import CONE, ELLIPSOID, HALF_SPACE, LEFT_BLOOD, MUSCLE, RIGHT_BLOOD, paint
from ._ventricle import Ventricle

# Axes of the heart frame in RAS: towards the septum, the anterior wall, the base.
_SEPTUM, _BASE = np.array([0.74, 0.60, -0.20]), np.array([0.60, -0.62, 0.50])
# CT numbers of a contrast study, HU.
_FAT, _SOFT, _LIVER, _BONE, _MUSCLE = -90.0, 45.0, 95.0, 260.0, 124.0
# What the heart frame's origin is moved by, so that the heart is in the middle of the volume, in mm.
_MIDDLE = np.array([10.0, 2.0, -14.0])


def heart_axes(rng: np.random.Generator) -> FloatArray:
    """(3, 3) columns: the heart frame's axes in RAS, turned a little at random."""
    base = _BASE + rng.normal(0, 0.06, 3)
    base /= np.linalg.norm(base)
    septum = _SEPTUM + rng.normal(0, 0.06, 3)
    septum -= (septum @ base) * base
    septum /= np.linalg.norm(septum)
    return np.column_stack([septum, np.cross(base, septum), base])


def draw_bodies(
    rng: np.random.Generator, ventricle: Ventricle, axes: FloatArray, *, contrast: float
) -> FloatArray:
    """(b, 11) rows for the painter, from the back to the front; ``contrast`` scales all blood's HU."""
    left = contrast * rng.normal(476, 20)
    right, veins = contrast * rng.normal(430, 60), left * rng.normal(1.02, 0.02)
    aorta = left * rng.normal(0.99, 0.02)
    thick = rng.normal(9.0, 0.6)
    length = ventricle.wall[2] - ventricle.wall[4]
    bloods = _great_vessels(ventricle, axes, aorta=aorta, veins=veins)
    cavity = [28.0, 6.0, -0.33 * length, 38.0, 41.0, 0.62 * length, thick, 6.0]
    rows = _surroundings(ventricle, axes, aorta)
    for grow, value in ((6.0, _FAT), (0.0, _MUSCLE)):
        rows.append([MUSCLE, value, 0.0, thick + grow, thick - 2.5 + grow, 4.0 + grow])
        outer = [*cavity[:3], *(c + 3.0 + grow for c in cavity[3:6]), thick - 3.0 - grow, 9.0 + grow]
        rows.append([RIGHT_BLOOD, value, 0.0, *outer])
        rows.extend(
            [kind, value - 30 * (not grow), 0.0, *_grown(kind, row, 2.0 + grow)] for kind, _, _, row in bloods
        )
    rows.append([RIGHT_BLOOD, right, 0.22, *cavity])
    rows.extend([kind, value, uneven, *row] for kind, value, uneven, row in bloods)
    # The ventricle's own wall comes back over what the vessels' roots cut from it, then its blood.
    rows.append([LEFT_BLOOD, left, 0.045])
    table = np.zeros((len(rows), 11))
    for i, row in enumerate(rows):
        table[i, : len(row)] = row
    return table


def _great_vessels(
    ventricle: Ventricle, axes: FloatArray, *, aorta: float, veins: float
) -> list[tuple[float, float, float, list[float]]]:
    """(kind, HU, unevenness, shape) of what is open to the ventricle, and the right atrium and pulmonary trunk."""
    wide = float(ventricle.wall[0] / 25.5)
    mitral, outflow = wide * np.array([-6.5, -3.5, 0.0]), wide * np.array([10.5, 6.0, 0.0])
    root, arch = outflow + np.array([3.0, 9.0, 17.0]), outflow + np.array([7.0, 24.0, 48.0])
    atrium = [mitral[0] - 4, mitral[1] - 6, 27.0, 24.0, 21.0, 22.0]
    rows = [
        (ELLIPSOID, veins, 0.03, atrium),
        (CONE, veins, 0.03, [*mitral, *(mitral + np.array([-1.0, -2.0, 10.0])), 15.0 * wide, 17.0 * wide]),
        (CONE, aorta, 0.03, [*outflow, *root, 10.5 * wide, 14.5]),
        (CONE, aorta, 0.03, [*root, *arch, 14.5, 14.0]),
        (CONE, aorta, 0.03, [*arch, *(arch + axes.T @ np.array([0.0, 0.0, 70.0])), 14.0, 14.0]),
        (ELLIPSOID, 0.85 * veins, 0.2, [34.0, -24.0, 24.0, 21.0, 20.0, 24.0]),
        (CONE, 0.9 * veins, 0.1, [24.0, 36.0, -4.0, 5.0, 46.0, 34.0, 12.0, 12.5]),
    ]
    for side in (-1.0, 1.0):
        start = np.array(atrium[:3])
        end = start + axes.T @ np.array([55.0 * side, -25.0, 12.0 * side])
        rows.append((CONE, veins, 0.03, [*start, *end, 7.0, 6.0]))
    return rows


def _grown(kind: float, row: list[float], by: float) -> list[float]:
    if kind == ELLIPSOID:
        return [*row[:3], *(r + by for r in row[3:])]
    # The ends of a vessel stay where they are: its wall is around it, not across its mouth.
    return [*row[:6], row[6] + by, row[7] + by]


def _surroundings(ventricle: Ventricle, axes: FloatArray, aorta: float) -> list[list[float]]:
    """Diaphragm, chest wall, spine and descending aorta; planes and cylinders of RAS seen in the heart frame."""
    apex = axes[:, 2] * (ventricle.wall[4] - ventricle.wall[2] - 14)
    rows: list[list[float]] = []
    for normal, value, beyond in (
        (np.array([0.0, 0.25, -0.97]), _LIVER, 1.0),
        (np.array([-0.15, 0.98, 0.0]), _FAT, 6.0),
        (np.array([-0.15, 0.98, 0.0]), _SOFT, 12.0),
    ):
        direction = axes.T @ (normal / np.linalg.norm(normal))
        rows.append([HALF_SPACE, value, 0.0, *direction, direction @ (axes.T @ apex) + beyond])
    up = axes.T @ np.array([0.0, 0.0, 200.0])
    for place, value, radius in (([5.0, -80.0, 0.0], _BONE, 21.0), ([-22.0, -66.0, 0.0], aorta, 12.0)):
        middle = axes.T @ np.array(place)
        rows.append([CONE, value, 0.0, *(middle - up), *(middle + up), radius, radius])
    return rows


def scanned(
    rng: np.random.Generator,
    ventricle: Ventricle,
    axes: FloatArray,
    bodies: FloatArray,
    *,
    shape: tuple[int, int, int],
    spacing: float,
    noise: float,
    blur: float,
    grain: float,
    n_jobs: int | None,
) -> tuple[NDArray[np.float32], BoolArray, BoolArray, FloatArray]:
    """Return CT numbers, both masks, and the affine from voxels to RAS mm."""
    affine = np.diag([spacing, spacing, spacing, 1.0])
    middle = axes @ _MIDDLE
    affine[:3, 3] = middle - spacing * (np.array(shape) - 1) / 2
    to_heart = axes.T @ affine[:3]
    waves = np.column_stack([rng.normal(0, 1 / 14, (12, 3)), rng.uniform(0, 2 * np.pi, 12)])
    arrays = ventricle.arrays
    bounds = _bounds(bodies, ventricle, spacing)
    values = np.empty(shape)
    left, right = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    slabs = [(i, min(i + 8, shape[0])) for i in range(0, shape[0], 8)]

    def slab(limits: tuple[int, int]) -> None:
        paint(values, left, right, limits[0], limits[1], to_heart, bodies, bounds, waves, *arrays)

    for _ in ordered_map(slab, slabs, n_jobs):
        pass
    picture = ndimage.gaussian_filter(values.astype(np.float32), blur / spacing)
    grains = ndimage.gaussian_filter(rng.standard_normal(shape, dtype=np.float32), grain / spacing)
    picture += grains * np.float32(noise / grains.std())
    return np.clip(np.rint(picture), -1024, 3071), left, right, affine


def _bounds(bodies: FloatArray, ventricle: Ventricle, spacing: float) -> FloatArray:
    """(b, 4) centres and squared radii of spheres outside which a body has no part in any voxel."""
    spheres = np.zeros((len(bodies), 4))
    tall = 0.5 * (ventricle.wall[2] - ventricle.wall[4])
    for sphere, row in zip(spheres, bodies, strict=True):
        kind, shape = row[0], row[3:]
        if kind == HALF_SPACE:
            sphere[3] = 1e9
        elif kind == CONE:
            ends = shape[:6].reshape(2, 3)
            sphere[:3], radius = ends.mean(axis=0), np.linalg.norm(ends[1] - ends[0]) / 2 + shape[6:8].max()
        elif kind in {ELLIPSOID, RIGHT_BLOOD}:
            sphere[:3], radius = shape[:3], shape[3:6].max()
        else:
            sphere[2], radius = -tall, np.hypot(tall, ventricle.wall[:2].max()) + 10 + max(shape[0], shape[2])
        if kind != HALF_SPACE:
            sphere[3] = (1.2 * radius + 4 * spacing) ** 2
    return spheres
