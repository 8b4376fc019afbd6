"""The benchmarks run, and their figures hang together; nothing here looks at how fast anything is."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pliant.bench.harness import BenchmarkError, measured
from pliant.cli import main


def test_field(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "field", "--levels", "3", "--repeats", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    sums = {(row["what"], row["engine"]): row["checksum"] for row in found["rows"]}
    assert len(sums) == 6
    assert found["machine"]["cores"] >= 1
    # NetworKit counts each pair in both directions.
    assert sums["betweenness", "networkit"] == pytest.approx(2 * sums["betweenness", "pliant"], rel=1e-7)
    assert sums["betweenness", "igraph"] == pytest.approx(sums["betweenness", "pliant"], rel=1e-7)
    for engine in ("networkit", "scipy"):
        assert sums["distances", engine] == pytest.approx(sums["distances", "pliant"], rel=1e-9)
    assert all(row["seconds"] > 0 and row["peak_mb"] > 0 for row in found["rows"])


def test_spectral(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--levels", "3", "-k", "20", "--repeats", "1", "--no-convergence", "--json"]
    assert main(["bench", "spectral", *arguments]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row["vertices"] == 642
    assert row["residual"] < 1e-8


@pytest.mark.data
def test_maps(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = data / "shapes" / "tosca_remeshed_5k"
    assert main(["bench", "maps", str(folder), "--pairs", "1", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert row["symmetric"] < 0.1


def test_wrong_levels_and_failed_measurements() -> None:
    assert main(["bench", "field", "--levels", "x"]) == 2
    assert main(["bench", "field", "--levels", "99"]) == 2
    with pytest.raises(BenchmarkError, match="failed"):
        measured("pliant.bench.field", "no such task", {}, repeats=1)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["maps"], "no two shapes of one class"),
        (["symmetry"], "no shape is there"),
        (["symmetry", "--names", "cat0"], "2 files are missing: cat.symmetry.csv, cat0.ply"),
        (["symmetry", "--repeated", "dog"], "dog0.ply: no such file"),
    ],
)
def test_folders_without_shapes_are_bad_input(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", *arguments[:1], str(tmp_path), *arguments[1:]]) == 3
    assert said in capsys.readouterr().err
