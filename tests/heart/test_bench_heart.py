"""The benchmark of the study: who could not be measured is counted, real hearts are read from their table."""

from __future__ import annotations

import csv
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pliant import InputError
from pliant.bench import heart as bench
from pliant.bench import heart_real
from pliant.cli import main
from pliant.heart import phantom_cohort


def test_a_subject_whose_ct_cannot_be_measured_is_counted_and_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen: list[Any] = []

    def described(volume: Any, **options: Any) -> Any:
        seen.append(options["landmarks"])
        if len(seen) == 3:
            raise InputError("no chamber")
        return SimpleNamespace(features=len(seen))

    monkeypatch.setattr(bench, "phantom_cohort", partial(phantom_cohort, mesh_step=4.0))
    monkeypatch.setattr(bench, "describe_heart", described)
    features, stenosis, about = bench._cohort("ct", 4, 7, 8.0)
    assert features == [1, 2, 4]
    assert about["failed"] == 1
    assert np.array_equal(stenosis, phantom_cohort(4, rng=7).stenosis[[0, 1, 3]])
    # Septal landmarks only: apex and base are found.
    assert all(set(marks) == {"septum"} for marks in seen)


def test_tables_that_are_not_there_or_lack_their_data(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for options, said in (
        (["--tables", "5.4"], "tables are 5.3, 5.7"),
        (["--tables", "sunnybrook"], "needs the folder"),
        (["--tables", "sunnybrook", "--data", str(tmp_path)], "no cases.csv"),
    ):
        assert main(["bench", "heart", *options]) == 3
        assert said in " ".join(capsys.readouterr().err.split())


@pytest.mark.data
def test_real_hearts_are_read_with_their_groups(data: Path, tmp_path: Path) -> None:
    place = data / "heart" / "sunnybrook"
    rows = list(csv.DictReader((place / "cases.csv").read_text(encoding="utf-8").splitlines()))
    # Case 42 is normal, case 4 has heart failure, case 7 has hypertrophy and is left out.
    chosen = [rows[i] for i in (4, 7, 42)]
    (tmp_path / "lv_endo_ply").symlink_to(place / "lv_endo_ply")
    with (tmp_path / "cases.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(chosen)
    features, diseased = heart_real.measured_hearts(tmp_path)
    assert diseased.tolist() == [True, False]
    volumes = [float(rows[i]["mesh_ml"]) for i in (4, 42)]
    assert [f.cavity_ml for f in features] == pytest.approx(volumes, rel=0.01)
    # Slices and their thickness give the length, but for what is closed at either end.
    lengths = [float(rows[i]["n_slices"]) * float(rows[i]["z_mm"]) for i in (4, 42)]
    assert [f.axis_mm for f in features] == pytest.approx(lengths, abs=8)
    assert all(0.2 < f.sphericity < 0.9 for f in features)
