"""Legacy VTK (.vtk): polygonal data and unstructured grids, text and binary, versions 1 to 5.1."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import IntArray
from ...errors import FileFormatError, InputError
from ..surface import Mesh
from .contents import Contents
from .text import claimed, floats, integers, shown
from .vtk_cells import POLYGON, STRIP, surface_polygons

MAGIC = b"# vtk DataFile"
_TYPES = {
    "char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2", "int": "i4",
    "unsigned_int": "u4", "long": "i8", "unsigned_long": "u8", "float": "f4", "double": "f8",
    "vtkidtype": "i4", "vtktypeint64": "i8", "vtktypeuint64": "u8", "vtktypeint32": "i4",
    "vtktypeuint32": "u4", "vtktypeint16": "i2", "vtktypeuint16": "u2", "vtktypeint8": "i1",
    "vtktypeuint8": "u1", "vtktypefloat32": "f4", "vtktypefloat64": "f8",
}  # fmt: skip
_WORDS = {
    "i1": "char", "u1": "unsigned_char", "i2": "short", "u2": "unsigned_short", "i4": "int",
    "u4": "unsigned_int", "i8": "vtktypeint64", "u8": "vtktypeuint64", "f4": "float", "f8": "double",
}  # fmt: skip
_WIDTHS = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "GLOBAL_IDS": 1, "PEDIGREE_IDS": 1}


def read(data: bytes) -> Contents:
    """Parse a legacy file; cell data are passed over."""
    return _Reader(data).contents()


def write(mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    """Write binary polygonal data, version 3.0, float64 positions, arrays as point data."""
    rows = np.column_stack([np.full(mesh.n_faces, 3), mesh.faces]).astype(">i4")
    parts = [
        b"# vtk DataFile Version 3.0\nwritten by pliant\nBINARY\nDATASET POLYDATA\n",
        f"POINTS {mesh.n_vertices} double\n".encode(),
        mesh.vertices.astype(">f8").tobytes(),
        f"\nPOLYGONS {mesh.n_faces} {rows.size}\n".encode(),
        rows.tobytes(),
    ]
    if data:
        parts.append(f"\nPOINT_DATA {mesh.n_vertices}\nFIELD FieldData {len(data)}\n".encode())
    for name, array in data.items():
        if not name or any(character.isspace() for character in name):
            message = f"{name!r} cannot name a VTK array: no spaces, and not empty"
            raise InputError(message)
        values = array.astype("u1") if array.dtype == np.bool_ else array
        values = values.astype("f4") if values.dtype == np.float16 else values
        width = 1 if values.ndim == 1 else values.shape[1]
        word = _WORDS[values.dtype.str[1:]]
        parts.append(f"{name} {width} {mesh.n_vertices} {word}\n".encode())
        parts.append(values.astype(values.dtype.newbyteorder(">")).tobytes() + b"\n")
    return b"".join(parts)


class _Reader:
    """Walks a legacy file once, section by section."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0
        self._vertices: NDArray[np.float64] | None = None
        self._cells: list[tuple[IntArray, IntArray, int | None]] = []
        self._types: IntArray | None = None
        self._arrays: dict[str, NDArray[Any]] = {}
        self._place = ""
        self._count = 0
        heading = self._line()
        self._split_cells = float(heading.split()[-1]) >= 5
        self._line()  # the title, which may be anything
        encoding = self._line().strip().upper()
        if encoding not in (b"ASCII", b"BINARY"):
            message = f"third line must be ASCII or BINARY, got {shown(encoding)}"
            raise FileFormatError(message)
        self._binary = encoding == b"BINARY"

    def contents(self) -> Contents:
        while (words := self._words()) is not None:
            self._section(words)
        if self._vertices is None:
            raise FileFormatError("no POINTS section")
        connectivity, ends, types = self._joined_cells()
        corners, sizes, notes = surface_polygons(connectivity, ends, types)
        return Contents(self._vertices, corners, sizes, self._arrays, notes)

    def _section(self, words: list[str]) -> None:
        keyword = words[0].upper()
        if keyword == "DATASET":
            if words[1].upper() not in ("POLYDATA", "UNSTRUCTURED_GRID"):
                message = (
                    f"a dataset of type {words[1]} is not a surface; POLYDATA and UNSTRUCTURED_GRID are read"
                )
                raise FileFormatError(message)
        elif keyword == "POINTS":
            self._vertices = self._values(3 * int(words[1]), words[2]).astype(np.float64).reshape(-1, 3)
        elif keyword in ("POLYGONS", "TRIANGLE_STRIPS", "CELLS", "LINES", "VERTICES"):
            kind = {"POLYGONS": POLYGON, "TRIANGLE_STRIPS": STRIP, "LINES": 4, "VERTICES": 2}.get(keyword)
            self._cells.append((*self._cell_lists(int(words[1]), int(words[2])), kind))
        elif keyword == "CELL_TYPES":
            self._types = self._values(int(words[1]), "int").astype(np.int64)
        elif keyword in ("POINT_DATA", "CELL_DATA"):
            self._place, self._count = keyword, int(words[1])
        elif keyword == "METADATA":
            while self._line().strip():
                pass
        elif keyword == "FIELD":
            self._field(int(words[2]))
        else:
            self._attribute(keyword, words)

    def _attribute(self, keyword: str, words: list[str]) -> None:
        if keyword == "SCALARS":
            width = int(words[3]) if len(words) > 3 else 1
            self._keep(words[1], self._values(width * self._count, words[2]), width)
        elif keyword == "LOOKUP_TABLE":
            # "LOOKUP_TABLE default" belongs to SCALARS; with a size it is a table of colours.
            if len(words) > 2:
                self._values(4 * int(words[2]), "unsigned_char" if self._binary else "float")
        elif keyword == "COLOR_SCALARS":
            width = int(words[2])
            kind = "unsigned_char" if self._binary else "float"
            self._keep(words[1], self._values(width * self._count, kind), width)
        elif keyword in _WIDTHS:
            self._keep(words[1], self._values(_WIDTHS[keyword] * self._count, words[2]), _WIDTHS[keyword])
        elif keyword == "TEXTURE_COORDINATES":
            self._keep(words[1], self._values(int(words[2]) * self._count, words[3]), int(words[2]))
        else:
            message = f"unknown section {shown(keyword.encode())} at byte {self._at}"
            raise FileFormatError(message)

    def _field(self, count: int) -> None:
        for _ in range(count):
            words = self._words()
            if words is not None and words[0].upper() == "METADATA":
                self._section(words)
                words = self._words()
            if words is None:
                raise FileFormatError("the file ends inside a FIELD section: it is truncated")
            name, width, rows, kind = words[0], int(words[1]), int(words[2]), words[3]
            values = self._values(width * rows, kind)
            if rows == self._count:
                self._keep(name, values, width)

    def _keep(self, name: str, values: NDArray[Any], width: int) -> None:
        if self._place == "POINT_DATA":
            self._arrays[name] = values if width == 1 else values.reshape(-1, width)

    def _cell_lists(self, count: int, size: int) -> tuple[IntArray, IntArray]:
        """Corners and ends of cells, from either of the two layouts."""
        if self._split_cells:
            offsets = self._labelled(b"OFFSETS", count)
            if not len(offsets) or offsets[0] != 0:
                raise FileFormatError("the OFFSETS of the cells do not start at 0")
            return self._labelled(b"CONNECTIVITY", size), offsets[1:]
        flat = self._values(size, "int").astype(np.int64)
        if size == 4 * count and (flat[::4] == 3).all():
            return flat.reshape(-1, 4)[:, 1:].ravel(), 3 * np.arange(1, count + 1)
        corners, ends, at = [flat[:0]], [], 0
        for number in range(count):
            length = int(flat[at]) if at < size else -1
            if length < 0 or at + 1 + length > size:
                message = f"cell {number} of {count} reaches outside its section"
                raise FileFormatError(message)
            corners.append(flat[at + 1 : at + 1 + length])
            ends.append(length)
            at += 1 + length
        return np.concatenate(corners), np.cumsum(np.array(ends, dtype=np.int64))

    def _labelled(self, label: bytes, count: int) -> IntArray:
        words = self._words()
        if words is None or words[0].upper().encode() != label:
            message = f"{label.decode()} expected at byte {self._at}"
            raise FileFormatError(message)
        return self._values(count, words[1]).astype(np.int64)

    def _joined_cells(self) -> tuple[IntArray, IntArray, IntArray]:
        if not self._cells:
            nothing = np.empty(0, dtype=np.int64)
            return nothing, nothing, nothing
        shifts = np.cumsum([0] + [len(corners) for corners, _, _ in self._cells])
        corners = np.concatenate([corners for corners, _, _ in self._cells])
        ends = np.concatenate(
            [ends + shift for (_, ends, _), shift in zip(self._cells, shifts, strict=False)]
        )
        if any(kind is None for _, _, kind in self._cells):
            if self._types is None or len(self._cells) > 1:
                raise FileFormatError("the CELLS of an unstructured grid need one CELL_TYPES section")
            return corners, ends, self._types
        kinds = [np.full(len(ends), kind) for _, ends, kind in self._cells]
        return corners, ends, np.concatenate(kinds).astype(np.int64)

    def _line(self) -> bytes:
        if self._at >= len(self._data):
            return b""
        end = self._data.find(b"\n", self._at)
        end = len(self._data) if end < 0 else end
        line = self._data[self._at : end]
        self._at = end + 1
        return line

    def _words(self) -> list[str] | None:
        """Words of the next line that has some; None at the end of the file."""
        while self._at < len(self._data):
            line = self._line()
            if line.strip():
                return line.decode("latin-1").split()
        return None

    def _values(self, count: int, kind: str) -> NDArray[Any]:
        if kind.lower() not in _TYPES:
            message = f"values of type {shown(kind.encode())} are not read"
            raise FileFormatError(message)
        dtype = np.dtype(_TYPES[kind.lower()])
        claimed(f"{kind} values", count, dtype.itemsize if self._binary else 1, len(self._data) - self._at)
        if self._binary:
            raw = np.frombuffer(self._data, dtype=dtype.newbyteorder(">"), count=count, offset=self._at)
            self._at += raw.nbytes
            return raw.astype(dtype)
        return self._text_values(count, dtype)

    def _text_values(self, count: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        self._skip_lookup_table()
        if not count:
            return np.empty(0, dtype=dtype)
        rest = self._data[self._at :]
        tokens = rest.split(None, count)
        if len(tokens) < count:
            message = f"{count} values are claimed, {len(tokens)} are left: the file is truncated"
            raise FileFormatError(message)
        self._at = len(self._data) - (len(tokens[count]) if len(tokens) > count else 0)
        return (floats if dtype.kind == "f" else integers)(tokens[:count]).astype(dtype)

    def _skip_lookup_table(self) -> None:
        after = self._at
        words = self._words()
        if words is None or words[0].upper() != "LOOKUP_TABLE":
            self._at = after
