"""Dense maps without landmarks: figures in other poses, orientation, determinism, real scans, refusals."""

from __future__ import annotations

import numpy as np
import pytest

import pliant
from pliant import InputError, MeshError, eigenbasis, shapes
from pliant.evaluate.maps import map_error
from pliant.matching import dense_map
from pliant.matching.dense import reversed_area


@pytest.fixture(scope="module")
def figure():
    return shapes.quadruped(1000)


@pytest.fixture(scope="module")
def walking(figure):
    """The same figure walking, its vertices in another order; vertex i is ``old[i]`` of the figure."""
    mesh = figure.posed("walk").mesh
    old = np.random.default_rng(0).permutation(mesh.n_vertices)
    return pliant.Mesh(mesh.vertices[old], np.argsort(old)[mesh.faces]), old


@pytest.fixture(scope="module")
def found(figure, walking):
    return dense_map(figure.mesh, walking[0], k=60)


def test_another_pose_is_mapped_left_to_left(figure, walking, found):
    error = map_error(found.p_ba, walking[1], figure.mesh)
    assert error.mean < 0.02
    assert found.reversed_area < 0.15
    assert found.measures["folding"] < 0.3


def test_turned_over_maps_come_out_mirrored(figure, walking):
    mirrored = dense_map(figure.mesh, walking[0], k=60, orientation="reverse")
    error = map_error(mirrored.p_ba, walking[1], figure.mesh, symmetry=figure.symmetry)
    assert error.mean > 0.1
    assert error.symmetric_mean < 0.02
    assert mirrored.reversed_area > 0.85


def test_winding_inwards_changes_nothing(figure, walking, found):
    inside_out = dense_map(figure.mesh.flipped(), walking[0], k=60)
    error = map_error(inside_out.p_ba, walking[1], figure.mesh)
    assert error.mean < 0.02
    assert inside_out.reversed_area < 0.15


def test_size_position_and_repetition_change_nothing(figure, walking, found):
    moved = walking[0].scaled(37.0).translated([5, -3, 1])
    assert (dense_map(figure.mesh, moved, k=60).p_ba == found.p_ba).mean() > 0.99
    again = dense_map(figure.mesh, walking[0], k=60)
    assert (again.p_ba == found.p_ba).all()
    assert again.candidate_scores.tobytes() == found.candidate_scores.tobytes()


def test_spectra_alone_give_a_map_or_its_mirror_image(figure, walking):
    a, b = eigenbasis(figure.mesh, 60), eigenbasis(walking[0], 60)
    result = dense_map(a, b)
    error = map_error(result.p_ba, walking[1], figure.mesh, symmetry=figure.symmetry)
    assert error.symmetric_mean < 0.02
    assert np.isnan(result.reversed_area)
    assert "folding" not in result.measures


def test_different_meshes_of_one_surface():
    fine, coarse = shapes.human(1500, pose="walk"), shapes.human(1000)
    result = dense_map(fine.mesh, coarse.mesh, k=60)
    rest = shapes.human(1500).mesh.vertices
    truth = ((coarse.mesh.vertices[:, None] - rest[None]) ** 2).sum(axis=2).argmin(axis=1)
    assert map_error(result.p_ba, truth, fine.mesh).mean < 0.04


def test_reversed_area_in_closed_form():
    mesh = shapes.icosphere(3)
    everyone = np.arange(mesh.n_vertices)
    assert reversed_area(everyone, mesh, mesh) == 0
    antipode = (mesh.vertices @ mesh.vertices.T).argmin(axis=1)
    assert reversed_area(antipode, mesh, mesh) == 1
    assert reversed_area(antipode, mesh.flipped(), mesh) == 1  # inside out is the same surface
    assert np.isnan(reversed_area(0 * everyone, mesh, mesh))
    half = np.where(
        mesh.vertices[:, 2] > 0, everyone, (mesh.vertices * [1, -1, 1] @ mesh.vertices.T).argmax(axis=1)
    )
    assert reversed_area(half, mesh, mesh) == pytest.approx(0.5, abs=0.08)


def test_refusals(figure):
    ball = shapes.icosphere(2)
    two = pliant.Mesh(
        np.vstack([ball.vertices, ball.vertices + 5]), np.vstack([ball.faces, ball.faces + ball.n_vertices])
    )
    with pytest.raises(MeshError, match="a is in 2 pieces"):
        dense_map(two, figure.mesh)
    with pytest.raises(InputError, match="orientation"):
        dense_map(ball, ball, orientation="both")
    with pytest.raises(InputError, match="needs 30"):
        dense_map(ball, ball, k=20)
    spectrum = eigenbasis(ball, 40)
    with pytest.raises(InputError, match="spectra: that of b has 162"):
        dense_map(ball, figure.mesh, spectra=(spectrum, spectrum))
    with pytest.raises(InputError, match="descriptors of b must have shape"):
        dense_map(spectrum, spectrum, descriptors=(ball.vertices, figure.mesh.vertices))
    with pytest.raises(InputError, match="3 descriptors and b 2"):
        dense_map(spectrum, spectrum, descriptors=(ball.vertices, ball.vertices[:, :2]))
    bad = ball.vertices.copy()
    bad[4] = np.inf
    with pytest.raises(InputError, match=r"descriptors of a: 1 rows.*\[4\]"):
        dense_map(spectrum, spectrum, descriptors=(bad, ball.vertices))


@pytest.mark.data
def test_scanned_wolves(data):
    folder = data / "shapes" / "tosca_remeshed_5k"
    a, b = (pliant.load_mesh(folder / f"wolf{i}.ply") for i in (0, 2))
    at_a, at_b = (np.loadtxt(folder / f"wolf{i}.vts", dtype=int) - 1 for i in (0, 2))
    result = dense_map(a, b, k=80)
    error = map_error(result.p_ba[at_b], at_a, a)
    assert error.mean < 0.03
