"""``pliant describe``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant.cli import main


@pytest.fixture(scope="module")
def bumpy_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("describe") / "bumpy.ply"
    pliant.save_mesh(path, pliant.shapes.bumpy_sphere(2, rng=0))
    return path


def test_stores_what_the_functions_return(
    bumpy_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "signatures.npz"
    names = "hks,wks,bdk,bde,gfe,gch,curvature"
    assert main(["describe", str(bumpy_file), "--with", names, "-k", "40", "-o", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert [row["signature"] for row in said["tables"]] == names.split(",")
    assert said["k"] == 40
    mesh = pliant.load_mesh(bumpy_file)
    spectrum = pliant.eigenbasis(mesh, 40)
    with np.load(out) as stored:
        np.testing.assert_array_equal(stored["wks"], pliant.wks(spectrum))
        np.testing.assert_array_equal(stored["bde"], pliant.bde(spectrum))
        np.testing.assert_array_equal(stored["bdk"][:, 0], pliant.bdk(spectrum))
        np.testing.assert_array_equal(stored["gfe"][:, 0], pliant.gfe(mesh))
        np.testing.assert_array_equal(stored["curvature"], pliant.curvature_signature(mesh))
        np.testing.assert_allclose(stored["gch"].sum(axis=1), 1)
        assert json.loads(str(stored["settings"]))["k"] == 40


def test_writes_a_picture_and_a_table(
    bumpy_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figure = tmp_path / "signatures.png"
    # More eigenpairs than vertices are more than there are: all but one are taken.
    assert main(["describe", str(bumpy_file), "--with", "bdk", "-k", "999", "--figure", str(figure)]) == 0
    said = capsys.readouterr().out
    assert "161" in said
    assert "bdk" in said
    assert figure.stat().st_size > 1000


@pytest.mark.parametrize("names", ["", "hks,,wks", "hks,shot"])
def test_unknown_signatures_are_bad_usage(
    bumpy_file: Path, names: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["describe", str(bumpy_file), "--with", names]) == 2
    assert "hks, wks, bdk, bde" in " ".join(capsys.readouterr().err.split())
