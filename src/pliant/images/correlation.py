"""All shifts of one image's edges over another's at once, by Fourier transform."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import BoolArray, FloatArray
from ._opencv import Image, blurred, carried_back, carried_mask, opencv
from .agreement import EvenEdges
from .registration import carried, inverse

__all__ = ["shifts"]

# Edges less their mean over this distance, in pixels of the reduced images: texture everywhere is no agreement.
_LOCAL = 4.0
# Peaks closer than this are one.
_APART = 4
# Less overlap, as a share of the smaller picture, is left out: little always agrees with something.
_LEAST_OVERLAP = 0.25


def shifts(one: EvenEdges, two: EvenEdges, linear: FloatArray, *, count: int = 3) -> list[FloatArray]:
    """Find the shifts under which the oriented edges of two images correlate best, their linear part given.

    Parameters
    ----------
    one, two : EvenEdges
        Much reduced.
    linear : (2, 2) array of float
        Takes steps in the first image to steps in the second.
    count : int
        Most results.

    Returns
    -------
    list of (3, 3) array of float
        Affine transforms, taking pixels of the first image to the second; the best first.

    Notes
    -----
    The correlation is normalised by the edges in the overlap and multiplied by the root of the overlap's share, as a
    correlation over fewer pixels says less. Cost: 20 Fourier transforms, 8 ms at 45 x 45.
    """
    to_two, shape = _canvas(two.mask.shape, linear)
    inside = carried_mask(two.mask, to_two, shape)
    other = np.stack([carried_back(c, to_two, shape) * inside for c in _without_mean(two)])
    height, width = one.mask.shape
    scores = _correlations(_without_mean(one), one.mask, other, inside)
    found = []
    for _ in range(count):
        row, column = np.unravel_index(int(scores.argmax()), scores.shape)
        if not scores[row, column] > 0:
            break
        back = np.eye(3)
        back[0, 2] = -(column if column < width else column - scores.shape[1])
        back[1, 2] = -(row if row < height else row - scores.shape[0])
        found.append(to_two @ back)
        scores[_near(scores.shape, int(row), int(column))] = 0
    return found


def _without_mean(edges: EvenEdges) -> Image:
    weight = np.maximum(blurred(edges.mask, _LOCAL), 0.05)
    return np.stack([(c - blurred(c * edges.mask, _LOCAL) / weight) * edges.mask for c in edges.channels])


def _canvas(shape: tuple[int, ...], linear: FloatArray) -> tuple[FloatArray, tuple[int, int]]:
    """Return a frame in which the second image lies as in the first but for a shift: to the image, and its size."""
    middle = np.array([(shape[1] - 1) / 2, (shape[0] - 1) / 2])
    matrix = np.eye(3)
    matrix[:2, :2] = linear
    corners = np.array([[0, 0], [shape[1], 0], [0, shape[0]], [shape[1], shape[0]]]) - middle
    placed = carried(inverse(matrix), corners)
    low, high = np.floor(placed.min(axis=0)), np.ceil(placed.max(axis=0))
    offset, centre = np.eye(3), np.eye(3)
    offset[:2, 2], centre[:2, 2] = low, middle
    width, height = (int(side) + 1 for side in high - low)
    return centre @ matrix @ offset, (height, width)


def _correlations(first: Image, inside1: BoolArray, second: Image, inside2: BoolArray) -> FloatArray:
    """Return the score of every shift, row and column modulo the size of the result."""
    cv2 = opencv()
    size = [cv2.getOptimalDFTSize(a + b) for a, b in zip(inside1.shape, inside2.shape, strict=True)]

    def correlated(a: NDArray[Any], b: NDArray[Any]) -> FloatArray:
        product = np.fft.rfft2(a, size) * np.conj(np.fft.rfft2(b, size))
        result: FloatArray = np.fft.irfft2(product.sum(axis=0), size)
        return result

    masks = inside1[None].astype(np.float64), inside2[None].astype(np.float64)
    common = correlated(*masks) / max(1.0, min(masks[0].sum(), masks[1].sum()))
    energy1 = correlated((first**2).sum(axis=0)[None], masks[1])
    energy2 = correlated(masks[0], (second**2).sum(axis=0)[None])
    energy = np.sqrt(np.maximum(energy1, 0) * np.maximum(energy2, 0)) + 1e-6
    scores = correlated(first, second) / energy * np.sqrt(np.clip(common, 0, 1))
    return np.where(common > _LEAST_OVERLAP, scores, 0.0)


def _near(shape: tuple[int, ...], row: int, column: int) -> BoolArray:
    """Return which shifts are close to one, the rows and columns going round."""
    down, across = (np.abs(np.arange(n) - at) for n, at in zip(shape, (row, column), strict=True))
    down, across = np.minimum(down, shape[0] - down), np.minimum(across, shape[1] - across)
    near: BoolArray = down[:, None] ** 2 + across**2 < _APART**2
    return near
