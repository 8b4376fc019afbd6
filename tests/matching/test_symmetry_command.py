"""``pliant symmetry``: what it prints, what it writes, and what it says where there is nothing."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from pliant import save_mesh, shapes
from pliant.cli.app import app
from pliant.matching.symmetry import SymmetryResult


@pytest.fixture(scope="module")
def runner():
    return CliRunner()


def test_it_writes_arrays_numbers_a_picture_and_a_page(runner, tmp_path):
    save_mesh(tmp_path / "figure.ply", shapes.quadruped(1000).mesh)
    folder = tmp_path / "new"
    done = runner.invoke(app, ["symmetry", str(tmp_path / "figure.ply"), "-o", str(folder), "--up", "y"])
    assert done.exit_code == 0, done.output
    assert "global" in done.output
    assert SymmetryResult.load(folder).symmetries[0].kind == "global"
    assert (folder / "symmetry-1.png").read_bytes().startswith(b"\x89PNG")
    assert 'data-symmetry="0"' in (folder / "symmetries.html").read_text(encoding="utf-8")


def test_json_says_why_there_is_none(runner, tmp_path):
    save_mesh(tmp_path / "sphere.ply", shapes.icosphere(3))
    done = runner.invoke(app, ["symmetry", str(tmp_path / "sphere.ply"), "--json"])
    assert done.exit_code == 0, done.output
    stored = json.loads(done.stdout)
    assert stored["symmetries"] == []
    assert "continuous" in stored["reasons"][0]


def test_limits_are_named_after_what_they_are_for(runner, tmp_path, monkeypatch):
    monkeypatch.setattr("pliant._progress.FIRST", 0.01)
    save_mesh(tmp_path / "figure.ply", shapes.quadruped(1000).mesh)
    done = runner.invoke(app, ["symmetry", str(tmp_path / "figure.ply"), "-o", str(tmp_path / "new")])
    assert done.exit_code == 0, done.output
    found = SymmetryResult.load(tmp_path / "new")
    assert found.settings["limits_of_limb_pairs"] == {"distortion": 0.25, "eigenvalues": 0.3}
    assert found.symmetries[0].distortion <= found.settings["limits_of_the_whole"]["distortion"]
    assert "limits" not in found.settings
    page = (tmp_path / "new" / "symmetries.html").read_text(encoding="utf-8")
    assert ">limits of limb pairs</th><td>distortion 0.25, eigenvalues 0.3</td>" in page
    # No terminal here: lines instead of a bar.
    assert "pliant: symmetries: done in " in done.stderr
    whole = runner.invoke(app, ["symmetry", str(tmp_path / "figure.ply"), "--no-parts", "--json"])
    assert "limits_of_limb_pairs" not in json.loads(whole.stdout)["settings"]
    assert whole.stderr == ""
