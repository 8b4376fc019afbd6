"""The command line: what it prints, what it writes, and the codes it ends with."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant import cli, shapes
from pliant.cli.app import app

ENTRY = "import sys; from pliant.cli import main; sys.exit(main())"


def process(*arguments: str | Path, **options) -> subprocess.CompletedProcess[str]:
    """Run the program as a process of its own."""
    command = [sys.executable, "-c", ENTRY, *map(str, arguments)]
    environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "200"}
    return subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=False, env=environment, **options
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("meshes")


@pytest.fixture(scope="module")
def sphere_file(folder) -> Path:
    path = folder / "sphere.ply"
    pliant.save_mesh(path, shapes.icosphere(3))
    return path


@pytest.fixture(scope="module")
def sphere(sphere_file):
    return pliant.load_mesh(sphere_file)


@pytest.fixture(scope="module")
def broken_file(folder) -> Path:
    path = folder / "broken.ply"
    path.write_text("this is no mesh\n")
    return path


@pytest.fixture(scope="module")
def dirty_file(folder) -> Path:
    """A sphere with one face wound the wrong way and a vertex of no face."""
    mesh = shapes.icosphere(2)
    faces = mesh.faces.copy()
    faces[7] = faces[7, ::-1]
    path = folder / "dirty.ply"
    pliant.save_mesh(path, pliant.Mesh(np.vstack([mesh.vertices, [[5.0, 5, 5]]]), faces))
    return path


def test_every_command_explains_itself(capsys):
    assert cli.main(["--help"]) == 0
    said = capsys.readouterr().out
    names = {command.name or command.callback.__name__ for command in app.registered_commands}
    assert {"demo", "inspect", "field"} <= names
    for name in names:
        assert name in said
        assert cli.main([name, "--help"]) == 0


def test_help_does_not_import_the_heavy_packages():
    code = (
        "import sys; from pliant.cli import main; main(['--help']); "
        "heavy = {'numpy', 'scipy', 'numba', 'matplotlib', 'nibabel', 'nilearn'} & set(sys.modules); "
        "sys.stderr.write(repr(sorted(heavy)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr in ("[]", "['numpy']")


def test_version(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == f"pliant {pliant.__version__}\n"


def test_no_arguments_shows_help(capsys):
    assert cli.main([]) in (0, 2)  # the parser's versions differ
    captured = capsys.readouterr()
    assert "inspect" in captured.out + captured.err


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["inspect"],
        ["field"],
        ["field", "m.ply", "--weights", "heavy"],
        ["field", "m.ply", "--graph", "none"],
        ["field", "m.ply", "--samples", "0"],
        ["field", "m.ply", "--jobs", "0"],
        ["field", "m.ply", "-o", "values.obj"],
        ["field", "m.ply", "-o", "values.xyz"],
        ["field", "m.ply", "-o", "no-such-folder/values.npz"],
        ["field", "m.ply", "--figure", "picture.doc"],
        ["field", "m.ply", "--page", "page.png"],
        ["reproduce", "table-9.9"],
    ],
)
def test_bad_usage_ends_with_2_before_any_work(arguments, capsys):
    assert cli.main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "Traceback" not in captured.err
    assert captured.err


@pytest.mark.parametrize("name", ["x.csv", "x.obj"])
def test_endings_offered_for_values_hold_values(name, sphere_file, tmp_path, capsys):
    assert cli.main(["field", str(sphere_file), "-o", str(tmp_path / name)]) == 2
    said = capsys.readouterr().err.replace("\u2502", " ")
    offered = said.split("use ")[1].split("\u2570")[0].replace(",", " ").split()
    assert ".npz" in offered
    for ending in offered:
        out = tmp_path / f"values{ending}"
        assert cli.main(["field", str(sphere_file), "-o", str(out), "--json"]) == 0
        assert "gfe" in pliant.load_arrays(out)


def one_error_line(said: str, path: Path) -> bool:
    lines = said.strip().splitlines()
    return len(lines) == 1 and lines[0].startswith("pliant: error: ") and path.name in lines[0]


@pytest.mark.parametrize("command", ["inspect", "field"])
def test_bad_input_ends_with_3_and_one_line(command, broken_file, folder, capsys):
    for path in (broken_file, folder / "absent.ply", folder):
        assert cli.main([command, str(path)]) == 3
        captured = capsys.readouterr()
        assert captured.out == ""
        assert one_error_line(captured.err, path), captured.err


def test_bad_input_of_a_process_ends_with_3(broken_file):
    done = process("field", broken_file)
    assert done.returncode == 3
    assert done.stdout == ""
    assert one_error_line(done.stderr, broken_file), done.stderr


def test_usage_errors_of_a_process_end_with_2():
    done = process("field", "m.ply", "--weights", "heavy")
    assert done.returncode == 2
    assert "--weights" in done.stderr


def test_inspect_names_what_it_finds(dirty_file, sphere_file, capsys):
    assert cli.main(["inspect", str(sphere_file), str(dirty_file)]) == 0
    said = capsys.readouterr().out
    for report in (pliant.check_up(pliant.load_mesh(path)) for path in (sphere_file, dirty_file)):
        assert str(report) in said
    assert "unreferenced" in said


def test_inspect_goes_on_past_a_bad_file(broken_file, sphere_file):
    done = process("inspect", broken_file, sphere_file, "--json")
    assert done.returncode == 3
    first, second = json.loads(done.stdout)
    assert "error" in first
    assert second == {
        "file": str(sphere_file),
        **pliant.check_up(pliant.load_mesh(sphere_file)).to_dict(),
    }


def test_field_stores_the_exact_values_and_what_made_them(sphere_file, sphere, tmp_path, capsys):
    out = tmp_path / "field.npz"
    assert cli.main(["field", str(sphere_file), "-o", str(out), "--weights", "uniform"]) == 0
    with np.load(out) as stored:
        assert np.array_equal(stored["gfe"], pliant.gfe(sphere, weights="uniform"))
        settings = json.loads(str(stored["settings"]))
        assert set(stored.files) == {"gfe", "settings"}
    assert settings == {
        "mesh": "sphere.ply",
        "quantity": "gfe",
        "weights": "uniform",
        "graph": "edges",
        "pliant": pliant.__version__,
    }
    said = capsys.readouterr().out
    assert f"wrote {out}" in said
    assert "Most travelled" in said
    assert str(int(np.argmax(pliant.gfe(sphere, weights="uniform")))) in said


def test_field_samples_with_a_seed(sphere_file, sphere, tmp_path):
    out = tmp_path / "field.npz"
    options = ["--samples", "64", "--seed", "5", "--graph", "refined"]
    assert cli.main(["field", str(sphere_file), "-o", str(out), *options]) == 0
    wanted = pliant.estimate_gfe(sphere, 64, graph="refined", rng=5)
    with np.load(out) as stored:
        assert np.array_equal(stored["gfe"], wanted.values)
        assert np.array_equal(stored["half_width"], wanted.half_widths)
        settings = json.loads(str(stored["settings"]))
    assert (settings["samples"], settings["seed"], settings["confidence"]) == (64, 5, 0.95)


@pytest.mark.parametrize("ending", [".ply", ".vtp", ".func.gii"])
def test_field_writes_other_formats(sphere_file, sphere, tmp_path, ending):
    out = tmp_path / f"field{ending}"
    assert cli.main(["field", str(sphere_file), "-o", str(out)]) == 0
    assert np.allclose(pliant.load_arrays(out)["gfe"], pliant.gfe(sphere), rtol=1e-6)


def test_field_as_json_is_all_there_is_on_standard_output(sphere_file, sphere, tmp_path):
    picture, page = tmp_path / "gfe.png", tmp_path / "gfe.html"
    done = process("field", sphere_file, "--json", "--figure", picture, "--scale", "log", "--page", page)
    assert done.returncode == 0, done.stderr
    assert '<option value="log" selected>' in page.read_text(encoding="utf-8")
    assert done.stderr == ""
    facts = json.loads(done.stdout)
    field = pliant.gfe(sphere)
    assert facts["vertices"] == sphere.n_vertices
    assert facts["gfe"]["median"] == pytest.approx(np.median(field))
    assert facts["most_travelled"][0] == {
        "vertex": int(np.argmax(field)),
        "gfe": pytest.approx(field.max()),
    }
    assert facts["check_up"]["ok"] is True
    assert facts["written"] == [str(picture), str(page)]
    assert picture.read_bytes().startswith(b"\x89PNG")
    html = page.read_text(encoding="utf-8")
    assert "sphere.ply" in html
    assert '"histograms":["GCH: share of the 50 nearest vertices"]' in html


def test_what_is_wrong_with_a_mesh_is_said_beside_its_field(dirty_file):
    done = process("field", dirty_file, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["check_up"]["ok"] is False
    lines = done.stderr.strip().splitlines()
    assert all(line.startswith("pliant: warning: ") for line in lines)
    assert any("unreferenced" in line for line in lines)


def test_too_many_samples_is_bad_input(sphere_file, capsys):
    assert cli.main(["field", str(sphere_file), "--samples", "100000"]) == 3
    assert "samples" in capsys.readouterr().err


def test_warnings_are_one_line(folder, capsys):
    path = folder / "square.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    assert cli.main(["inspect", str(path)]) == 0
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("pliant: warning: ")


def test_a_reader_that_leaves_ends_it_quietly(sphere_file):
    files = " ".join([str(sphere_file)] * 30)
    command = f"'{sys.executable}' -c '{ENTRY}' inspect {files} | true; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert done.stdout.strip() == "141"


def in_the_shell(command: str) -> tuple[str, str]:
    """Return what a command line, in which PLIANT is the program, says on both streams."""
    line = command.replace("PLIANT", f"'{sys.executable}' -c '{ENTRY}'")
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=120, check=True)
    return done.stdout.strip(), done.stderr.strip()


def test_help_that_nobody_reads_ends_like_the_rest():
    assert in_the_shell("PLIANT --help | true; echo ${PIPESTATUS[0]}") == ("141", "")


def test_streams_that_are_closed_are_no_error(sphere_file):
    # Without a place to write to, the interpreter has no standard output, or error, at all.
    for closed in ("--help >&-", f"inspect '{sphere_file}' >&-", f"field '{sphere_file}' >&- 2>&-"):
        assert in_the_shell(f"exec 3>&1; PLIANT {closed}; echo $? >&3") == ("0", "")


def test_a_full_disk_is_said(sphere_file):
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    said, complaint = in_the_shell(f"exec 3>&1; PLIANT inspect '{sphere_file}' > /dev/full; echo $? >&3")
    assert said == "3"
    assert complaint == "pliant: error: No space left on device"


def test_an_interrupt_ends_with_130_and_no_traceback(sphere_file):
    code = (
        "import os, signal, sys, time, pliant; from pliant.cli import main\n"
        # A shell that runs the tests in the background has told its children to ignore interrupts.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "pliant.load_mesh = lambda path: (os.kill(os.getpid(), signal.SIGINT), time.sleep(30))\n"
        f"sys.exit(main(['inspect', {str(sphere_file)!r}]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=25, check=False
    )
    assert done.returncode == 130
    assert done.stdout == ""
    assert "Traceback" not in done.stderr


def test_an_unwritable_output_is_bad_input(sphere_file, tmp_path, monkeypatch, capsys):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied", "gfe.png")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", refuse)
    assert cli.main(["field", str(sphere_file), "--figure", str(tmp_path / "gfe.png")]) == 3
    assert capsys.readouterr().err == "pliant: error: gfe.png: Permission denied\n"
