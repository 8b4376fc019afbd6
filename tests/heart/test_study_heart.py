"""The study: finds what is there, finds nothing where nothing is, and learns nothing from the test subjects."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from pliant import FileFormatError, InputError, save_mesh
from pliant.cli import main
from pliant.cli.app import app
from pliant.heart import (
    BagOfFeatures,
    HeartSubject,
    describe_cohort,
    heart_phantom,
    heart_study,
    phantom_cohort,
    read_heart_cohort,
    read_heart_landmarks,
)
from pliant.heart._crossval import inputs_by_fold, splits_of
from pliant.heart.features import SegmentFeatures

SEGMENTS = np.repeat(np.arange(1, 18), 25)
TERRITORY = np.array([-1, 0, 0, 2, 2, 1, 1, 0, 0, 2, 2, 1, 1, 0, 0, 2, 1, 0])
FAST = {
    "classifiers": ("logistic",),
    "regressors": ("ridge",),
    "folds": 5,
    "repeats": 1,
    "permutations": 0,
    "n_jobs": 1,
}


def cohort(
    n: int, strength: float, seed: int = 0, column: int = 1
) -> tuple[list[SegmentFeatures], np.ndarray]:
    """Rows of noise in which one column follows the stenosis of the segment's territory; roughness does not."""
    rng = np.random.default_rng(seed)
    percent = rng.permuted(np.tile(np.linspace(5, 100, n)[:, None], (1, 3)), axis=0)
    subjects = []
    for row in percent:
        values = rng.normal(0, 1, (len(SEGMENTS), 23))
        values[:, column] += strength * row[TERRITORY[SEGMENTS]] / 30
        subjects.append(
            SegmentFeatures(
                values, SEGMENTS, SEGMENTS, rng.normal(1, 0.1, 18), np.ones(18), rng.normal(120, 9)
            )
        )
    return subjects, percent


def test_a_change_is_found_in_its_territory_and_above_the_baselines() -> None:
    features, percent = cohort(30, 1.0)
    found = heart_study(features, percent, resamples=300, **FAST)
    for unit in ("LAD", "LCX", "RCA"):
        assert found.row(unit, "bag of features", "ridge").score.value > 0.7
        assert found.row(unit, "bag of features", "logistic").score.value > 0.7
    difference, low, high = found.above(
        "bag of features", "roughness", model="ridge", baseline_model="linear"
    )
    assert low > 0
    assert low < difference < high


def test_nothing_is_found_where_there_is_nothing() -> None:
    features, percent = cohort(24, 0.0)
    found = heart_study(features, percent, **{**FAST, "permutations": 19})
    inside = [row.score.value <= row.score.null for row in found.rows if row.method == "bag of features"]
    assert sum(inside) >= 5
    assert all(row.score.p >= 0.05 for row in found.rows)


def test_every_study_shows_both_baselines_and_all_columns() -> None:
    features, percent = cohort(30, 1.0)
    found = heart_study(features, percent, scenario="global", threshold=80.0, **FAST)
    assert found.cautions == ()
    table = found.table()
    assert {row["method"] for row in table} == {
        "bag of features", "bag of features and size", "roughness", "cavity volume"
    }  # fmt: skip
    assert {row["unit"] for row in table} == {"all"}
    graded = next(row for row in table if row["model"] == "ridge")
    assert graded["R2"] == pytest.approx(graded["r"] * abs(graded["r"]), abs=2e-3)
    assert graded["low"] <= graded["r"] <= graded["high"]


def test_an_interval_needs_ten_subjects_of_each_class() -> None:
    features, _ = cohort(21, 1.0)
    for diseased, known in ((10, True), (9, False), (12, False)):
        labels = np.arange(21) < diseased
        found = heart_study(
            features,
            diseased=labels,
            scenario="global",
            methods={"bag": BagOfFeatures(words=5)},
            **{**FAST, "folds": 2},
        )
        for row in found.rows:
            assert np.isfinite([row.score.low, row.score.high]).all() == known
        assert np.isfinite(found.rows[0].score.value)
        assert len(found.cautions) == (0 if known else 1)
        record = found.table()[0]
        assert (record["low"] is None) == (not known)
    assert "all 12 of 21" in found.cautions[0]


def test_segments_take_the_stenosis_of_their_territory() -> None:
    features, percent = cohort(12, 1.0)
    found = heart_study(
        features, percent, scenario="segment", methods={"bag": BagOfFeatures(words=5)}, **FAST
    )
    assert len(found.problems) == 17
    assert np.array_equal(found.problems["segment 15"].percent, percent[:, 2])
    assert found.row("segment 12", "bag", "ridge").predicted.shape == (1, 12)


def test_vocabulary_and_predictions_do_not_see_the_test_subject() -> None:
    features, percent = cohort(14, 1.0)
    diseased = percent[:, 0] >= 70
    splits = splits_of(diseased, "leave-one-out", 1, np.random.default_rng(0))
    bags = [f.values for f in features]
    before = inputs_by_fold(BagOfFeatures(words=5), bags, splits)
    bags[3] = bags[3] + 50
    after = inputs_by_fold(BagOfFeatures(words=5), bags, splits)
    assert splits[0][3][1].tolist() == [3]
    others = np.arange(14) != 3
    assert np.array_equal(before[0][3][others], after[0][3][others])
    assert not np.array_equal(before[0][5][others], after[0][5][others])


def test_perceptron_and_least_squares_run_and_repeat_with_the_seed() -> None:
    features, percent = cohort(16, 2.0)
    options = {
        "scenario": "global",
        "folds": 4,
        "repeats": 1,
        "permutations": 2,
        "rng": 4,
        "resamples": 50,
        "n_jobs": 1,
    }
    one, two = (heart_study(features, percent, **options) for _ in range(2))
    assert [row.predicted.tobytes() for row in one.rows] == [row.predicted.tobytes() for row in two.rows]
    assert {row.model for row in one.rows} == {"perceptron", "logistic", "linear", "ridge"}
    assert {row.model for row in one.rows if row.method.endswith("size")} == {"logistic", "ridge"}


def test_labels_that_cannot_be_used_are_refused() -> None:
    features, percent = cohort(12, 1.0)
    with pytest.raises(InputError, match=r"missing .* \[4\]"):
        heart_study(features, np.where(np.arange(12)[:, None] == 4, np.nan, percent))
    with pytest.raises(InputError, match="LAD: 0 of 12"):
        heart_study(features, percent * 0.5)
    with pytest.raises(InputError, match="must be"):
        heart_study(features, percent[:5])
    with pytest.raises(InputError, match="give stenosis"):
        heart_study(features)
    with pytest.raises(InputError, match="needs the stenosis"):
        heart_study(features, diseased=np.arange(12) % 2)
    with pytest.raises(InputError, match=r"wrong or missing at \[2\]"):
        heart_study(
            features, diseased=np.where(np.arange(12) == 2, np.nan, np.arange(12) % 2), scenario="global"
        )
    with pytest.raises(InputError, match="models are"):
        heart_study(features, percent, classifiers=("forest",))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="baseline"):
        heart_study(features, percent, methods={"roughness": BagOfFeatures()})
    with pytest.raises(InputError, match="folds"):
        heart_study(features, percent, folds=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("cohort")
    phantom_cohort(4, rng=1, spacing=4.0, mesh_step=2.5).save(place, volumes=False)
    return place


def test_a_cohort_resumes_and_lists_a_bad_subject(folder: Path, tmp_path: Path) -> None:
    subjects = [*read_heart_cohort(folder / "cohort.csv"), HeartSubject("lost", folder / "lost.ply")]
    assert len(subjects[0].stenosis) == 3
    found = describe_cohort(subjects, tmp_path, points=20, n_jobs=1)
    assert list(found.failed) == ["lost"]
    features, stenosis, left_out = found.for_stenosis()
    assert len(features) == len(stenosis) == 4
    assert "lost" in left_out
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "subjects").iterdir()}
    (tmp_path / "subjects" / "p002.npz").write_bytes(b"damaged")
    again = describe_cohort(subjects, tmp_path, points=20, n_jobs=1)
    assert [f.values.tobytes() for f in again.features[:4]] == [
        f.values.tobytes() for f in found.features[:4]
    ]  # type: ignore[union-attr]
    after = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "subjects").iterdir()}
    assert {name for name in kept if kept[name] != after[name]} == {"p002.npz"}


def test_a_missing_label_leaves_one_subject_out_by_name(folder: Path, tmp_path: Path) -> None:
    lines = (folder / "cohort.csv").read_text(encoding="utf-8").splitlines()
    columns = lines[0].split(",")
    cells = lines[2].split(",")
    cells[columns.index("stenosis_LCX")] = ""
    table = folder / "gap.csv"
    table.write_text("\n".join([lines[0], lines[1], ",".join(cells), *lines[3:]]))
    found = describe_cohort(read_heart_cohort(table), tmp_path, points=20, n_jobs=1)
    _, stenosis, left_out = found.for_stenosis()
    assert len(stenosis) == 3
    assert left_out == {"p001": "the stenosis of a territory is missing"}


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("name,mesh\na,a.ply\n", "columns subject"),
        ("subject,mesh\n", "needs a row"),
        ("subject,mesh\na,a.ply\nA,b.ply\n", "each once"),
        ("subject,mesh\n../a,a.ply\n", "letters and digits"),
        ("subject,mesh,diseased\na,a.ply,perhaps\n", "must be a number"),
    ],
)
def test_tables_that_cannot_be_read_say_why(tmp_path: Path, text: str, match: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(FileFormatError, match=match):
        read_heart_cohort(tmp_path / "t.csv")


def test_files_that_are_no_tables_say_so(tmp_path: Path) -> None:
    (tmp_path / "mesh.ply").write_bytes(bytes(range(200, 256)))
    for path in (tmp_path / "mesh.ply", tmp_path, tmp_path / "none.csv"):
        with pytest.raises(FileFormatError, match="text file in UTF-8"):
            read_heart_cohort(path)


def test_a_cohort_without_labels_is_refused_before_it_is_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "t.csv").write_text("subject,mesh,diseased\na,a.ply,\n")
    assert main(["heart", "study", str(tmp_path / "t.csv"), "-o", str(tmp_path / "out")]) == 3
    assert "has no label" in " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert not (tmp_path / "out").exists()
    rows = "".join(f"p{i},p{i}.ply,{80 if i < 1 else 10},{80 * (i % 2)},{80 * (i % 2)}\n" for i in range(6))
    (tmp_path / "t.csv").write_text(f"subject,mesh,stenosis_LAD,stenosis_LCX,stenosis_RCA\n{rows}")
    assert main(["heart", "study", str(tmp_path / "t.csv"), "-o", str(tmp_path / "out")]) == 3
    assert "LAD: 1 of 6 subjects are diseased" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "{",
        '{"top": [1, 2, 3]}',
        '{"apex": [1, 2, 3], "space": "LPS"}',
        '{"apex": [1, 2]}',
        '{"apex": "here"}',
    ],
)
def test_landmark_files_that_cannot_be_read_say_why(tmp_path: Path, text: str) -> None:
    (tmp_path / "l.json").write_text(text)
    with pytest.raises(FileFormatError, match=r"l\.json"):
        read_heart_landmarks(tmp_path / "l.json")


def test_report_writes_one_page_that_says_what_it_is_not(tmp_path: Path) -> None:
    phantom = heart_phantom(spacing=2.0, mesh_step=3.0, rng=6)
    from pliant.heart._volume_files import write_image

    write_image(tmp_path / "ct.nii.gz", np.asarray(phantom.volume.values), np.asarray(phantom.volume.affine))
    marks = {name: points.tolist() for name, points in phantom.landmarks.items()}
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    command = ["heart", "report", str(tmp_path / "ct.nii.gz"), "-o", str(tmp_path / "out"), "--points", "40"]
    done = CliRunner().invoke(app, [*command, "--landmarks", str(tmp_path / "marks.json"), "--json"])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "not a medical device" in page
    assert not re.findall(r"(?:src|href)=\"(?!data:)[^\"]+|url\(", page)
    assert page.count("data:image/png") == 4
    assert f"sphericity {json.loads(done.stdout)['sphericity']:.2f}" in page
    for step in ("volume", "blood pool", "surface", "segments", "features"):
        assert f"{step}: " in page
    steps = json.loads((tmp_path / "out" / "steps.json").read_text(encoding="utf-8"))
    assert steps["steps"]["segments"]["confidence"] == 1.0
    assert len((tmp_path / "out" / "segments.csv").read_text(encoding="utf-8").splitlines()) == 18


def test_commands_for_meshes(folder: Path, tmp_path: Path) -> None:
    run = CliRunner().invoke
    mesh, marks = str(folder / "p000.ply"), str(folder / "p000.landmarks.json")
    done = run(
        app, ["heart", "segments", mesh, "-o", str(tmp_path / "s.csv"), "--landmarks", marks, "--json"]
    )
    assert done.exit_code == 0, done.output
    said = json.loads(done.stdout)
    assert said["confidence"] == 1.0
    assert len(said["vertices_of_segments"]) == 18
    truth = np.loadtxt(folder / "p000.segments.csv", delimiter=",", skiprows=1, dtype=int)
    mine = np.loadtxt(tmp_path / "s.csv", delimiter=",", skiprows=1, dtype=int)
    assert (truth.reshape(len(mine), -1)[:, -1] == mine[:, 1]).mean() > 0.97
    done = run(
        app,
        ["heart", "describe", mesh, "-o", str(tmp_path / "d.csv"), "--landmarks", marks, "--points", "20"],
    )
    assert done.exit_code == 0, done.output
    assert (tmp_path / "d.csv").read_text(encoding="utf-8").startswith("segment,name,territory")


def test_study_command_leaves_tables(folder: Path, tmp_path: Path) -> None:
    rows = (folder / "cohort.csv").read_text(encoding="utf-8").splitlines()
    columns = rows[0].split(",")
    kept = [columns.index(name) for name in ("subject", "mesh", "landmarks")]
    text = "subject,mesh,landmarks,diseased\n"
    for i, row in enumerate(rows[1:]):
        cells = row.split(",")
        text += ",".join(cells[k] for k in kept) + f",{i % 2}\n"
    table = folder / "groups.csv"
    table.write_text(text + "bad,none.ply,,1\n")
    options = [
        "--points",
        "20",
        "--folds",
        "2",
        "--repeats",
        "1",
        "--permutations",
        "0",
        "--words",
        "4",
        "--jobs",
        "1",
    ]
    done = CliRunner().invoke(app, ["heart", "study", str(table), "-o", str(tmp_path), *options, "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert list(found["left_out"]) == ["bad"]
    assert (tmp_path / "global.csv").read_text(encoding="utf-8").startswith("unit,method,model")
    methods = {
        "bag of features",
        "bag of features and size",
        "roughness",
        "cavity volume",
        "volume and sphericity",
    }
    assert {row["method"] for row in found["rows"]} == methods


def test_segments_refuses_a_mesh_that_is_no_ventricle(tmp_path: Path) -> None:
    from pliant import Mesh

    save_mesh(tmp_path / "flat.ply", Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    done = CliRunner().invoke(
        app, ["heart", "segments", str(tmp_path / "flat.ply"), "-o", str(tmp_path / "s.csv")]
    )
    assert done.exit_code != 0
    assert isinstance(done.exception, InputError)
