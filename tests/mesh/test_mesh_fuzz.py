"""Broken files of every format: a mesh, a named error, nothing else."""

from __future__ import annotations

import random
import warnings
from pathlib import Path

import pytest
from mesh_file_samples import LOOSE, SAMPLES

from pliant.errors import PliantError, PliantWarning
from pliant.mesh import Mesh, load_arrays, load_mesh

ALL = {**SAMPLES, **LOOSE}
MUTATIONS = 300


def mutated(data: bytes, chance: random.Random) -> bytes:
    """Flip, cut, insert, repeat, overwrite: one to four times."""
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(data) + 1)
        kind = chance.randrange(7)
        if kind == 0 and at < len(data):
            data = data[:at] + bytes([data[at] ^ 1 << chance.randrange(8)]) + data[at + 1 :]
        elif kind == 1:
            data = data[: max(at, 1)]
        elif kind == 2:
            data = data[:at] + chance.randbytes(chance.randint(1, 8)) + data[at:]
        elif kind == 3:
            data = data[:at] + data[at + chance.randint(1, 16) :]
        elif kind == 4:
            data = data[:at] + b"\xff" * chance.randint(1, 8) + data[at + 8 :]
        elif kind == 5:
            data = data[:at] + str(chance.choice([-1, 2**31, 2**63, 10**30, 1e400])).encode() + data[at:]
        else:
            data = data[:at] + data[at // 2 :]
        data = data or b"\0"
    return data


def outcome(path: Path) -> str:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", PliantWarning)
        try:
            arrays = load_arrays(path)
            assert isinstance(arrays, dict)
        except PliantError:
            pass
        try:
            mesh = load_mesh(path)
        except PliantError as error:
            return "error" if str(path) in str(error) else f"an error that does not name the file: {error}"
        return "mesh" if isinstance(mesh, Mesh) else "no mesh"


@pytest.mark.parametrize("name", ALL)
def test_mutated_files_end_in_a_mesh_or_a_named_error(name: str, tmp_path: Path) -> None:
    chance = random.Random(f"{name} 1")
    path = tmp_path / name
    outcomes = []
    for _ in range(MUTATIONS):
        path.write_bytes(mutated(ALL[name], chance))
        outcomes.append(outcome(path))
    assert set(outcomes) <= {"mesh", "error"}
    # Were every mutation refused, or none, the test would not be looking at the readers.
    assert outcomes.count("error") > MUTATIONS // 10


@pytest.mark.parametrize("name", ALL)
def test_every_truncation_ends_in_a_mesh_or_a_named_error(name: str, tmp_path: Path) -> None:
    data = ALL[name]
    path = tmp_path / name
    for end in range(1, len(data), max(1, len(data) // 150)):
        path.write_bytes(data[:end])
        assert outcome(path) in ("mesh", "error")


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("shapes/tosca/wolf0.ply", 60),
        ("shapes/non_rigid_world/seahorse0.obj", 60),
        ("cortex/slam/example_mesh.gii", 100),
        ("heart/aha/LV_4396_vertices_with_aha_segments.vtk", 100),
        ("cortex/subject1/lh.white", 15),
    ],
)
def test_mutated_real_files_end_in_a_mesh_or_a_named_error(
    name: str, count: int, data: Path, tmp_path: Path
) -> None:
    chance = random.Random(f"{name} 2")
    whole = (data / name).read_bytes()
    path = tmp_path / Path(name).name
    for _ in range(count):
        path.write_bytes(mutated(whole, chance))
        assert outcome(path) in ("mesh", "error")
