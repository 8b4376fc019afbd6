"""Reading pictures: one value whatever the file, with what is picture and what is fill told apart."""

from __future__ import annotations

import io
import threading
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import BoolArray, FloatArray, frozen
from ..errors import InputError, PliantWarning, require
from ._opencv import resized
from .padding import inside_of_padding

__all__ = ["Picture", "as_picture", "decode_picture", "load_picture"]

ImageLike: TypeAlias = "Picture | str | Path | ArrayLike"

# Twice what Pillow warns at: past it a small file can fill the memory.
MAX_PIXELS = 178_956_970
# Matching works on a few hundred pixels; more than this a side is only for the eye.
MAX_SIDE = 2048
_SMALLEST_ALPHA = 0.5
_REDUCED = "pixels reduced to"
# Pillow reads others too, some of them (EPS) by running another program.
_HARMLESS = ("JPEG", "PNG", "WEBP", "TIFF", "GIF", "BMP", "PPM")
_OPENING = threading.Lock()
_LUMINANCE = np.array([0.299, 0.587, 0.114], dtype=np.float32)


@dataclass(frozen=True, eq=False)
class Picture:
    """One picture, upright, with the part of it that counts.

    Attributes
    ----------
    grey : (h, w) array of float
        Luminance from 0 (black) to 1 (white).
    mask : (h, w) array of bool
        True inside the picture, False in fill around it.
    colour : (h, w, 3) array of uint8
        For showing.
    size : tuple of int
        Width and height of the source after turning it upright, in pixels. All coordinates that Pliant
        returns are in these pixels; ``grey`` is smaller than this where ``notes`` say so.
    notes : tuple of str
        What was done to the source: turned, reduced, fill found.
    """

    grey: FloatArray
    mask: BoolArray
    colour: NDArray[np.uint8]
    size: tuple[int, int]
    notes: tuple[str, ...] = ()

    @property
    def reduction(self) -> tuple[float, float]:
        """Pixels of ``grey`` to a pixel of the source, across and down."""
        height, width = self.grey.shape
        return width / self.size[0], height / self.size[1]


def load_picture(path: str | Path, *, mask: str | Path | ArrayLike | None = None) -> Picture:
    """Read a picture from a file.

    Parameters
    ----------
    path : str or Path
        JPEG, PNG, TIFF, or whatever else Pillow reads; 8 or 16 bits, grey, colour or with transparency. The
        orientation that the camera wrote (EXIF) is applied.
    mask : file or (h, w) array_like, optional
        What is picture (nonzero) and what is fill. Default: the transparency if there is any, otherwise fill
        of constant black or white that touches the border is found.

    Returns
    -------
    Picture

    Raises
    ------
    InputError
        If the file is missing, not a picture, truncated, of more than 178,956,970 pixels, or the mask does not fit.
    MissingExtraError
        Without Pillow and OpenCV: ``pip install 'pliant[images]'``.

    Warns
    -----
    PliantWarning
        If the longer side is beyond 2,048 pixels: the picture is reduced, coordinates stay those of the file.

    Notes
    -----
    Memory is 12 bytes a pixel of the file while it is read (JPEG less: it is decoded at reduced size).

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from PIL import Image
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "ramp.png"
    >>> Image.fromarray(np.tile(np.arange(1, 61, dtype=np.uint8), (40, 1))).save(path)
    >>> load_picture(path).size
    (60, 40)
    """
    given = None if mask is None else _mask_array(mask)
    return _said(_read(_file_bytes(Path(path)), str(path), given))


def decode_picture(data: bytes, *, name: str = "the picture", max_pixels: int = MAX_PIXELS) -> Picture:
    """Read a picture from the bytes of a file, as one who does not trust where they come from.

    Parameters
    ----------
    data : bytes
        A JPEG, PNG, WebP, TIFF, GIF, BMP or PNM file: formats whose readers run no other program. The orientation that
        the camera wrote is applied; transparency or fill at the border becomes the mask.
    name : str
        What messages call it.
    max_pixels : int
        More are refused before any is decoded.

    Returns
    -------
    Picture
        With all that was done to it, reduction too, in its notes; nothing is warned of.

    Raises
    ------
    InputError
        If it is of none of these formats, truncated, or has too many pixels.
    MissingExtraError
        Without Pillow and OpenCV: ``pip install 'pliant[images]'``.

    Examples
    --------
    >>> decode_picture(b"P5 3 2 255 " + bytes([10, 60, 90, 20, 80, 70])).size
    (3, 2)
    """
    return _read(data, name, None, formats=_HARMLESS, max_pixels=max_pixels)


def as_picture(image: Any, *, mask: Any = None) -> Picture:
    """Take a picture in any form: a :class:`Picture`, a file, or an array of pixels.

    Parameters
    ----------
    image : Picture, str, Path, or array_like
        An array is (h, w), (h, w, 1), (h, w, 3) or (h, w, 4), in 0..255 (uint8), 0..65535 (uint16) or 0..1
        (float); four channels have transparency last.
    mask : file or (h, w) array_like, optional
        See :func:`load_picture`; replaces the mask of a :class:`Picture`.

    Returns
    -------
    Picture

    Raises
    ------
    InputError
        As :func:`load_picture`, or if the array is not of one of these kinds.

    Examples
    --------
    >>> import numpy as np
    >>> as_picture(np.zeros((20, 30), np.uint8), mask=np.ones((20, 30))).size
    (30, 20)
    """
    if isinstance(image, Picture):
        if mask is None:
            return image
        return Picture(
            image.grey,
            frozen(_fitted_mask(_mask_array(mask), image.size, image.grey.shape)),
            image.colour,
            image.size,
            image.notes,
        )
    if isinstance(image, str | Path):
        return load_picture(image, mask=mask)
    pixels = np.asarray(image)
    if (
        pixels.ndim not in (2, 3)
        or (pixels.ndim == 3 and pixels.shape[2] not in (1, 3, 4))
        or not pixels.size
    ):
        message = (
            f"an image is an array (h, w), (h, w, 3) or (h, w, 4) that is not empty, got shape {pixels.shape}"
        )
        raise InputError(message)
    size = (pixels.shape[1], pixels.shape[0])
    _check_pixels(size, "the array")
    return _said(_from_array(pixels, size, None if mask is None else _mask_array(mask), [], "the array"))


def _said(picture: Picture) -> Picture:
    """Warn of a reduction, which changes what can be seen."""
    for note in picture.notes:
        if _REDUCED in note:
            warnings.warn(note, PliantWarning, stacklevel=3)
    return picture


def _file_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        message = f"{path}: {error.strerror or error}"
        raise InputError(message) from error


def _read(
    data: bytes,
    name: str,
    mask: BoolArray | None,
    *,
    formats: Sequence[str] | None = None,
    max_pixels: int = MAX_PIXELS,
) -> Picture:
    image = _opened(data, name, formats)
    size = image.size
    _check_pixels(size, name, max_pixels)
    image.draft("RGB", (MAX_SIDE, MAX_SIDE))
    image, turned = _decoded(image, name)
    if turned:
        size = (size[1], size[0]) if turned == "on its side" else size
    notes = [f"{name}: turned upright (it was stored {turned})"] if turned else []
    return _from_array(np.asarray(image), size, mask, notes, name)


def _opened(data: bytes, name: str, formats: Sequence[str] | None = None) -> Any:
    pillow = require("PIL.Image", "images")
    try:
        # Warning filters belong to the whole process, so that threads must take turns.
        with _OPENING, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return pillow.open(io.BytesIO(data), formats=formats)
    except pillow.DecompressionBombError as error:
        message = f"{name}: more than {MAX_PIXELS:,} pixels; reduce the picture first"
        raise InputError(message) from error
    except pillow.UnidentifiedImageError as error:
        known = "any known format" if formats is None else f"a known format ({', '.join(formats)})"
        message = f"{name} is not a picture of {known}"
        raise InputError(message) from error
    except Exception as error:
        message = f"{name} is not a picture that can be read: {error}"
        raise InputError(message) from error


def _check_pixels(size: tuple[int, int], name: str, most: int = MAX_PIXELS) -> None:
    if size[0] * size[1] > most:
        message = f"{name}: {size[0]} x {size[1]} are more than {most:,} pixels; reduce the picture first"
        raise InputError(message)


_TURNS = {2: "mirrored", 3: "upside down", 4: "mirrored", 5: "on its side", 6: "on its side", 7: "on its side",
          8: "on its side"}  # fmt: skip


def _decoded(image: Any, name: str) -> tuple[Any, str]:
    """Decode the pixels, upright, to grey, RGB, RGBA or 16 bits; return also how they were stored."""
    operations = require("PIL.ImageOps", "images")
    try:
        turned = _TURNS.get(image.getexif().get(0x0112, 1), "")
        image = operations.exif_transpose(image)
        if image.mode in ("P", "PA", "LA") or "transparency" in image.info:
            image = image.convert("RGBA")
        elif image.mode not in ("L", "RGB", "RGBA") and not image.mode.startswith(("I", "F")):
            image = image.convert("L" if image.mode == "1" else "RGB")
        factor = max(image.size) // MAX_SIDE
        return (image.reduce(factor) if factor > 1 and image.mode in ("L", "RGB", "RGBA") else image), turned
    except Exception as error:
        message = f"{name}: the pixels cannot be decoded ({error}); the file is truncated or damaged"
        raise InputError(message) from error


def _from_array(
    pixels: NDArray[Any], size: tuple[int, int], mask: BoolArray | None, notes: list[str], name: str
) -> Picture:
    values = _unit_range(pixels, name)
    alpha = values[..., 3] if values.ndim == 3 and values.shape[2] == 4 else None
    colour = values[..., :3] if values.ndim == 3 and values.shape[2] > 1 else None
    grey = values.reshape(values.shape[:2]) if colour is None else colour @ _LUMINANCE
    longest = max(size)
    shape = grey.shape
    if max(shape) > MAX_SIDE:
        factor = MAX_SIDE / max(shape)
        shape = (max(1, round(shape[0] * factor)), max(1, round(shape[1] * factor)))
    if longest > MAX_SIDE:
        note = (
            f"{name}: {size[0]} x {size[1]} {_REDUCED} {shape[1]} x {shape[0]}; coordinates stay the source's"
        )
        notes = [*notes, note]
    fit = (shape[1], shape[0])
    if shape != grey.shape:
        colour = (
            None if colour is None else np.stack([resized(colour[..., c], *fit) for c in range(3)], axis=-1)
        )
        alpha = None if alpha is None else resized(alpha, *fit)
        grey = resized(grey, *fit)
    inside, said = _inside(grey, alpha, mask, size)
    shown = np.repeat(grey[..., None], 3, axis=2) if colour is None else colour
    shown8 = np.rint(np.clip(shown, 0, 1) * 255).astype(np.uint8)
    return Picture(frozen(grey.astype(np.float64)), frozen(inside), frozen(shown8), size, (*notes, *said))


def _inside(
    grey: NDArray[Any], alpha: NDArray[Any] | None, mask: BoolArray | None, size: tuple[int, int]
) -> tuple[BoolArray, list[str]]:
    if mask is not None:
        return _fitted_mask(mask, size, grey.shape), []
    if alpha is not None and alpha.min() < _SMALLEST_ALPHA:
        return alpha >= _SMALLEST_ALPHA, ["transparent parts left out"]
    inside = inside_of_padding(grey)
    return inside, [] if inside.all() else [f"constant fill at the border left out ({(~inside).mean():.0%})"]


def _unit_range(pixels: NDArray[Any], name: str) -> NDArray[np.float32]:
    if pixels.dtype == np.bool_:
        return pixels.astype(np.float32)
    if pixels.dtype == np.uint8:
        return pixels.astype(np.float32) / np.float32(255)
    if pixels.dtype.kind in "iu":
        top = int(pixels.max())
        if int(pixels.min()) < 0 or top > 65535:
            message = f"{name}: integer pixels must be in 0..65535, got {int(pixels.min())}..{top}"
            raise InputError(message)
        return pixels.astype(np.float32) / np.float32(65535 if pixels.dtype.itemsize > 1 else 255)
    if pixels.dtype.kind != "f":
        message = f"{name}: pixels must be numbers, got dtype {pixels.dtype}"
        raise InputError(message)
    bad = int(np.count_nonzero(~np.isfinite(pixels)))
    if bad or pixels.min() < 0 or pixels.max() > 1:
        what = f"{bad} are not finite" if bad else f"got {pixels.min():.3g}..{pixels.max():.3g}"
        message = (
            f"{name}: pixels that are floats must be in 0..1: {what}; divide by the largest possible value"
        )
        raise InputError(message)
    return pixels.astype(np.float32)


def _mask_array(mask: Any) -> BoolArray:
    values = (
        np.asarray(_decoded(_opened(_file_bytes(Path(mask)), str(mask)), str(mask))[0])
        if isinstance(mask, str | Path)
        else np.asarray(mask)
    )
    if values.ndim == 3:
        values = values[..., 0]
    if values.ndim != 2 or values.dtype.kind not in "biuf":
        message = f"a mask is an array (h, w) of numbers or booleans, got shape {values.shape}, dtype {values.dtype}"
        raise InputError(message)
    return np.asarray(values != 0)


def _fitted_mask(mask: BoolArray, size: tuple[int, int], shape: tuple[int, ...]) -> BoolArray:
    if mask.shape not in ((size[1], size[0]), shape):
        message = f"the mask has shape {mask.shape}, the picture {(size[1], size[0])} (height, width)"
        raise InputError(message)
    if mask.shape == shape:
        return mask
    return np.asarray(resized(mask, shape[1], shape[0]) > 0.5)
