"""One numbering of symmetries from 1 in all that is read, and files that name the mesh they are of."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pliant import FileFormatError, InputError, Mesh, load_mesh, save_mesh, shapes
from pliant.cli import main
from pliant.matching.symmetry import Symmetry, SymmetryResult
from pliant.mesh.fingerprint import MeshFingerprint
from pliant.report.symmetry import symmetry_camera, symmetry_names, symmetry_page

NUMBERS = (0.9, 0.1, 0.01, 1.0, 0.02, 0.8)


@pytest.fixture(scope="module")
def figure():
    return shapes.quadruped(1000)


@pytest.fixture(scope="module")
def result(figure):
    """The true mirror in group 1, and a leg that it carries to another, in group 2."""
    n = figure.mesh.n_vertices
    leg = figure.parts == figure.part_names.index("left hind leg")
    other = np.zeros(n, bool)
    other[figure.symmetry[leg]] = True
    mirror = Symmetry(np.ones(n, bool), np.ones(n, bool), figure.symmetry, np.eye(3), *NUMBERS, group=0)
    limbs = Symmetry(
        leg,
        other,
        np.where(leg, figure.symmetry, -1),
        np.eye(3),
        *NUMBERS,
        kind="partial",
        group=1,
        implied_by=0,
    )
    return SymmetryResult((mirror, limbs), (), {"samples": 100}, MeshFingerprint.of(figure.mesh))


@pytest.mark.parametrize("ending", [".ply", ".off", ".obj", ".stl.ply", ".vtk"])
def test_a_mesh_read_back_is_the_same_mesh(figure, tmp_path, ending):
    save_mesh(tmp_path / f"figure{ending}", figure.mesh)
    assert MeshFingerprint.of(load_mesh(tmp_path / f"figure{ending}")) == MeshFingerprint.of(figure.mesh)


def test_single_precision_is_the_same_mesh_and_any_change_is_another(figure):
    mesh, own = figure.mesh, MeshFingerprint.of(figure.mesh)
    single = mesh.with_vertices(mesh.vertices.astype("f4").astype("f8"))
    assert MeshFingerprint.of(single) == own
    signed = Mesh(np.where(mesh.vertices == 0, -0.0, mesh.vertices), mesh.faces)
    assert MeshFingerprint.of(signed) == own
    moved = mesh.vertices.copy()
    moved[17, 1] += 1e-4
    order = np.r_[1, 0, np.arange(2, mesh.n_vertices)]
    others = [
        mesh.with_vertices(moved),
        mesh.flipped(),
        mesh.scaled(1.001),
        Mesh(mesh.vertices[order], order[mesh.faces]),
    ]
    assert len({MeshFingerprint.of(one).sha256 for one in (mesh, *others)}) == 5


def test_another_mesh_is_refused_and_says_what_differs(figure, result):
    result.check_mesh(figure.mesh)
    with pytest.raises(InputError, match="this one has 162 and 320"):
        result.check_mesh(shapes.icosphere(2))
    with pytest.raises(InputError, match=r"as many vertices \(1000\).*SHA-256"):
        result.check_mesh(figure.mesh.scaled(2))
    with pytest.raises(InputError, match="another mesh"):
        symmetry_page(figure.mesh.scaled(2), result, title="another")


def test_view_refuses_another_mesh_and_warns_of_files_that_name_none(figure, result, tmp_path, capsys):
    save_mesh(tmp_path / "own.ply", figure.mesh)
    save_mesh(tmp_path / "other.ply", figure.mesh.scaled(2))
    result.save(tmp_path / "new")
    page = tmp_path / "view.html"
    given = [str(tmp_path / "new"), "-o", str(page)]
    assert main(["view", str(tmp_path / "own.ply"), *given]) == 0
    assert "warning" not in capsys.readouterr().err
    page.unlink()
    assert main(["view", str(tmp_path / "other.ply"), *given]) == 3
    assert "made on another mesh" in capsys.readouterr().err
    assert not page.exists()
    stored = json.loads((tmp_path / "new" / "symmetries.json").read_text(encoding="utf-8"))
    del stored["mesh"]
    (tmp_path / "new" / "symmetries.json").write_text(json.dumps(stored))
    assert main(["view", str(tmp_path / "other.ply"), *given]) == 0
    assert "warning: other.ply: new does not say which mesh" in capsys.readouterr().err
    assert "new does not say which mesh" in page.read_text(encoding="utf-8")
    assert main(["view", str(tmp_path / "own.ply"), *given]) == 0
    save_mesh(tmp_path / "ball.ply", shapes.icosphere(2))
    assert main(["view", str(tmp_path / "ball.ply"), *given]) == 3


def test_what_is_written_counts_from_one_and_comes_back(result, tmp_path):
    result.save(tmp_path)
    rows = json.loads((tmp_path / "symmetries.json").read_text(encoding="utf-8"))["symmetries"]
    assert [row["number"] for row in rows] == [1, 2]
    assert [row["group"] for row in rows] == [1, 2]
    assert [row["implied_by"] for row in rows] == [None, 1]
    back = SymmetryResult.load(tmp_path)
    assert back.mesh == result.mesh
    assert [(s.group, s.implied_by) for s in back.symmetries] == [(0, -1), (1, 0)]


def test_files_of_the_version_before_are_read(result, tmp_path):
    result.save(tmp_path)
    place = tmp_path / "symmetries.json"
    stored = json.loads(place.read_text(encoding="utf-8"))
    del stored["mesh"]
    for row, (group, implied_by) in zip(stored["symmetries"], [(0, -1), (1, 0)], strict=True):
        del row["number"]
        row.update(group=group, implied_by=implied_by)
    place.write_text(json.dumps(stored | {"format": "pliant-symmetries-2"}))
    back = SymmetryResult.load(tmp_path)
    assert back.mesh is None
    assert [(s.group, s.implied_by) for s in back.symmetries] == [(0, -1), (1, 0)]
    stored["mesh"] = {"vertices": "many"}
    place.write_text(json.dumps(stored))
    with pytest.raises(FileFormatError, match="fingerprint"):
        SymmetryResult.load(tmp_path)


def test_the_page_calls_them_as_the_table_does(figure, result):
    assert symmetry_names(result) == ["Symmetry 1 (global)", "Symmetry 2 (partial)"]
    html = symmetry_page(figure.mesh, result, title="A beast", up="y")
    assert html.count("<span>Symmetry 1 (global)</span>") == 1
    assert '<th scope="row">Symmetry 2 (partial)</th><td>2</td><td>1</td>' in html


@pytest.mark.parametrize("up", ["y", "z"])
def test_a_mirror_is_looked_at_from_within_its_plane(figure, result, up):
    """Both halves are seen: as much of the left faces the viewer as of the right."""
    mesh = figure.mesh
    if up == "z":
        mesh = mesh.with_vertices(mesh.vertices @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]))
    rotation = symmetry_camera(mesh, result.symmetries[0], up=up)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)
    assert abs(rotation[2, 0]) < 1e-6
    seen = np.clip(mesh.face_normals @ rotation[2], 0, None) * mesh.face_areas
    left = mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 0
    assert seen[left].sum() == pytest.approx(seen[~left].sum(), rel=1e-3)
    assert rotation[1, {"y": 1, "z": 2}[up]] > 0.45  # what is up is up in the image


def test_a_mirror_that_lies_flat_has_a_camera_too(figure, result):
    flat = figure.mesh.with_vertices(figure.mesh.vertices[:, [2, 0, 1]])  # left is up
    rotation = symmetry_camera(flat, result.symmetries[0], up="y")
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert abs(rotation[2, 1]) < 1e-6
