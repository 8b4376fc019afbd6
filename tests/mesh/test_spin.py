"""Spin transformations against closed forms, symmetries and refinement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pliant import Mesh, shapes, spin_transform
from pliant.errors import InputError, MeshError, NumericalError, PliantWarning
from pliant.mesh.spin import quasi_conformal_error

AXES = np.array([1.0, 1.3, 0.8])


def misfit(truth: np.ndarray, found: np.ndarray) -> float:
    """Relative distance after the best similarity."""
    a, b = truth - truth.mean(axis=0), found - found.mean(axis=0)
    u, sizes, v = np.linalg.svd(b.T @ a)
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ v))])
    scale = (sizes @ np.diag(sign)) / (b**2).sum()
    return float(np.linalg.norm(scale * b @ u @ sign @ v - a) / np.linalg.norm(a))


def bump(mesh: Mesh, height: float) -> np.ndarray:
    return height * np.exp(-6 * (1 - mesh.vertices[:, 2]))


def tube_with_bump(sides: int) -> tuple[Mesh, np.ndarray]:
    mesh = shapes.cylinder(1, 4, sides=sides, caps=False)
    x, y, z = mesh.vertices.T
    return mesh, 1.5 * np.exp(-(np.arctan2(y, x) ** 2 + (z - 2) ** 2) / 0.3)


@pytest.mark.parametrize(
    "mesh",
    [
        shapes.icosphere(2),
        shapes.cylinder(1, 3, sides=16, caps=False),
        shapes.cylinder(1, 3, sides=16),
        shapes.torus(rings=20, sides=10),
        shapes.grid(6, 7),
    ],
)
@pytest.mark.parametrize("constant", [0.0, 0.4])
def test_constant_density_gives_the_surface_back(mesh: Mesh, constant: float) -> None:
    back = spin_transform(mesh, np.full(mesh.n_vertices, constant))
    np.testing.assert_allclose(back.vertices, mesh.vertices, atol=1e-7)


def test_inversion_is_a_spin_transformation_of_known_density() -> None:
    # f -> -f / |f|^2 has half-density change -2 <f, N> / |f|^2; both sides are exact, so the error is the method's.
    errors = []
    for level in (2, 3, 4):
        ball = shapes.ellipsoid(AXES, level)
        normals = ball.vertices / AXES**2
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        mesh = ball.translated([3.0, 0.4, 0.5])
        squares = (mesh.vertices**2).sum(axis=1)
        rho = -2 * (mesh.vertices * normals).sum(axis=1) / squares
        truth = -mesh.vertices / squares[:, None]
        errors.append(misfit(truth, spin_transform(mesh, rho).vertices))
        assert errors[-1] < 0.1 * misfit(truth, mesh.vertices)
    assert errors[-1] < 2e-3
    assert errors[0] / errors[1] > 3
    assert errors[1] / errors[2] > 3


def test_positive_density_swells_the_surface_outwards() -> None:
    ball = shapes.icosphere(3)
    top, bottom = np.argmax(ball.vertices[:, 2]), np.argmin(ball.vertices[:, 2])
    height = spin_transform(ball, bump(ball, 1.0)).vertices[[top, bottom]]
    dent = spin_transform(ball, bump(ball, -1.0)).vertices[[top, bottom]]
    assert np.linalg.norm(height[0] - height[1]) > 2.1
    assert np.linalg.norm(dent[0] - dent[1]) < 1.9


def test_angle_error_falls_with_refinement_closed_and_open() -> None:
    closed, tube = [], []
    for level in (2, 3, 4):
        ball = shapes.icosphere(level)
        closed.append(quasi_conformal_error(ball, spin_transform(ball, bump(ball, 1.5))).mean() - 1)
    for sides in (16, 32, 48):
        mesh, rho = tube_with_bump(sides)
        tube.append(quasi_conformal_error(mesh, spin_transform(mesh, rho)).mean() - 1)
    assert closed[0] > 1.7 * closed[1] > 1.7**2 * closed[2]
    assert tube[0] > 1.6 * tube[1]
    assert tube[1] > 1.3 * tube[2]
    assert closed[2] < 0.02
    assert tube[2] < 0.02


def test_the_bump_moves_the_bump_and_little_else() -> None:
    mesh, rho = tube_with_bump(32)
    bent = spin_transform(mesh, rho)
    stretch = np.sqrt(bent.vertex_areas / mesh.vertex_areas)
    far = rho < 1e-6
    assert np.argmax(stretch) in np.argsort(rho)[-20:]
    assert np.ptp(stretch[far]) < 0.35 * np.ptp(stretch)


@settings(max_examples=15)
@given(seed=st.integers(0, 2**16), scale=st.floats(0.01, 100))
def test_similarity_and_renumbering(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    ball = shapes.ellipsoid(AXES, 2)
    direction = rng.normal(size=3)
    rho = 0.2 * ball.vertices @ direction / np.linalg.norm(direction)
    bent = spin_transform(ball, rho)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    moved = ball.transformed(rotation).scaled(scale).translated(rng.normal(size=3))
    assert misfit(bent.vertices, spin_transform(moved, rho / scale).vertices) < 1e-5
    order = rng.permutation(ball.n_vertices)
    back = np.argsort(order)
    mixed = Mesh(ball.vertices[order], back[ball.faces])
    np.testing.assert_allclose(spin_transform(mixed, rho[order]).vertices[back], bent.vertices, atol=1e-6)


def test_area_and_centre_are_kept() -> None:
    mesh, rho = tube_with_bump(24)
    bent = spin_transform(mesh, rho)
    assert bent.area == pytest.approx(mesh.area)
    centre = [m.vertex_areas @ m.vertices / m.area for m in (mesh, bent)]
    np.testing.assert_allclose(centre[0], centre[1], atol=1e-9)


def test_a_handle_that_cannot_close_is_reported() -> None:
    torus = shapes.torus(rings=30, sides=16)
    with pytest.warns(PliantWarning, match="do not close up"):
        spin_transform(torus, 0.5 * torus.vertices[:, 0])


def test_refusals() -> None:
    ball = shapes.icosphere(1)
    with pytest.raises(InputError, match="rho must have one value a vertex"):
        spin_transform(ball, np.zeros(3))
    with pytest.raises(InputError, match="not finite"):
        spin_transform(ball, np.full(ball.n_vertices, np.nan))
    two = Mesh(
        np.vstack([ball.vertices, ball.vertices + 5]), np.vstack([ball.faces, ball.faces + ball.n_vertices])
    )
    with pytest.raises(MeshError, match="has 2"):
        spin_transform(two, np.zeros(two.n_vertices))
    astray = np.array(ball.faces)
    astray[0] = astray[0, ::-1]
    with pytest.raises(MeshError, match="orient"):
        spin_transform(Mesh(ball.vertices, astray), np.zeros(ball.n_vertices))
    crowded = Mesh(np.eye(5, 3) + np.arange(15).reshape(5, 3) % 4, [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    with pytest.raises(MeshError, match="three faces"):
        spin_transform(crowded, np.zeros(5))
    flat = Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(MeshError, match="no area"):
        spin_transform(flat, np.zeros(4))


def test_a_density_too_large_is_an_error_or_a_warning_never_silence() -> None:
    ball = shapes.icosphere(2)
    rho = 40 * np.sin(9 * ball.vertices[:, 0]) * np.cos(7 * ball.vertices[:, 1])
    with pytest.raises((NumericalError, PliantWarning)):
        spin_transform(ball, rho)


def test_quasi_conformal_error_of_a_known_map() -> None:
    mesh = shapes.grid(5, 4)
    shear = mesh.transformed([[1, 1, 0], [0, 1, 0], [0, 0, 1]])
    np.testing.assert_allclose(quasi_conformal_error(mesh, shear), ((1 + 5**0.5) / 2) ** 2)
    np.testing.assert_allclose(quasi_conformal_error(mesh, mesh.scaled(3)), 1)
    assert np.isinf(quasi_conformal_error(mesh, mesh.transformed(np.diag([1.0, 0, 1])))).all()
    with pytest.raises(MeshError, match="same triangles"):
        quasi_conformal_error(mesh, mesh.flipped())
