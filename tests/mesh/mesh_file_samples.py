"""One small mesh, written by hand in every dialect the readers know."""

from __future__ import annotations

import base64
import gzip
import struct
import zlib

import numpy as np

# An octahedron, with coordinates that float32 and int16 hundredths hold exactly.
VERTICES = np.array(
    [[1.5, 0, 0], [-1.5, 0, 0], [0, 2.25, 0], [0, -2.25, 0], [0, 0, 3], [0, 0, -3]], dtype=np.float64
)
FACES = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
VALUES = np.array([0.5, 1.5, 2.5, 3.5, 4.5, 5.5], dtype=np.float32)


def rows(array: np.ndarray, prefix: str = "") -> str:
    return "".join(prefix + " ".join(str(value) for value in row) + "\n" for row in array.tolist())


def off() -> bytes:
    return f"OFF\n# a comment\n6 8 12\n{rows(VERTICES)}\n{rows(FACES, '3 ')}".encode()


def off_one_line() -> bytes:
    coloured = "".join(f"3 {a} {b} {c} 255 0 0\n" for a, b, c in FACES)
    return f"COFF6 8 12\n{rows(np.hstack([VERTICES, np.ones((6, 4))]))}{coloured}".encode()


def obj() -> bytes:
    corners = "".join(
        "f " + " ".join(f"{v + 1}/{k}/1" for k, v in enumerate(face, 1)) + "\n" for face in FACES
    )
    texture = "vt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n"
    return f"# made by hand\nmtllib x.mtl\no it\n{rows(VERTICES, 'v ')}{texture}usemtl y\ns off\n{corners}".encode()


def obj_relative() -> bytes:
    return (rows(VERTICES, "v ") + "".join(f"f {a - 6} {b - 6} {c - 6}\n" for a, b, c in FACES)).encode()


def _ply_header(form: str, newline: str = "\n") -> bytes:
    lines = [
        "ply", f"format {form} 1.0", "comment made by hand", "element vertex 6", "property float x",
        "property float y", "property float z", "property float height", "element face 8",
        "property uchar quality", "property list uchar int vertex_indices", "end_header", "",
    ]  # fmt: skip
    return newline.join(lines).encode()


def ply_text(newline: str = "\n") -> bytes:
    body = rows(np.column_stack([VERTICES, VALUES])) + "".join(f"7 3 {a} {b} {c}\n" for a, b, c in FACES)
    return _ply_header("ascii", newline) + body.replace("\n", newline).encode()


def ply_binary(order: str, newline: str = "\n") -> bytes:
    vertex = np.column_stack([VERTICES, VALUES]).astype(order + "f4").tobytes()
    face = b"".join(struct.pack(order + "BB3i", 7, 3, *face) for face in FACES.tolist())
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    return _ply_header(name, newline) + vertex + face


def stl_text() -> bytes:
    facets = "".join(
        "facet normal 0 0 0\n outer loop\n" + rows(VERTICES[face], "  vertex ") + " endloop\nendfacet\n"
        for face in FACES
    )
    return f"solid octahedron\n{facets}endsolid octahedron\n".encode()


def stl_binary() -> bytes:
    # Starts with "solid", as many binary files do.
    facets = b"".join(
        bytes(12) + VERTICES[face].astype("<f4").tobytes() + struct.pack("<H", 0) for face in FACES
    )
    return b"solid but binary".ljust(80) + struct.pack("<I", len(FACES)) + facets


def vtk_text() -> bytes:
    return (
        "# vtk DataFile Version 3.0\nby hand\nASCII\nDATASET POLYDATA\n"
        f"POINTS 6 float\n{rows(VERTICES)}POLYGONS 8 32\n{rows(FACES, '3 ')}"
        f"CELL_DATA 8\nSCALARS region int 1\nLOOKUP_TABLE default\n{'1 ' * 8}\n"
        f"POINT_DATA 6\nSCALARS height float\nLOOKUP_TABLE default\n{rows(VALUES[:, None])}"
        f"NORMALS normals float\n{rows(VERTICES)}"
    ).encode()


def vtk_grid_text() -> bytes:
    return (
        "# vtk DataFile Version 2.0\nby hand\nASCII\nDATASET UNSTRUCTURED_GRID\n"
        f"POINTS 6 double\n{rows(VERTICES)}\nCELLS 8 32\n{rows(FACES, '3 ')}\nCELL_TYPES 8\n{'5 ' * 8}\n"
        f"POINT_DATA 6\nFIELD FieldData 1\nheight 1 6 float\n{rows(VALUES[:, None])}"
    ).encode()


def vtk_offsets_binary() -> bytes:
    ends = np.arange(0, 25, 3).astype(">i8").tobytes()
    metadata = b"\nMETADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n"
    return (
        b"# vtk DataFile Version 5.1\nby hand\nBINARY\nDATASET POLYDATA\nPOINTS 6 float\n"
        + VERTICES.astype(">f4").tobytes() + metadata
        + b"POLYGONS 9 24\nOFFSETS vtktypeint64\n" + ends + b"\nCONNECTIVITY vtktypeint64\n"
        + FACES.astype(">i8").tobytes() + b"\nPOINT_DATA 6\nFIELD FieldData 1\nheight 1 6 float\n"
        + VALUES.astype(">f4").tobytes() + b"\n"
    )  # fmt: skip


def _vtk_xml(kind: str, settings: str, arrays: dict[str, str], appended: bytes = b"") -> bytes:
    count = "Polys" if kind == "PolyData" else "Cells"
    cells = "".join(arrays[name] for name in ("connectivity", "offsets", "types") if name in arrays)
    head, tail = (
        f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="0.1" byte_order="LittleEndian" {settings}>\n'
        f'<{kind}>\n<Piece NumberOfPoints="6" NumberOf{count}="8">\n<PointData Scalars="height">'
        f"{arrays['height']}</PointData>\n<Points>{arrays['Points']}</Points>\n<{count}>{cells}</{count}>\n"
        f"</Piece>\n</{kind}>\n",
        "</VTKFile>\n",
    )
    return head.encode() + appended + tail.encode()


_XML_ARRAYS = {
    "Points": ("Float32", 3, VERTICES.astype("<f4")),
    "height": ("Float32", 1, VALUES),
    "connectivity": ("Int32", 1, FACES.astype("<i4")),
    "offsets": ("Int32", 1, np.arange(3, 25, 3).astype("<i4")),
}


def vtp_text() -> bytes:
    arrays = {
        name: f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="ascii">'
        + " ".join(map(str, values.ravel().tolist()))
        + "</DataArray>"
        for name, (kind, width, values) in _XML_ARRAYS.items()
    }
    return _vtk_xml("PolyData", "", arrays)


def vtp_binary() -> bytes:
    arrays = {
        name: f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="binary">'
        + base64.b64encode(struct.pack("<I", values.nbytes) + values.tobytes()).decode()
        + "</DataArray>"
        for name, (kind, width, values) in _XML_ARRAYS.items()
    }
    return _vtk_xml("PolyData", "", arrays)


def vtp_appended(encoding: str) -> bytes:
    stream, arrays = b"", {}
    for name, (kind, width, values) in _XML_ARRAYS.items():
        packed = zlib.compress(values.tobytes())
        header = struct.pack("<4Q", 1, values.nbytes, 0, len(packed))
        arrays[name] = (
            f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="appended" '
            f'offset="{len(stream)}"/>'
        )
        stream += (
            header + packed if encoding == "raw" else base64.b64encode(header) + base64.b64encode(packed)
        )
    settings = 'header_type="UInt64" compressor="vtkZLibDataCompressor"'
    block = f'<AppendedData encoding="{encoding}">\n   _'.encode() + stream + b"\n</AppendedData>\n"
    return _vtk_xml("PolyData", settings, arrays, block)


def vtu_text() -> bytes:
    arrays = {
        name: f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="ascii">'
        + " ".join(map(str, values.ravel().tolist()))
        + "</DataArray>"
        for name, (kind, width, values) in _XML_ARRAYS.items()
    }
    arrays["types"] = f'<DataArray type="UInt8" Name="types" format="ascii">{"5 " * 8}</DataArray>'
    return _vtk_xml("UnstructuredGrid", "", arrays)


def gifti(encoding: str, order: str = "<") -> bytes:
    blocks = []
    for intent, kind, values in (
        ("NIFTI_INTENT_POINTSET", "NIFTI_TYPE_FLOAT32", VERTICES.astype(order + "f4")),
        ("NIFTI_INTENT_TRIANGLE", "NIFTI_TYPE_INT32", FACES.astype(order + "i4")),
    ):
        # Big-endian files here are column-major too.
        raw = values.tobytes(order="C" if order == "<" else "F")
        text = {
            "ASCII": rows(values),
            "Base64Binary": base64.b64encode(raw).decode(),
            "GZipBase64Binary": base64.b64encode(zlib.compress(raw)).decode(),
        }[encoding]
        blocks.append(
            f'<DataArray Intent="{intent}" DataType="{kind}" Dimensionality="2" Dim0="{len(values)}" Dim1="3" '
            f'ArrayIndexingOrder="{"RowMajorOrder" if order == "<" else "ColumnMajorOrder"}" '
            f'Encoding="{encoding}" Endian="{"LittleEndian" if order == "<" else "BigEndian"}" '
            f'ExternalFileName="" ExternalFileOffset=""><MetaData/><Data>{text}</Data></DataArray>'
        )
    doctype = '<!DOCTYPE GIFTI SYSTEM "http://www.nitrc.org/frs/download.php/115/gifti.dtd">'
    body = f'<GIFTI Version="1.0" NumberOfDataArrays="2"><MetaData/>{"".join(blocks)}</GIFTI>'
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{doctype}\n{body}\n'.encode()


def freesurfer() -> bytes:
    head = b"\xff\xff\xfecreated by hand\n\n" + struct.pack(">2i", 6, 8)
    footer = struct.pack(">3i", 2, 0, 20) + b"valid = 1\n"
    return head + VERTICES.astype(">f4").tobytes() + FACES.astype(">i4").tobytes() + footer


SAMPLES: dict[str, bytes] = {
    "text.off": off(),
    "one_line.off": off_one_line(),
    "texture.obj": obj(),
    "relative.obj": obj_relative(),
    "text.ply": ply_text(),
    "windows.ply": ply_text("\r\n"),
    "little.ply": ply_binary("<"),
    "big.ply": ply_binary(">"),
    "windows_little.ply": ply_binary("<", "\r\n"),
    "text.vtk": vtk_text(),
    "grid.vtk": vtk_grid_text(),
    "offsets.vtk": vtk_offsets_binary(),
    "text.vtp": vtp_text(),
    "binary.vtp": vtp_binary(),
    "raw.vtp": vtp_appended("raw"),
    "base64.vtp": vtp_appended("base64"),
    "text.vtu": vtu_text(),
    "text.surf.gii": gifti("ASCII"),
    "base64.gii": gifti("Base64Binary"),
    "zipped.gii": gifti("GZipBase64Binary"),
    "big.gii": gifti("GZipBase64Binary", ">"),
    "lh.white": freesurfer(),
    "little.ply.gz": gzip.compress(ply_binary("<"), mtime=0),
}
LOOSE: dict[str, bytes] = {"text.stl": stl_text(), "binary.stl": stl_binary()}

POLYGONS = {
    "poly.off": "OFF\n5 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 2 2\n3 0 1 4\n4 0 1 2 3\n5 0 1 2 3 4\n",
    "poly.obj": "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 2\nf 1 2 5\nf 1 2 3 4\nf 1 2 3 4 5\n",
    "poly.ply": "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 3\nproperty list uchar int vertex_index\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 2 2\n3 0 1 4\n4 0 1 2 3\n5 0 1 2 3 4\n",
    "poly.vtk": "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 5 float\n"
    "0 0 0 1 0 0 1 1 0 0 1 0 2 2 2\nPOLYGONS 3 15\n3 0 1 4\n4 0 1 2 3\n5 0 1 2 3 4\n",
}
