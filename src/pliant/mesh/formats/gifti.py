"""GIFTI: neuroimaging's XML surface format."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import as_indices
from ...errors import FileFormatError, InputError
from ..surface import Mesh
from .contents import Contents, no_polygons
from .raw import Inflater
from .text import floats, integers
from .xml import Node, parsed

_TYPES = {
    "NIFTI_TYPE_UINT8": "u1", "NIFTI_TYPE_INT8": "i1", "NIFTI_TYPE_INT16": "i2", "NIFTI_TYPE_UINT16": "u2",
    "NIFTI_TYPE_INT32": "i4", "NIFTI_TYPE_UINT32": "u4", "NIFTI_TYPE_INT64": "i8", "NIFTI_TYPE_UINT64": "u8",
    "NIFTI_TYPE_FLOAT32": "f4", "NIFTI_TYPE_FLOAT64": "f8",
}  # fmt: skip
_POINTS, _TRIANGLES = "NIFTI_INTENT_POINTSET", "NIFTI_INTENT_TRIANGLE"
_CODES = {"1008": _POINTS, "1009": _TRIANGLES}
_IDENTITY = """<CoordinateSystemTransformMatrix>
<DataSpace><![CDATA[NIFTI_XFORM_UNKNOWN]]></DataSpace>
<TransformedSpace><![CDATA[NIFTI_XFORM_UNKNOWN]]></TransformedSpace>
<MatrixData>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</MatrixData>
</CoordinateSystemTransformMatrix>
"""


def read(data: bytes) -> Contents:
    """Parse a GIFTI file; coordinate transforms are not applied, as in nibabel."""
    root = parsed(data)
    inflater = Inflater(len(data))
    points: list[NDArray[Any]] = []
    triangles: list[NDArray[Any]] = []
    arrays: dict[str, NDArray[Any]] = {}
    for number, node in enumerate(root.named("DataArray")):
        intent = node.attributes.get("Intent", "")
        values = _values(node, inflater, number)
        if _CODES.get(intent, intent) == _POINTS:
            points.append(_three_columns(values, "points"))
        elif _CODES.get(intent, intent) == _TRIANGLES:
            triangles.append(_three_columns(values, "triangles"))
        else:
            arrays[_unused(_name(node) or f"array_{len(arrays)}", arrays)] = values
    notes = []
    if len(points) > 1 or len(triangles) > 1:
        notes.append(
            f"{len(points)} point sets and {len(triangles)} triangle lists: the first of each is used"
        )
    corners, sizes = no_polygons()
    if triangles:
        # Some writers store the triangles as float; whole numbers are taken, others refused.
        corners, sizes = as_indices(triangles[0], "triangles").ravel(), np.full(len(triangles[0]), 3)
    return Contents(points[0].astype(np.float64) if points else None, corners, sizes, arrays, tuple(notes))


def write(mesh: Mesh, data: Mapping[str, NDArray[Any]]) -> bytes:
    """Write a surface: float32 points and int32 triangles, as the standard has them."""
    del data
    blocks = [
        _block(mesh.vertices.astype("<f4"), _POINTS, extra=_IDENTITY),
        _block(mesh.faces.astype("<i4"), _TRIANGLES),
    ]
    return _document(blocks)


def write_arrays(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Write one data array for each per-vertex array: float32, int32 or uint8."""
    return _document([_block(_storable(name, array), _intent(array), name) for name, array in arrays.items()])


def _intent(array: NDArray[Any]) -> str:
    return "NIFTI_INTENT_NONE" if array.dtype.kind == "f" and array.ndim == 2 else "NIFTI_INTENT_SHAPE"


def _storable(name: str, array: NDArray[Any]) -> NDArray[Any]:
    if array.dtype.kind == "f":
        return array.astype("<f4")
    if array.dtype in (np.bool_, np.uint8):
        return array.astype("u1")
    if array.size and (array.min() < -(2**31) or array.max() >= 2**31):
        message = f"{name} has whole numbers beyond 32 bits, which GIFTI cannot hold; save it as NPZ"
        raise InputError(message)
    return array.astype("<i4")


def _block(values: NDArray[Any], intent: str, name: str = "", *, extra: str = "") -> str:
    kind = {"f": "NIFTI_TYPE_FLOAT32", "i": "NIFTI_TYPE_INT32", "u": "NIFTI_TYPE_UINT8"}[values.dtype.kind]
    sizes = " ".join(f'Dim{axis}="{size}"' for axis, size in enumerate(values.shape))
    meta = f"<MD><Name>Name</Name><Value>{escape(name)}</Value></MD>" if name else ""
    text = base64.b64encode(zlib.compress(np.ascontiguousarray(values).tobytes())).decode("ascii")
    return (
        f'<DataArray Intent="{intent}" DataType="{kind}" ArrayIndexingOrder="RowMajorOrder" '
        f'Dimensionality="{values.ndim}" {sizes} Encoding="GZipBase64Binary" Endian="LittleEndian" '
        f'ExternalFileName="" ExternalFileOffset="">\n<MetaData>{meta}</MetaData>\n{extra}'
        f"<Data>{text}</Data>\n</DataArray>\n"
    )


def _document(blocks: list[str]) -> bytes:
    head = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<!DOCTYPE GIFTI SYSTEM "http://www.nitrc.org/frs/download.php/115/gifti.dtd">\n'
        f'<GIFTI Version="1.0" NumberOfDataArrays="{len(blocks)}">\n<MetaData/>\n<LabelTable/>\n'
    )
    return (head + "".join(blocks) + "</GIFTI>\n").encode("utf-8")


def _name(node: Node) -> str:
    meta = node.first("MetaData")
    for entry in meta.named("MD") if meta is not None else ():
        key, value = entry.first("Name"), entry.first("Value")
        if key is not None and value is not None and key.text.strip() == "Name":
            return value.text.strip()
    return ""


def _unused(name: str, taken: Mapping[str, Any]) -> str:
    number, candidate = 1, name
    while candidate in taken:
        number += 1
        candidate = f"{name}_{number}"
    return candidate


def _three_columns(values: NDArray[Any], what: str) -> NDArray[Any]:
    if values.ndim != 2 or values.shape[1] != 3:
        message = f"the {what} have shape {values.shape} where (count, 3) is needed"
        raise FileFormatError(message)
    return values


def _values(node: Node, inflater: Inflater, number: int) -> NDArray[Any]:
    attributes = node.attributes
    shape = tuple(int(attributes[f"Dim{axis}"]) for axis in range(int(attributes["Dimensionality"])))
    if attributes["DataType"] not in _TYPES or min(shape, default=0) < 0:
        message = f"data array {number}: type {attributes['DataType']} of shape {shape} is not read"
        raise FileFormatError(message)
    big = "BIG" in attributes.get("Endian", "").upper()
    dtype = np.dtype(_TYPES[attributes["DataType"]]).newbyteorder(">" if big else "<")
    data = node.first("Data")
    flat = _decoded(attributes["Encoding"], data.text if data is not None else "", shape, dtype, inflater)
    column = attributes.get("ArrayIndexingOrder", "").startswith("Col")
    values = flat.reshape(shape, order="F" if column else "C")
    return values.astype(dtype.newbyteorder("="), order="C")


def _decoded(
    encoding: str, text: str, shape: tuple[int, ...], dtype: np.dtype[Any], inflater: Inflater
) -> NDArray[Any]:
    count = int(np.prod([*shape], dtype=object)) if shape else 1
    if encoding == "ASCII":
        words = text.encode("ascii").split()
        values = (floats if dtype.kind == "f" else integers)(words)
        if len(values) != count:
            message = f"a data array has {len(values)} numbers where its shape {shape} needs {count}"
            raise FileFormatError(message)
        return values.astype(dtype)
    if encoding not in ("Base64Binary", "GZipBase64Binary"):
        message = f"data encoded as {encoding} is not read; save the file with GZipBase64Binary"
        raise FileFormatError(message)
    raw = base64.b64decode("".join(text.split()), validate=True)
    if encoding == "GZipBase64Binary":
        raw = inflater.inflate(raw, expected=count * dtype.itemsize)
    if len(raw) != count * dtype.itemsize:
        message = f"a data array has {len(raw)} bytes where its shape {shape} needs {count * dtype.itemsize}"
        raise FileFormatError(message)
    return np.frombuffer(raw, dtype=dtype)
