"""Where two registered images show the same edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import BoolArray, FloatArray
from ._opencv import Image, blurred, carried_back, carried_mask, resized
from .blur import EdgeChannels

__all__ = ["Agreement", "EvenEdges", "agreement", "even_edges"]

_SMOOTHING = 2.0
# Edges are divided by their mean over this distance, so that lit windows do not outweigh dim walls.
_EVENING = 20.0
_FLOOR = 0.25
_WINDOW = 6.0


@dataclass(frozen=True, eq=False)
class EvenEdges:
    """Oriented edges of an image, slightly smoothed, of about the same strength everywhere.

    Attributes
    ----------
    channels : (c, h, w) array of float32
    strength : (h, w) array of float32
        Edge strength before evening, slightly smoothed.
    mask : (h, w) array of bool
    """

    channels: Image
    strength: Image
    mask: BoolArray

    def reduced(self, factor: int) -> EvenEdges:
        """Return the same at a fraction of the size."""
        height, width = (max(1, side // factor) for side in self.mask.shape)
        channels = np.stack([resized(c, width, height) for c in self.channels])
        return EvenEdges(
            channels, resized(self.strength, width, height), resized(self.mask, width, height) > 0.999
        )


@dataclass(frozen=True, eq=False)
class Agreement:
    """How far two images agree, in the frame of the first.

    Attributes
    ----------
    correlation : (h, w) array of float
        Correlation of the oriented edges in a window around each pixel, -1 to 1; 0 outside the overlap.
    shared : (h, w) array of float
        Geometric mean of both edge strengths.
    overlap : (h, w) array of bool
        Where both pictures are.
    """

    correlation: FloatArray
    shared: FloatArray
    overlap: BoolArray

    @property
    def total(self) -> float:
        """Mean correlation over the overlap, weighted by shared edges; 0 without any."""
        weight = self.shared[self.overlap]
        total = float(weight.sum())
        return float(weight @ self.correlation[self.overlap]) / total if total > 0 else 0.0


def even_edges(edges: EdgeChannels) -> EvenEdges:
    """Smooth and even out oriented edges for comparison.

    Parameters
    ----------
    edges : EdgeChannels

    Returns
    -------
    EvenEdges
    """
    channels = np.stack([blurred(channel, _SMOOTHING) for channel in edges.channels])
    strength = np.sqrt((channels**2).sum(axis=0))
    near = blurred(strength, _EVENING) / np.maximum(blurred(edges.mask, _EVENING), 0.1)
    usual = near[edges.mask].mean() if edges.mask.any() else 0.0
    even: Image = (channels / (near + _FLOOR * usual + 1e-9)).astype(np.float32)
    return EvenEdges(even, blurred(edges.strength, _SMOOTHING), edges.mask)


def agreement(one: EvenEdges, two: EvenEdges, transform: FloatArray, *, window: float = _WINDOW) -> Agreement:
    """Compare the edges of two images under a transform.

    Parameters
    ----------
    one, two : EvenEdges
    transform : (3, 3) array of float
        Affine; takes pixels of the first image to the second.
    window : float
        Standard deviation of the Gaussian window, in pixels.

    Returns
    -------
    Agreement

    Notes
    -----
    Cost: 22 blurs over the first image.
    """
    shape = one.mask.shape
    overlap = carried_mask(two.mask, transform, shape) & one.mask

    def mean(values: Image) -> Image:
        return blurred(values * overlap, window)

    weight = np.maximum(mean(np.ones(shape, dtype=np.float32)), 1e-6)
    covariance, variance1, variance2 = (np.zeros(shape, dtype=np.float32) for _ in range(3))
    for first, second in zip(one.channels, two.channels, strict=True):
        other = carried_back(second, transform, shape)
        mean1, mean2 = mean(first) / weight, mean(other) / weight
        covariance += mean(first * other) / weight - mean1 * mean2
        variance1 += mean(first * first) / weight - mean1 * mean1
        variance2 += mean(other * other) / weight - mean2 * mean2
    # The constant keeps flat parts, where there is nothing to compare, near 0.
    scale = np.sqrt(np.maximum(variance1, 0) * np.maximum(variance2, 0) + 1e-4)
    correlation = np.clip(covariance / scale, -1, 1) * overlap
    strength = carried_back(two.strength, transform, shape)
    shared = np.sqrt(np.maximum(one.strength, 0) * np.maximum(strength, 0)) * overlap
    return Agreement(correlation.astype(np.float64), shared.astype(np.float64), overlap)
