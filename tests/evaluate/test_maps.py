"""Map error: closed forms on a strip and a grid, symmetric answers, partial truth, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pliant
from pliant import InputError, MeshError, shapes
from pliant.evaluate.maps import MapError, map_error


@pytest.fixture(scope="module")
def lattice():
    """A square of side 20 with right-angled cells of side 1: vertex (x, y) is 21 y + x, or the like."""
    mesh = shapes.grid(21, 21)
    side = np.ptp(mesh.vertices[:, 0])
    return mesh.scaled(20 / side)


def _at(mesh, x, y):
    low = mesh.vertices.min(axis=0)
    return int(np.abs(mesh.vertices - low - [x, y, 0]).sum(axis=1).argmin())


def test_a_shift_along_the_lattice_has_the_error_of_its_length(lattice):
    points = np.array([_at(lattice, x, y) for x in range(15) for y in range(21)])
    moved = np.array([_at(lattice, x + 5, y) for x in range(15) for y in range(21)])
    error = map_error(moved, points, lattice)
    np.testing.assert_allclose(error.errors, 5 / 20)
    assert error.mean == pytest.approx(0.25)
    assert error.curve[-1] == 1.0
    assert (error.curve[:-1] == 0).all()


def test_the_truth_has_no_error_and_scale_does_not_matter(lattice):
    everyone = np.arange(lattice.n_vertices)
    assert map_error(everyone, everyone, lattice).mean == 0
    wrong = np.roll(everyone, 7)
    small, large = map_error(wrong, everyone, lattice), map_error(wrong, everyone, lattice.scaled(1000))
    np.testing.assert_allclose(small.errors, large.errors, rtol=1e-6)


def test_curve_is_the_share_at_most_each_threshold():
    error = MapError([0.3, 0.0, 0.1, 0.1], [0.0, 0.05, 0.1, 0.3], None, [0, 1, 2, 3])
    assert error.curve.tolist() == [0.25, 0.25, 0.75, 1.0]
    assert error.mean == pytest.approx(0.125)
    assert error.symmetric_mean is None
    assert error.pointwise_errors is None


def test_symmetric_answers_count_for_the_whole_map_or_point_by_point():
    figure = shapes.human(1000)
    everyone, mirror = np.arange(figure.mesh.n_vertices), figure.symmetry
    mirrored = map_error(mirror, everyone, figure.mesh, symmetry=mirror)
    assert mirrored.mean > 0.1
    assert mirrored.symmetric_mean == 0
    assert mirrored.symmetric_curve[0] == 1
    right_half = np.where(figure.mesh.vertices[:, 0] > 0, mirror, everyone)
    mixed = map_error(right_half, everyone, figure.mesh, symmetry=mirror)
    assert mixed.symmetric_mean > 0.1
    assert mixed.pointwise_errors.max() == 0


def test_unknown_truth_is_left_out_and_counted(lattice):
    everyone = np.arange(lattice.n_vertices)
    truth = everyone.copy()
    truth[:400] = -1
    error = map_error(np.roll(everyone, 1), truth, lattice)
    assert error.n_missing == 400
    assert error.points.tolist() == list(range(400, 441))
    unknown_mirror = map_error(everyone, truth, lattice, symmetry=np.full(441, -1))
    assert np.isnan(unknown_mirror.mirrored).all()
    assert unknown_mirror.symmetric_mean == 0


def test_blocks_do_not_change_the_numbers():
    mesh = shapes.human(1500).mesh
    truth = np.random.default_rng(0).permutation(mesh.n_vertices)
    mapped = np.random.default_rng(1).permutation(mesh.n_vertices)
    error = map_error(mapped, truth, mesh)
    rows = [3, 700, 1400]
    alone = pliant.geodesic_distances(mesh, truth[rows], method="refined")[range(3), mapped[rows]]
    np.testing.assert_allclose(error.errors[rows], alone / mesh.area**0.5, rtol=1e-9)


@given(st.integers(1, 441), st.integers(0, 5))
def test_samples_are_some_of_all_points(count, seed):
    mesh = shapes.grid(21, 21)
    everyone = np.arange(441)
    error = map_error(everyone[::-1], everyone, mesh, samples=count, rng=seed)
    assert len(np.unique(error.points)) == len(error.errors) == count
    again = map_error(everyone[::-1], everyone, mesh, samples=count, rng=seed)
    assert (again.points == error.points).all()


def test_another_piece_is_infinitely_wrong():
    ball = shapes.icosphere(1)
    both = pliant.Mesh(
        np.vstack([ball.vertices, ball.vertices + 5]), np.vstack([ball.faces, ball.faces + ball.n_vertices])
    )
    error = map_error([0, ball.n_vertices], [0, 0], both)
    assert error.errors.tolist() == [0, np.inf]
    assert error.curve.max() == 0.5


def test_refusals(lattice):
    everyone = np.arange(441)
    with pytest.raises(InputError, match=r"truth must have .* \(441,\), got \(440,\)"):
        map_error(everyone, everyone[:-1], lattice)
    with pytest.raises(InputError, match="p_ba: 1 of 441 are outside"):
        map_error(everyone + 1, everyone, lattice)
    with pytest.raises(InputError, match="truth: 1 entries are outside"):
        map_error(everyone, everyone + 1, lattice)
    with pytest.raises(InputError, match="symmetry"):
        map_error(everyone, everyone, lattice, symmetry=everyone[:5])
    with pytest.raises(InputError, match="none of the 441"):
        map_error(everyone, np.full(441, -1), lattice)
    with pytest.raises(InputError, match="whole numbers"):
        map_error(everyone + 0.5, everyone, lattice)
    with pytest.raises(InputError, match="samples"):
        map_error(everyone, everyone, lattice, samples=0)
    with pytest.raises(InputError, match="thresholds"):
        map_error(everyone, everyone, lattice, thresholds=[-1])
    with pytest.raises(MeshError, match="no area"):
        map_error(everyone, everyone, lattice.scaled(0))
