"""OFF: Geomview's object file format, as text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import FileFormatError
from ..surface import Mesh
from .contents import Contents
from .text import claimed, floats, integers, shown

# Some writers glue the counts to the keyword: "OFF490 518 0".
_HEADER = re.compile(rb"\s*(ST)?(C)?(N)?(4)?(n)?OFF(?=[\s\d#]|$)")


def is_off(data: bytes) -> bool:
    """Whether the first word is an OFF keyword."""
    return _HEADER.match(_without_comments(data[:4096])) is not None


def read(data: bytes) -> Contents:
    """Parse an OFF file; colours, normals and texture coordinates are passed over."""
    lines = [line for line in _without_comments(data).splitlines() if line and not line.isspace()]
    lines = _after_keyword(lines)
    if not lines:
        raise FileFormatError("there is nothing after the OFF keyword: no counts, no vertices")
    counts = integers(lines[0].split()[:2])
    if len(counts) != 2:
        message = f"counts of vertices and faces expected, got {shown(lines[0])}"
        raise FileFormatError(message)
    n_vertices, n_faces = (int(count) for count in counts)
    available = sum(map(len, lines[1:])) + len(lines)
    claimed("vertices", n_vertices, 6, available)
    claimed("faces", n_faces, 2, available)
    if n_vertices + n_faces > len(lines) - 1:
        message = (
            f"the header claims {n_vertices} vertices and {n_faces} faces, one a line, but {len(lines) - 1} "
            "lines follow: the file is truncated or its header is wrong"
        )
        raise FileFormatError(message)
    vertices = _vertices(lines[1 : 1 + n_vertices])
    corners, sizes = _faces(lines[1 + n_vertices : 1 + n_vertices + n_faces])
    extra = len(lines) - 1 - n_vertices - n_faces
    notes = (f"{extra} lines after the last face are passed over",) if extra else ()
    return Contents(vertices, corners, sizes, notes=notes)


def write(mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    """Write an OFF file; numbers keep all their digits."""
    del data
    rows = ["OFF", f"{mesh.n_vertices} {mesh.n_faces} 0"]
    rows += ["{!r} {!r} {!r}".format(*row) for row in mesh.vertices.tolist()]
    rows += ["3 {} {} {}".format(*row) for row in mesh.faces.tolist()]
    return ("\n".join(rows) + "\n").encode("ascii")


def _without_comments(data: bytes) -> bytes:
    return re.sub(rb"#[^\r\n]*", b"", data) if b"#" in data else data


def _after_keyword(lines: list[bytes]) -> list[bytes]:
    match = _HEADER.match(lines[0]) if lines else None
    if match is None:
        return lines
    if match.group(4) or match.group(5):
        raise FileFormatError("points of other than three dimensions (4OFF, nOFF) are not read")
    rest = lines[0][match.end() :]
    if b"BINARY" in rest:
        raise FileFormatError("binary OFF is not read; save it as text OFF or as PLY")
    return [rest, *lines[1:]] if rest.strip() else lines[1:]


def _vertices(lines: list[bytes]) -> NDArray[np.float64]:
    rows = [line.split()[:3] for line in lines]
    for number, row in enumerate(rows):
        if len(row) != 3:
            message = (
                f"vertex {number} has {len(row)} coordinates where three are needed: {shown(lines[number])}"
            )
            raise FileFormatError(message)
    return floats([token for row in rows for token in row]).reshape(-1, 3)


def _faces(lines: list[bytes]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    rows = [line.split() for line in lines]
    sizes = integers([row[0] for row in rows])
    corners: list[bytes] = []
    for number, (row, size) in enumerate(zip(rows, sizes.tolist(), strict=True)):
        if size < 0 or len(row) < size + 1:
            message = f"face {number} claims {size} corners: {shown(lines[number])}"
            raise FileFormatError(message)
        corners += row[1 : size + 1]
    return integers(corners), sizes
