"""``pliant cortex``: tables, arrays, figures and the page; equal results when run again."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import nibabel
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
        signature=ContextSignature(count=20, bins=6, scale="log", percentile=99.9), n_jobs=1,
    )  # fmt: skip
    ranking = variability(found.histograms, edges=found.edges, resamples=40, rng=0)
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
    page = (place / "out/report.html").read_text(encoding="utf-8")
    assert "<h1>Folding over 7 subjects</h1>" in page
    assert "gone.ply" in page
    assert page.count("data:image/png;base64,") == 3
    assert "Difference between a and b" in page
    assert "http://" not in page.replace("http://www.w3.org", "")


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


def test_other_measures_and_other_runs_are_compared(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(place, "first", "--json") == 0
    capsys.readouterr()
    assert run(place, "beside", "--against", "curvature", "--beside", str(place / "first"), "--json") == 0
    agreement = json.loads(capsys.readouterr().out)["agreement"]
    same = agreement[str(place / "first")]
    # The table has six digits, which may tie two sites.
    assert same["spearman"] == pytest.approx(1.0, abs=2e-3)
    assert same["sites"] == 21
    assert -1 <= agreement["curvature"]["low"] <= agreement["curvature"]["spearman"] < 1
    with (place / "beside/sites.csv").open() as lines:
        deviations = [float(row["mad_curvature"]) for row in csv.DictReader(lines)]
    setting = ContextSignature(count=20, bins=6, percentile=99.9)
    found = study_cohort(
        read_cohort(place / "cohort.csv"), place / "curvature", landmarks=place / "sites.csv",
        signature=setting, measure="curvature", n_jobs=1,
    )  # fmt: skip
    expected = variability(found.histograms, edges=found.edges, resamples=1, rng=0).mad
    np.testing.assert_allclose(deviations, expected, rtol=1e-5)
    assert "Agreement with other measures" in (place / "beside/report.html").read_text(encoding="utf-8")


def test_as_the_dissertation_has_it(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(place, "printed", "--scale", "linear", "--deviation", "bins", "--json") == 0
    capsys.readouterr()
    found = study_cohort(
        read_cohort(place / "cohort.csv"), place / "library", landmarks=place / "sites.csv",
        signature=ContextSignature(count=20, bins=6), n_jobs=1,
    )  # fmt: skip
    arrays = load_arrays(place / "printed/cohort.npz")
    np.testing.assert_array_equal(arrays["histograms"], found.histograms)
    np.testing.assert_array_equal(arrays["mad"], variability(found.histograms, resamples=1).mad)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_killed_and_resumed_it_writes_the_same_bytes(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(place, "whole", "--json") == 0
    capsys.readouterr()
    whole = [sys.executable, "-c", "from pliant.cli import main; raise SystemExit(main())", "cortex",
             str(place / "cohort.csv"), "--landmarks", str(place / "sites.csv"), "-o", str(place / "cut"),
             "--count", "20", "--bins", "6", "--resamples", "40", "--jobs", "1"]  # fmt: skip
    with subprocess.Popen(whole, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as running:
        # As soon as one subject is there, in the midst of the others or of what follows.
        while running.poll() is None and not list((place / "cut/subjects").glob("*.npz")):
            time.sleep(0.005)
        running.send_signal(signal.SIGKILL)
    assert run(place, "cut", "--json") == 0
    capsys.readouterr()
    names = [*TABLES, *(f"subjects/s{i}.npz" for i in range(7))]
    for name in names:
        assert (place / "cut" / name).read_bytes() == (place / "whole" / name).read_bytes(), name


def test_a_folder_of_freesurfer_derivatives(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = place / "derivatives"
    for i in range(4):
        surf = folder / f"s{i}" / "surf"
        surf.mkdir(parents=True)
        mesh = shapes.bumpy_sphere(subdivisions=2, rng=i)
        nibabel.freesurfer.write_geometry(surf / "lh.pial", mesh.vertices, mesh.faces)
        nibabel.freesurfer.write_morph_data(surf / "lh.sulc", mesh.vertices[:, 2])
    given = ["cortex", str(folder), "--surface", "pial", "--landmarks", str(place / "sites.csv"), "-o",
             str(place / "fs"), "--count", "20", "--resamples", "20", "--jobs", "1"]  # fmt: skip
    assert main([*given, "--against", "sulc", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["subjects"], said["failed"]) == (4, {})
    assert "sulc" in said["agreement"]
