"""Outline drawings of photographs: what somebody would draw who follows the strongest contours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import BoolArray
from ..images import Picture, as_picture
from ..images._opencv import Image, away_from_fill, blurred, opencv, resized

__all__ = ["outline_drawing"]

# Square root of the number of pixels of a drawing, and in such pixels: smoothing before contours are looked for,
# least length of a contour, width of a stroke, softness of its sides.
_SIDE = 224
_SMOOTHING = 2.6
_LEAST_LENGTH = 27
_STROKE = 3
_SOFTNESS = 0.7
# Share of the picture with a gradient that may begin a contour, and how much weaker it may go on.
_STRONG_SHARE = 0.07
_GOES_ON = 0.4
_FULL_SCALE = 32_000
# Gradients below this, for grey from 0 to 1, are rounding.
_NO_GRADIENT = 1e-4


def outline_drawing(picture: Any) -> Picture:
    """Draw the strongest long contours of a picture as dark strokes on white paper.

    Parameters
    ----------
    picture : Picture, str, Path, or array_like
        See :func:`pliant.images.as_picture`.

    Returns
    -------
    Picture
        About 224 x 224 pixels, in the proportions of the picture; blank where it has no contours.

    Raises
    ------
    InputError
        If the picture cannot be used.

    Notes
    -----
    Contours are those of Canny (1986), from thresholds that suit the picture, without those that are short. Texture
    goes, as it does when somebody draws, but so do faint contours, and shadows stay. Cost: 3 ms.

    Examples
    --------
    >>> disc = np.hypot(*np.mgrid[-60:60, -60:60]) < 40
    >>> paper = outline_drawing(np.where(disc, 0.6, 0.4)).grey
    >>> bool(paper[112, 112] > 0.99), bool(paper[112].min() < 0.1)
    (True, True)
    """
    loaded = as_picture(picture)
    height, width = loaded.grey.shape
    factor = _SIDE / (height * width) ** 0.5
    shape = (max(1, round(height * factor)), max(1, round(width * factor)))
    mask: BoolArray = resized(loaded.mask, shape[1], shape[0]) > 0.99
    lines = _long(_contours(resized(loaded.grey, shape[1], shape[0]), mask))
    cv2 = opencv()
    strokes = cv2.dilate(lines.astype(np.uint8), np.ones((_STROKE, _STROKE), np.uint8))
    ink = blurred(strokes, _SOFTNESS)
    paper = np.rint(255 * np.clip(1 - ink, 0, 1)).astype(np.uint8)
    # Paper is picture: its white is not to be taken for fill.
    return as_picture(paper, mask=mask)


def _contours(grey: Image, mask: BoolArray) -> BoolArray:
    cv2 = opencv()
    # Fill has no weight: what lies inside the mask is smoothed as if nothing else were there.
    weight = blurred(mask, _SMOOTHING, mirrored=True)
    smooth = blurred(grey * mask, _SMOOTHING, mirrored=True) / np.maximum(weight, 1e-3)
    across = cv2.Sobel(smooth, cv2.CV_32F, 1, 0)
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1)
    inside = away_from_fill(mask, _SMOOTHING)
    strength = np.hypot(across, down) * inside
    top = float(strength.max())
    if not top > _NO_GRADIENT:
        return np.zeros(mask.shape, dtype=bool)
    strong = float(np.quantile(strength[mask], 1 - _STRONG_SHARE))
    # Canny wants whole numbers: the strongest gradient takes nearly all of their range.
    scale = _FULL_SCALE / top
    steps: list[NDArray[np.int16]] = [
        np.rint(scale * inside * part).astype(np.int16) for part in (across, down)
    ]
    found = cv2.Canny(*steps, _GOES_ON * strong * scale, strong * scale, L2gradient=True)
    return np.asarray(found > 0)


def _long(lines: BoolArray) -> BoolArray:
    _, numbers, facts, _ = opencv().connectedComponentsWithStats(lines.astype(np.uint8), connectivity=8)
    kept = np.asarray(facts[:, 4] >= _LEAST_LENGTH)
    kept[0] = False
    long: BoolArray = kept[numbers]
    return long
