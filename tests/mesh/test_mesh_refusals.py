"""Files that are no mesh: each refusal names what is wrong, and nothing large is allocated on a claim."""

from __future__ import annotations

import gzip
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
from mesh_file_samples import FACES, LOOSE, POLYGONS, SAMPLES, VERTICES

from pliant.errors import FileFormatError, InputError, MeshError, PliantWarning
from pliant.mesh import Mesh, load_mesh, save_mesh


def test_missing_empty_folder_and_device(put, tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="there is no such file"):
        load_mesh(tmp_path / "nothing.ply")
    with pytest.raises(FileFormatError, match=r"empty \(0 bytes\)"):
        load_mesh(put("x.ply", b""))
    with pytest.raises(FileFormatError, match=r"empty \(0 bytes\) once unpacked"):
        load_mesh(put("x.ply.gz", gzip.compress(b"")))
    with pytest.raises(FileFormatError, match="this is a folder"):
        load_mesh(tmp_path)
    with pytest.raises(FileFormatError, match="not a regular file"):
        load_mesh("/dev/zero")
    with pytest.raises(FileFormatError, match="cannot be read"):
        load_mesh("a\0b.ply")


@pytest.mark.parametrize("name", ["little.ply", "big.ply"])
def test_truncated_binary_ply(name: str, put) -> None:
    with pytest.raises(FileFormatError, match="truncated"):
        load_mesh(put(name, SAMPLES[name][:-9]))
    with pytest.raises(FileFormatError, match=r"claims 6 vertex rows, at least 96 bytes, but only 50"):
        load_mesh(put(name, SAMPLES[name].split(b"end_header\n")[0] + b"end_header\n" + bytes(50)))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("little.ply", b"element vertex 6", b"element vertex 250000000"),
        ("little.ply", b"element face 8", b"element face 3000000000000"),
        ("text.ply", b"element vertex 6", b"element vertex 250000000"),
        ("text.off", b"6 8 12", b"250000000 8 12"),
        ("text.vtk", b"POINTS 6", b"POINTS 250000000"),
        ("offsets.vtk", b"POLYGONS 9 24", b"POLYGONS 9 400000000"),
        ("zipped.gii", b'Dim0="6"', b'Dim0="250000000"'),
        ("base64.gii", b'Dim0="6"', b'Dim0="250000000"'),
        ("raw.vtp", struct.pack("<4Q", 1, 72, 0, 1)[:16], struct.pack("<2Q", 1, 3 << 30)),
        ("raw.vtp", struct.pack("<4Q", 1, 72, 0, 1)[:16], struct.pack("<2Q", 3 << 30, 72)),
        ("lh.white", struct.pack(">2i", 6, 8), struct.pack(">2i", 250_000_000, 8)),
    ],
)
def test_a_claim_of_gigabytes_is_refused_before_anything_is_allocated(
    name: str, old: bytes, new: bytes, put
) -> None:
    import tracemalloc

    data = SAMPLES[name].replace(old, new)
    assert data != SAMPLES[name]
    path = put(name, data)
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match=r"claim|needs \d+"):
            load_mesh(path)
        assert tracemalloc.get_traced_memory()[1] < 4e6
    finally:
        tracemalloc.stop()


def test_stl_claims_more_triangles_than_it_holds(put) -> None:
    data = LOOSE["binary.stl"].replace(b"solid", b"other")
    with pytest.raises(FileFormatError, match="claims 60000000 triangles, at least 3000000000 bytes"):
        load_mesh(put("x.stl", data[:80] + struct.pack("<I", 60_000_000) + data[84:]))


def test_a_gzip_bomb_is_stopped(put) -> None:
    import tracemalloc

    path = put("x.off.gz", gzip.compress(b"OFF\n" + bytes(400_000_000), 1))
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match="grows beyond"):
            load_mesh(path)
        assert tracemalloc.get_traced_memory()[1] < 4e8
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e400"])
def test_coordinates_that_are_not_finite(value: str, put) -> None:
    path = put("x.off", f"OFF\n3 1 0\n0 0 0\n{value} 0 0\n0 1 0\n3 0 1 2\n")
    with pytest.raises(
        MeshError, match=r"1 of 3 vertices have NaN or infinite coordinates, first at \[1\]"
    ) as said:
        load_mesh(path)
    assert str(path) in str(said.value)


def test_binary_nan(put) -> None:
    data = SAMPLES["little.ply"]
    at = data.index(b"end_header\n") + 11
    with pytest.raises(MeshError, match=r"first at \[0\]"):
        load_mesh(put("x.ply", data[:at] + struct.pack("<f", np.nan) + data[at + 4 :]))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("x.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 {}\n"),
        ("x.ply", POLYGONS["poly.ply"].replace("3 0 1 4", "3 0 1 {}").replace("4 0 1 2 3", "3 0 1 2")
         .replace("5 0 1 2 3 4", "3 0 1 2")),
    ],
)  # fmt: skip
@pytest.mark.parametrize("index", [-1, 99])
def test_faces_that_name_vertices_that_are_not_there(name: str, text: str, index: int, put) -> None:
    with pytest.raises(MeshError, match=r"1 of \d faces name vertices outside"):
        load_mesh(put(name, text.format(index)))


def test_obj_counts_from_one(put) -> None:
    with pytest.raises(FileFormatError, match=r"1 faces name vertex 0, first faces \[1\]; OBJ counts from 1"):
        load_mesh(put("x.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 0 1 2\n"))
    with pytest.raises(MeshError, match="outside"):
        load_mesh(put("x.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9\n"))


def test_a_point_cloud_is_no_mesh(put) -> None:
    with pytest.raises(MeshError, match="4 vertices and no faces: this is a point cloud"):
        load_mesh(put("x.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n"))


def test_volume_meshes_are_named(put) -> None:
    text = (
        "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n"
        "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"
    )
    with pytest.raises(MeshError, match="1 volume or higher-order cells and no surface: extract the surface"):
        load_mesh(put("x.vtk", text))


@pytest.mark.parametrize("ending", ["ply", "vtk", "vtp", "vtu", "gii", "off", "stl", "obj"])
def test_a_text_file_named_like_a_mesh(ending: str, put) -> None:
    with pytest.raises(FileFormatError):
        load_mesh(put(f"notes.{ending}", "Dear diary, today I measured a cortex.\n" * 20))


def test_a_wrong_ending_is_reported(put) -> None:
    with pytest.warns(PliantWarning, match="named like OFF, but it is PLY and is read as that"):
        mesh = load_mesh(put("x.off", SAMPLES["little.ply"]))
    np.testing.assert_array_equal(mesh.faces, FACES)


def test_an_unknown_format_lists_what_is_read(put) -> None:
    with pytest.raises(FileFormatError, match=r"unknown format.*\.off, \.obj, \.ply, \.stl"):
        load_mesh(put("x.xyz", b"PK\x03\x04 and so on"))
    with pytest.raises(InputError, match=r"no format has this ending; use one of \.off"):
        save_mesh("x.xyz", Mesh(VERTICES, FACES))


def test_xml_entities_are_refused(put) -> None:
    bomb = '<!DOCTYPE GIFTI [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>'
    text = SAMPLES["text.surf.gii"].decode().replace("<MetaData/>", "<MetaData>&b;</MetaData>", 1)
    text = text.replace(text[text.index("<!DOCTYPE") : text.index("<GIFTI")], bomb)
    with pytest.raises(FileFormatError, match="declares entities"):
        load_mesh(put("x.gii", text))
    with pytest.raises(FileFormatError, match="nested deeper"):
        load_mesh(put("x.gii", "<GIFTI>" + "<MetaData>" * 100_000))


def test_per_vertex_files_are_not_meshes(put) -> None:
    curv = b"\xff\xff\xff" + struct.pack(">3i", 4, 8, 1) + np.arange(4, dtype=">f4").tobytes()
    with pytest.raises(FileFormatError, match="load_arrays reads them"):
        load_mesh(put("lh.thickness", curv))
    only = SAMPLES["text.surf.gii"].replace(b"NIFTI_INTENT_POINTSET", b"NIFTI_INTENT_NONE")
    with pytest.raises(FileFormatError, match="load_arrays reads them"):
        load_mesh(put("x.gii", only))


@pytest.mark.parametrize("token", ["1_0", "0x10", "1,5", "one"])
def test_numbers_python_reads_and_formats_do_not(token: str, put) -> None:
    with pytest.raises(FileFormatError, match="not a number"):
        load_mesh(put("x.off", f"OFF\n3 1 0\n0 0 0\n{token} 0 0\n0 1 0\n3 0 1 2\n"))


def test_what_is_left_out_is_said(put) -> None:
    obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nw 9 9 9\nl 1 2\nf 1 2 3\n"
    with pytest.warns(PliantWarning) as said:
        load_mesh(put("x.obj", obj))
    text = " ".join(str(warning.message) for warning in said)
    assert "1 lines describe points, lines" in text
    assert "words OBJ does not have ('w')" in text
    with pytest.warns(PliantWarning, match="3 bytes after the last element"):
        load_mesh(put("x.ply", SAMPLES["little.ply"] + b"abc"))


def test_a_mesh_written_with_its_arguments_swapped_is_told_their_order(tmp_path: Path) -> None:
    triangle = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(InputError, match=r"save_mesh\(path, mesh\); got Mesh and"):
        save_mesh(triangle, tmp_path / "x.ply")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="Path and str"):
        save_mesh(tmp_path / "x.ply", "mesh")  # type: ignore[arg-type]


def test_readers_say_nothing_on_the_terminal(put, capfd: pytest.CaptureFixture[str]) -> None:
    for name, data in {**SAMPLES, **LOOSE}.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PliantWarning)
            for part in (data, data[: len(data) // 2]):
                try:
                    load_mesh(put(name, part))
                except MeshError:
                    continue
    assert capfd.readouterr() == ("", "")
