"""VTK's XML files: polygonal data (.vtp) and unstructured grids (.vtu)."""

from __future__ import annotations

import base64
import lzma
import re
import zlib
from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import IntArray
from ...errors import FileFormatError
from ..surface import Mesh
from .contents import Contents
from .raw import Inflater
from .text import claimed, floats, integers
from .vtk_cells import POLYGON, STRIP, TRIANGLE, surface_polygons
from .xml import Node, parsed

_TYPES = {
    f"{word}{8 * size}": f"{code}{size}"
    for word, code, sizes in (("Int", "i", (1, 2, 4, 8)), ("UInt", "u", (1, 2, 4, 8)), ("Float", "f", (4, 8)))
    for size in sizes
}
_WORDS = {code: word for word, code in _TYPES.items()}
_BLOCK = 1 << 15
_ZLIB, _LZMA = "vtkZLibDataCompressor", "vtkLZMADataCompressor"
_APPENDED = re.compile(rb"<AppendedData[^>]*>\s*_")


def read(data: bytes) -> Contents:
    """Parse a VTP or VTU file; pieces are joined in order, cell data are passed over."""
    document = _Document(data)
    pieces = [document.piece(node) for node in document.dataset.named("Piece")]
    if not pieces:
        raise FileFormatError("the file holds no Piece")
    shifts = np.cumsum([0] + [len(piece.vertices) for piece in pieces if piece.vertices is not None])
    corners = [piece.corners + shift for piece, shift in zip(pieces, shifts, strict=False)]
    shared = set.intersection(*(set(piece.data) for piece in pieces))
    arrays = {
        name: np.concatenate([piece.data[name] for piece in pieces])
        for name in pieces[0].data
        if name in shared
    }
    return Contents(
        np.concatenate([piece.vertices for piece in pieces if piece.vertices is not None]),
        np.concatenate(corners),
        np.concatenate([piece.sizes for piece in pieces]),
        arrays,
        tuple(note for piece in pieces for note in piece.notes),
    )


def write_polydata(mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    """Write VTP: zlib-compressed, float64 positions, arrays as point data."""
    counts = f'NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{mesh.n_faces}"'
    cells = f"<Polys>\n{_connectivity(mesh)}</Polys>\n"
    return _written("PolyData", counts, cells, mesh, data)


def write_grid(mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    """Write VTU: zlib-compressed, float64 positions, arrays as point data."""
    types = _array("types", np.full(mesh.n_faces, TRIANGLE, dtype="u1"))
    cells = f"<Cells>\n{_connectivity(mesh)}{types}</Cells>\n"
    return _written("UnstructuredGrid", f'NumberOfCells="{mesh.n_faces}"', cells, mesh, data)


def _written(kind: str, counts: str, cells: str, mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    arrays = "".join(_array(name, values) for name, values in data.items())
    text = (
        '<?xml version="1.0"?>\n'
        f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        f'compressor="{_ZLIB}">\n<{kind}>\n<Piece NumberOfPoints="{mesh.n_vertices}" {counts}>\n'
        f"<PointData>\n{arrays}</PointData>\n<Points>\n{_array('Points', mesh.vertices)}</Points>\n{cells}"
        f"</Piece>\n</{kind}>\n</VTKFile>\n"
    )
    return text.encode("utf-8")


def _connectivity(mesh: Mesh) -> str:
    ends = 3 * np.arange(1, mesh.n_faces + 1, dtype=np.int64)
    return _array("connectivity", mesh.faces.ravel()) + _array("offsets", ends)


def _array(name: str, values: NDArray[Any]) -> str:
    values = values.astype("u1") if values.dtype == np.bool_ else values
    values = values.astype("f4") if values.dtype == np.float16 else values
    raw = values.astype(values.dtype.newbyteorder("<")).tobytes()
    blocks = [zlib.compress(raw[at : at + _BLOCK]) for at in range(0, len(raw), _BLOCK)]
    header = np.array([len(blocks), _BLOCK, len(raw) % _BLOCK, *map(len, blocks)], dtype="<u8")
    text = base64.b64encode(header.tobytes()) + base64.b64encode(b"".join(blocks))
    width = values.shape[1] if values.ndim == 2 else 1
    return (
        f'<DataArray type="{_WORDS[values.dtype.str[1:]]}" Name="{escape(name)}" '
        f'NumberOfComponents="{width}" format="binary">{text.decode("ascii")}</DataArray>\n'
    )


class _Document:
    """The XML tree, the appended block beside it, and the settings both share."""

    def __init__(self, data: bytes) -> None:
        self._inflater = Inflater(len(data))
        self._appended = b""
        match = _APPENDED.search(data)
        if match:
            end = data.rfind(b"</AppendedData")
            if end < match.end():
                raise FileFormatError("the appended data have no end: the file is truncated")
            self._appended = data[match.end() : end]
            data = data[: match.end()] + data[end:]
        root = parsed(data)
        order = root.attributes.get("byte_order", "LittleEndian")
        self._order = ">" if order == "BigEndian" else "<"
        self._header = np.dtype(
            self._order + ("u8" if root.attributes.get("header_type") == "UInt64" else "u4")
        )
        self._compressor = root.attributes.get("compressor", "")
        block = root.first("AppendedData")
        self._raw = block is not None and block.attributes.get("encoding") == "raw"
        kind = root.attributes.get("type", "")
        dataset = root.first(kind)
        if kind not in ("PolyData", "UnstructuredGrid") or dataset is None:
            message = f"a dataset of type {kind!r} is not a surface; PolyData and UnstructuredGrid are read"
            raise FileFormatError(message)
        self.dataset = dataset
        self._offsets = sorted(_all_offsets(root))

    def piece(self, node: Node) -> Contents:
        count = int(node.attributes["NumberOfPoints"])
        points = node.first("Points")
        array = points.first("DataArray") if points is not None else None
        if array is None:
            raise FileFormatError("a piece has no Points")
        vertices = self._values(array).astype(np.float64).reshape(-1, 3)
        if len(vertices) != count:
            message = f"a piece claims {count} points and holds {len(vertices)}"
            raise FileFormatError(message)
        corners, sizes, notes = surface_polygons(*self._cells(node))
        bad = np.flatnonzero((corners < 0) | (corners >= count))
        if bad.size:
            message = f"{bad.size} corners name points outside 0..{count - 1}"
            raise FileFormatError(message)
        return Contents(vertices, corners, sizes, self._point_data(node, count), notes)

    def _cells(self, node: Node) -> tuple[IntArray, IntArray, IntArray]:
        lists: list[tuple[IntArray, IntArray, IntArray]] = []
        shift = 0
        for tag, kind in (("Verts", 2), ("Lines", 4), ("Polys", POLYGON), ("Strips", STRIP), ("Cells", 0)):
            group = node.first(tag)
            arrays = {a.attributes.get("Name", ""): a for a in group.named("DataArray")} if group else {}
            if "connectivity" not in arrays or "offsets" not in arrays:
                continue
            corners = self._values(arrays["connectivity"]).astype(np.int64).ravel()
            ends = self._values(arrays["offsets"]).astype(np.int64).ravel()
            types = self._values(arrays["types"]).ravel() if tag == "Cells" else np.full(len(ends), kind)
            if len(ends) and ends[-1] != len(corners):
                message = f"the cells of {tag} end at {ends[-1]}, their list of corners at {len(corners)}"
                raise FileFormatError(message)
            lists.append((corners, ends + shift, types.astype(np.int64)))
            shift += len(corners)
        if not lists:
            nothing = np.empty(0, dtype=np.int64)
            return nothing, nothing, nothing
        corners, ends, types = (np.concatenate([part[k] for part in lists]) for k in range(3))
        return corners, ends, types

    def _point_data(self, node: Node, count: int) -> dict[str, NDArray[Any]]:
        group = node.first("PointData")
        arrays: dict[str, NDArray[Any]] = {}
        for array in group.named("DataArray") if group is not None else ():
            if array.attributes.get("type") in _TYPES:
                values = self._values(array)
                if len(values) != count:
                    name = array.attributes.get("Name")
                    message = f"the point data {name!r} have {len(values)} rows, not {count}"
                    raise FileFormatError(message)
                arrays[array.attributes.get("Name", f"array_{len(arrays)}")] = values
        return arrays

    def _values(self, node: Node) -> NDArray[Any]:
        kind = node.attributes.get("type", "")
        if kind not in _TYPES:
            message = f"a data array of type {kind!r} is not read"
            raise FileFormatError(message)
        dtype = np.dtype(_TYPES[kind])
        layout = node.attributes.get("format", "ascii")
        if layout == "ascii":
            words = node.text.encode("ascii").split()
            values = (floats if dtype.kind == "f" else integers)(words)
        else:
            raw = self._bytes(node, layout)
            values = np.frombuffer(raw, dtype=self._order + _TYPES[kind])
        values = values.astype(dtype)
        width = int(node.attributes.get("NumberOfComponents", "1") or "1")
        return values if width == 1 else values.reshape(-1, width)

    def _bytes(self, node: Node, layout: str) -> bytes:
        if layout == "binary":
            stream = _base64(node.text.encode("ascii"))
        elif layout == "appended":
            at = int(node.attributes["offset"])
            end = next((offset for offset in self._offsets if offset > at), len(self._appended))
            if not 0 <= at < len(self._appended):
                message = f"an array is said to start at byte {at} of {len(self._appended)} appended bytes"
                raise FileFormatError(message)
            stream = self._appended[at:end] if self._raw else _base64(self._appended[at:end])
        else:
            message = f"data in the format {layout!r} are not read"
            raise FileFormatError(message)
        return self._unpacked(stream)

    def _unpacked(self, stream: bytes) -> bytes:
        size = self._header.itemsize
        if self._compressor not in ("", _ZLIB, _LZMA):
            message = f"data compressed with {self._compressor} are not read; save the file with zlib"
            raise FileFormatError(message)
        claimed("header words", 1, size, len(stream))
        first = int(np.frombuffer(stream, dtype=self._header, count=1)[0])
        if not self._compressor:
            claimed("bytes", first, 1, len(stream) - size)
            return stream[size : size + first]
        claimed("blocks", first, size, len(stream) - size)
        if not first:
            return b""
        claimed("header words", 3 + first, size, len(stream))
        _, full, last, *packed = np.frombuffer(stream, dtype=self._header, count=3 + first).tolist()
        at = (3 + first) * size
        claimed("compressed bytes", sum(packed), 1, len(stream) - at)
        blocks = []
        for number, length in enumerate(packed):
            expected = last if number == first - 1 and last else full
            blocks.append(self._block(stream[at : at + length], expected))
            at += length
        return b"".join(blocks)

    def _block(self, data: bytes, expected: int) -> bytes:
        if self._compressor == _ZLIB:
            return self._inflater.inflate(data, expected=expected)
        result = lzma.LZMADecompressor(memlimit=1 << 28).decompress(data, max_length=expected)
        if len(result) != expected:
            message = f"a compressed block has {len(result)} bytes where its header claims {expected}"
            raise FileFormatError(message)
        return result


def _all_offsets(node: Node) -> list[int]:
    own = [int(node.attributes["offset"])] if node.tag == "DataArray" and "offset" in node.attributes else []
    return own + [offset for child in node.children for offset in _all_offsets(child)]


def _base64(text: bytes) -> bytes:
    # Header and data may be encoded apart, so padding can stand in the middle.
    joined = b"".join(text.split())
    return b"".join(base64.b64decode(part, validate=True) for part in re.findall(rb"[^=]+={0,2}", joined))
