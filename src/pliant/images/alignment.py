"""Fine alignment of two images' edges, once their points have told the transform roughly."""

from __future__ import annotations

import numpy as np

from .._arrays import BoolArray, FloatArray
from ._opencv import Image, blurred, carried_back, carried_mask, opencv
from .agreement import EvenEdges, agreement

__all__ = ["aligned"]

# Coarse to fine, in pixels of smoothing; steps at each.
_LEVELS = (4.0, 2.0, 0.0)
_STEPS = 4
# Weight of an isotropic prior against stretch, in parts of the data's own weight.
_STIFFNESS = 0.02
_FEWEST = 200
# Less is within the noise of the comparison, and the points know better.
_LEAST_GAIN = 0.02


def aligned(one: EvenEdges, two: EvenEdges, transform: FloatArray) -> FloatArray:
    """Move an affine transform to where the oriented edges of two images agree best.

    Gauss-Newton on the squared difference of the edge channels, with weights that let outliers go (what only one
    of the images shows), from coarse to fine.

    Parameters
    ----------
    one, two : EvenEdges
    transform : (3, 3) array of float
        Affine; takes pixels of the first image to the second; right to about 10 pixels.

    Returns
    -------
    (3, 3) array of float
        The given transform where the new one does not clearly raise the agreement of the edges.

    Notes
    -----
    Cost: 12 steps of a warp and two derivatives a channel.
    """
    found = transform
    for width in _LEVELS:
        first, second = ([blurred(c, width) if width else c for c in edges.channels] for edges in (one, two))
        for _ in range(_STEPS):
            step = _step(first, second, one.mask, two.mask, found)
            if step is None:
                return transform
            found = found @ step
    gained = agreement(one, two, found).total - agreement(one, two, transform).total
    return found if gained > _LEAST_GAIN else transform


def _step(
    first: list[Image], second: list[Image], mask1: BoolArray, mask2: BoolArray, transform: FloatArray
) -> FloatArray | None:
    """Return the small affine change, in the first frame, of one Gauss-Newton step; None where it runs away."""
    height, width = mask1.shape
    overlap = carried_mask(mask2, transform, mask1.shape) & mask1
    if np.count_nonzero(overlap) < _FEWEST:
        return None
    rows, columns = np.nonzero(overlap)
    x, y = (columns - width / 2) / width, (rows - height / 2) / width
    normal, right = np.zeros((6, 6)), np.zeros(6)
    for target, source in zip(first, second, strict=True):
        slopes, miss, weights = _linearised(target, carried_back(source, transform, mask1.shape), overlap)
        jacobian = np.column_stack([slope * part for slope in slopes for part in (x, y, 1.0)])
        normal += jacobian.T @ (weights[:, None] * jacobian)
        right += jacobian.T @ (weights * miss)
    scale = np.trace(normal)
    if not scale > 0:
        return None
    prior = scale * (_STIFFNESS / 6 * np.diag([1.0, 1, 0, 1, 1, 0]) + 1e-6 * np.eye(6))
    change = np.linalg.solve(normal + prior, right)
    if np.abs(change).max() > 0.1 * width:
        return None
    step = np.eye(3)
    step[:2, :2] += change.reshape(2, 3)[:, :2] / width
    step[:2, 2] = change.reshape(2, 3) @ np.array([-0.5, -0.5 * height / width, 1.0])
    return step


def _linearised(
    target: Image, source: Image, overlap: BoolArray
) -> tuple[list[FloatArray], FloatArray, FloatArray]:
    """Return slopes across and down, misses and robust weights inside the overlap."""
    cv2 = opencv()
    aim, value = target[overlap].astype(np.float64), source[overlap].astype(np.float64)
    power = float(value @ value)
    gain = float(aim @ value) / power if power > 0 else 0.0
    miss = aim - gain * value
    usual = 1.5 * np.sqrt(np.mean(miss**2)) + 1e-12
    slopes = [
        gain * (cv2.Sobel(source, cv2.CV_32F, across, 1 - across, ksize=3)[overlap] / 8.0)
        for across in (1, 0)
    ]
    return slopes, miss, 1 / (1 + (miss / usual) ** 2)
