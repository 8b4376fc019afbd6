"""Segmentation of the left ventricle against the truth of phantoms, a real CT, and SimpleITK's active contour.

pliant bench segmentation --subjects 4 --tables methods,median,level-set,time --ct FOLDER
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy import ndimage

from ..errors import PliantWarning, require
from ..heart import (
    HeartPhantom,
    distance_regularized_level_set,
    heart_phantom,
    load_volume,
    segment_blood_pool,
    volume_overlap,
)

__all__ = ["level_set_row", "median_table", "methods_table", "real_rows", "time_row"]

Row = dict[str, Any]


def methods_table(
    subjects: int = 4, *, spacing: float = 1.0, noise: float = 47.0, rng: int = 100
) -> list[Row]:
    """Compare the methods on phantoms: mean and least Dice, by itself and with the basal plane given."""
    rows = []
    hearts = [
        heart_phantom(spacing=spacing, noise=noise, mesh_step=4.0, rng=rng + i) for i in range(subjects)
    ]
    for method in ("threshold", "region", "edge"):
        alone = [_dice(heart, method=method) for heart in hearts]
        given = [_dice(heart, method=method, basal_plane=_plane(heart)) for heart in hearts]
        rows.append(
            {
                "method": method,
                "automatic": float(np.mean(alone)),
                "least automatic": float(np.min(alone)),
                "plane given": float(np.mean(given)),
                "least given": float(np.min(given)),
                "subjects": subjects,
            }
        )
    return rows


def median_table(
    sizes: tuple[float, ...] = (1.0, 3.0, 5.0, 7.0, 9.0),
    *,
    noises: tuple[float, ...] = (25.0, 47.0, 90.0),
    method: Literal["threshold", "region", "edge"] = "threshold",
    spacing: float = 1.0,
    rng: int = 100,
) -> list[Row]:
    """Recompute Table 5.2: overlap (eq. 5.4) by the median's size in mm, over levels of noise, plane given.

    The dissertation printed .796, .925 and .831 for 5, 7 and 9 voxels.
    """
    hearts = [heart_phantom(spacing=spacing, noise=noise, mesh_step=4.0, rng=rng) for noise in noises]
    rows = []
    for size in sizes:
        options: Row = {"method": method, "smoothing": "median", "width": size}
        found = [_overlap(h, "intersection over union", basal_plane=_plane(h), **options) for h in hearts]
        by_noise = {f"noise {noise:g}": value for noise, value in zip(noises, found, strict=True)}
        rows.append({"median mm": size, **by_noise, "mean": float(np.mean(found))})
    return rows


def level_set_row(
    size: int = 200, *, rng: int = 1, steps: tuple[int, ...] = (50, 100, 200, 400)
) -> list[Row]:
    """Time the region level set and SimpleITK's geodesic active contour: one image, one start, one thread each.

    Seconds are processor time, all preparation included; the contour is run for several numbers of steps, since its own
    rule for stopping does not hold on noise. Last comes the region level set stopped as soon as its overlap is the
    contour's after the first of these numbers: the two at equal overlap.
    """
    spacing = 160 / size
    heart = heart_phantom(spacing=spacing, mesh_step=4.0, rng=rng)
    truth = np.asarray(heart.mask)
    # Both need a barrier against what the ventricle opens into: beyond 3 mm of the truth there is wall.
    room = ndimage.distance_transform_edt(~truth, sampling=spacing) <= 3
    room &= _below(heart)
    smooth = ndimage.gaussian_filter(heart.volume.values, 0.7 / spacing)
    image = np.where(room, smooth, np.float32(124)).astype(np.float32)
    start = ndimage.distance_transform_edt(truth, sampling=spacing) > 4

    def ours(most: int) -> Any:
        return distance_regularized_level_set(
            image, start, spacing=spacing, levels=(476, 124), n_jobs=1, max_iterations=most
        )

    ours(6)
    begun = time.process_time()
    found = ours(300)
    rows = [_timed("pliant region", found.iterations, begun, found.mask, truth)]
    for most in steps:
        begun = time.process_time()
        rows.append(_timed("SimpleITK contour", most, begun, _contour(image, start, spacing, most), truth))
    rows.append(_as_good(ours, rows[1]["dice"], truth, rows[0]))
    for row in rows:
        row["ratio"] = row["seconds"] / rows[0]["seconds"]
    return rows


def real_rows(folder: str | Path) -> list[Row]:
    """Compare with the rough reference of a real CT; ``folder`` is the evaluation data's heart/ct."""
    place = Path(folder)
    volume = load_volume(place / "ct_pulm_cropped.nii.gz", modality="CT")
    reference = load_volume(place / "silver_LV_bloodpool_watershed.nii.gz").values > 0
    rows = []
    for method in ("threshold", "region", "edge"):
        found = segment_blood_pool(volume, method=method)
        rows.append(
            {
                "method": method,
                "dice": volume_overlap(found.mask, reference, measure="dice"),
                "intersection over union": volume_overlap(found.mask, reference),
                "ml": found.millilitres,
                "leak": found.leak,
            }
        )
    return rows


def time_row(size: int = 256, *, rng: int = 1) -> Row:
    """Time one segmentation of a volume of so many voxels an edge, in processor seconds."""
    heart = heart_phantom(spacing=160 / (size - 1), mesh_step=4.0, rng=rng)
    segment_blood_pool(heart.volume)
    begun = time.process_time()
    found = segment_blood_pool(heart.volume)
    seconds = time.process_time() - begun
    return {
        "voxels": size,
        "seconds": seconds,
        "dice": volume_overlap(found.mask, heart.mask, measure="dice"),
    }


def _as_good(ours: Callable[[int], Any], overlap: float, truth: Any, at_rest: Row) -> Row:
    """Time the fewest steps, in sixes, after which an overlap is reached; at rest where it never is."""
    low, high = 0, -(-at_rest["steps"] // 6)
    best = {**at_rest, "what": "pliant region, as good"}
    while high - low > 1:
        middle = (low + high) // 2
        begun = time.process_time()
        row = _timed("pliant region, as good", 6 * middle, begun, ours(6 * middle).mask, truth)
        if row["dice"] >= overlap:
            best, high = row, middle
        else:
            low = middle
    return best


def _contour(image: Any, start: Any, spacing: float, most: int) -> Any:
    sitk = require("SimpleITK", "heart")
    before = sitk.ProcessObject.GetGlobalDefaultNumberOfThreads()
    sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    try:
        pictures = [sitk.GetImageFromArray(image), sitk.GetImageFromArray(start.astype(np.uint8))]
        for picture in pictures:
            picture.SetSpacing([spacing] * 3)
        slopes = sitk.Cast(sitk.GradientMagnitudeRecursiveGaussian(pictures[0], 0.5), sitk.sitkFloat32)
        contour = sitk.GeodesicActiveContourLevelSetImageFilter()
        contour.SetPropagationScaling(1.0)
        contour.SetCurvatureScaling(0.2)
        contour.SetAdvectionScaling(1.0)
        contour.SetMaximumRMSError(0.002)
        contour.SetNumberOfIterations(most)
        signed = sitk.SignedMaurerDistanceMap(pictures[1], squaredDistance=False, useImageSpacing=True)
        return (
            sitk.GetArrayFromImage(contour.Execute(signed, sitk.Sigmoid(slopes, -15.0, 40.0, 1.0, 0.0))) < 0
        )
    finally:
        sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(before)


def _timed(name: str, steps: int, begun: float, mask: Any, truth: Any) -> Row:
    seconds = time.process_time() - begun
    return {
        "what": name,
        "steps": steps,
        "seconds": seconds,
        "dice": volume_overlap(mask, truth, measure="dice"),
    }


def _below(heart: HeartPhantom) -> Any:
    base, axis = _plane(heart)
    points = heart.volume.points(np.moveaxis(np.indices(heart.volume.shape), 0, -1))
    return (points - base) @ axis < 0


def _plane(heart: HeartPhantom) -> tuple[Any, Any]:
    base = heart.landmarks["base"]
    return base, base - heart.landmarks["apex"]


def _dice(heart: HeartPhantom, **options: Any) -> float:
    return _overlap(heart, "dice", **options)


def _overlap(
    heart: HeartPhantom, measure: Literal["intersection over union", "dice"], **options: Any
) -> float:
    with warnings.catch_warnings():
        # A leak shows in the overlap.
        warnings.simplefilter("ignore", PliantWarning)
        found = segment_blood_pool(heart.volume, **options)
    return volume_overlap(found.mask, heart.mask, measure=measure)
