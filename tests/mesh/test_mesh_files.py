"""Files in and out: order kept, against independent readers, and what is refused."""

from __future__ import annotations

import gzip
import os
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from mesh_file_samples import FACES, LOOSE, POLYGONS, SAMPLES, VALUES, VERTICES

from pliant.errors import FileFormatError, InputError, MeshError, PliantWarning
from pliant.mesh import Mesh, load_arrays, load_mesh, merged, save_mesh, triangulated

EXACT = (".off", ".obj", ".ply", ".vtk", ".vtp", ".vtu", ".ply.gz", ".OFF")
SINGLE = (".gii", ".surf.gii", ".white", ".pial.gz")


@pytest.mark.parametrize("name", SAMPLES)
def test_every_dialect_keeps_vertices_and_faces_in_order(name: str, put) -> None:
    mesh = load_mesh(put(name, SAMPLES[name]))
    np.testing.assert_array_equal(mesh.vertices, VERTICES)
    np.testing.assert_array_equal(mesh.faces, FACES)


@pytest.mark.parametrize("name", [n for n in SAMPLES if n.endswith((".ply", ".vtk", ".vtp", ".vtu"))])
def test_every_dialect_keeps_its_point_data(name: str, put) -> None:
    np.testing.assert_array_equal(load_arrays(put(name, SAMPLES[name]))["height"], VALUES)


@pytest.mark.parametrize("name", LOOSE)
def test_stl_keeps_loose_corners_and_merges_on_demand(name: str, put) -> None:
    mesh = load_mesh(put(name, LOOSE[name]))
    np.testing.assert_array_equal(mesh.vertices, VERTICES[FACES].reshape(-1, 3))
    np.testing.assert_array_equal(mesh.faces, np.arange(24).reshape(8, 3))
    joined, index_map = merged(mesh)
    assert joined.n_vertices == 6
    np.testing.assert_array_equal(joined.vertices[index_map], mesh.vertices)


@pytest.mark.parametrize("name", ["lh.white", "rh.pial", "surface", "something.dat", "x.ply"])
def test_freesurfer_is_recognised_by_its_magic(name: str, put) -> None:
    path = put(name, SAMPLES["lh.white"])
    if name == "x.ply":
        with pytest.warns(PliantWarning, match="named like PLY, but it is FreeSurfer geometry"):
            mesh = load_mesh(path)
    else:
        mesh = load_mesh(path)
    np.testing.assert_array_equal(mesh.faces, FACES)


def test_a_gzipped_file_without_gz_in_its_name_is_read(put) -> None:
    assert load_mesh(put("x.off", gzip.compress(SAMPLES["text.off"]))).n_faces == 8


def test_path_may_be_a_string(put) -> None:
    assert load_mesh(str(put("x.off", SAMPLES["text.off"]))).n_faces == 8


# Polygons


@pytest.mark.parametrize("name", POLYGONS)
def test_polygons_are_split_in_place_and_said(name: str, put) -> None:
    with pytest.warns(PliantWarning, match="1 quads and 1 larger polygons are split into 5 triangles"):
        mesh = load_mesh(put(name, POLYGONS[name]))
    expected = [[0, 1, 4], [0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3], [0, 3, 4]]
    assert mesh.faces.tolist() == expected
    assert mesh.n_vertices == 5


def test_binary_ply_of_mixed_polygons(put) -> None:
    header = SAMPLES["little.ply"].split(b"end_header\n")[0].replace(b"element face 8", b"element face 2")
    vertex = np.column_stack([VERTICES, VALUES]).astype("<f4").tobytes()
    faces = struct.pack("<BB4i", 1, 4, 0, 1, 2, 3) + struct.pack("<BB3i", 1, 3, 3, 4, 5)
    with pytest.warns(PliantWarning, match="1 quads"):
        mesh = load_mesh(put("x.ply", header + b"end_header\n" + vertex + faces))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [3, 4, 5]]


def test_faces_of_one_or_two_corners_are_left_out_and_said(put) -> None:
    with pytest.warns(PliantWarning, match="1 faces with fewer than three corners"):
        mesh = load_mesh(put("x.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n"))
    assert mesh.faces.tolist() == [[0, 1, 2]]


def test_vtk_strips_and_pixels_keep_their_orientation(put) -> None:
    head = "# vtk DataFile Version 3.0\n\nASCII\nDATASET {}\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n"
    strip = load_mesh(put("s.vtk", head.format("POLYDATA") + "TRIANGLE_STRIPS 1 5\n4 0 1 2 3\n"))
    np.testing.assert_array_equal(strip.face_normals, [[0, 0, 1]] * 2)
    grid = head.format("UNSTRUCTURED_GRID") + "CELLS 2 8\n4 0 1 2 3\n2 0 1\nCELL_TYPES 2\n8 3\n"
    with pytest.warns(PliantWarning) as said:
        pixel = load_mesh(put("p.vtk", grid))
    assert pixel.area == pytest.approx(1)
    assert any("1 point and line cells are left out" in str(w.message) for w in said)


def test_freesurfer_quads_are_split_by_its_own_rule(tmp_path: Path) -> None:
    import nibabel

    quads = np.array([[0, 2, 1, 4], [1, 3, 0, 5]])
    body = b"\xff\xff\xff" + struct.pack(">I", 6)[1:] + struct.pack(">I", 2)[1:]
    body += (VERTICES * 100).astype(">i2").tobytes() + b"".join(
        struct.pack(">I", v)[1:] for v in quads.ravel()
    )
    path = tmp_path / "lh.white"
    path.write_bytes(body)
    with pytest.warns(PliantWarning, match="2 quadrangles are split into 4 triangles"):
        mesh = load_mesh(path)
    vertices, faces = nibabel.freesurfer.read_geometry(path)
    np.testing.assert_allclose(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)


def test_vtu_pieces_are_joined(put) -> None:
    text = SAMPLES["text.vtu"].decode()
    start, end = text.index("<Piece"), text.index("</UnstructuredGrid>")
    mesh = load_mesh(put("x.vtu", text[:end] + text[start:end] + text[end:]))
    np.testing.assert_array_equal(mesh.vertices, np.vstack([VERTICES, VERTICES]))
    np.testing.assert_array_equal(mesh.faces, np.vstack([FACES, FACES + 6]))


def test_triangulated_matches_a_plain_loop() -> None:
    chance = np.random.default_rng(4)
    polygons = [chance.integers(0, 99, size=k).tolist() for k in chance.integers(3, 9, size=50)]
    expected = [[p[0], p[k], p[k + 1]] for p in polygons for k in range(1, len(p) - 1)]
    assert triangulated(polygons).tolist() == expected
    assert triangulated(np.array([[0, 1, 2, 3]])).tolist() == [[0, 1, 2], [0, 2, 3]]
    assert triangulated([]).shape == (0, 3)
    with pytest.raises(MeshError, match="1 polygons have fewer than three corners"):
        triangulated([[0, 1, 2], [0, 1]])


# Round trips


@st.composite
def meshes(draw: st.DrawFn, width: int) -> Mesh:
    n = draw(st.integers(3, 12))
    finite = st.floats(-1e6, 1e6, width=width, allow_subnormal=False)
    vertices = draw(hnp.arrays(np.float64, (n, 3), elements=finite))
    faces = draw(hnp.arrays(np.int64, (draw(st.integers(1, 9)), 3), elements=st.integers(0, n - 1)))
    return Mesh(vertices, faces)


@pytest.mark.parametrize("ending", EXACT)
@given(mesh=meshes(width=64))
def test_round_trip_is_exact(tmp_path_factory, ending: str, mesh: Mesh) -> None:
    path = tmp_path_factory.getbasetemp() / f"round{ending}"
    save_mesh(path, mesh)
    back = load_mesh(path)
    np.testing.assert_array_equal(back.vertices, mesh.vertices)
    np.testing.assert_array_equal(back.faces, mesh.faces)


@pytest.mark.parametrize("ending", SINGLE)
@given(mesh=meshes(width=64))
def test_round_trip_to_single_precision(tmp_path_factory, ending: str, mesh: Mesh) -> None:
    path = tmp_path_factory.getbasetemp() / f"round{ending}"
    save_mesh(path, mesh)
    back = load_mesh(path)
    np.testing.assert_array_equal(back.vertices, mesh.vertices.astype(np.float32))
    np.testing.assert_array_equal(back.faces, mesh.faces)


@given(mesh=meshes(width=32))
def test_stl_round_trip_keeps_corners(tmp_path_factory, mesh: Mesh) -> None:
    path = tmp_path_factory.getbasetemp() / "round.stl"
    save_mesh(path, mesh)
    back = load_mesh(path)
    np.testing.assert_array_equal(back.vertices[back.faces], mesh.vertices[mesh.faces])


@pytest.mark.parametrize("ending", [".off", ".obj", ".ply", ".stl", ".vtu", ".gii", ".white"])
def test_what_is_written_is_read_by_others(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"x{ending}"
    save_mesh(path, Mesh(VERTICES, FACES))
    vertices, faces = _read_by_others(path)
    np.testing.assert_array_equal(np.asarray(vertices)[np.asarray(faces)], VERTICES[FACES])


def _read_by_others(path: Path) -> tuple[np.ndarray, np.ndarray]:
    import meshio
    import nibabel
    import trimesh

    if path.suffix == ".gii":
        return nibabel.load(path).agg_data(("pointset", "triangle"))
    if path.suffix == ".white":
        return nibabel.freesurfer.read_geometry(path)
    if path.suffix == ".vtu":
        read = meshio.read(path)
        return read.points, read.cells_dict["triangle"]
    read = trimesh.load_mesh(path, process=False, maintain_order=True)
    return read.vertices, read.faces


def test_what_others_write_is_read(tmp_path: Path) -> None:
    import meshio
    import trimesh

    other = meshio.Mesh(VERTICES, [("triangle", FACES)], point_data={"height": VALUES})
    for name, options in (
        ("a.vtk", {}), ("b.vtk", {"binary": False}), ("c.vtu", {}), ("d.vtu", {"binary": False}),
        ("e.vtu", {"compression": "lzma"}), ("f.vtu", {"compression": None}), ("g.ply", {}),
        ("h.vtk", {"file_format": "vtk42"}),
    ):  # fmt: skip
        meshio.write(tmp_path / name, other, **options)
        mesh = load_mesh(tmp_path / name)
        np.testing.assert_array_equal(mesh.vertices, VERTICES, err_msg=name)
        np.testing.assert_array_equal(mesh.faces, FACES, err_msg=name)
        np.testing.assert_array_equal(load_arrays(tmp_path / name)["height"], VALUES, err_msg=name)
    whole = trimesh.Trimesh(VERTICES, FACES, process=False)
    for name in ("a.off", "b.obj", "c.ply", "d.stl"):
        whole.export(tmp_path / name)
        mesh = load_mesh(tmp_path / name)
        np.testing.assert_allclose(mesh.vertices[mesh.faces], VERTICES[FACES], atol=1e-7, err_msg=name)


# Writing


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "x.off"
    save_mesh(path, Mesh(VERTICES, FACES))
    before = path.read_bytes()

    def broken(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", broken)
    with pytest.raises(InputError, match="cannot be written: disk full"):
        save_mesh(path, Mesh(VERTICES * 2, FACES))
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.off"]


def test_writing_into_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        save_mesh(tmp_path / "no" / "x.off", Mesh(VERTICES, FACES))


@pytest.mark.parametrize("ending", [".off", ".ply", ".vtp", ".gii", ".ply.gz", ".stl"])
def test_same_mesh_same_bytes(ending: str, tmp_path: Path) -> None:
    for name in ("a", "b"):
        save_mesh(tmp_path / f"{name}{ending}", Mesh(VERTICES, FACES))
    assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()


# Real files


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "n_vertices"), [("cat0", 27_894), ("dog0", 25_290), ("horse0", 19_248), ("wolf0", 4_344)]
)
def test_tosca_keeps_order_against_a_plain_parse(data: Path, name: str, n_vertices: int) -> None:
    path = data / "shapes" / "tosca" / f"{name}.ply"
    body = path.read_bytes().split(b"end_header\n", 1)[1]
    vertices = np.frombuffer(body, dtype="<f4", count=3 * n_vertices).reshape(-1, 3)
    faces = np.frombuffer(body[vertices.nbytes :], dtype=np.dtype([("n", "u1"), ("v", "<i4", 3)]))["v"]
    mesh = load_mesh(path)
    assert mesh.n_vertices == n_vertices
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)


@pytest.mark.data
def test_real_obj_against_a_plain_parse(data: Path) -> None:
    path = data / "shapes" / "non_rigid_world" / "gorilla1.obj"
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    vertices = [[float(x) for x in words[1:4]] for words in lines if words and words[0] == "v"]
    faces = [[int(x.split("/")[0]) - 1 for x in words[1:]] for words in lines if words and words[0] == "f"]
    mesh = load_mesh(path)
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)


@pytest.mark.data
def test_real_cortex_against_nibabel(data: Path) -> None:
    import nibabel

    white = data / "cortex" / "subject1" / "lh.white"
    vertices, faces = nibabel.freesurfer.read_geometry(white)
    mesh = load_mesh(white)
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)
    for name in ("pycortex_S1/wm_lh.gii", "slam/example_mesh.gii"):
        vertices, faces = nibabel.load(data / "cortex" / name).agg_data(("pointset", "triangle"))
        mesh = load_mesh(data / "cortex" / name)
        np.testing.assert_array_equal(mesh.vertices, vertices)
        np.testing.assert_array_equal(mesh.faces, faces)
    thickness = data / "cortex" / "subject1" / "lh.thickness"
    with pytest.raises(FileFormatError, match="load_arrays reads them"):
        load_mesh(thickness)


@pytest.mark.data
def test_real_heart_against_meshio(data: Path) -> None:
    import meshio

    path = data / "heart" / "aha" / "LV_4396_vertices_with_aha_segments.vtk"
    read = meshio.read(path)
    mesh = load_mesh(path)
    np.testing.assert_array_equal(mesh.vertices, read.points)
    np.testing.assert_array_equal(mesh.faces, read.cells_dict["triangle"])
    np.testing.assert_array_equal(load_arrays(path)["subpartID"], read.point_data["subpartID"].ravel())
