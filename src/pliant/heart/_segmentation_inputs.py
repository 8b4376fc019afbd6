"""What a segmentation takes, checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, as_floats
from ..errors import InputError
from .volume import Volume

_METHODS, _FILTERS = ("threshold", "region", "edge"), ("gaussian", "median")
_LEAST_EXTENT, _LEAST_SLICES = 40.0, 8


def refuse_volume(volume: Volume) -> None:
    """Refuse what is no CT or too thin to hold a ventricle."""
    if volume.modality not in {"", "CT"}:
        message = f"a contrast CT is needed; this volume is {volume.modality}"
        raise InputError(message)
    extent = volume.spacing * np.array(volume.shape)
    if min(volume.shape) < _LEAST_SLICES or extent.min() < _LEAST_EXTENT:
        message = (
            f"{volume!r} is too thin: at least {_LEAST_SLICES} voxels and {_LEAST_EXTENT:g} mm are needed along each "
            "axis. A single slice cannot be segmented"
        )
        raise InputError(message)


def checked_options(method: str, smoothing: str, width: float | None) -> float:
    """Refuse unknown options; return the width in mm, or its default."""
    for name, value, known in (("method", method, _METHODS), ("smoothing", smoothing, _FILTERS)):
        if value not in known:
            message = f"{name} must be one of {', '.join(known)}, got {value!r}"
            raise InputError(message)
    chosen = {"gaussian": 0.7, "median": 3.0}[smoothing] if width is None else float(width)
    if not 0 <= chosen <= 15:
        message = f"width must be between 0 and 15 mm, got {width}"
        raise InputError(message)
    return chosen


def checked_mask(mask: ArrayLike | None, volume: Volume) -> BoolArray | None:
    """Return the mask of where to look on the volume's grid, or refuse it."""
    if mask is None:
        return None
    array = np.asarray(mask, dtype=bool)
    if array.shape != volume.shape or not array.any():
        what = (
            "is empty"
            if array.shape == volume.shape
            else f"has shape {array.shape}, the volume {volume.shape}"
        )
        message = f"mask {what}; give a part of the volume's own grid"
        raise InputError(message)
    return array


def checked_point(point: ArrayLike | None, name: str) -> FloatArray | None:
    """Return (3,) finite coordinates, or refuse."""
    if point is None:
        return None
    place = as_floats(point, name)
    if place.shape != (3,) or not np.isfinite(place).all():
        message = f"{name} must be three finite numbers, got {place.tolist()}"
        raise InputError(message)
    return place
