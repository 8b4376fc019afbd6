"""Endocardial surfaces: closed, in place, of the right volume; denoising in its own right."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from pliant import InputError, Mesh, MeshError, check_up, shapes, with_noise
from pliant.heart import (
    HeartPhantom,
    Volume,
    endocardial_surface,
    heart_phantom,
    mean_face_normal_filter,
    vertex_diffusion,
)
from pliant.heart._denoising import enclosed_volume
from pliant.mesh import boundary_edges, without_unreferenced


def ball(radius: float = 10.0, spacing: float = 1.0, reach: float = 14.0) -> Volume:
    axis = np.arange(-reach, reach + spacing / 2, spacing)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    affine = np.diag([spacing, spacing, spacing, 1.0])
    affine[:3, 3] = -reach
    return Volume(radius - np.sqrt(x**2 + y**2 + z**2), affine)


@pytest.fixture(scope="module")
def phantom() -> HeartPhantom:
    return heart_phantom(spacing=1.5, mesh_step=1.5, rng=5)


@pytest.mark.parametrize("spacing", [2.0, 1.0])
def test_a_ball_has_its_volume_place_and_outward_normals(spacing: float) -> None:
    found = endocardial_surface(ball(spacing=spacing), level=0.0, smoothing=0.0, step=0.0, denoising="none")
    assert found.genus == 0
    assert found.volume_ml == pytest.approx(4 / 3 * np.pi, rel=0.01 * spacing**2)
    assert np.abs(np.linalg.norm(found.mesh.vertices, axis=1) - 10).max() < 0.1 * spacing
    assert ((found.mesh.vertices * found.mesh.vertex_normals).sum(axis=1) > 9).all()


def test_a_mirrored_grid_keeps_normals_outwards() -> None:
    source = ball()
    affine = source.affine @ np.diag([-1.0, 1.0, 1.0, 1.0])
    found = endocardial_surface(Volume(source.values, affine), level=0.0, denoising="none")
    assert enclosed_volume(found.mesh) > 0


@settings(max_examples=15)
@given(seed=st.integers(0, 10_000), level=st.integers(0, 3))
def test_whole_number_voxels_at_the_level_leave_no_hole(seed: int, level: int) -> None:
    values = np.random.default_rng(seed).integers(-1, 5, (8, 8, 8))
    found = endocardial_surface(
        Volume(values, np.eye(4)), level=level, smoothing=0.0, step=0.0, denoising="none"
    )
    report = check_up(found.mesh)
    assert report.boundary_loops == 0
    assert report.components == 1


def test_a_surface_cut_by_the_volumes_rim_is_closed_there() -> None:
    values = np.ones((6, 6, 6))
    values[:, :, 3:] = 0
    found = endocardial_surface(Volume(values, np.eye(4)), smoothing=0.0, step=0.0)
    assert check_up(found.mesh).boundary_loops == 0


@pytest.mark.parametrize("denoising", ["normals", "diffusion"])
def test_ct_gives_the_phantoms_surface_with_its_volume_kept(phantom: HeartPhantom, denoising: str) -> None:
    found = endocardial_surface(phantom.volume, mask=phantom.mask, denoising=denoising)  # type: ignore[arg-type]
    assert abs(found.volume_change) < 0.01
    assert found.volume_ml == pytest.approx(enclosed_volume(phantom.mesh) / 1000, rel=0.06)
    away = cKDTree(phantom.mesh.vertices).query(found.mesh.vertices)[0]
    assert away.mean() < 0.8
    assert check_up(found.mesh).components == 1


def test_smaller_pieces_are_dropped_and_counted() -> None:
    values = np.zeros((30, 12, 12))
    values[2:12, 2:10, 2:10] = 1
    values[20:24, 4:8, 4:8] = 1
    found = endocardial_surface(Volume(values, np.eye(4)), smoothing=0.0, step=0.0)
    assert found.dropped > 20
    assert found.mesh.vertices[:, 0].max() < 13


@pytest.mark.parametrize(
    "denoise",
    [mean_face_normal_filter, vertex_diffusion, lambda m: vertex_diffusion(m, form="centred", step=0.02)],
)
def test_denoising_follows_rigid_motions(denoise) -> None:  # type: ignore[no-untyped-def]
    noisy = with_noise(shapes.ellipsoid((3.0, 2.0, 1.0), 3), 0.2, rng=1)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    moved = noisy.transformed(turn).translated([40.0, -7.0, 3.0])
    expected = denoise(noisy).transformed(turn).translated([40.0, -7.0, 3.0])
    assert np.abs(denoise(moved).vertices - expected.vertices).max() < 1e-9


def test_printed_diffusion_about_the_origin_would_move_with_it() -> None:
    # Why the formula is centred: on vertices of unequal degree its pull does not vanish even on a plane.
    mesh = shapes.icosphere(2).translated([30.0, 0, 0])
    i, j = np.concatenate([mesh.edges, mesh.edges[:, ::-1]]).T
    root = np.sqrt(np.bincount(i, minlength=mesh.n_vertices))
    pull = mesh.vertices[j] / root[j, None] - mesh.vertices[i] / root[i, None]
    assert np.linalg.norm(pull, axis=1).max() > 1.0
    assert np.linalg.norm(mesh.vertices[j] - mesh.vertices[i], axis=1).max() < 0.4


@pytest.mark.parametrize(("denoise", "share"), [(mean_face_normal_filter, 0.5), (vertex_diffusion, 0.6)])
def test_denoising_brings_a_noisy_ball_back_and_keeps_its_volume(denoise, share: float) -> None:  # type: ignore[no-untyped-def]
    clean = shapes.icosphere(4)
    noisy = with_noise(clean, 0.2, rng=0)
    after = denoise(noisy)
    errors = [np.abs(np.linalg.norm(m.vertices, axis=1) - 1).mean() for m in (noisy, after)]
    assert errors[1] < share * errors[0]
    assert enclosed_volume(after) == pytest.approx(enclosed_volume(noisy), rel=1e-4)


def test_normals_filter_keeps_a_sharp_edge_that_diffusion_rounds() -> None:
    grid = np.linspace(-1, 1, 41)
    x, y = (g.ravel() for g in np.meshgrid(grid, grid, indexing="ij"))
    index = np.arange(41 * 41).reshape(41, 41)
    a, b, c, d = (
        index[:-1, :-1].ravel(),
        index[1:, :-1].ravel(),
        index[1:, 1:].ravel(),
        index[:-1, 1:].ravel(),
    )
    roof = Mesh(
        np.column_stack([x, y, -np.abs(x)]),
        np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]),
    )
    ridge = (np.abs(x) < 1e-9) & (np.abs(y) < 0.8)
    kept = mean_face_normal_filter(roof, rounds=5).vertices[ridge, 2]
    rounded = vertex_diffusion(roof, rounds=20).vertices[ridge, 2]
    assert np.abs(kept).mean() < 0.6 * np.abs(rounded).mean()


@pytest.mark.parametrize("denoise", [mean_face_normal_filter, vertex_diffusion])
def test_rims_stay_and_the_rest_moves(denoise) -> None:  # type: ignore[no-untyped-def]
    ball = with_noise(shapes.icosphere(3), 0.3, rng=0)
    half = without_unreferenced(
        Mesh(ball.vertices, ball.faces[(ball.vertices[ball.faces, 2] < 0.1).all(axis=1)])
    ).mesh
    rim = np.unique(boundary_edges(half))
    moved = denoise(half)
    assert np.array_equal(moved.vertices[rim], half.vertices[rim])
    assert np.abs(moved.vertices - half.vertices).max() > 0.005


def test_what_cannot_be_a_surface_is_refused() -> None:
    source = ball()
    with pytest.raises(InputError, match="outside the values"):
        endocardial_surface(source, level=500.0)
    with pytest.raises(InputError, match="give the level"):
        endocardial_surface(source)
    with pytest.raises(InputError, match="empty"):
        endocardial_surface(source, mask=np.zeros(source.shape))
    with pytest.raises(InputError, match="shape"):
        endocardial_surface(source, mask=np.ones((3, 3, 3)))
    with pytest.raises(InputError, match="denoising"):
        endocardial_surface(source, level=0.0, denoising="median")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="rounds"):
        mean_face_normal_filter(shapes.icosphere(1), rounds=-1)
    with pytest.raises(InputError, match="form"):
        vertex_diffusion(shapes.icosphere(1), form="printed")  # type: ignore[arg-type]
    with pytest.raises(MeshError, match="no triangle"):
        vertex_diffusion(Mesh([[0, 0, 0]], np.empty((0, 3), int)))
