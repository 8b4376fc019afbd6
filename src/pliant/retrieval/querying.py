"""Pictures into an index, and the pictures like a given one out of it."""

from __future__ import annotations

import hashlib
import io
import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import IntArray, frozen
from .._parallel import ordered_map
from .._progress import progress_bar
from ..errors import InputError, PliantError, require
from ..images import Picture, as_picture, decode_picture
from ._items import Encoder
from .bits import Codes
from .index import ShapeIndex

__all__ = ["AddReport", "QueryMatch", "QueryResult", "add_folder", "preview_jpeg", "query_index"]

_ENDINGS = frozenset((".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".gif", ".bmp", ".ppm", ".pgm"))
#: Longer side of the picture that an index keeps: twice what partial matching works on.
PREVIEW_SIDE = 320
_BATCH = 32


@dataclass(frozen=True, eq=False)
class AddReport:
    """What became of the pictures of a folder.

    Attributes
    ----------
    ids : (m,) array of int
        Of the pictures added, in the order of their names.
    unchanged : int
        Pictures that the index had already, byte for byte.
    failures : dict
        Why others were left out, by file.
    """

    ids: IntArray
    unchanged: int
    failures: dict[str, str]


@dataclass(frozen=True)
class QueryMatch:
    """One picture of an index that is like the query.

    Attributes
    ----------
    id : int
    name : str
    label : str
    distance : int
        Bits in which the codes differ.
    """

    id: int
    name: str
    label: str
    distance: int


@dataclass(frozen=True, eq=False)
class QueryResult:
    """The pictures of an index nearest to a query.

    Attributes
    ----------
    matches : tuple of QueryMatch
        By distance, then by id.
    bits : int
        Length of the codes: the greatest distance there can be.
    picture : Picture
        The query.
    """

    matches: tuple[QueryMatch, ...]
    bits: int
    picture: Picture

    @property
    def notes(self) -> tuple[str, ...]:
        """What was done to the query, and whether the order of the matches means nothing."""
        ties = Counter(match.distance for match in self.matches)
        distance, most = max(ties.items(), key=lambda tie: tie[1], default=(0, 0))
        if most < max(3, len(self.matches) / 2):
            return self.picture.notes
        tied = (
            f"{most} of {len(self.matches)} matches are all {distance} bits away, in the order in which they were "
            "added: codes learned from few classes tell classes apart, not the pictures of one class"
        )
        return (*self.picture.notes, tied)

    @property
    def label(self) -> str:
        """The most frequent label of the matches, of equally frequent ones the one met first; empty without any."""
        counts = Counter(match.label for match in self.matches if match.label)
        return max(counts, key=lambda label: counts[label], default="")


def query_index(index: ShapeIndex, image: Any, *, count: int = 12, label: str | None = None) -> QueryResult:
    """Find the pictures of an index whose codes are nearest to that of a picture.

    Parameters
    ----------
    index : ShapeIndex
        With a model.
    image : Picture, str, Path, or array_like
        See :func:`pliant.images.as_picture`.
    count : int
        Matches wanted; fewer are returned where there are fewer.
    label : str, optional
        Only among pictures of this class.

    Returns
    -------
    QueryResult

    Raises
    ------
    InputError
        If the picture cannot be used, the index is empty or has no model, or nothing has the label.

    Notes
    -----
    Cost: encoding the picture; the search is about 1.2 ms a million 128-bit codes.

    Examples
    --------
    >>> class Brightness:
    ...     bits = 8
    ...     def encode(self, pictures):
    ...         return np.array([[255 >> int(8 * p.grey.mean())] for p in pictures], dtype=np.uint8)
    >>> index = ShapeIndex(model=Brightness())
    >>> dark, bright = np.full((20, 20), 0.2), np.full((20, 20), 0.9)
    >>> _ = index.add(index.model.encode([as_picture(dark), as_picture(bright)]), names=["dark", "bright"])
    >>> query_index(index, np.full((9, 9), 0.8)).matches[0]
    QueryMatch(id=2, name='bright', label='', distance=1)
    """
    picture = as_picture(image)
    found = index.search(index.model.encode([picture]), count, label=label)
    kept = found.ids[0] >= 0
    items = index.items(found.ids[0][kept])
    matches = tuple(
        QueryMatch(item.id, item.name, item.label, int(distance))
        for item, distance in zip(items, found.distances[0][kept], strict=True)
    )
    return QueryResult(matches, index.bits, picture)


def add_folder(
    index: ShapeIndex, folder: str | Path, *, n_jobs: int | None = 1, progress: bool = False
) -> AddReport:
    """Add every picture below a folder; the folder that it lies in first, below that one, is its class.

    Parameters
    ----------
    index : ShapeIndex
        With a model.
    folder : str or Path
        ``folder/class/picture.jpg``; pictures in the folder itself have no class. Links to folders are not followed.
    n_jobs : int, optional
        Threads; None or -1 for one a processor.
    progress : bool
        Show a bar where someone is watching.

    Returns
    -------
    AddReport
        A picture that cannot be used is reported there, and the others are added.

    Raises
    ------
    InputError
        If the folder is missing or holds no pictures, or another process keeps writing to the index.

    Notes
    -----
    Pictures are added 32 at a time, and those that were added stay: run it again after an interruption and it goes
    on. A file that changed since takes the place of what it was. The index keeps a JPEG of 320 pixels a side of each,
    about 20 kB, and never opens the file again.

    Examples
    --------
    >>> import tempfile
    >>> add_folder(ShapeIndex(8), tempfile.mkdtemp())
    Traceback (most recent call last):
    pliant.errors.InputError: ...: no pictures below it (.bmp, .gif, .jpeg, .jpg, .pgm, .png, .ppm, .tif, .tiff, .webp)
    """
    root = Path(folder)
    paths = _picture_files(root)
    known = {source: digest for source, (_, digest) in index.sources().items()}
    model, ids, failures, unchanged = index.model, [np.zeros(0, dtype=np.int64)], dict[str, str](), 0
    waiting: list[_Encoded] = []

    def store() -> None:
        if waiting:
            ids.append(_stored(index, waiting))
            waiting.clear()

    with progress_bar("adding pictures", len(paths), show=progress) as advance:
        for path, found in zip(
            paths, ordered_map(lambda p: _encoded(model, p, root, known), paths, n_jobs), strict=True
        ):
            advance()
            if isinstance(found, str):
                failures[str(path)] = found
            elif found is None:
                unchanged += 1
            else:
                waiting.append(found)
            if len(waiting) == _BATCH:
                store()
        store()
    return AddReport(frozen(np.concatenate(ids)), unchanged, failures)


def preview_jpeg(picture: Picture, side: int = PREVIEW_SIDE) -> bytes:
    """Write a picture small enough to keep and to show, fill and transparency in white.

    Parameters
    ----------
    picture : Picture
    side : int
        Pixels of the longer side at most.

    Returns
    -------
    bytes
        A JPEG file.
    """
    pillow = require("PIL.Image", "images")
    shown = pillow.fromarray(np.where(picture.mask[..., None], picture.colour, np.uint8(255)))
    shown.thumbnail((side, side), pillow.Resampling.LANCZOS)
    buffer = io.BytesIO()
    shown.save(buffer, "JPEG", quality=85)
    return buffer.getvalue()


@dataclass(frozen=True, eq=False)
class _Encoded:
    """A picture that is ready to be stored."""

    code: Codes
    name: str
    label: str
    file: tuple[str, str]
    preview: bytes


def _encoded(model: Encoder, path: Path, root: Path, known: dict[str, str | None]) -> _Encoded | str | None:
    """Return a picture's code and preview, None where the index has it, or why it cannot be used."""
    try:
        data = path.read_bytes()
        source = os.fsencode(os.path.realpath(path)).decode("utf-8", "backslashreplace")
        digest = hashlib.sha256(data).hexdigest()
        if known.get(source) == digest:
            return None
        picture = decode_picture(data, name=path.name)
        parts = path.relative_to(root).parts
        return _Encoded(
            model.encode([picture])[0],
            _printable("/".join(parts)),
            _printable(parts[0]) if len(parts) > 1 else "",
            (source, digest),
            preview_jpeg(picture),
        )
    except PliantError as error:
        return str(error)
    except Exception as error:  # One bad picture ends in the report, whatever is bad about it.
        return f"{type(error).__name__}: {error}"


def _stored(index: ShapeIndex, found: list[_Encoded]) -> IntArray:
    return index.add_files(
        np.stack([one.code for one in found]),
        names=[one.name for one in found],
        labels=[one.label for one in found],
        previews=[one.preview for one in found],
        files=[one.file for one in found],
    )


def _picture_files(root: Path) -> list[Path]:
    if not root.is_dir():
        message = f"{root}: there is no such folder"
        raise InputError(message)
    paths = sorted(_walked(root))
    if not paths:
        message = f"{root}: no pictures below it ({', '.join(sorted(_ENDINGS))})"
        raise InputError(message)
    return paths


def _walked(root: Path) -> Iterator[Path]:
    for place, _, names in os.walk(root):
        for name in names:
            if Path(name).suffix.lower() in _ENDINGS and not name.startswith("."):
                yield Path(place, name)


def _printable(text: str) -> str:
    """Return text fit to be shown and stored; a file name can hold anything."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
