"""Every command on files that are not what it needs: one line, code 3, nothing half done."""

from __future__ import annotations

import gzip
import json
import os
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant import Mesh, shapes
from pliant.cli import main
from pliant.cli.app import app

MESH_COMMANDS = (
    ["inspect"],
    ["mend", "-o", "out.ply"],
    ["field", "-o", "out.npz"],
    ["path", "0", "5", "-o", "out.csv"],
    ["describe", "-o", "out.npz"],
    ["symmetry", "-o", "out"],
    ["components", "-o", "out.npz"],
    ["correspond", "sphere.ply", "-o", "out.csv"],
    ["view", "-o", "out.html"],
    ["heart", "segments", "-o", "out.csv"],
    ["heart", "describe", "-o", "out.csv"],
    ["heart", "report", "-o", "out"],
)
OTHER_COMMANDS = (
    ["heart", "segment", "-o", "out.nii.gz"],
    ["heart", "surface", "-o", "out.ply"],
    ["heart", "study", "-o", "out"],
    ["cortex", "-o", "out"],
    ["image", "match", "noise.png", "-o", "out"],
    ["image", "evaluate"],
    ["retrieval", "train", "-o", "out"],
    ["retrieval", "evaluate"],
    ["retrieval", "query", "noise.png"],
    ["retrieval", "remove", "1"],
    ["retrieval", "serve"],
    ["reproduce", "figure-3.4", "-o", "out", "--data"],
)
FOLDERS_OF_RESULTS = (
    ["symmetry", "sphere.ply"],
    ["cortex", "table.csv"],
    ["demo"],
    ["heart", "phantom"],
    ["heart", "study", "table.csv"],
    ["heart", "report", "sphere.ply"],
    ["image", "match", "noise.png", "noise.png"],
    ["retrieval", "train", "."],
    ["retrieval", "query", ".", "noise.png"],
    ["reproduce", "figure-3.4"],
)


def put(command: list[str], file: str) -> list[str]:
    """Name a file as the first input of a command."""
    if command[-1] == "--data":
        return [*command, file]
    place = 2 if command[0] in ("heart", "image", "retrieval") else 1
    return [*command[:place], file, *command[place:]]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of files that are good for something else, or for nothing."""
    folder = tmp_path_factory.mktemp("bad")
    pliant.save_mesh(folder / "sphere.ply", shapes.icosphere(2))
    (folder / "text.ply").write_text("hello\nworld\n")
    (folder / "nan.off").write_text("OFF 3 1 0\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n")
    for name in ("empty.ply", "empty.nii.gz", "empty.csv", "empty.json", "empty.png"):
        (folder / name).touch()
    (folder / "table.csv").write_text("vertex,segment\n1,2\n")
    (folder / "match.json").write_text(json.dumps({"box1": [0, 0, 1, 1], "score": 3}))
    whole = gzip.compress(np.random.default_rng(0).bytes(5000))
    (folder / "half.nii.gz").write_bytes(whole[:2000])
    (folder / "folder").mkdir()
    pillow = pytest.importorskip("PIL.Image")
    noise = np.random.default_rng(0).integers(0, 255, (60, 60), dtype=np.uint8)
    pillow.fromarray(noise).save(folder / "noise.png")
    return folder


@pytest.mark.parametrize("file", ["missing.ply", "empty.ply", "text.ply", "nan.off", "folder", "match.json"])
@pytest.mark.parametrize("command", MESH_COMMANDS, ids=" ".join)
def test_what_is_no_mesh(
    command: list[str],
    file: str,
    place: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(place)
    before = sorted(place.iterdir())
    assert main(put(command, file)) == 3
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("pliant: error: ")
    assert file in captured.err
    assert sorted(place.iterdir()) == before


@pytest.mark.parametrize(
    "file", ["missing.csv", "empty.csv", "empty.nii.gz", "half.nii.gz", "folder", "match.json", "table.csv"]
)
@pytest.mark.parametrize("command", OTHER_COMMANDS, ids=" ".join)
def test_what_is_no_input(
    command: list[str],
    file: str,
    place: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if command[0] == "reproduce" and file == "folder":
        file = "noise.png"  # an empty folder of data is one
    monkeypatch.chdir(place)
    before = sorted(place.iterdir())
    assert main(put(command, file)) == 3
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("pliant: error: ")
    assert sorted(place.iterdir()) == before


def test_results_to_agree_with_are_read_before_the_work(
    place: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "cohort.csv").write_text(f"subject,mesh\na,{place / 'sphere.ply'}\n")
    (tmp_path / "sites.csv").write_text("vertex\n1\n")
    arguments = ["cortex", str(tmp_path / "cohort.csv"), "--landmarks", str(tmp_path / "sites.csv")]
    assert main([*arguments, "--beside", str(place / "folder"), "-o", str(tmp_path / "out")]) == 3
    assert "sites.csv" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("out", ["sphere.ply", "sphere.ply/below"])
@pytest.mark.parametrize("command", FOLDERS_OF_RESULTS, ids=" ".join)
def test_a_folder_that_cannot_be_made_is_bad_usage(
    command: list[str], out: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(place)
    assert main([*command, "-o", out]) == 2


def test_a_closed_folder_is_bad_usage(place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Nothing is closed to the superuser, who may be running this.
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert main(["symmetry", str(place / "sphere.ply"), "-o", str(tmp_path / "out")]) == 2
    assert main(["field", str(place / "sphere.ply"), "-o", str(tmp_path / "out.npz")]) == 2


@pytest.mark.parametrize(
    "arguments",
    [
        ["heart", "segment", "sphere.ply", "-o", "out"],
        ["heart", "surface", "sphere.ply", "-o", "out"],
        ["heart", "segments", "sphere.ply", "-o", "out"],
        ["heart", "describe", "sphere.ply", "-o", "out"],
        ["describe", "sphere.ply", "-o", "out"],
        ["view", "sphere.ply", "-o", "out"],
        ["components", "sphere.ply", "-o", "out"],
        ["correspond", "sphere.ply", "sphere.ply", "-o", "out"],
    ],
    ids=" ".join,
)
def test_a_name_without_an_ending_is_bad_usage(
    arguments: list[str], place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(place)
    assert main(arguments) == 2
    assert "--output" in capsys.readouterr().err


def test_a_single_triangle_has_a_picture_too(tmp_path: Path) -> None:
    pliant.save_mesh(tmp_path / "one.ply", Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    figure = tmp_path / "one.png"
    assert main(["field", str(tmp_path / "one.ply"), "--figure", str(figure)]) == 0
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_a_mesh_without_area_cannot_be_mended(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pliant.save_mesh(tmp_path / "flat.ply", Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]))
    assert main(["mend", str(tmp_path / "flat.ply"), "-o", str(tmp_path / "out.ply")]) == 3
    assert "none of the 1 faces has an area" in capsys.readouterr().err
    assert main(["field", str(tmp_path / "flat.ply")]) == 3
    assert "--weights uniform" in capsys.readouterr().err


def test_every_command_says_what_is_wrong_with_a_mesh(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh = shapes.icosphere(2)
    path = tmp_path / "doubled.ply"
    pliant.save_mesh(path, Mesh(mesh.vertices, np.vstack([mesh.faces, mesh.faces[:2]])))
    for command in MESH_COMMANDS:
        if command[0] in ("inspect", "mend", "correspond", "describe"):
            continue
        arguments = [part.replace("out", str(tmp_path / "out")) for part in put(command, str(path))]
        assert main(arguments) in (0, 3)
        assert "doubled.ply: 2 duplicate faces" in capsys.readouterr().err


def test_the_older_name_of_an_option_is_taken(place: Path, tmp_path: Path) -> None:
    out = tmp_path / "field.npz"
    assert main(["field", str(place / "sphere.ply"), "--out", str(out)]) == 0
    assert out.is_file()


def test_results_go_to_one_option() -> None:
    from typer.main import get_command

    def options(command: object, name: str) -> None:
        for below, one in getattr(command, "commands", {}).items():
            options(one, f"{name} {below}")
        for option in getattr(command, "params", []):
            names = set(getattr(option, "opts", []))
            assert not names & {"--out", "--folder"}, name
            assert ("-o" in names) == ("--output" in names), name

    options(get_command(app), "pliant")
