"""PLY: Stanford's polygon format, text and binary of either byte order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..._arrays import as_indices
from ...errors import FileFormatError, InputError
from ..surface import Mesh
from .contents import Contents, no_polygons
from .text import claimed, floats, integers, shown

_TYPES = {
    b"char": "i1", b"int8": "i1", b"uchar": "u1", b"uint8": "u1", b"short": "i2", b"int16": "i2",
    b"ushort": "u2", b"uint16": "u2", b"int": "i4", b"int32": "i4", b"uint": "u4", b"uint32": "u4",
    b"float": "f4", b"float32": "f4", b"double": "f8", b"float64": "f8",
}  # fmt: skip
_NAMES = {
    "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint", "f4": "float",
    "f8": "double",
}  # fmt: skip
_ORDERS = {b"binary_little_endian": "<", b"binary_big_endian": ">", b"ascii": ""}
_LISTS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True)
class _Property:
    name: str
    dtype: str
    count_dtype: str = ""  # empty where the property is one number


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


@dataclass(frozen=True, eq=False)
class _Lists:
    values: NDArray[Any]
    sizes: NDArray[np.int64]


_Columns: TypeAlias = dict[str, "NDArray[Any] | _Lists"]


def read(data: bytes) -> Contents:
    """Parse a PLY file; elements other than vertices and faces are passed over."""
    order, elements, at = _header(data)
    columns: dict[str, _Columns] = {}
    tokens = data[at:].split() if not order else []
    if not order:
        at = 0
    for element in elements:
        if element.name in columns:
            message = f"the header declares the element {element.name} twice"
            raise FileFormatError(message)
        rows, at = _binary(element, data, at, order) if order else _text(element, tokens, at)
        columns[element.name] = rows
    if "tristrips" in columns:
        raise FileFormatError("triangle strips are not read; save the file with a face list")
    extra = len(data) - at if order else len(tokens) - at
    if order and not data[at:].strip():
        extra = 0
    note = f"{extra} {'bytes' if order else 'numbers'} after the last element are passed over"
    return _contents(columns, (note,) if extra else ())


def write(mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    """Write little-endian binary PLY, positions in float64, each array as vertex properties."""
    fields = _fields(data)
    vertex = np.empty(mesh.n_vertices, dtype=[(axis, "<f8") for axis in "xyz"] + [f[:2] for f in fields])
    for axis, name in enumerate("xyz"):
        vertex[name] = mesh.vertices[:, axis]
    for name, _, values in fields:
        vertex[name] = values
    face = np.empty(mesh.n_faces, dtype=[("count", "u1"), ("corners", "<i4", 3)])
    face["count"], face["corners"] = 3, mesh.faces
    named = [f"property {_NAMES[code.lstrip('<|')]} {name}" for name, code, _ in fields]
    header = [
        "ply", "format binary_little_endian 1.0", f"element vertex {mesh.n_vertices}",
        *(f"property double {axis}" for axis in "xyz"), *named,
        f"element face {mesh.n_faces}", "property list uchar int vertex_indices", "end_header", "",
    ]  # fmt: skip
    return "\n".join(header).encode("ascii") + vertex.tobytes() + face.tobytes()


def _fields(data: Mapping[str, NDArray[Any]]) -> list[tuple[str, str, NDArray[Any]]]:
    fields: list[tuple[str, str, NDArray[Any]]] = []
    for name, array in data.items():
        values = _storable(name, array)
        if values.ndim == 1:
            fields.append((name, values.dtype.str, values))
        else:
            fields += [(f"{name}_{k}", values.dtype.str, values[:, k]) for k in range(values.shape[1])]
    names = [name for name, _, _ in fields]
    bad = [name for name in names if not name.isascii() or not name.isprintable() or " " in name or not name]
    bad += [name for name in names if names.count(name) > 1 or name in "xyz"]
    if bad:
        message = (
            f"{len(bad)} names cannot be PLY properties, first {bad[0]!r}: they must be unique printable "
            "ASCII without spaces, and not x, y or z"
        )
        raise InputError(message)
    return fields


def _storable(name: str, array: NDArray[Any]) -> NDArray[Any]:
    if array.dtype == np.bool_:
        return array.astype("u1")
    if array.dtype.str[1:] in ("i8", "u8"):
        if array.size and (array.min() < -(2**31) or array.max() >= 2**31):
            message = f"{name} has whole numbers beyond 32 bits, which PLY cannot hold; save it as NPZ"
            raise InputError(message)
        return array.astype("<i4")
    if array.dtype == np.float16:
        return array.astype("<f4")
    return array.astype(array.dtype.newbyteorder("<"))


def _header(data: bytes) -> tuple[str, list[_Element], int]:
    end = data.find(b"end_header")
    if end < 0:
        raise FileFormatError("the header has no end_header line: the file is truncated or not PLY")
    newline = b"\r\n" if data[3:5] == b"\r\n" else data[3:4]
    at = data.find(newline, end)
    at = len(data) if at < 0 else at + len(newline)
    lines = [line.split() for line in data[:end].replace(b"\r", b"\n").split(b"\n")[1:]]
    lines = [words for words in lines if words and words[0] not in (b"comment", b"obj_info")]
    if not lines or lines[0][0] != b"format" or len(lines[0]) != 3 or lines[0][1] not in _ORDERS:
        message = f"the header has no known format line, got {shown(b' '.join(lines[0]) if lines else b'')}"
        raise FileFormatError(message)
    elements: list[_Element] = []
    for words in lines[1:]:
        if words[0] == b"element" and len(words) == 3:
            elements.append(_Element(words[1].decode("latin-1"), int(integers(words[2:])[0]), ()))
        elif words[0] == b"property" and elements:
            last = elements[-1]
            elements[-1] = _Element(last.name, last.count, (*last.properties, _property(words, last)))
        else:
            message = f"the header has a line that is not PLY: {shown(b' '.join(words))}"
            raise FileFormatError(message)
    return _ORDERS[lines[0][1]], elements, at


def _property(words: list[bytes], element: _Element) -> _Property:
    name = words[-1].decode("latin-1")
    if any(other.name == name for other in element.properties):
        message = f"the header declares the property {name} of {element.name} twice"
        raise FileFormatError(message)
    if len(words) == 3 and words[1] in _TYPES:
        return _Property(name, _TYPES[words[1]])
    if len(words) == 5 and words[1] == b"list" and words[2] in _TYPES and words[3] in _TYPES:
        if _TYPES[words[2]].startswith("f"):
            message = f"the lists of {name} are counted in {words[2].decode()}, not in whole numbers"
            raise FileFormatError(message)
        return _Property(name, _TYPES[words[3]], _TYPES[words[2]])
    message = f"the header has a property of unknown type: {shown(b' '.join(words))}"
    raise FileFormatError(message)


def _binary(element: _Element, data: bytes, at: int, order: str) -> tuple[_Columns, int]:
    least = sum(np.dtype(p.count_dtype or p.dtype).itemsize for p in element.properties)
    claimed(f"{element.name} rows", element.count, least, len(data) - at)
    if not element.properties or not element.count:
        return _empty(element), at
    columns = _uniform_rows(element, data, at, order)
    return columns if columns is not None else _walked_rows(element, data, at, order)


def _empty(element: _Element) -> _Columns:
    nothing = np.empty(0, dtype=np.int64)
    return {
        p.name: _Lists(nothing, nothing) if p.count_dtype else np.empty(0, dtype=p.dtype)
        for p in element.properties
    }


def _uniform_rows(element: _Element, data: bytes, at: int, order: str) -> tuple[_Columns, int] | None:
    """Read rows whose lists are all as long as in the first one, as one array; None if they are not."""
    fields: list[tuple[str, str] | tuple[str, str, int]] = []
    where = at
    for number, p in enumerate(element.properties):
        length = 1
        if p.count_dtype:
            length = _list_length(p, data, where, order)
            fields.append((f"n{number}", order + p.count_dtype))
            where += np.dtype(p.count_dtype).itemsize
            fields.append((f"v{number}", order + p.dtype, (length,)))  # type: ignore[arg-type]
        else:
            fields.append((f"v{number}", order + p.dtype))
        where += length * np.dtype(p.dtype).itemsize
    dtype = np.dtype(fields)
    if element.count * dtype.itemsize > len(data) - at:
        if not any(p.count_dtype for p in element.properties):
            claimed(f"{element.name} rows", element.count, dtype.itemsize, len(data) - at)
        return None
    rows = np.frombuffer(data, dtype=dtype, count=element.count, offset=at)
    columns: _Columns = {}
    for number, p in enumerate(element.properties):
        values = rows[f"v{number}"]
        if p.count_dtype:
            lengths = rows[f"n{number}"].astype(np.int64)
            if (lengths != values.shape[1]).any():
                return None
            columns[p.name] = _Lists(values.ravel(), lengths)
        else:
            columns[p.name] = values
    return columns, at + rows.nbytes


def _list_length(p: _Property, data: bytes, at: int, order: str) -> int:
    count = np.dtype(order + p.count_dtype)
    claimed(f"list of {p.name}", 1, count.itemsize, len(data) - at)
    length = int(np.frombuffer(data, dtype=count, count=1, offset=at)[0])
    claimed(
        f"entries of one list of {p.name}",
        length,
        np.dtype(p.dtype).itemsize,
        len(data) - at - count.itemsize,
    )
    return length


def _walked_rows(element: _Element, data: bytes, at: int, order: str) -> tuple[_Columns, int]:
    found: dict[str, list[NDArray[Any]]] = {p.name: [] for p in element.properties}
    for _ in range(element.count):
        for p in element.properties:
            length = 1
            if p.count_dtype:
                length = _list_length(p, data, at, order)
                at += np.dtype(p.count_dtype).itemsize
            item = np.dtype(order + p.dtype)
            claimed(p.name, length, item.itemsize, len(data) - at)
            found[p.name].append(np.frombuffer(data, dtype=item, count=length, offset=at))
            at += length * item.itemsize
    return {p.name: _gathered(p, found[p.name]) for p in element.properties}, at


def _gathered(p: _Property, rows: list[NDArray[Any]]) -> NDArray[Any] | _Lists:
    values = np.concatenate(rows)
    if not p.count_dtype:
        return values
    return _Lists(values, np.fromiter(map(len, rows), dtype=np.int64, count=len(rows)))


def _text(element: _Element, tokens: list[bytes], at: int) -> tuple[_Columns, int]:
    width = len(element.properties)
    if element.count * width > len(tokens) - at or element.count < 0:
        message = (
            f"the header claims {element.count} {element.name} rows of at least {width} numbers, but "
            f"{len(tokens) - at} numbers are left: the file is truncated or its header is wrong"
        )
        raise FileFormatError(message)
    if not width or not element.count:
        return _empty(element), at
    if not any(p.count_dtype for p in element.properties):
        end = at + element.count * width
        return {
            p.name: _parsed(p, tokens[at + k : end : width]) for k, p in enumerate(element.properties)
        }, end
    found: dict[str, list[bytes]] = {p.name: [] for p in element.properties}
    sizes: dict[str, list[int]] = {p.name: [] for p in element.properties}
    for row in range(element.count):
        for p in element.properties:
            length = 1
            if p.count_dtype:
                length = int(tokens[at]) if at < len(tokens) else -1
                at += 1
            if length < 0 or at + length > len(tokens):
                message = f"{element.name} {row} is cut short or has a negative count: the file is truncated"
                raise FileFormatError(message)
            found[p.name] += tokens[at : at + length]
            sizes[p.name].append(length)
            at += length
    return {
        p.name: _Lists(_parsed(p, found[p.name]), np.array(sizes[p.name], dtype=np.int64))
        if p.count_dtype
        else _parsed(p, found[p.name])
        for p in element.properties
    }, at


def _parsed(p: _Property, tokens: list[bytes]) -> NDArray[Any]:
    if p.dtype.startswith("f"):
        return floats(tokens)
    values = integers(tokens)
    limits = np.iinfo(p.dtype)
    if values.size and (values.min() < limits.min or values.max() > limits.max):
        message = f"{p.name} has values that do not fit its declared type"
        raise FileFormatError(message)
    return values.astype(p.dtype)


def _contents(columns: dict[str, _Columns], notes: tuple[str, ...]) -> Contents:
    vertex = columns.get("vertex", {})
    scalars = {name: values for name, values in vertex.items() if isinstance(values, np.ndarray)}
    if not {"x", "y", "z"} <= scalars.keys():
        raise FileFormatError("no vertices: the header has no element vertex with properties x, y and z")
    vertices = np.column_stack([scalars.pop(axis).astype(np.float64) for axis in "xyz"])
    face = columns.get("face", {})
    lists = {name: values for name, values in face.items() if isinstance(values, _Lists)}
    chosen = next((lists[name] for name in _LISTS if name in lists), None)
    if chosen is None and face:
        message = f"the element face has no list named vertex_indices, it has {', '.join(map(repr, face))}"
        raise FileFormatError(message)
    corners, sizes = no_polygons() if chosen is None else (chosen.values, chosen.sizes)
    native = {name: values.astype(values.dtype.newbyteorder("=")) for name, values in scalars.items()}
    return Contents(vertices, as_indices(corners, "vertex_indices"), sizes, native, notes)
