"""The check-up: each finding alone, closed forms, laws, real meshes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pliant
from pliant.mesh import CheckUp, Mesh, check_up, load_mesh, shapes

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
TETRAHEDRON = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def found(report: CheckUp) -> dict[str, tuple[int, tuple[int, ...]]]:
    return {finding.name: (finding.count, finding.first) for finding in report.findings}


def square_torus(size: int = 5) -> Mesh:
    i, j = np.divmod(np.arange(size * size), size)
    u, v = 2 * np.pi * i / size, 2 * np.pi * j / size
    points = np.column_stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)])
    right, up = (i + 1) % size * size + j, i * size + (j + 1) % size
    both = (i + 1) % size * size + (j + 1) % size
    here = np.arange(size * size)
    return Mesh(points, np.vstack([np.column_stack([here, right, both]), np.column_stack([here, both, up])]))


def test_clean_closed_meshes_have_nothing_to_find() -> None:
    for mesh, genus in ((TETRAHEDRON, 0), (shapes.icosphere(2), 0), (square_torus(), 1)):
        report = check_up(mesh)
        assert report.findings == ()
        assert report.ok
        assert (report.genus, report.components, report.boundary_loops) == (genus, 1, 0)
        assert report.euler_characteristic == 2 - 2 * genus


@pytest.mark.parametrize(
    ("mesh", "name", "count", "first"),
    [
        (Mesh([*SQUARE, [9, 9, 9]], [[0, 1, 2], [0, 2, 3]]), "unreferenced vertices", 1, (4,)),
        (Mesh([*SQUARE, [2, 0, 0]], [[0, 1, 2], [0, 2, 3], [0, 1, 4]]), "degenerate faces", 1, (2,)),
        (Mesh(SQUARE, [[0, 1, 2], [0, 2, 3], [1, 1, 2]]), "degenerate faces", 1, (2,)),
        (Mesh(SQUARE, [[0, 1, 2], [0, 2, 3], [2, 1, 0]]), "duplicate faces", 1, (2,)),
        (Mesh([*SQUARE, [0, 0, 1]], [[0, 1, 2], [0, 2, 3], [0, 2, 4]]), "non-manifold edges", 1, (1,)),
        (Mesh([*SQUARE, [1, 0, 0]], [[0, 1, 2], [0, 2, 3], [1, 4, 2]]), "zero-length edges", 1, (4,)),
        (Mesh([*SQUARE, [0, 0, 0]], [[0, 1, 2], [4, 2, 3]]), "duplicate vertices", 1, (4,)),
        (Mesh(SQUARE, [[0, 1, 2], [0, 3, 2]]), "inconsistently wound faces", 1, (1,)),
        (Mesh([*SQUARE, [5, 5, 5], [6, 5, 5], [5, 6, 5]], [[0, 1, 2], [4, 5, 6]]), "components", 2, (0, 4)),
        (Mesh([[0, 0, 0], [1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]], [[0, 2, 1], [0, 3, 4]]),
         "non-manifold vertices", 1, (0,)),
        (TETRAHEDRON.flipped(), "inward wound faces", 4, (0, 1, 2, 3)),
        (Mesh(SQUARE, [[0, 1, 2], [0, 2, 3]]), "boundary loops", 1, (0,)),
    ],
)  # fmt: skip
def test_each_defect_is_found_with_its_place(
    mesh: Mesh, name: str, count: int, first: tuple[int, ...]
) -> None:
    report = check_up(mesh)
    assert found(report)[name] == (count, first)
    assert report.ok is (name == "boundary loops")
    finding = next(f for f in report.findings if f.name == name)
    assert finding.breaks
    assert finding.remedy


@given(seed=st.integers(0, 999))
def test_findings_do_not_change_under_motion_scale_and_relabelling(seed: int) -> None:
    chance = np.random.default_rng(seed)
    n = int(chance.integers(4, 12))
    mesh = Mesh(
        chance.integers(0, 3, size=(n, 3)), chance.integers(0, n, size=(int(chance.integers(1, 20)), 3))
    )
    report = check_up(mesh)
    counts = {name: count for name, (count, _) in found(report).items()}
    turn = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    order = chance.permutation(n)
    relabelled = Mesh(mesh.vertices[np.argsort(order)], order[mesh.faces][chance.permutation(mesh.n_faces)])
    for other in (mesh.scaled(4), mesh.translated([8, -4, 2]), mesh.transformed(turn), relabelled):
        again = check_up(other)
        # Which of two halves is the minority, or which way a flat closed piece looks, is free.
        free = {"inconsistently wound faces", "inward wound faces"} if other is relabelled else set()
        got = {name: count for name, (count, _) in found(again).items()}
        assert {k: v for k, v in got.items() if k not in free} == {
            k: v for k, v in counts.items() if k not in free
        }
        assert (again.genus, again.euler_characteristic) == (report.genus, report.euler_characteristic)


@given(holes=st.integers(0, 4), seed=st.integers(0, 99))
def test_genus_and_loops_of_a_punctured_torus(holes: int, seed: int) -> None:
    torus = square_torus(12)
    # Faces two rows apart, so that no two holes share a vertex.
    rows = [36 * k + 1 for k in range(holes)]
    report = check_up(Mesh(torus.vertices, np.delete(torus.faces, rows, axis=0)))
    assert (report.genus, report.boundary_loops) == (1, holes)


def test_several_components_add_their_genus() -> None:
    a, b = square_torus(), square_torus().translated([20, 0, 0])
    both = Mesh(np.vstack([a.vertices, b.vertices]), np.vstack([a.faces, b.faces + a.n_vertices]))
    report = check_up(both)
    assert (report.genus, report.components, report.euler_characteristic) == (2, 2, 0)


def test_numbers_of_the_unit_square() -> None:
    report = check_up(Mesh(SQUARE, [[0, 1, 2], [0, 2, 3]]))
    assert report.area == pytest.approx(1)
    assert report.diagonal == pytest.approx(np.sqrt(2))
    lengths = np.array([1, 1, 1, 1, np.sqrt(2)])
    assert report.edge_length["median"] == pytest.approx(1)
    assert report.edge_length["max"] == pytest.approx(np.sqrt(2))
    assert report.edge_length["spread"] == pytest.approx(lengths.std() / lengths.mean())


@pytest.mark.parametrize(
    ("size", "unit"),
    [(170.0, "mm"), (17.0, "cm"), (0.17, "m"), (1.7, "unknown"), (1e6, "unknown"), (0, "unknown")],
)
def test_unit_is_a_guess_with_its_reason(size: float, unit: str) -> None:
    report = check_up(Mesh(np.array(SQUARE) * size / np.sqrt(2), [[0, 1, 2], [0, 2, 3]]))
    assert report.unit == unit
    assert "across" in report.unit_reason


@pytest.mark.parametrize("size", [1e-300, 1e160, 1e300])
def test_extreme_sizes_give_no_warning_and_plain_json(size: float) -> None:
    report = check_up(Mesh(TETRAHEDRON.vertices * size, TETRAHEDRON.faces))
    assert report.findings == ()
    plain = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert plain["genus"] == 0
    assert plain["ok"] is True


@pytest.mark.parametrize("n", [1, 2])
def test_meshes_too_small_for_a_face(n: int) -> None:
    report = check_up(Mesh(np.eye(3)[:n], np.empty((0, 3), dtype=int)))
    assert found(report) == {"unreferenced vertices": (n, tuple(range(n)))}
    assert report.genus is None
    assert report.edge_length == {}
    assert str(report)


def test_it_reads_well_and_goes_into_json() -> None:
    report = check_up(Mesh([*SQUARE, [9, 9, 9]], [[0, 1, 2], [0, 2, 3]]))
    text = str(report)
    assert "5 vertices, 2 faces" in text
    assert "error: 1 unreferenced vertices [4]" in text
    assert "without_unreferenced(mesh)" in text
    plain = json.loads(json.dumps(report.to_dict()))
    assert plain["findings"][0]["first"] == [4]
    assert plain["ok"] is False


def test_every_remedy_that_is_a_call_exists_and_mends() -> None:
    chance = np.random.default_rng(3)
    mended = set()
    for n_faces in (2, 3, 12) * 15:
        n = int(chance.integers(5, 10))
        mesh = Mesh(chance.integers(0, 3, size=(n, 3)), chance.integers(0, n, size=(n_faces, 3)))
        for finding in check_up(mesh).findings:
            if not finding.remedy.endswith(")"):
                continue
            name = finding.remedy.partition("(")[0]
            call = getattr(pliant.mesh, name)
            try:
                better = call(mesh).mesh
            except pliant.MeshError:  # nothing but defects
                continue
            assert finding.name not in found(check_up(better)), finding
            mended.add(finding.name)
    assert {"degenerate faces", "duplicate faces", "unreferenced vertices", "duplicate vertices",
            "components", "inconsistently wound faces", "zero-length edges"} <= mended  # fmt: skip


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "loops", "components"),
    [("cat0", 2, 1), ("dog0", 2, 1), ("horse0", 0, 1), ("wolf0", 0, 1), ("victoria0", 3, 1)],
)
def test_tosca(data: Path, name: str, loops: int, components: int) -> None:
    report = check_up(load_mesh(data / "shapes" / "tosca" / f"{name}.ply"))
    assert (report.boundary_loops, report.components) == (loops, components)
    assert report.genus == 0


@pytest.mark.data
def test_cortex_is_a_clean_sphere_in_millimetres(data: Path) -> None:
    for name in ("subject1/lh.white", "pycortex_S1/wm_lh.gii"):
        report = check_up(load_mesh(data / "cortex" / name))
        assert report.findings == ()
        assert (report.genus, report.unit) == (0, "mm")


@pytest.mark.data
def test_dirty_meshes_are_named(data: Path) -> None:
    gorilla = check_up(load_mesh(data / "shapes" / "non_rigid_world" / "gorilla1.obj"))
    assert gorilla.components == 21
    assert found(gorilla)["duplicate faces"][0] == 13
    heart = check_up(load_mesh(data / "heart" / "aha" / "LV_4396_vertices_with_aha_segments.vtk"))
    assert found(heart)["non-manifold edges"][0] == 15
    assert heart.genus is None


def test_every_remedy_names_calls_that_exist():
    import re
    from pathlib import Path

    import pliant

    text = Path(pliant.check_up.__code__.co_filename).read_text(encoding="utf-8")
    calls = set(re.findall(r"\b(\w+)\(mesh[,)]", "".join(re.findall(r'"[^"]*"', text))))
    assert "orient" in calls
    assert not [name for name in calls if not hasattr(pliant, name)]
