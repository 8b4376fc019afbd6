"""``pliant view`` takes results in the formats that people keep them in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pliant import save_arrays, save_mesh, shapes
from pliant.cli import main


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    mesh = shapes.icosphere(2)
    save_mesh(tmp_path / "ball.gii", mesh)
    return tmp_path


def test_results_of_many_formats(ball: Path) -> None:
    from nibabel.freesurfer import write_annot, write_morph_data

    n = shapes.icosphere(2).n_vertices
    np.save(ball / "heat.npy", np.linspace(0, 1, n))
    (ball / "table.csv").write_text("depth,kind\n" + "\n".join(f"{i / 7},{i % 3}" for i in range(n)))
    write_morph_data(ball / "lh.thickness", np.linspace(1, 4, n))
    colours = np.array([[9, 0, 0, 0, 0], [0, 9, 0, 0, 0]])
    parcels = np.arange(n) % 2 - (np.arange(n) < 10)
    write_annot(ball / "lh.x.annot", parcels, colours, ["frontal", "occipital"], fill_ctab=True)
    save_arrays(ball / "a.shape.gii", {"texture": np.arange(float(n))})
    (ball / "a.shape.gii").rename(ball / "texture.gii")
    files = ["ball.gii", "heat.npy", "table.csv", "lh.thickness", "lh.x.annot", "texture.gii"]
    assert main(["view", *(str(ball / name) for name in files), "-o", str(ball / "page.html")]) == 0
    page = (ball / "page.html").read_text(encoding="utf-8")
    for name in ("heat", "depth", "kind", "lh.thickness", "lh.x.annot", "frontal", "occipital", "texture"):
        assert f'"{name}"' in page, name


def test_a_result_of_another_length_is_named(ball: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (ball / "short.csv").write_text("1\n2\n")
    assert main(["view", str(ball / "ball.gii"), str(ball / "short.csv"), "-o", str(ball / "page.html")]) == 0
    assert "short, shape (2,), has no row a vertex" in capsys.readouterr().err


def test_a_broken_table_is_refused(ball: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (ball / "bad.csv").write_text("1,2\n3\n")
    assert main(["view", str(ball / "ball.gii"), str(ball / "bad.csv"), "-o", str(ball / "page.html")]) == 3
    assert "do not have the 2 cells" in capsys.readouterr().err
    assert not (ball / "page.html").exists()
