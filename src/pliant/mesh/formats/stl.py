"""STL: loose triangles, text or binary."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import FileFormatError
from ..surface import Mesh
from .contents import Contents
from .text import claimed, floats

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEAD = 84
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def is_binary_stl(data: bytes) -> bool:
    """Whether the file is exactly as long as its triangle count says."""
    return len(data) >= _HEAD and len(data) == _HEAD + _RECORD.itemsize * _count(data)


def read(data: bytes) -> Contents:
    """Keep each triangle's three corners as they stand: nothing is merged."""
    # Binary files may start with "solid" too, so the length decides.
    if data.lstrip()[:5].lower() == b"solid" and not is_binary_stl(data):
        return _loose(_text_corners(data))
    return _loose(*_binary_corners(data))


def write(mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    """Write binary STL, float32; vertices are no longer shared."""
    del data
    records = np.zeros(mesh.n_faces, dtype=_RECORD)
    records["corners"] = mesh.vertices[mesh.faces]
    records["normal"] = mesh.face_normals
    head = b"binary STL".ljust(80, b" ") + np.array(mesh.n_faces, dtype="<u4").tobytes()
    return head + records.tobytes()


def _loose(corners: NDArray[np.float64], notes: tuple[str, ...] = ()) -> Contents:
    vertices = corners.reshape(-1, 3)
    return Contents(vertices, np.arange(len(vertices)), np.full(len(vertices) // 3, 3), notes=notes)


def _count(data: bytes) -> int:
    return int.from_bytes(data[80:_HEAD], "little")


def _binary_corners(data: bytes) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    if len(data) < _HEAD:
        message = f"a binary STL header has {_HEAD} bytes, the file has {len(data)}"
        raise FileFormatError(message)
    count = _count(data)
    claimed("triangles", count, _RECORD.itemsize, len(data) - _HEAD)
    records = np.frombuffer(data, dtype=_RECORD, count=count, offset=_HEAD)
    extra = len(data) - _HEAD - records.nbytes
    notes = (f"{extra} bytes after the last triangle are passed over",) if extra else ()
    return records["corners"].astype(np.float64), notes


def _text_corners(data: bytes) -> NDArray[np.float64]:
    lowered = data.lower()
    opened, closed = (len(re.findall(word, lowered)) for word in (rb"\bfacet\b", rb"\bendfacet\b"))
    corners = _VERTEX.findall(data)
    if b"endsolid" not in lowered or opened != closed or len(corners) != 3 * opened:
        message = (
            f"{opened} triangles begin, {closed} end, with {len(corners)} corners where {3 * opened} are "
            "needed: the file is truncated or not STL"
        )
        raise FileFormatError(message)
    return floats([number for corner in corners for number in corner]).reshape(-1, 3, 3)
