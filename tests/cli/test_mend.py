"""``pliant mend``, and that what the shell names as remedies are its commands."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant import Mesh, shapes
from pliant.cli import main
from pliant.cli.ending import at_the_shell


@pytest.fixture
def dirty(tmp_path: Path) -> Path:
    """Two spheres, the smaller one slit along an edge loop; a doubled face, a turned one, a vertex of no face."""
    large, small = shapes.icosphere(2), shapes.icosphere(1).scaled(0.2).translated([5, 0, 0])
    slit = small.vertices[small.faces[0]]
    vertices = np.vstack([large.vertices, small.vertices, slit, [[9, 9, 9]]])
    n = large.n_vertices
    faces = np.vstack([large.faces, small.faces + n, large.faces[:1]])
    faces[7] = faces[7, ::-1]
    faces[large.n_faces] = n + small.n_vertices + np.arange(3)
    path = tmp_path / "dirty.ply"
    pliant.save_mesh(path, Mesh(vertices, faces))
    return path


def test_mends_what_inspect_names(dirty: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, numbers = tmp_path / "clean.ply", tmp_path / "numbers.npz"
    old = pliant.load_mesh(dirty)
    options = ["--merge", "0", "--largest", "--index-map", str(numbers), "--json"]
    assert main(["mend", str(dirty), "-o", str(out), *options]) == 0
    said = json.loads(capsys.readouterr().out)
    new = pliant.load_mesh(out)
    sphere = shapes.icosphere(2)
    assert pliant.check_up(new).ok
    assert (new.n_vertices, new.n_faces) == (sphere.n_vertices, sphere.n_faces)
    assert np.array_equal(new.faces, sphere.faces)
    assert said["check_up"]["ok"] is True
    assert said["faces_turned"] == 1
    assert said["vertices_dropped"] + said["vertices_joined"] + said["vertices"] == old.n_vertices
    assert said["written"] == [str(out), str(numbers)]
    index_map = pliant.load_arrays(numbers)["index_map"]
    kept = index_map >= 0
    np.testing.assert_array_equal(new.vertices[index_map[kept]], old.vertices[kept])


def test_says_what_it_did_and_what_it_left(
    dirty: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "clean.obj"
    assert main(["mend", str(dirty), "--output", str(out), "--merge", "1e-9"]) == 0
    captured = capsys.readouterr()
    assert re.search(r"vertices joined +3\b", captured.out)
    assert "faces dropped" in captured.out
    assert f"wrote {out}" in captured.out
    assert "clean.obj: 2 components" in captured.err
    assert "`pliant mend --largest`" in captured.err


@pytest.mark.parametrize("out", ["clean.xyz", "clean", "nowhere/clean.ply", "."])
def test_refuses_what_it_cannot_write_before_the_work(dirty: Path, out: str) -> None:
    assert main(["mend", str(dirty), "-o", out]) == 2


def test_findings_at_the_shell_name_commands_and_one_degree(
    dirty: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["components", str(dirty)]) in (0, 3)
    lines = [line for line in capsys.readouterr().err.splitlines() if "warning" in line]
    assert len(lines) >= 4
    for line in lines:
        assert line.startswith("pliant: warning: dirty.ply: ")
        assert "error:" not in line
        assert line.count("warning:") == 1
        assert "(mesh" not in line
        assert "`pliant mend" in line


def test_inspect_names_the_command_that_mends(dirty: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(dirty)]) == 0
    said = capsys.readouterr().out
    assert f"pliant mend {dirty} --merge 0 --largest --output FILE" in said
    sphere = dirty.with_name("sphere.ply")
    pliant.save_mesh(sphere, shapes.icosphere(1))
    assert main(["inspect", str(sphere)]) == 0
    assert "pliant mend" not in capsys.readouterr().out


def test_no_command_is_named_that_would_change_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    book, out = tmp_path / "book.ply", tmp_path / "out.ply"
    corners = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0]]
    pages = [[0, 1, 2], [0, 1, 3], [0, 1, 4]]
    pliant.save_mesh(book, Mesh(corners, [*pages, pages[0]]))
    assert main(["inspect", str(book)]) == 0
    assert "pliant mend" in capsys.readouterr().out
    assert main(["mend", str(book), "--merge", "0", "-o", str(out)]) == 0
    said = capsys.readouterr().err
    assert "1 non-manifold edges" in said
    assert "mesh editor" in said
    assert "pliant mend" not in said
    assert main(["inspect", str(out)]) == 0
    assert "pliant mend" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("take pliant.largest_component(mesh)", "take `pliant mend --largest`"),
        ("(pliant.largest_component keeps the largest)", "(`pliant mend --largest` keeps the largest)"),
        ("use merged(mesh, tolerance=0)", "use `pliant mend --merge 0`"),
        ("pliant.merged(mesh, tolerance=0)", "`pliant mend --merge 0`"),
        ("without_unreferenced(mesh)", "`pliant mend`"),
        ("use pliant.orient first", "use `pliant mend` first"),
        ("see pliant.check_up(mesh), or", "see `pliant inspect`, or"),
        (
            "2 edges; use kind='robust', which takes non-manifold meshes, or mend the mesh (see pliant.check_up)",
            "2 edges; mend the mesh (see `pliant inspect`)",
        ),
        ("first [3]; mend them or use kind='robust'", "first [3]; mend them"),
        ('use device="cpu", which', "use --device cpu, which"),
        ('choose either device="cuda" or scheduler=: w', "choose either --device cuda or --scheduler: w"),
        ("how to orient it", "how to orient it"),
    ],
)
def test_remedies_of_the_library_become_commands(text: str, wanted: str) -> None:
    assert at_the_shell(text) == wanted


def test_reasons_at_the_shell_name_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = shapes.icosphere(2)
    other = one.translated([5, 0, 0])
    two = Mesh(
        np.vstack([one.vertices, other.vertices]), np.vstack([one.faces, other.faces + one.n_vertices])
    )
    pliant.save_mesh(tmp_path / "two.ply", two)
    assert main(["symmetry", str(tmp_path / "two.ply")]) == 0
    said = capsys.readouterr().out
    assert "2 pieces" in said
    assert "take `pliant mend --largest`" in said


def test_every_remedy_of_a_check_up_has_its_command() -> None:
    source = (Path(pliant.__file__).parent / "mesh" / "check.py").read_text(encoding="utf-8")
    calls = {line.strip().strip('",') for line in source.splitlines() if "(mesh" in line and '"' in line}
    remedies = [line for line in calls if not line.startswith(("yield", "def", "return"))]
    assert len(remedies) >= 6
    assert not [text for text in remedies if "(mesh" in at_the_shell(text)]
