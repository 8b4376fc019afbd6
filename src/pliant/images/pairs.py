"""Pairs of images with known truth: from photographs by known changes, and real pairs moved out of register."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray, frozen
from ..errors import InputError, require
from ._opencv import blurred, opencv
from .picture import Picture, as_picture
from .registration import carried, inverse

__all__ = ["ChangeKind", "ImagePair", "moved", "shipped_photographs", "synthetic_pair", "synthetic_pairs"]

ChangeKind: TypeAlias = Literal[
    "crop",
    "rotation",
    "scale",
    "perspective",
    "occlusion",
    "night",
    "haze",
    "drawing",
    "engraving",
    "painting",
]


@dataclass(frozen=True, eq=False)
class ImagePair:
    """Two pictures and what is known about them.

    Attributes
    ----------
    name, kind : str
    picture1, picture2 : Picture
    box1, box2 : (4,) array of float
        True boxes of what they share, x0, y0, x1, y1 in pixels, x1 and y1 exclusive.
    homography : (3, 3) array of float
        Takes pixels of the first picture to the second, centres at whole numbers.
    monument : str
        What is shown: pairs of one monument are not independent.
    notes : dict
        What made the pair.
    """

    name: str
    kind: str
    picture1: Picture
    picture2: Picture
    box1: FloatArray
    box2: FloatArray
    homography: FloatArray
    monument: str = ""
    notes: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("box1", "box2", "homography"):
            object.__setattr__(self, name, frozen(np.asarray(getattr(self, name), dtype=np.float64)))

    @property
    def registered(self) -> bool:
        """Whether the pictures lie on each other already."""
        return bool(np.allclose(self.homography, np.eye(3), atol=1e-6))


def moved(
    pair: ImagePair,
    *,
    rng: int | np.random.Generator = 0,
    turn: float = 15.0,
    scales: tuple[float, float] = (0.5, 1.4),
) -> ImagePair:
    """Turn and resize the second picture of a pair at random, so that the pair is no longer in register.

    Parameters
    ----------
    pair : ImagePair
    rng : int or Generator
        Seed.
    turn : float
        Largest angle, in degrees, either way.
    scales : tuple of float
        Range of the change of size, drawn evenly.

    Returns
    -------
    ImagePair
        The canvas grows so that nothing is cut off; what it gains is outside the mask. ``box2`` is the upright box
        around the turned true one, so it is a little too large.

    Raises
    ------
    InputError
        If the range is not of positive numbers in order.
    """
    if turn < 0 or not 0 < scales[0] <= scales[1]:
        message = f"turn must not be negative and scales positive and in order, got {turn} and {scales}"
        raise InputError(message)
    generator = np.random.default_rng(rng)
    angle, scale = np.deg2rad(generator.uniform(-turn, turn)), generator.uniform(*scales)
    width, height = pair.picture2.size
    cosine, sine = scale * np.cos(angle), scale * np.sin(angle)
    motion = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]])
    corners = carried(
        motion, [[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]]
    )
    motion[:2, 2] = -corners.min(axis=0) - 0.5
    size = (int(np.ceil(np.ptp(corners[:, 0]))), int(np.ceil(np.ptp(corners[:, 1]))))
    picture, box = _warped(pair.picture2, motion, size), _carried_box(motion, pair.box2, size)
    notes = {**pair.notes, "turn": float(np.rad2deg(angle)), "scale": float(scale)}
    return replace(pair, picture2=picture, box2=box, homography=motion @ pair.homography, notes=notes)


def shipped_photographs() -> dict[str, NDArray[np.uint8]]:
    """Return photographs that scikit-image ships, by name: no network is needed.

    Returns
    -------
    dict of str to (h, w) or (h, w, 3) array of uint8
    """
    data = require("skimage.data", "images")
    return {
        name: np.asarray(getattr(data, name)())
        for name in ("astronaut", "camera", "chelsea", "coffee", "rocket")
    }


def synthetic_pair(
    photograph: Any, kind: ChangeKind, *, name: str = "photograph", rng: int | np.random.Generator = 0
) -> ImagePair:
    """Make a pair with exactly known truth from one photograph.

    Parameters
    ----------
    photograph : Picture, str, Path, or array_like
        See :func:`as_picture`.
    kind : str
        One of "crop", "rotation", "scale", "perspective", "occlusion", "night", "haze", "drawing", "engraving",
        "painting": what happens to the second picture. The first four move it; all that is still seen is
        shared. The others change how it looks and leave it where it is.
    name : str
        Of the photograph: the pair's monument.
    rng : int or Generator
        Seed.

    Returns
    -------
    ImagePair
        The boxes are the shared part: what both pictures show, occluded or not.

    Raises
    ------
    InputError
        If the kind is unknown or the photograph unusable.

    Examples
    --------
    >>> import numpy as np
    >>> photograph = np.random.default_rng(0).integers(0, 256, (60, 80, 3)).astype(np.uint8)
    >>> pair = synthetic_pair(photograph, "crop", rng=1)
    >>> pair.picture2.size < pair.picture1.size, pair.kind
    (True, 'crop')
    """
    if kind not in get_args(ChangeKind):
        message = f"kind must be one of {', '.join(get_args(ChangeKind))}, got {kind!r}"
        raise InputError(message)
    generator = np.random.default_rng(rng)
    picture = as_picture(photograph)
    if picture.size != picture.grey.shape[::-1]:
        message = (
            f"the photograph is {picture.size[0]} x {picture.size[1]} pixels; reduce it to 2048 a side first"
        )
        raise InputError(message)
    if kind in _MOTIONS:
        motion, size = _MOTIONS[kind](picture.size, generator)
        second = _warped(picture, motion, size)
    else:
        motion, size = np.eye(3), picture.size
        colour = _LOOKS[kind](picture.colour.astype(np.float32) / 255, generator)
        second = as_picture(np.clip(colour, 0, 1), mask=picture.mask)
    whole = np.array([0.0, 0.0, *picture.size])
    box2 = _carried_box(motion, whole, size)
    box1 = _carried_box(inverse(motion), np.array([0.0, 0.0, *size]), picture.size)
    return ImagePair(f"{name}-{kind}", kind, picture, second, box1, box2, motion, name)


def synthetic_pairs(
    photographs: Mapping[str, Any] | None = None,
    *,
    kinds: Sequence[ChangeKind] = get_args(ChangeKind),
    rng: int | np.random.Generator = 0,
) -> Iterator[ImagePair]:
    """Yield a pair for every photograph and kind of change.

    Parameters
    ----------
    photographs : mapping of str to image, optional
        By name. Default: :func:`shipped_photographs`.
    kinds : sequence of str
        See :func:`synthetic_pair`.
    rng : int or Generator
        Seed.

    Yields
    ------
    ImagePair
    """
    generator = np.random.default_rng(rng)
    for name, photograph in (shipped_photographs() if photographs is None else photographs).items():
        for kind in kinds:
            yield synthetic_pair(photograph, kind, name=name, rng=generator)


def _warped(picture: Picture, motion: FloatArray, size: tuple[int, int]) -> Picture:
    """Carry a picture to a new canvas; what it does not cover is outside the mask."""
    cv2 = opencv()
    across, down = picture.reduction
    # The motion is in pixels of the source, the picture may be smaller.
    inward = np.array([[1 / across, 0, (1 / across - 1) / 2], [0, 1 / down, (1 / down - 1) / 2], [0, 0, 1.0]])
    matrix = motion @ inward
    shrink = np.sqrt(abs(np.linalg.det(matrix[:2, :2])))
    colour = picture.colour
    if shrink < 1:
        width = 0.5 * float(np.sqrt(1 / shrink**2 - 1)) + 1e-3
        smooth = np.stack([blurred(colour[..., c], width, mirrored=True) for c in range(3)], axis=-1)
        colour = np.rint(np.clip(smooth, 0, 255)).astype(np.uint8)
    warped = cv2.warpPerspective(colour, matrix, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    inside = (
        cv2.warpPerspective(picture.mask.astype(np.float32), matrix, size, flags=cv2.INTER_LINEAR) > 0.999
    )
    return as_picture(warped, mask=inside)


def _carried_box(motion: FloatArray, box: FloatArray, size: tuple[int, int]) -> FloatArray:
    """Return the upright box, within a canvas, around a box carried by a motion of pixel centres."""
    x0, y0, x1, y1 = box - 0.5
    corners = carried(motion, [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]) + 0.5
    low, high = np.maximum(corners.min(axis=0), 0), np.minimum(corners.max(axis=0), size)
    return np.array([*low, *np.maximum(high, low)])


_Motion = Callable[[tuple[int, int], np.random.Generator], tuple[FloatArray, tuple[int, int]]]


def _crop(size: tuple[int, int], rng: np.random.Generator) -> tuple[FloatArray, tuple[int, int]]:
    width, height = size
    part = rng.uniform(0.6, 0.8)
    new = (round(part * width), round(part * height))
    x, y = rng.integers(0, width - new[0] + 1), rng.integers(0, height - new[1] + 1)
    return np.array([[1, 0, -float(x)], [0, 1, -float(y)], [0, 0, 1]]), new


def _about_centre(size: tuple[int, int], angle: float, scale: float) -> FloatArray:
    centre = (np.array(size) - 1) / 2
    linear = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    matrix = np.eye(3)
    matrix[:2, :2], matrix[:2, 2] = linear, centre - linear @ centre
    return matrix


def _rotation(size: tuple[int, int], rng: np.random.Generator) -> tuple[FloatArray, tuple[int, int]]:
    angle = np.deg2rad(rng.uniform(5, 15)) * rng.choice([-1, 1])
    return _about_centre(size, angle, 1.0), size


def _scale(size: tuple[int, int], rng: np.random.Generator) -> tuple[FloatArray, tuple[int, int]]:
    return _about_centre(size, 0.0, rng.uniform(1.2, 1.4)), size


def _perspective(size: tuple[int, int], rng: np.random.Generator) -> tuple[FloatArray, tuple[int, int]]:
    cv2 = opencv()
    width, height = size
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], dtype=np.float32)
    pulled = corners + (rng.uniform(-0.08, 0.08, (4, 2)) * [width, height]).astype(np.float32)
    matrix: FloatArray = np.asarray(cv2.getPerspectiveTransform(corners, pulled), dtype=np.float64)
    return matrix, size


_MOTIONS: dict[str, _Motion] = {
    "crop": _crop,
    "rotation": _rotation,
    "scale": _scale,
    "perspective": _perspective,
}

_Look = Callable[[FloatArray, np.random.Generator], NDArray[Any]]


def _luminance(colour: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(colour @ np.array([0.299, 0.587, 0.114], dtype=np.float32))


def _occlusion(colour: NDArray[Any], rng: np.random.Generator) -> NDArray[Any]:
    height, width = colour.shape[:2]
    covered = colour.copy()
    for _ in range(3):
        x, y = rng.integers(0, width * 4 // 5), rng.integers(0, height * 4 // 5)
        covered[y : y + height // 5, x : x + width // 5] = rng.random(3)
    return covered


def _night(colour: NDArray[Any], rng: np.random.Generator) -> NDArray[Any]:
    """Dark and blue, with lamps: bright parts of the day are not bright, and lamps light their surroundings."""
    height, width = colour.shape[:2]
    lamps = np.zeros((height, width), dtype=np.float32)
    lamps[rng.integers(0, height, 12), rng.integers(0, width, 12)] = 1.0
    light = blurred(lamps, 0.06 * width, mirrored=True)
    light = light / max(float(light.max()), 1e-9)
    lit = (1 - 0.6 * colour) * (0.12 + 0.8 * light[..., None])
    noise = rng.normal(0, 0.01, colour.shape)
    return np.asarray(lit * np.array([0.8, 0.85, 1.0]) + noise)


def _haze(colour: NDArray[Any], rng: np.random.Generator) -> NDArray[Any]:
    height = colour.shape[0]
    depth = np.linspace(0.85, 0.45, height, dtype=np.float32)[:, None, None]
    return np.asarray((1 - depth) * colour + depth * rng.uniform(0.75, 0.9))


def _drawing(colour: NDArray[Any], rng: np.random.Generator) -> NDArray[Any]:
    """Dark lines on paper where the luminance bends."""
    grey = _luminance(colour)
    bend = blurred(grey, 1.5, mirrored=True) - blurred(grey, 3.0, mirrored=True)
    ink = np.clip(np.abs(bend) / (3 * bend.std() + 1e-9), 0, 1)
    paper = 0.95 + rng.normal(0, 0.01, grey.shape)
    return np.repeat((paper - 0.9 * ink)[..., None], 3, axis=2)


def _engraving(colour: NDArray[Any], rng: np.random.Generator) -> NDArray[Any]:
    """Hatching that is denser where the picture is dark."""
    grey = blurred(_luminance(colour), 1.0, mirrored=True)
    y, x = np.mgrid[: grey.shape[0], : grey.shape[1]]
    wave = 0.5 + 0.5 * np.sin((x + y + rng.uniform(0, 6)) * (2 * np.pi / 5))
    ink = 1 / (1 + np.exp(-(wave - 0.15 - 0.8 * grey) * 12))
    return np.repeat((1 - 0.85 * ink)[..., None], 3, axis=2)


def _painting(colour: NDArray[Any], rng: np.random.Generator) -> NDArray[Any]:
    """Flat strokes of a few colours on canvas."""
    cv2 = opencv()
    flat = cv2.medianBlur(np.rint(colour * 255).astype(np.uint8), 9).astype(np.float32) / 255
    few = np.rint(flat * 6) / 6
    warm = few * np.array([1.0, 0.92, 0.75]) + rng.normal(0, 0.02, few.shape)
    return np.asarray(warm)


_LOOKS: dict[str, _Look] = {
    "occlusion": _occlusion,
    "night": _night,
    "haze": _haze,
    "drawing": _drawing,
    "engraving": _engraving,
    "painting": _painting,
}
