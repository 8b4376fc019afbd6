"""``pliant cortex``: tables, arrays, figures and the page; equal results when run again."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from pliant import load_arrays, save_mesh, shapes
from pliant.cli import main
from pliant.cortex import ContextSignature, read_cohort, study_cohort, variability

TABLES = ("sites.csv", "subjects.csv", "cohort.npz", "settings.json")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("cohort")
    lines = ["subject,mesh,group"]
    for i in range(7):
        save_mesh(place / f"s{i}.ply", shapes.bumpy_sphere(subdivisions=2, rng=i))
        lines.append(f"s{i},s{i}.ply,{'ab'[i % 2]}")
    (place / "sites.csv").write_text("vertex\n" + "\n".join(str(v) for v in range(0, 162, 8)) + "\n")
    (place / "cohort.csv").write_text("\n".join([*lines, "gone,gone.ply,a"]) + "\n")
    return place


def run(place: Path, out: str, *more: str) -> int:
    return main(
        ["cortex", str(place / "cohort.csv"), "--landmarks", str(place / "sites.csv"), "-o", str(place / out),
         "--count", "20", "--bins", "6", "--resamples", "40", "--jobs", "1", *more]
    )  # fmt: skip


def test_command_writes_what_the_library_finds(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(place, "out", "--json") == 0
    said = json.loads(capsys.readouterr().out)
    assert said["subjects"] == 8
    assert list(said["failed"]) == ["gone"]
    assert all(Path(path).stat().st_size > 0 for path in said["written"])
    found = study_cohort(
        read_cohort(place / "cohort.csv"), place / "library", landmarks=place / "sites.csv",
        signature=ContextSignature(count=20, bins=6), n_jobs=1,
    )  # fmt: skip
    ranking = variability(found.histograms, resamples=40, rng=0)
    np.testing.assert_array_equal(load_arrays(place / "out/cohort.npz")["histograms"], found.histograms)
    with (place / "out/sites.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    np.testing.assert_allclose([float(row["mad"]) for row in rows], ranking.mad, rtol=1e-5)
    assert [row["site"] for row in rows if row["class"] == "regular"] == said["regular"]
    assert all(0 < float(row["group_q"]) <= 1 for row in rows)
    with (place / "out/subjects.csv").open() as lines:
        people = list(csv.DictReader(lines))
    assert "gone.ply" in people[-1]["error"]
    assert people[0]["error"] == ""
    page = (place / "out/report.html").read_text()
    assert "Variability over 7 subjects" in page


def test_a_second_run_writes_the_same_bytes(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(place, "out") == 0
    assert "rank stability" in capsys.readouterr().out
    before = [(place / "out" / name).read_bytes() for name in TABLES]
    assert run(place, "out") == 0
    assert run(place, "elsewhere") == 0
    for name, content in zip(TABLES, before, strict=True):
        assert (place / "out" / name).read_bytes() == content
        assert (place / "elsewhere" / name).read_bytes() == content


def test_bad_input_ends_with_one_line(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (place / "bad.csv").write_text("subject\ns1\n")
    assert main(["cortex", str(place / "bad.csv"), "-o", str(place / "x")]) == 3
    assert "missing mesh" in capsys.readouterr().err
    assert run(place, "y", "--radius", "0.3") == 3
    assert "count or radius" in capsys.readouterr().err
