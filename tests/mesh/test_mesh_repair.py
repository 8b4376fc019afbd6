"""Repairs: what changes, what stays, and where every vertex went."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pliant.errors import InputError, MeshError
from pliant.mesh import (
    Mesh,
    check_up,
    edge_faces,
    largest_component,
    load_mesh,
    merged,
    orient,
    repaired,
    shapes,
    without_degenerate_faces,
    without_duplicate_faces,
    without_unreferenced,
)

SPHERE = shapes.icosphere(2)


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def beside(first: Mesh, second: Mesh) -> Mesh:
    return Mesh(
        np.vstack([first.vertices, second.vertices]),
        np.vstack([first.faces, second.faces + first.n_vertices]),
    )


def turned_rows(mesh: Mesh, rows: np.ndarray) -> Mesh:
    faces = mesh.faces.copy()
    faces[rows] = faces[rows][:, ::-1]
    return Mesh(mesh.vertices, faces)


@given(seed=st.integers(0, 999), share=st.floats(0, 1))
def test_orient_makes_a_closed_mesh_outward_whatever_was_turned(seed: int, share: float) -> None:
    rows = np.random.default_rng(seed).random(SPHERE.n_faces) < share
    result = orient(turned_rows(SPHERE, rows))
    assert edge_faces(result.mesh).agree.all()
    assert volume(result.mesh) == pytest.approx(volume(SPHERE))
    np.testing.assert_array_equal(result.faces_flipped, np.flatnonzero(rows))
    np.testing.assert_array_equal(np.sort(result.mesh.faces, axis=1), np.sort(SPHERE.faces, axis=1))
    np.testing.assert_array_equal(result.index_map, np.arange(SPHERE.n_vertices))


def test_orient_is_the_same_after_a_move_and_a_scale() -> None:
    rows = np.arange(0, SPHERE.n_faces, 3)
    broken = turned_rows(SPHERE, rows)
    for other in (broken.translated([1e6, 0, 0]), broken.scaled(1e-9), broken.scaled(1e150)):
        np.testing.assert_array_equal(orient(other).faces_flipped, rows)


def test_orient_treats_each_component_alone() -> None:
    pair = beside(SPHERE.flipped(), turned_rows(SPHERE.translated([5, 0, 0]), np.array([3, 4])))
    result = orient(pair)
    expected = np.concatenate([np.arange(SPHERE.n_faces), SPHERE.n_faces + np.array([3, 4])])
    np.testing.assert_array_equal(result.faces_flipped, expected)


def test_orient_keeps_the_majority_of_an_open_piece() -> None:
    open_piece = Mesh(SPHERE.vertices, SPHERE.faces[5:])
    for mesh in (open_piece, open_piece.flipped()):
        broken = turned_rows(mesh, np.array([7, 8, 100]))
        assert orient(broken).faces_flipped.tolist() == [7, 8, 100]


def test_orient_leaves_a_moebius_strip_as_it_is() -> None:
    k = np.arange(9)
    angle = 2 * np.pi * k / 9
    strip = Mesh(
        np.column_stack([np.cos(2 * angle), np.sin(2 * angle), np.cos(angle)]),
        np.column_stack([k, k + 1, k + 2]) % 9,
    )
    pair = beside(strip, turned_rows(SPHERE, np.array([0])))
    assert orient(pair).faces_flipped.tolist() == [9]
    report = check_up(strip)
    assert report.genus is None
    assert [(f.name, f.count) for f in report.findings if f.severity == "error"] == [("one-sided faces", 9)]


@given(seed=st.integers(0, 99))
def test_orient_does_not_depend_on_the_order_of_faces(seed: int) -> None:
    chance = np.random.default_rng(seed)
    broken = turned_rows(SPHERE, chance.random(SPHERE.n_faces) < 0.3)
    order = chance.permutation(SPHERE.n_faces)
    shuffled = orient(Mesh(broken.vertices, broken.faces[order])).mesh
    np.testing.assert_array_equal(shuffled.faces, orient(broken).mesh.faces[order])


def test_largest_component_by_area() -> None:
    small, big = SPHERE, shapes.icosphere(1).scaled(3).translated([9, 0, 0])
    result = largest_component(beside(small, big))
    np.testing.assert_array_equal(result.mesh.vertices, big.vertices)
    np.testing.assert_array_equal(result.mesh.faces, big.faces)
    np.testing.assert_array_equal(result.index_map[: small.n_vertices], -1)
    np.testing.assert_array_equal(result.index_map[small.n_vertices :], np.arange(big.n_vertices))
    np.testing.assert_array_equal(result.faces_kept, small.n_faces + np.arange(big.n_faces))
    assert largest_component(SPHERE).mesh is SPHERE


def test_without_unreferenced_maps_back() -> None:
    rows = np.insert(SPHERE.vertices, [0, 10, 10, SPHERE.n_vertices], 9.0, axis=0)
    kept = np.delete(np.arange(len(rows)), [0, 11, 12, len(rows) - 1])
    mesh = Mesh(rows, kept[SPHERE.faces])
    result = without_unreferenced(mesh)
    np.testing.assert_array_equal(result.mesh.vertices, SPHERE.vertices)
    np.testing.assert_array_equal(result.mesh.faces, SPHERE.faces)
    np.testing.assert_array_equal(np.flatnonzero(result.index_map < 0), [0, 11, 12, len(rows) - 1])
    with pytest.raises(InputError, match="nothing would be left"):
        without_unreferenced(Mesh([[0, 0, 0]], np.empty((0, 3), dtype=int)))


@given(seed=st.integers(0, 99))
def test_merging_loose_corners_brings_the_mesh_back(seed: int) -> None:
    order = np.random.default_rng(seed).permutation(SPHERE.n_faces)
    loose = Mesh(
        SPHERE.vertices[SPHERE.faces[order]].reshape(-1, 3), np.arange(3 * SPHERE.n_faces).reshape(-1, 3)
    )
    joined, index_map = merged(loose)
    assert joined.n_vertices == SPHERE.n_vertices
    np.testing.assert_array_equal(joined.vertices[index_map], loose.vertices)
    np.testing.assert_array_equal(joined.vertices[joined.faces], loose.vertices[loose.faces])
    assert (np.diff([index_map.tolist().index(k) for k in range(joined.n_vertices)]) > 0).all()


def test_merging_with_a_tolerance_joins_chains_and_drops_collapsed_faces() -> None:
    line = Mesh(
        [[0, 0, 0], [0.9, 0, 0], [1.8, 0, 0], [9, 0, 0], [9, 9, 0]], [[0, 1, 3], [0, 3, 4], [2, 4, 3]]
    )
    result = merged(line, tolerance=1.0)
    assert result.index_map.tolist() == [0, 0, 0, 1, 2]
    assert result.mesh.faces.tolist() == [[0, 1, 2], [0, 2, 1]]
    assert result.faces_kept.tolist() == [1, 2]
    assert merged(line, tolerance=0.5).mesh.n_vertices == 5


def test_minus_zero_lies_where_zero_does() -> None:
    mesh = Mesh([[0.0, 0, 0], [-0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 2, 3]])
    assert merged(mesh).index_map.tolist() == [0, 0, 1, 2]


@pytest.mark.parametrize("tolerance", [-1.0, np.nan, np.inf, 1e3])
def test_merging_refuses_a_tolerance_that_cannot_be_meant(tolerance: float) -> None:
    with pytest.raises(InputError, match="tolerance"):
        merged(shapes.icosphere(3), tolerance=tolerance)


def test_degenerate_faces_go_and_thin_ones_stay() -> None:
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [1, 1e-9, 0]]
    mesh = Mesh(vertices, [[0, 1, 2], [0, 0, 1], [0, 1, 3], [0, 3, 4]])
    result = without_degenerate_faces(mesh)
    assert result.faces_kept.tolist() == [0, 3]
    assert result.mesh.n_vertices == 5
    for factor in (1e-150, 1e150):
        assert without_degenerate_faces(mesh.scaled(factor)).faces_kept.tolist() == [0, 3]
    with pytest.raises(MeshError, match="has an area"):
        without_degenerate_faces(Mesh(vertices, [[0, 1, 3]]))


def test_duplicate_faces_keep_the_first_however_wound() -> None:
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    mesh = Mesh(vertices, [[0, 1, 3], [0, 1, 2], [2, 1, 0], [1, 2, 0], [0, 3, 2]])
    assert without_duplicate_faces(mesh).faces_kept.tolist() == [0, 1, 4]


def test_repaired_mends_all_at_once_and_joins_the_maps() -> None:
    loose = Mesh(SPHERE.vertices[SPHERE.faces].reshape(-1, 3), np.arange(3 * SPHERE.n_faces).reshape(-1, 3))
    dirty = Mesh(
        np.vstack([[[9, 9, 9]], turned_rows(loose, np.array([5, 6])).vertices]),
        np.vstack([[[1, 1, 2]], turned_rows(loose, np.array([5, 6])).faces + 1, loose.faces[:3] + 1]),
    )
    result = repaired(dirty, tolerance=0)
    assert check_up(result.mesh).findings == ()
    assert result.mesh.n_vertices == SPHERE.n_vertices
    assert result.faces_flipped.tolist() == [6, 7]
    assert result.index_map[0] == -1
    np.testing.assert_array_equal(result.mesh.vertices[result.index_map[1:]], dirty.vertices[1:])
    np.testing.assert_array_equal(
        np.sort(result.index_map[dirty.faces[result.faces_kept]], axis=1), np.sort(result.mesh.faces, axis=1)
    )


def test_a_repair_unpacks_and_is_read_only() -> None:
    mesh, index_map = orient(SPHERE)
    assert isinstance(mesh, Mesh)
    assert not index_map.flags.writeable


@pytest.mark.data
def test_orient_mends_the_horse_as_it_was_mended_by_hand(data: Path) -> None:
    raw = load_mesh(data / "shapes" / "tosca" / "horse5.raw-winding.ply")
    mended = load_mesh(data / "shapes" / "tosca" / "horse5.ply")
    sides = edge_faces(raw)
    assert int((~sides.agree).sum()) == 36
    result = orient(raw)
    assert result.faces_flipped.size == 108
    first = mended.faces.argmin(axis=1)[:, None]
    own = result.mesh.faces.argmin(axis=1)[:, None]
    np.testing.assert_array_equal(
        np.take_along_axis(result.mesh.faces, (own + np.arange(3)) % 3, axis=1),
        np.take_along_axis(mended.faces, (first + np.arange(3)) % 3, axis=1),
    )
    assert volume(result.mesh) > 0


@pytest.mark.data
@pytest.mark.parametrize("name", ["gorilla1", "cat0", "wolf0", "seahorse0"])
def test_repaired_dirty_meshes_come_out_clean_of_what_it_mends(data: Path, name: str) -> None:
    mesh = load_mesh(data / "shapes" / "non_rigid_world" / f"{name}.obj")
    mended = check_up(repaired(mesh).mesh)
    left = {finding.name for finding in mended.findings}
    assert not left & {
        "degenerate faces", "duplicate faces", "unreferenced vertices", "inconsistently wound faces",
        "inward wound faces",
    }  # fmt: skip


def test_a_repair_that_is_taken_for_its_mesh_says_so():
    mesh = shapes.icosphere(1)
    repair = repaired(mesh)
    for name in ("vertices", "n_faces", "area"):
        with pytest.raises(AttributeError, match=r"a Repair has no .*mesh, index_map = "):
            getattr(repair, name)
    with pytest.raises(AttributeError, match="mesh, index_map = "):
        check_up(repair)
    with pytest.raises(AttributeError, match=r"no nonsense$"):
        _ = repair.nonsense
    copied = pickle.loads(pickle.dumps(repair))
    assert copied.mesh.n_faces == mesh.n_faces


def test_the_largest_piece_alone_is_kept_where_that_is_asked():
    one, two = shapes.icosphere(2), shapes.icosphere(1).scaled(0.5).translated([4, 0, 0])
    both = Mesh(np.vstack([two.vertices, one.vertices]), np.vstack([two.faces, one.faces + two.n_vertices]))
    mesh, index_map = repaired(both, largest=True)
    assert mesh.n_vertices == one.n_vertices
    assert (index_map[: two.n_vertices] == -1).all()
    assert np.array_equal(index_map[two.n_vertices :], np.arange(one.n_vertices))
    assert repaired(both).mesh.n_vertices == both.n_vertices
