"""The benchmarks of devices, clusters and sizes run; their laws are those of the points they are given."""

from __future__ import annotations

import json

import numba.cuda
import numpy as np
import pytest

from pliant.bench import scaling
from pliant.cli import main


def test_no_figure_stands_where_there_is_no_device(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(numba.cuda, "is_available", lambda: False)
    assert main(["bench", "field", "--device", "cuda", "--levels", "3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    rows = {row["engine"]: row for row in found["rows"]}
    assert len(rows) == 6
    for name, row in rows.items():
        if name.startswith("cuda"):
            assert row["seconds"] is None
            assert row["ratio"] is None
            assert "nvidia-smi" in row["skipped"]
        else:
            assert row["seconds"] > 0
    assert rows["johnson"]["ratio"] == 1
    assert "24 to 31" in found["printed"].values()
    assert main(["bench", "field", "--device", "cuda", "--levels", "3"]) == 0
    assert "not measured" in capsys.readouterr().out


def test_cluster(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "cluster", "--level", "3", "--workers", "1", "--repeats", "1", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [row["workers"] for row in rows] == [0, 1]
    assert rows[0]["sha256"] == rows[1]["sha256"]
    assert rows[1]["speedup"] == 1
    assert main(["bench", "cluster", "--workers", "x"]) == 2


def test_scaling(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [
        "--sizes",
        "300,700",
        "--samples",
        "64",
        "--phases",
        "hierarchy,field,sampled field",
        "--jobs",
        "1",
    ]
    assert main(["bench", "scaling", *arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [len(row["phases"]) for row in found["rows"]] == [3, 3]
    assert all(part["seconds"] > 0 and part["peak_mb"] > 0 for row in found["rows"] for part in row["phases"])
    assert found["laws"] == []
    assert main(["bench", "scaling", "--phases", "nothing"]) == 2


def test_a_power_law_is_found_again() -> None:
    n = np.array([1e3, 1e4, 1e5, 1e6])
    factor, exponent, residuals = scaling.power_law(n, 3e-6 * n**1.25)
    assert factor == pytest.approx(3e-6)
    assert exponent == pytest.approx(1.25)
    np.testing.assert_allclose(residuals, 0, atol=1e-12)


def test_predictions_are_the_laws_and_marked() -> None:
    rows = [
        {
            "n": n,
            "phases": [
                {"phase": "hierarchy", "seconds": 1e-5 * n},
                {"phase": "field", "seconds": 1e-9 * n**2, "ms_per_source": 1e-6 * n},
            ],
        }
        for n in (5_000, 20_000, 80_000)
    ]
    fitted = scaling.laws(rows)
    assert [law["exponent"] for law in fitted] == pytest.approx([1, 1])
    one, ten = scaling.cohort_hours(fitted, subjects=36, vertices=100_000, workers=(1, 10))
    # 1 s of hierarchy and 10 s of field a subject; ten machines take 4 subjects each at most.
    assert one["hours"] == pytest.approx(36 * 11 / 3600)
    assert ten["hours"] == pytest.approx(4 * 11 / 3600)
    assert one["prediction"] is True
    assert one["left_out"] == ["eigenbasis", "densities"]


def test_the_surface_has_about_the_size_asked_for() -> None:
    for size in (1_000, 50_000):
        assert scaling.surface(size).n_vertices == pytest.approx(size, rel=0.1)
