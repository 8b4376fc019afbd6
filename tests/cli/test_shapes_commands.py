"""pliant components and pliant correspond, on figures whose parts and correspondence are known."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant.cli import main


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, np.ndarray]:
    folder = tmp_path_factory.mktemp("animals")
    animal = pliant.shapes.quadruped(2500)
    rest, bent = folder / "rest.ply", folder / "bent.ply"
    pliant.save_mesh(rest, animal.mesh)
    pliant.save_mesh(bent, animal.posed("walk").mesh)
    return rest, bent, animal.symmetry


def test_components(files, tmp_path, capsys) -> None:
    rest, _, _ = files
    out, figure = tmp_path / "parts.npz", tmp_path / "parts.png"
    assert main(["components", str(rest), "-o", str(out), "--figure", str(figure), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    labels = pliant.load_arrays(out)["component"]
    assert figure.stat().st_size > 1000
    assert len(found["components"]) == labels.max() + 1 >= 4
    assert [part["vertices"] for part in found["components"]] == [
        int((labels == i).sum()) for i in range(len(found["components"]))
    ]


def test_correspond(files, tmp_path, capsys) -> None:
    rest, bent, symmetry = files
    out, figure = tmp_path / "pairs.csv", tmp_path / "pairs.png"
    arguments = ["correspond", str(rest), str(bent), "-o", str(out), "--figure", str(figure), "--up", "y"]
    assert main([*arguments, "--samples", "80", "--json"]) == 0
    pairs = json.loads(capsys.readouterr().out)["pairs"]
    assert figure.stat().st_size > 1000
    assert len(out.read_text(encoding="utf-8").splitlines()) == len(pairs) + 1
    a, b = (np.array([pair[key] for pair in pairs]) for key in ("vertex_a", "vertex_b"))
    mesh = pliant.load_mesh(rest)
    distances = pliant.GeodesicHierarchy(mesh).distances(b)
    rows = np.arange(len(pairs))
    error = np.minimum(distances[rows, a], distances[rows, symmetry[a]]) / np.sqrt(mesh.area)
    assert len(pairs) >= 20
    assert np.median(error) < 0.12


def test_a_figure_of_pairs_needs_pairs() -> None:
    mesh = pliant.shapes.icosphere(1)
    with pytest.raises(pliant.InputError, match="pair up"):
        pliant.correspondence_figure(mesh, mesh, [0, 1], [0])
    with pytest.raises(pliant.InputError, match="outside"):
        pliant.correspondence_figure(mesh, mesh, [0], [99])
    assert pliant.correspondence_figure(mesh, mesh, [], []).axes
