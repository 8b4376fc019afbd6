"""Descriptors of pictures and what pairs of them share, each computed once and kept in a file."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

import numpy as np
from scipy.spatial.distance import cdist

from .. import __version__
from .._arrays import BoolArray, FloatArray, IntArray, frozen
from ..errors import FileFormatError, InputError, PliantError
from ..images import Picture, load_picture, match_pair
from ..images.registration import carried
from ..images.views import WORKING_SIZE
from ..mesh import load_arrays, save_arrays
from .outlines import outline_drawing
from .vocabulary import Floats32, describe_picture

__all__ = ["Collection", "FeatureStore", "Tables", "read_collection", "shared_tables"]

# Raised when what a kind of file holds changes, so that older ones are made anew.
_FORMATS = {"descriptors": 1, "drawing": 1, "pair": 2}
# How far from where a transform takes it a point may be found again, in pixels of a picture of WORKING_SIZE a side:
# a little more than points keep apart.
_REACH = 6.5
_ENDINGS = frozenset((".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".gif", ".bmp", ".ppm", ".pgm"))


@dataclass(frozen=True, eq=False)
class Collection:
    """Pictures and their classes.

    Attributes
    ----------
    paths : tuple of Path
    labels : (n,) array of str
    digests : tuple of str
        SHA-256 of each file's content; empty where it cannot be read.
    """

    paths: tuple[Path, ...]
    labels: np.ndarray[Any, Any]
    digests: tuple[str, ...]


def read_collection(source: Any) -> Collection:
    """List the pictures of a folder of folders, one a class, or take a list of (path, class)."""
    if isinstance(source, str | os.PathLike):
        root = Path(source)
        if not root.is_dir():
            message = f"{root}: there is no such folder"
            raise InputError(message)
        pairs = [
            (path, place.name)
            for place in sorted(p for p in root.iterdir() if p.is_dir() and not p.name.startswith("."))
            for path in sorted(place.iterdir())
            if path.suffix.lower() in _ENDINGS and not path.name.startswith(".")
        ]
    else:
        pairs = [(Path(path), str(label)) for path, label in source]
    if not pairs:
        flat = isinstance(source, str | os.PathLike) and sum(
            path.suffix.lower() in _ENDINGS for path in Path(source).iterdir()
        )
        found = f"{flat} pictures lie in the folder itself, none in folders" if flat else "no pictures"
        message = f"{source}: {found}; lay them out as FOLDER/CLASS/picture.jpg"
        raise InputError(message)
    paths = tuple(path for path, _ in pairs)
    return Collection(
        paths, frozen(np.array([label for _, label in pairs])), tuple(_digest(path) for path in paths)
    )


def _digest(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


@dataclass(frozen=True)
class FeatureStore:
    """A folder of computed features; what is in a file's name decides what is in the file.

    Attributes
    ----------
    folder : Path
    points : int
        Drawn in each picture.
    seed : int
        Of the points.
    """

    folder: Path
    points: int
    seed: int

    def describe(self, item: tuple[Path, str]) -> str:
        """Describe the picture of a path and digest, unless that is done; return why it cannot be."""
        return self._described("descriptors", item)

    def draw(self, item: tuple[Path, str]) -> str:
        """Describe an outline drawing of a picture, unless that is done; return why it cannot be."""
        return self._described("drawing", item)

    def describe_and_draw(self, item: tuple[Path, str]) -> str:
        """Do both, in one process; return why the picture cannot be described."""
        why = self.describe(item)
        if not why:
            self.draw(item)
        return why

    def is_drawn(self, digest: str) -> bool:
        """Tell whether an outline drawing of a picture is described."""
        return _sound(self._path("drawing", digest))

    def _described(self, kind: str, item: tuple[Path, str]) -> str:
        path, digest = item
        kept = self._path(kind, digest)
        try:
            if not _sound(kept):
                picture = load_picture(path)
                seen = outline_drawing(picture) if kind == "drawing" else picture
                found = describe_picture(seen, points=self.points, rng=self.seed)
                # Half precision is far finer than the descriptors' noise.
                save_arrays(
                    kept,
                    {"descriptors": found.descriptors.astype(np.float16), "positions": found.positions},
                )
        except Exception as error:  # one bad picture, whatever ails it, must not end the others
            return _explained(error)
        return ""

    def compare(self, pair: tuple[tuple[Path, str], tuple[Path, str]]) -> str:
        """Match two pictures that are described, unless that is done; return why it cannot be."""
        (path1, digest1), (path2, digest2) = pair
        kept = self._path("pair", digest1, digest2)
        try:
            if not _sound(kept):
                pictures = load_picture(path1), load_picture(path2)
                match = match_pair(*pictures, rng=self.seed)
                positions = (self.positions(digest1), self.positions(digest2))
                first = _inside(match.region1, pictures[0], positions[0])
                second = _inside(match.region2, pictures[1], positions[1])
                apart = _apart(match.transform, positions, pictures[1])
                descriptors = self.descriptors(digest1), self.descriptors(digest2)
                places, distances = _found_again(apart, first[:, None] & second, descriptors)
                save_arrays(
                    kept,
                    {
                        "first": first,
                        "second": second,
                        "score": np.array(match.score),
                        "places": places,
                        "distances": distances,
                    },
                )
        except Exception as error:
            return _explained(error)
        return ""

    def descriptors(self, digest: str, kind: str = "descriptors") -> Floats32:
        """Return the descriptors of a picture that is described, or ("drawing") of its drawing."""
        table: Floats32 = load_arrays(self._path(kind, digest))["descriptors"].astype(np.float32)
        return table

    def positions(self, digest: str) -> FloatArray:
        """Return where they are, in pixels of the source."""
        return load_arrays(self._path("descriptors", digest))["positions"]

    def shared(self, digest1: str, digest2: str) -> tuple[BoolArray, BoolArray]:
        """Return which points of each of two pictures lie in the part found in the other."""
        arrays = load_arrays(self._path("pair", digest1, digest2))
        return arrays["first"] != 0, arrays["second"] != 0

    def found_again(self, digest1: str, digest2: str) -> tuple[IntArray, FloatArray]:
        """Return which points of two pictures show the same, (m, 2) and how far apart their descriptors are, (m,)."""
        arrays = load_arrays(self._path("pair", digest1, digest2))
        return arrays["places"], arrays["distances"]

    def _path(self, kind: str, *digests: str) -> Path:
        text = " ".join((kind, str(_FORMATS[kind]), __version__, str(self.points), str(self.seed), *digests))
        key = hashlib.sha256(text.encode()).hexdigest()[:40]
        place = self.folder / key[:2]
        place.mkdir(parents=True, exist_ok=True)
        return place / f"{kind}-{key}.npz"


class Tables(Sequence[Floats32]):
    """Descriptors of several pictures, read when asked for: memory holds one picture at a time."""

    def __init__(self, store: FeatureStore, digests: Sequence[str], kind: str = "descriptors") -> None:
        self.store, self.digests, self.kind = store, tuple(digests), kind

    def __len__(self) -> int:
        """Return the number of pictures."""
        return len(self.digests)

    def __iter__(self) -> Iterator[Floats32]:
        """Read one picture after another."""
        return (self.store.descriptors(digest, self.kind) for digest in self.digests)

    @overload
    def __getitem__(self, place: int) -> Floats32: ...
    @overload
    def __getitem__(self, place: slice) -> Tables: ...
    def __getitem__(self, place: int | slice) -> Floats32 | Tables:
        """Read the descriptors of one picture."""
        if isinstance(place, slice):
            return Tables(self.store, self.digests[place], self.kind)
        return self.store.descriptors(self.digests[place], self.kind)


def shared_tables(
    store: FeatureStore, pairs: Sequence[tuple[str, str]], closest: float
) -> Iterator[Floats32]:
    """Yield for each pair of digests the means of the descriptors that were found again.

    ``closest`` is the share of all of them that is taken, by the distance of their descriptors. In the mean of two
    what only one of the pictures shows around the point counts half.
    """
    if not pairs:
        return
    limit = np.quantile(np.concatenate([[0.0], *(store.found_again(*pair)[1] for pair in pairs)]), closest)
    for pair in pairs:
        places, distances = store.found_again(*pair)
        one, two = places[distances <= limit].T
        yield (store.descriptors(pair[0])[one] + store.descriptors(pair[1])[two]) / 2


def _inside(region: BoolArray, picture: Picture, positions: FloatArray) -> BoolArray:
    """Return which positions, in pixels of the source, lie in a region at the size of ``picture.grey``."""
    height, width = region.shape
    at = np.rint((positions + 0.5) * np.array(picture.reduction) - 0.5).astype(np.int64)
    flags: BoolArray = region[np.clip(at[:, 1], 0, height - 1), np.clip(at[:, 0], 0, width - 1)]
    return flags


def _apart(
    transform: FloatArray | None, positions: tuple[FloatArray, FloatArray], second: Picture
) -> FloatArray:
    """Return how far points of the second picture are from where the first's are taken, in working pixels."""
    if transform is None:
        return np.full((len(positions[0]), len(positions[1])), np.inf)
    pixel = (second.size[0] * second.size[1]) ** 0.5 / WORKING_SIZE
    there: FloatArray = cdist(carried(transform, positions[0]), positions[1]) / pixel
    return there


def _found_again(
    apart: FloatArray, allowed: BoolArray, descriptors: tuple[Floats32, Floats32]
) -> tuple[IntArray, FloatArray]:
    """Give each point of the first picture the likest one of those near where it is taken, if there are any."""
    unlike = np.where(allowed & (apart < _REACH), cdist(*descriptors, "sqeuclidean"), np.inf)
    likest = unlike.argmin(axis=1)
    distances = unlike[np.arange(len(unlike)), likest]
    found = np.flatnonzero(np.isfinite(distances))
    return np.column_stack([found, likest[found]]).astype(np.int64), distances[found]


def _sound(path: Path) -> bool:
    if not path.exists():
        return False
    try:
        load_arrays(path)
    except FileFormatError:
        return False
    return True


def _explained(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, PliantError | OSError) and text else f"{type(error).__name__}: {text}"
