"""``pliant view`` takes results in the formats that people keep them in."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pliant import detect_symmetries, load_mesh, save_arrays, save_mesh, shapes
from pliant.cli import main
from pliant.report.symmetry import symmetry_camera


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    mesh = shapes.icosphere(2)
    save_mesh(tmp_path / "ball.gii", mesh)
    return tmp_path


def test_results_of_many_formats(ball: Path) -> None:
    from nibabel.freesurfer import write_annot, write_morph_data

    n = shapes.icosphere(2).n_vertices
    np.save(ball / "heat.npy", np.linspace(0, 1, n))
    (ball / "table.csv").write_text("depth,kind\n" + "\n".join(f"{i / 7},{i % 3}" for i in range(n)))
    write_morph_data(ball / "lh.thickness", np.linspace(1, 4, n))
    colours = np.array([[9, 0, 0, 0, 0], [0, 9, 0, 0, 0]])
    parcels = np.arange(n) % 2 - (np.arange(n) < 10)
    write_annot(ball / "lh.x.annot", parcels, colours, ["frontal", "occipital"], fill_ctab=True)
    save_arrays(ball / "a.shape.gii", {"texture": np.arange(float(n))})
    (ball / "a.shape.gii").rename(ball / "texture.gii")
    files = ["ball.gii", "heat.npy", "table.csv", "lh.thickness", "lh.x.annot", "texture.gii"]
    assert main(["view", *(str(ball / name) for name in files), "-o", str(ball / "page.html")]) == 0
    page = (ball / "page.html").read_text(encoding="utf-8")
    for name in ("heat", "depth", "kind", "lh.thickness", "lh.x.annot", "frontal", "occipital", "texture"):
        assert f'"{name}"' in page, name


def shown(page: Path) -> list[dict[str, Any]]:
    """What a page carries of each surface."""
    text = page.read_text(encoding="utf-8")
    data: list[dict[str, Any]] = json.loads(re.search(r'id="surfaces">(.*?)</script>', text, re.S).group(1))
    return data


def test_a_result_of_another_length_is_refused(ball: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (ball / "short.csv").write_text("1\n2\n")
    assert main(["view", str(ball / "ball.gii"), str(ball / "short.csv"), "-o", str(ball / "page.html")]) == 3
    told = capsys.readouterr().err
    assert "ball.gii has 162 vertices; short.csv: short has length 2" in told
    assert not (ball / "page.html").exists()


def test_a_result_of_another_length_among_others_is_told(
    ball: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (ball / "short.csv").write_text("1\n2\n")
    np.save(ball / "heat.npy", np.linspace(0, 1, 162))
    files = [str(ball / name) for name in ("ball.gii", "short.csv", "heat.npy")]
    assert main(["view", *files, "-o", str(ball / "page.html")]) == 0
    note = "no row for each of the 162 vertices: short.csv: short has length 2"
    assert note in capsys.readouterr().err
    (surface,) = shown(ball / "page.html")
    assert [layer["name"] for layer in surface["layers"]] == ["heat"]
    assert note in surface["notes"][0]


@pytest.mark.parametrize(("width", "columns"), [(100, range(0, 100, 9)), (12, range(12)), (3, range(3))])
def test_columns_that_are_not_offered_are_told(
    ball: Path, capsys: pytest.CaptureFixture[str], width: int, columns: range
) -> None:
    np.save(ball / "modes.npy", np.random.default_rng(0).random((162, width)))
    assert main(["view", str(ball / "ball.gii"), str(ball / "modes.npy"), "-o", str(ball / "page.html")]) == 0
    (surface,) = shown(ball / "page.html")
    assert [layer["name"] for layer in surface["layers"]] == [f"modes, column {i}" for i in columns]
    told = capsys.readouterr().err
    if width > 12:
        note = "modes has 100 columns, counted from 0; 12 of them can be shown: 0, 9, 18"
        assert note in told
        assert note in surface["notes"][0]
    else:
        assert not told
        assert not surface["notes"]


def test_symmetries_bring_their_cameras_and_colours(tmp_path: Path) -> None:
    figure = shapes.quadruped(1000)
    save_mesh(tmp_path / "figure.ply", figure.mesh)
    result = detect_symmetries(load_mesh(tmp_path / "figure.ply"))
    result.save(tmp_path / "found")
    files = [str(tmp_path / name) for name in ("figure.ply", "found")]
    assert main(["view", *files, "--up", "y", "-o", str(tmp_path / "page.html")]) == 0
    (surface,) = shown(tmp_path / "page.html")
    names = [f"Symmetry {i} ({found.kind})" for i, found in enumerate(result.symmetries, start=1)]
    assert [layer["name"] for layer in surface["layers"]] == [one["name"] for one in surface["maps"]] == names
    for shape, found in zip(surface["maps"], result.symmetries, strict=True):
        camera = symmetry_camera(load_mesh(tmp_path / "figure.ply"), found, up="y")
        np.testing.assert_allclose(shape["camera"], camera)


def test_the_example_of_the_documentation_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = Path(__file__).parents[2] / "docs" / "view.md"
    (code,) = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, str(page), "exec"), {})
    rest, walking = shown(tmp_path / "cats.html")
    assert rest["layers"][0]["labels"]["names"] == walking["layers"][0]["labels"]["names"]


def test_a_broken_table_is_refused(ball: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (ball / "bad.csv").write_text("1,2\n3\n")
    assert main(["view", str(ball / "ball.gii"), str(ball / "bad.csv"), "-o", str(ball / "page.html")]) == 3
    assert "do not have the 2 cells" in capsys.readouterr().err
    assert not (ball / "page.html").exists()
