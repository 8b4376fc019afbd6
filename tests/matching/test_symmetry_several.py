"""Surfaces with several mirrors get each of them; maps turned wrong in part are mended."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pliant import Mesh, eigenbasis, shapes
from pliant.matching.symmetry import Reflection, reflections
from pliant.matching.symmetry._frame import Coarse, Frame
from pliant.matching.symmetry._harmonic import harmonic_points


def radial(radius: Callable[[np.ndarray], np.ndarray], level: int) -> Mesh:
    """A star-shaped surface: a sphere's points times a function of direction."""
    ball = shapes.icosphere(level)
    return Mesh(ball.vertices * radius(ball.vertices)[:, None], ball.faces)


def folded(points: np.ndarray) -> np.ndarray:
    """A three-fold figure whose top and bottom differ."""
    angle = np.arctan2(points[:, 1], points[:, 0])
    across = np.hypot(points[:, 0], points[:, 1])
    return 1 + 0.35 * np.cos(3 * angle) * across**3 + 0.25 * points[:, 2]


def box(points: np.ndarray) -> np.ndarray:
    return (np.abs(points / np.array([1.0, 0.7, 0.4])) ** 6).sum(axis=1) ** (-1 / 6)


def in_space(mesh: Mesh, found: Reflection) -> tuple[np.ndarray, float]:
    """The orthogonal matrix nearest to a map, and how far points end from where it says, over sqrt(area)."""
    image = mesh.vertices[found.point_map]
    left, _, right = np.linalg.svd((mesh.vertices.T * mesh.vertex_areas) @ image)
    matrix = left @ right
    gaps = np.linalg.norm(mesh.vertices @ matrix - image, axis=1)
    return matrix, float(gaps.mean() / mesh.area**0.5)


def test_a_box_has_three_mirrors_and_a_point_reflection():
    mesh = radial(box, 4)
    found = [in_space(mesh, one) for one in reflections(mesh, eigenbasis(mesh, 150)).reflections]
    assert {tuple(np.diag(matrix).round().astype(int)) for matrix, _ in found} == {
        (-1, 1, 1),
        (1, -1, 1),
        (1, 1, -1),
        (-1, -1, -1),
    }
    assert max(error for _, error in found) < 0.01


def test_every_mirror_of_a_three_fold_figure():
    mesh = radial(folded, 5)
    found = [in_space(mesh, one) for one in reflections(mesh, eigenbasis(mesh, 120)).reflections]
    normals = np.array([np.linalg.eigh((m + m.T) / 2)[1][:, 0] for m, _ in found])
    assert len(found) == 3
    assert np.abs(normals[:, 2]).max() < 0.05
    angles = np.sort(np.arctan2(normals[:, 1], normals[:, 0]) % np.pi)
    np.testing.assert_allclose(np.diff(angles), np.pi / 3, atol=0.06)
    assert max(error for _, error in found) < 0.015


@pytest.mark.parametrize("kind", [shapes.human, shapes.quadruped])
def test_a_part_that_is_turned_the_wrong_way_is_mended(kind):
    figure = kind(2000)
    mesh = figure.posed(figure.random_pose(rng=4)).mesh
    frame = Frame(mesh, eigenbasis(mesh, 150))
    coarse = Coarse(frame, frame.samples(600))
    truth = coarse.cells[figure.symmetry[coarse.samples]]
    # Between the limbs, a quarter of the surface goes anywhere.
    centre = int(np.argmin(np.linalg.norm(frame.embedding[coarse.samples], axis=1)))
    near = coarse.distances[centre]
    wrong = np.flatnonzero(near < np.quantile(near, 0.25))
    start = truth.copy()
    start[wrong] = np.random.default_rng(0).permutation(start[wrong])

    def error(points: np.ndarray) -> float:
        return float(coarse.weights @ coarse.distances[points, truth])

    assert error(harmonic_points(coarse, start)) < 0.5 * error(start)
    # A true map stays, up to the spacing of samples.
    spacing = np.median(np.sort(coarse.distances, axis=1)[:, 1])
    assert error(harmonic_points(coarse, truth)) < 2 * spacing
