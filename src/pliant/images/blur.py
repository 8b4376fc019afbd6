"""Geometric blur: oriented edges around a point, smoothed the more the farther from it (Berg & Malik 2001)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, IntArray, as_floats, frozen
from .._kernels import kernel
from ..errors import InputError, first_indices
from ._opencv import Image, away_from_fill, blurred, opencv

__all__ = ["EdgeChannels", "edge_channels", "edge_points", "geometric_blur"]

Normalise: TypeAlias = Literal["hellinger", "l2", "none"]

#: Rings of the reference settings, in pixels of an image about 200 high, and the samples on each.
RADII = (0.0, 4.0, 8.0, 16.0, 32.0, 50.0)
SAMPLES = (1, 8, 8, 10, 12, 12)
# Blur of a sample at distance r: 0.5 r + 1.
_BLUR_SLOPE, _BLUR_LEAST = 0.5, 1.0
_CANDIDATES = 40


@dataclass(frozen=True, eq=False)
class EdgeChannels:
    """Edges of an image, sorted by orientation.

    Attributes
    ----------
    channels : (c, h, w) array of float
        Edge strength near each of c orientations, evenly spaced over 180 degrees. Light-to-dark and
        dark-to-light count alike, so that day and night agree.
    strength : (h, w) array of float
        Strength of the edge whatever its orientation; 0 outside the mask and along its border.
    mask : (h, w) array of bool
        What is picture.
    """

    channels: FloatArray
    strength: FloatArray
    mask: BoolArray


def edge_channels(
    grey: ArrayLike, *, mask: ArrayLike | None = None, orientations: int = 4, sigma: float = 1.0
) -> EdgeChannels:
    """Find the edges of an image in a few orientations.

    Parameters
    ----------
    grey : (h, w) array_like of float
        Luminance, in any unit.
    mask : (h, w) array_like of bool, optional
        What is picture. Edges along the border of the fill are false evidence and are left out.
    orientations : int
        Number of channels; an edge is shared between the two nearest.
    sigma : float
        Smoothing before the gradient is taken, in pixels.

    Returns
    -------
    EdgeChannels

    Raises
    ------
    InputError
        If the arrays do not fit, or an option is out of range.

    Notes
    -----
    Source: section 6.3.1 of the dissertation. Cost: a few filters over the image.

    Examples
    --------
    >>> import numpy as np
    >>> step = np.repeat([[0.0, 1.0]], 40, axis=0).repeat(20, axis=1)
    >>> edges = edge_channels(step)
    >>> bool(edges.channels[0].sum() > 100 * edges.channels[2].sum())  # across, not along
    True
    """
    image = as_floats(grey, "grey")
    if image.ndim != 2 or not image.size or not np.isfinite(image).all():
        message = f"grey must be a finite array (h, w) that is not empty, got shape {image.shape}"
        raise InputError(message)
    inside = np.ones(image.shape, dtype=bool) if mask is None else np.asarray(mask) != 0
    if inside.shape != image.shape:
        message = f"mask must have the image's shape {image.shape}, got {inside.shape}"
        raise InputError(message)
    if orientations < 2 or not sigma > 0:
        message = f"orientations must be 2 or more and sigma positive, got {orientations} and {sigma}"
        raise InputError(message)
    cv2 = opencv()
    smooth = cv2.GaussianBlur(_filled(image, inside), (0, 0), sigma, borderType=cv2.BORDER_REFLECT)
    across = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3, borderType=cv2.BORDER_REPLICATE) / 8
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3, borderType=cv2.BORDER_REPLICATE) / 8
    strength = np.hypot(across, down) * away_from_fill(inside, sigma)
    angle = np.mod(np.arctan2(down, across), np.pi) * (orientations / np.pi)
    channels = np.stack([strength * _share(angle, k, orientations) for k in range(orientations)])
    return EdgeChannels(
        frozen(channels.astype(np.float64)), frozen(strength.astype(np.float64)), frozen(inside)
    )


def _filled(image: FloatArray, inside: BoolArray) -> Image:
    """Continue the picture into the fill, so that its border is no edge."""
    if inside.all():
        return image.astype(np.float32)
    near = blurred(np.where(inside, image, 0), 8.0) / np.maximum(blurred(inside, 8.0), 1e-3)
    return np.where(inside, image, near).astype(np.float32)


def _share(angle: Image, channel: int, orientations: int) -> Image:
    apart = np.abs(angle - channel)
    share: Image = np.maximum(0, 1 - np.minimum(apart, orientations - apart))
    return share


def edge_points(
    strength: ArrayLike, count: int, *, spacing: float = 5.0, rng: int | np.random.Generator = 0
) -> IntArray:
    """Draw points from the edges at random, none too close to another.

    Parameters
    ----------
    strength : (h, w) array_like of float
        Edge strength: how likely a pixel is drawn.
    count : int
        Points wanted. There are fewer where the edges have no room for them.
    spacing : float
        Least distance between two points, in pixels.
    rng : int or Generator
        Seed.

    Returns
    -------
    (n, 2) array of int
        x and y of the pixels, in the order drawn.

    Raises
    ------
    InputError
        If the strengths are negative or not finite, or an option is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> points = edge_points(np.ones((50, 50)), 20, spacing=5, rng=1)
    >>> len(points)
    20
    """
    weights = as_floats(strength, "strength")
    if weights.ndim != 2 or not np.isfinite(weights).all() or (weights < 0).any():
        raise InputError("strength must be a (h, w) array of finite numbers, none negative")
    if count < 1 or not spacing >= 0:
        message = f"count must be 1 or more and spacing not negative, got {count} and {spacing}"
        raise InputError(message)
    generator = np.random.default_rng(rng)
    possible = np.flatnonzero(weights)
    # Drawing without replacement in proportion to the weights: the largest of log weight + Gumbel noise.
    keys = np.log(weights.ravel()[possible]) + generator.gumbel(size=len(possible))
    kept = min(len(possible), _CANDIDATES * count)
    head = np.argpartition(-keys, kept - 1)[:kept] if kept < len(possible) else np.arange(len(possible))
    order = possible[head[np.argsort(-keys[head], kind="stable")]]
    return _spaced(order, weights.shape[0], weights.shape[1], count, spacing)


@kernel
def _spaced(order: IntArray, height: int, width: int, count: int, spacing: float) -> IntArray:
    taken = np.zeros((height, width), dtype=np.bool_)
    points = np.empty((count, 2), dtype=np.int64)
    reach = int(np.ceil(spacing))
    found = 0
    for place in order:
        y, x = place // width, place % width
        if taken[y, x]:
            continue
        points[found, 0], points[found, 1] = x, y
        found += 1
        if found == count:
            break
        for v in range(max(0, y - reach), min(height, y + reach + 1)):
            for u in range(max(0, x - reach), min(width, x + reach + 1)):
                if (v - y) ** 2 + (u - x) ** 2 < spacing**2:
                    taken[v, u] = True
        taken[y, x] = True
    return points[:found]


def geometric_blur(
    edges: EdgeChannels,
    points: ArrayLike,
    *,
    scale: float = 1.0,
    normalise: Normalise = "hellinger",
    radii: Sequence[float] = RADII,
    samples: Sequence[int] = SAMPLES,
) -> FloatArray:
    """Describe the edges around points of an image.

    Each orientation channel is sampled on rings around the point, smoothed with a Gaussian of width
    0.5 r + 1 at distance r, so that parts far from the point may move more.

    Parameters
    ----------
    edges : EdgeChannels
        From :func:`edge_channels`.
    points : (n, 2) array_like of float
        x and y in pixels of the image, centres at whole numbers. They need not lie on edges.
    scale : float
        Factor on all distances and widths: 2 describes a picture twice as large alike.
    normalise : {"hellinger", "l2", "none"}
        "hellinger": each descriptor is divided by its sum and its square root taken, so that Euclidean distance
        is Hellinger's: contrast cancels and strong edges do not drown weak ones. "l2": to length 1, as in the paper.
    radii, samples : sequences
        Rings, in pixels, and the number of samples on each. Default: 51 samples to 50 px, for images about 200 high.

    Returns
    -------
    (n, samples x orientations) array of float
        204 numbers a point by default. Samples outside the image are 0, and so is a point without edges.

    Raises
    ------
    InputError
        If points are outside the image or an option is out of range.

    Notes
    -----
    Source: Berg & Malik 2001, *Geometric blur for template matching*, with the rings of section 6.3.1. One blur
    a ring and channel (24), then a look-up: about 40 ms for an image of 230 x 170, 1 s for 640 x 480 with ``scale=3``.
    Rotation by more than 15 degrees or a change of size by more than a third changes the descriptor a lot.

    Examples
    --------
    >>> import numpy as np
    >>> edges = edge_channels(np.random.default_rng(0).random((80, 100)))
    >>> geometric_blur(edges, [[50, 40], [20, 30]]).shape
    (2, 204)
    """
    where = _points_inside(points, edges.strength.shape)
    if len(radii) != len(samples) or min(radii) < 0 or min(samples) < 1 or not scale > 0:
        message = f"rings need radii >= 0, samples >= 1 and scale > 0, got {radii}, {samples}, {scale}"
        raise InputError(message)
    if normalise not in get_args(Normalise):
        message = f"normalise must be one of {', '.join(get_args(Normalise))}, got {normalise!r}"
        raise InputError(message)
    rings = []
    for radius, number in zip(radii, samples, strict=True):
        angles = 2 * np.pi * np.arange(number) / number
        offsets = scale * radius * np.column_stack([np.cos(angles), np.sin(angles)])
        width = scale * (_BLUR_SLOPE * radius + _BLUR_LEAST)
        rings.append(_ring([blurred(channel, width) for channel in edges.channels], where, offsets))
    numbers = sum(samples) * len(edges.channels)
    return _normalised(np.concatenate(rings, axis=1).reshape(len(where), numbers), normalise)


def _points_inside(points: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    where = as_floats(points, "points")
    if where.size == 0:
        return np.zeros((0, 2))
    if where.ndim != 2 or where.shape[1] != 2:
        message = f"points must have shape (n, 2), got {where.shape}"
        raise InputError(message)
    most = np.array([shape[1], shape[0]]) - 0.5
    bad = np.flatnonzero(~((where >= -0.5) & (where <= most)).all(axis=1))
    if bad.size:
        message = f"{bad.size} of {len(where)} points are outside the image, first {first_indices(bad)}"
        raise InputError(message)
    return where


def _ring(channels: list[Image], points: FloatArray, offsets: FloatArray) -> FloatArray:
    """Sample channels at points + offsets: (n, samples, channels)."""
    height, width = channels[0].shape
    # Half a pixel is far below the blur's width: the nearest pixel will do.
    at = np.rint(points[:, None, :] + offsets).astype(np.int64)
    x, y = at[..., 0], at[..., 1]
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    x, y = np.clip(x, 0, width - 1), np.clip(y, 0, height - 1)
    return np.stack([channel[y, x] * inside for channel in channels], axis=-1)


def _normalised(descriptors: FloatArray, normalise: Normalise) -> FloatArray:
    values = descriptors.astype(np.float64)
    if normalise == "none":
        return values
    if normalise == "l2":
        length = np.linalg.norm(values, axis=1, keepdims=True)
        unit: FloatArray = np.divide(values, length, out=np.zeros_like(values), where=length > 0)
        return unit
    total = values.sum(axis=1, keepdims=True)
    shares = np.divide(values, total, out=np.zeros_like(values), where=total > 0)
    roots: FloatArray = np.sqrt(np.maximum(shares, 0))
    return roots
