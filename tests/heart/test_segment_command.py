"""``pliant heart segment``, ``heart phantom`` and ``bench segmentation`` at the shell."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from pliant.bench import heart_segmentation
from pliant.cli import main
from pliant.heart import load_volume, segment_blood_pool, volume_overlap


@pytest.fixture(scope="module")
def cohort(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("phantoms") / "cohort"
    assert (
        main(["heart", "phantom", "-o", str(folder), "--count", "2", "--spacing", "2", "--mesh-step", "4"])
        == 0
    )
    return folder


def test_a_mask_lies_on_the_volume_s_grid(
    cohort: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = list(csv.DictReader((cohort / "cohort.csv").read_text(encoding="utf-8").splitlines()))
    image, out = cohort / rows[0]["volume"], tmp_path / "mask.nii.gz"
    assert main(["heart", "segment", str(image), "-o", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    volume, mask = load_volume(image, modality="CT"), load_volume(out)
    assert mask.shape == volume.shape
    assert np.allclose(mask.affine, volume.affine, atol=1e-4)
    assert np.array_equal(mask.values > 0, segment_blood_pool(volume).mask)
    truth = load_volume(cohort / rows[0]["mask"]).values > 0
    assert volume_overlap(mask.values > 0, truth, measure="dice") > 0.95
    assert said["leak"] is False
    assert said["millilitres"] == pytest.approx(
        (mask.values > 0).sum() * volume.voxel_volume / 1000, abs=0.01
    )


def test_a_given_plane_is_used(cohort: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    marks = json.loads((cohort / "p001.landmarks.json").read_text(encoding="utf-8"))
    axis = np.subtract(marks["base"], marks["apex"])
    plane = ",".join(f"{x:.4f}" for x in [*marks["base"], *axis])
    out = tmp_path / "mask.nrrd"
    arguments = ["heart", "segment", str(cohort / "p001.nii.gz"), "-o", str(out), f"--basal-plane={plane}"]
    assert main(arguments) == 0
    assert "given" in capsys.readouterr().out
    truth = load_volume(cohort / "p001.mask.nii.gz").values > 0
    assert volume_overlap(load_volume(out).values > 0, truth, measure="dice") > 0.96


def test_a_cohort_is_not_mixed_with_another(cohort: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["heart", "phantom", "-o", str(cohort), "--count", "2", "--spacing", "2", "--mesh-step", "4"]
    assert main(arguments) == 0
    assert main([*arguments, "--change", "none"]) == 2
    assert "other settings" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("extra", "code", "said"),
    [
        (["--seed", "1,2"], 2, "needs 3 numbers"),
        (["--basal-plane", "a,b"], 2, "not a list of numbers"),
        (["--seed", "900,0,0"], 3, "outside the volume"),
        (["--near", "MESH"], 3, "not a folder of DICOM"),
    ],
)
def test_bad_input_ends_with_its_code(
    cohort: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], extra: list[str], code: int, said: str
) -> None:
    extra = [str(cohort / "p000.ply") if part == "MESH" else part for part in extra]
    arguments = ["heart", "segment", str(cohort / "p000.nii.gz"), "-o", str(tmp_path / "m.nii.gz"), *extra]
    assert main(arguments) == code
    assert said in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "m.nii.gz").exists()


def test_measurements_are_of_what_they_say(capsys: pytest.CaptureFixture[str]) -> None:
    rows = heart_segmentation.median_table((3.0, 9.0), noises=(47.0,), spacing=3.0)
    assert rows[0]["mean"] > rows[1]["mean"]
    contours = heart_segmentation.level_set_row(50, steps=(30,))
    assert contours[0]["dice"] > 0.9
    assert contours[1]["ratio"] == pytest.approx(contours[1]["seconds"] / contours[0]["seconds"])
    good = contours[-1]
    assert good["what"] == "pliant region, as good"
    assert contours[0]["steps"] >= good["steps"]
    assert good["dice"] >= min(contours[1]["dice"], contours[0]["dice"])
    assert main(["bench", "segmentation", "--tables", "speed"]) == 2
    assert "no table speed" in " ".join(capsys.readouterr().err.split())
