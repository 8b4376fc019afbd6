"""Every Python block of the README and of the documentation runs, on small files of the names they use."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant import shapes

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.M | re.S)
WITH_CODE = [page for page in PAGES if BLOCK.search(page.read_text(encoding="utf-8"))]


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with the files that the pages name."""
    animal = shapes.quadruped(1500)
    pliant.save_mesh(tmp_path / "cat.ply", animal.mesh)
    pliant.save_mesh(tmp_path / "lh.pial", shapes.bumpy_sphere(subdivisions=3, rng=0))
    for i in range(6):
        pliant.save_mesh(tmp_path / f"s{i}.ply", shapes.bumpy_sphere(subdivisions=3, rng=i).scaled(40.0))
    rows = "".join(f"s{i},s{i}.ply\n" for i in range(6))
    (tmp_path / "cohort.csv").write_text(f"subject,mesh\n{rows}")
    (tmp_path / "sites.csv").write_text("vertex\n3\n17\n100\n400\n")
    _write_pictures(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _write_pictures(folder: Path) -> None:
    from PIL import Image

    from pliant.images import shipped_photographs, synthetic_pair

    pair = synthetic_pair(shipped_photographs()["astronaut"], "night", rng=0)
    for name, picture in (("day.jpg", pair.picture1), ("night.jpg", pair.picture2)):
        Image.fromarray(np.asarray(picture.colour)).save(folder / name)
    for kind in ("coffee", "rocket"):
        (folder / "photographs" / kind).mkdir(parents=True)
        for i, look in enumerate(("night", "drawing")):
            seen = synthetic_pair(shipped_photographs()[kind], look, rng=i).picture2
            Image.fromarray(np.asarray(seen.colour)).resize((200, 150)).save(
                folder / "photographs" / kind / f"{i}.jpg"
            )


def _names() -> dict[str, object]:
    """What pages that go on from another page start with."""
    animal = shapes.quadruped(1500)
    mesh = animal.mesh
    posed = animal.posed("walk").mesh
    return {
        "pliant": pliant,
        "mesh": mesh,
        "mesh_a": mesh,
        "mesh_b": posed,
        "field_a": pliant.gfe(mesh),
        "field_b": pliant.gfe(posed),
        "truth": np.arange(mesh.n_vertices),
        "mirror": animal.symmetry,
    }


@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: page.name)
@pytest.mark.filterwarnings("ignore::pliant.PliantWarning")
def test_the_blocks_of_a_page_run(page, place):
    names = _names()
    for block in BLOCK.findall(page.read_text(encoding="utf-8")):
        exec(compile(block, page.name, "exec"), names)


def test_there_are_pages_with_code():
    assert len(WITH_CODE) >= 10
