"""FreeSurfer geometry (lh.white, ...) and morphometry (lh.thickness, ...), recognised by their first three bytes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import IntArray
from ...errors import FileFormatError
from ..surface import Mesh
from .contents import Contents, no_polygons
from .text import claimed

_TRIANGLES = b"\xff\xff\xfe"
_QUADS = b"\xff\xff\xff"  # int16 hundredths of a millimetre; also the magic of per-vertex data
_FLOAT_QUADS = b"\xff\xff\xfd"
MAGICS = (_TRIANGLES, _QUADS, _FLOAT_QUADS)


def read(data: bytes) -> Contents:
    """Parse a triangle or quadrangle surface, positions in FreeSurfer's surface coordinates in mm; or morphometry."""
    if data[:3] == _TRIANGLES:
        return _triangles(data)
    if _is_vertex_data(data):
        values = np.frombuffer(data, dtype=">f4", offset=15).astype(np.float32)
        return Contents(None, *no_polygons(), {"": values})  # the file's name says what they are
    return _quads(data, coordinate=">f4" if data[:3] == _FLOAT_QUADS else ">i2")


def write(mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    """Write a triangle surface, float32."""
    del data
    counts = np.array([mesh.n_vertices, mesh.n_faces], dtype=">i4").tobytes()
    head = _TRIANGLES + b"created by pliant\n\n" + counts
    return head + mesh.vertices.astype(">f4").tobytes() + mesh.faces.astype(">i4").tobytes()


def _triangles(data: bytes) -> Contents:
    comment_end = data.find(b"\n", 3)
    start = data.find(b"\n", comment_end + 1) + 1 if comment_end >= 0 else 0
    if not start or start + 8 > len(data):
        raise FileFormatError("the header is cut short: the file is truncated")
    n_vertices, n_faces = (int(count) for count in np.frombuffer(data, dtype=">i4", count=2, offset=start))
    start += 8
    claimed("vertices", n_vertices, 12, len(data) - start)
    claimed("faces", n_faces, 12, len(data) - start - 12 * n_vertices)
    vertices = np.frombuffer(data, dtype=">f4", count=3 * n_vertices, offset=start).reshape(-1, 3)
    faces = np.frombuffer(data, dtype=">i4", count=3 * n_faces, offset=start + vertices.nbytes)
    return Contents(vertices.astype(np.float64), faces.astype(np.int64), np.full(n_faces, 3))


def _quads(data: bytes, coordinate: str) -> Contents:
    if len(data) < 9:
        raise FileFormatError("the header is cut short: the file is truncated")
    n_vertices, n_quads = (int.from_bytes(data[at : at + 3], "big") for at in (3, 6))
    item = np.dtype(coordinate).itemsize
    claimed("vertices", n_vertices, 3 * item, len(data) - 9)
    claimed("quadrangles", n_quads, 12, len(data) - 9 - 3 * item * n_vertices)
    vertices = np.frombuffer(data, dtype=coordinate, count=3 * n_vertices, offset=9).astype(np.float64)
    if item == 2:
        vertices /= 100
    tail = np.frombuffer(data, dtype=np.uint8, count=12 * n_quads, offset=9 + 3 * item * n_vertices)
    quads = (tail.reshape(-1, 3).astype(np.int64) @ np.array([65536, 256, 1])).reshape(-1, 4)
    faces = _split(quads)
    note = f"{n_quads} quadrangles are split into {len(faces)} triangles, by FreeSurfer's own rule"
    return Contents(vertices.reshape(-1, 3), faces.ravel(), np.full(len(faces), 3), notes=(note,))


def _split(quads: IntArray) -> IntArray:
    even = quads[:, [0, 1, 3, 2, 3, 1]]
    odd = quads[:, [0, 1, 2, 0, 2, 3]]
    return np.where(quads[:, :1] % 2 == 0, even, odd).reshape(-1, 3)


def _is_vertex_data(data: bytes) -> bool:
    if len(data) < 15:
        return False
    if data[:3] != _QUADS:
        return False
    n_vertices, _, width = np.frombuffer(data, dtype=">i4", count=3, offset=3).tolist()
    return bool(width == 1 and len(data) == 15 + 4 * n_vertices)
