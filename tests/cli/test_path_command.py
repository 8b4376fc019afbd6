"""``pliant path``: what it prints, what it writes, and what it refuses."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant import Mesh, shapes
from pliant.cli import main


@pytest.fixture
def sphere(tmp_path: Path) -> Path:
    file = tmp_path / "sphere.off"
    pliant.save_mesh(file, shapes.icosphere(2))
    return file


def test_the_table_holds_the_polyline(sphere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = sphere.parent / "path.csv"
    assert main(["path", str(sphere), "0", "3", "--graph", "refined", "-o", str(out)]) == 0
    said = capsys.readouterr().out
    expected = pliant.geodesic_path(pliant.load_mesh(sphere), 0, 3, graph="refined")
    assert f"{expected.length:.6g}" in said
    assert f"wrote {out}" in said
    with out.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert [int(row["vertex"]) for row in rows] == expected.vertices.tolist()
    points = np.array([[float(row[axis]) for axis in "xyz"] for row in rows])
    np.testing.assert_array_equal(points, expected.points)
    assert [float(row["along"]) for row in rows] == expected.along.tolist()


def test_json_is_all_there_is(sphere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["path", str(sphere), "0", "3", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["length"] == pytest.approx(pliant.geodesic_path(pliant.load_mesh(sphere), 0, 3).length)
    assert said["straight_line"] == pytest.approx(2.0)
    assert said["vertices"][0] == 0
    assert said["vertices"][-1] == 3
    assert said["steps"] == len(said["vertices"]) - 1
    assert said["written"] == []


def test_what_it_refuses(sphere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = pliant.load_mesh(sphere)
    n = one.n_vertices
    two = sphere.parent / "two.off"
    pliant.save_mesh(
        two, Mesh(np.vstack([one.vertices, one.vertices + 3]), np.vstack([one.faces, one.faces + n]))
    )
    out = sphere.parent / "path.csv"
    assert main(["path", str(two), "0", str(n), "-o", str(out)]) == 3
    assert f"no path leads from vertex 0 to {n}" in capsys.readouterr().err
    assert main(["path", str(sphere), "0", str(n), "-o", str(out)]) == 3
    assert "target: 1 of 1 are outside" in capsys.readouterr().err
    assert main(["path", str(sphere), "0", "3", "-o", str(out.with_suffix(".ply"))]) == 2
    assert main(["path", str(sphere), "zero", "3"]) == 2
    assert not out.exists()
