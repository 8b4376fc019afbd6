"""OBJ: Wavefront's text format, positions and faces."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import IntArray
from ...errors import FileFormatError, first_indices
from ..surface import Mesh
from .contents import Contents
from .text import floats, integers, shown

# Words of the format that carry nothing a triangle mesh keeps.
_QUIET = frozenset(
    b"vt vn vp g o s mg usemtl mtllib usemap maplib lod bevel c_interp d_interp shadow_obj trace_obj".split()
)
_SHAPES = frozenset(b"l p curv curv2 surf cstype deg bmat step parm trim hole scrv sp end con".split())


def read(data: bytes) -> Contents:
    """Parse ``v`` and ``f`` lines; texture and normal numbers of a corner are passed over."""
    positions: list[bytes] = []
    polygons: list[list[bytes]] = []
    seen_before: list[int] = []
    skipped: Counter[bytes] = Counter()
    for number, line in enumerate(_lines(data), start=1):
        words = line.split()
        if not words or words[0].startswith(b"#"):
            continue
        keyword = words[0]
        if keyword == b"v":
            if len(words) < 4:
                message = f"line {number}: a vertex needs three coordinates: {shown(line)}"
                raise FileFormatError(message)
            positions += words[1:4]
        elif keyword in (b"f", b"fo"):
            polygons.append(words[1:])
            seen_before.append(len(positions) // 3)
        elif keyword not in _QUIET:
            skipped[keyword] += 1
    if not positions:
        raise FileFormatError("no vertices: not one line starts with 'v'")
    corners, sizes = _corners(polygons, np.array(seen_before, dtype=np.int64))
    return Contents(floats(positions).reshape(-1, 3), corners, sizes, notes=_notes(skipped))


def write(mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    """Write an OBJ file; numbers keep all their digits."""
    del data
    rows = ["v {!r} {!r} {!r}".format(*row) for row in mesh.vertices.tolist()]
    rows += ["f {} {} {}".format(*row) for row in (mesh.faces + 1).tolist()]
    return ("\n".join(rows) + "\n").encode("ascii")


def _lines(data: bytes) -> list[bytes]:
    if b"\\" in data:
        data = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    return data.splitlines()


def _corners(polygons: list[list[bytes]], seen_before: IntArray) -> tuple[IntArray, IntArray]:
    sizes = np.fromiter(map(len, polygons), dtype=np.int64, count=len(polygons))
    numbers = integers([corner.partition(b"/")[0] for polygon in polygons for corner in polygon])
    zero = np.flatnonzero(numbers == 0)
    if zero.size:
        faces = np.unique(np.repeat(np.arange(len(sizes)), sizes)[zero])
        message = f"{faces.size} faces name vertex 0, first faces {first_indices(faces)}; OBJ counts from 1"
        raise FileFormatError(message)
    # A negative number counts back from the last vertex before the face.
    relative = np.repeat(seen_before, sizes) + numbers
    return np.where(numbers > 0, numbers - 1, relative), sizes


def _notes(skipped: Counter[bytes]) -> tuple[str, ...]:
    if not skipped:
        return ()
    known = sum(count for keyword, count in skipped.items() if keyword in _SHAPES)
    strange = sum(skipped.values()) - known
    notes = []
    if known:
        notes.append(f"{known} lines describe points, lines or free-form surfaces and are left out")
    if strange:
        names = ", ".join(shown(keyword, 12) for keyword in list(skipped)[:5] if keyword not in _SHAPES)
        notes.append(f"{strange} lines start with words OBJ does not have ({names}) and are left out")
    return tuple(notes)
