"""Lists of image pairs with true boxes, in JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import FloatArray
from ..errors import InputError
from .pairs import ImagePair
from .picture import load_picture

__all__ = ["PairRecord", "read_pairs"]


@dataclass(frozen=True, eq=False)
class PairRecord:
    """One entry of a list of pairs.

    Attributes
    ----------
    name, kind, monument : str
    image1, image2 : Path
    mask1, mask2 : Path or None
    box1, box2 : (4,) array of float
    homography : (3, 3) array of float
    """

    name: str
    kind: str
    monument: str
    image1: Path
    image2: Path
    mask1: Path | None
    mask2: Path | None
    box1: FloatArray
    box2: FloatArray
    homography: FloatArray

    def load(self) -> ImagePair:
        """Read the pictures.

        Returns
        -------
        ImagePair
        """
        return ImagePair(
            self.name,
            self.kind,
            load_picture(self.image1, mask=self.mask1),
            load_picture(self.image2, mask=self.mask2),
            self.box1,
            self.box2,
            self.homography,
            self.monument,
        )


def read_pairs(path: str | Path) -> tuple[PairRecord, ...]:
    """Read a list of image pairs.

    Parameters
    ----------
    path : str or Path
        JSON: a list of records. ``image1``, ``image2`` (paths from the list's folder), ``box1``, ``box2`` (x0, y0,
        x1, y1 in pixels, x1 and y1 exclusive) and ``homography`` (9 numbers by rows, from image 1 to image 2) are
        needed; ``name``, ``kind``, ``mask1``, ``mask2`` and ``monument`` are not. Without ``monument`` it is
        the name without digits at its end.

    Returns
    -------
    tuple of PairRecord

    Raises
    ------
    InputError
        If the file is missing or not such a list; the message names the record and what is wrong with it.
    """
    source = Path(path)
    try:
        entries = json.loads(source.read_text(encoding="utf-8"))
    except OSError as error:
        message = f"{source}: {error.strerror or error}"
        raise InputError(message) from error
    except ValueError as error:
        message = f"{source} is not JSON: {error}"
        raise InputError(message) from error
    if not isinstance(entries, list) or not entries or not all(isinstance(e, dict) for e in entries):
        message = f"{source} must hold a list of records that is not empty"
        raise InputError(message)
    return tuple(_record(entry, i, source) for i, entry in enumerate(entries))


def _record(entry: dict[str, Any], index: int, source: Path) -> PairRecord:
    where = f"{source}, record {index}"
    missing = [key for key in ("image1", "image2", "box1", "box2", "homography") if key not in entry]
    if missing:
        message = f"{where}: {', '.join(missing)} missing"
        raise InputError(message)
    name = str(entry.get("name", index))
    masks = [source.parent / entry[key] if entry.get(key) else None for key in ("mask1", "mask2")]
    return PairRecord(
        name=name,
        kind=str(entry.get("kind", "")),
        monument=str(entry.get("monument", name.rstrip("0123456789") or name)),
        image1=source.parent / str(entry["image1"]),
        image2=source.parent / str(entry["image2"]),
        mask1=masks[0],
        mask2=masks[1],
        box1=_numbers(entry["box1"], (4,), f"{where}: box1"),
        box2=_numbers(entry["box2"], (4,), f"{where}: box2"),
        homography=_numbers(entry["homography"], (3, 3), f"{where}: homography"),
    )


def _numbers(values: Any, shape: tuple[int, ...], name: str) -> FloatArray:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        message = f"{name} must be numbers: {error}"
        raise InputError(message) from error
    if array.size != int(np.prod(shape)) or not np.isfinite(array).all():
        message = f"{name} must be {int(np.prod(shape))} finite numbers, got {values!r}"
        raise InputError(message)
    return array.reshape(shape)
