"""The few OpenCV calls that the room shares, imported when first needed."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._arrays import BoolArray, FloatArray
from ..errors import require

Image: TypeAlias = NDArray[np.float32]


def opencv() -> Any:
    """Import OpenCV, or say which extra brings it."""
    return require("cv2", "images")


def blurred(image: NDArray[Any], sigma: float, *, mirrored: bool = False) -> Image:
    """Smooth with a Gaussian; beyond the border is nothing, or the image mirrored."""
    cv2 = opencv()
    border = cv2.BORDER_REFLECT if mirrored else cv2.BORDER_CONSTANT
    smooth: Image = cv2.GaussianBlur(
        np.ascontiguousarray(image, dtype=np.float32), (0, 0), sigma, borderType=border
    )
    return smooth


def away_from_fill(inside: BoolArray, sigma: float) -> BoolArray:
    """Say where smoothing by ``sigma`` sees no fill; the picture's own border is none."""
    cv2 = opencv()
    side = 2 * int(2 * sigma) + 1
    eroded = cv2.erode(
        inside.astype(np.uint8),
        np.ones((side, side), np.uint8),
        borderType=cv2.BORDER_CONSTANT,
        borderValue=1,
    )
    return np.asarray(eroded > 0)


def resized(image: NDArray[Any], width: int, height: int) -> Image:
    """Resize, averaging over area where the result is smaller."""
    cv2 = opencv()
    smaller = width < image.shape[1]
    how = cv2.INTER_AREA if smaller else cv2.INTER_LINEAR
    result: Image = cv2.resize(
        np.ascontiguousarray(image, dtype=np.float32), (width, height), interpolation=how
    )
    return result


def carried_back(image: NDArray[Any], transform: FloatArray, shape: tuple[int, int]) -> Image:
    """Sample an image where an affine transform takes each pixel of a frame of the given shape; 0 outside."""
    cv2 = opencv()
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    result: Image = cv2.warpAffine(
        np.ascontiguousarray(image, dtype=np.float32), transform[:2], (shape[1], shape[0]), flags=how
    )
    return result


def carried_mask(mask: BoolArray, transform: FloatArray, shape: tuple[int, int]) -> BoolArray:
    """Return where an affine transform takes a pixel of a frame wholly into the mask."""
    inside: BoolArray = carried_back(mask, transform, shape) > 0.999
    return inside
