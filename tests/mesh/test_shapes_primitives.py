"""Closed-form shapes against their closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pliant
from pliant import Mesh, shapes
from pliant.errors import InputError

counts = st.integers(3, 40)
lengths = st.floats(0.01, 100)


def edge_uses(mesh: Mesh) -> np.ndarray:
    ends = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.unique(ends, axis=0, return_counts=True)[1]


def euler(mesh: Mesh) -> int:
    return mesh.n_vertices - len(mesh.edges) + mesh.n_faces


def volume(mesh: Mesh) -> float:
    return float(np.linalg.det(mesh.vertices[mesh.faces]).sum() / 6)


def is_consistently_wound(mesh: Mesh) -> bool:
    half = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return len(np.unique(half, axis=0)) == len(half)


def assert_closed(mesh: Mesh, characteristic: int = 2) -> None:
    assert (edge_uses(mesh) == 2).all()
    assert euler(mesh) == characteristic
    assert is_consistently_wound(mesh)
    assert volume(mesh) > 0
    assert mesh.face_areas.min() > 0
    assert np.array_equal(np.unique(mesh.faces), np.arange(mesh.n_vertices))


def test_shapes_are_reached_from_the_top():
    assert pliant.shapes.icosphere(1).n_vertices == 42


def test_the_list_of_names_is_complete_and_true():
    assert all(hasattr(shapes, name) for name in shapes.__all__)
    assert list(shapes.__all__) == sorted(shapes.__all__)


@pytest.mark.parametrize("subdivisions", range(6))
def test_icosphere_counts_and_radius(subdivisions):
    mesh = shapes.icosphere(subdivisions, radius=3)
    assert mesh.n_vertices == 10 * 4**subdivisions + 2
    assert_closed(mesh)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 3, rtol=1e-14)


def test_a_finer_icosphere_keeps_the_coarser_vertices_first():
    coarse, fine = shapes.icosphere(2), shapes.icosphere(3)
    assert np.array_equal(fine.vertices[: coarse.n_vertices], coarse.vertices)


def refinement_rates(errors: list[float]) -> np.ndarray:
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.parametrize(
    ("make", "area", "enclosed"),
    [
        (lambda k: shapes.icosphere(k, radius=2), 16 * np.pi, 32 * np.pi / 3),
        (lambda k: shapes.torus(3, 1, rings=12 * 2**k, sides=5 * 2**k), 12 * np.pi**2, 6 * np.pi**2),
        (lambda k: shapes.cylinder(1, 3, sides=6 * 2**k), 8 * np.pi, 3 * np.pi),
        (lambda k: shapes.ellipsoid([1, 1, 2], k), 21.4784353, 8 * np.pi / 3),
    ],
    ids=["icosphere", "torus", "cylinder", "ellipsoid"],
)
def test_area_and_volume_converge_at_second_order(make, area, enclosed):
    meshes = [make(k) for k in (2, 3, 4)]
    areas = refinement_rates([abs(mesh.area - area) for mesh in meshes])
    volumes = refinement_rates([abs(volume(mesh) - enclosed) for mesh in meshes])
    assert areas == pytest.approx(2, abs=0.15)
    assert volumes == pytest.approx(2, abs=0.15)


@given(rings=counts, sides=counts, minor=lengths, ratio=st.floats(1.01, 50))
def test_torus_is_a_torus(rings, sides, minor, ratio):
    mesh = shapes.torus(minor * ratio, minor, rings=rings, sides=sides)
    assert mesh.n_vertices == rings * sides
    assert_closed(mesh, 0)
    to_circle = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]) - minor * ratio
    np.testing.assert_allclose(np.hypot(to_circle, mesh.vertices[:, 2]), minor, rtol=1e-9)


@given(sides=counts, rows=st.none() | st.integers(2, 20), radius=lengths, height=lengths)
def test_closed_cylinder_is_a_prism(sides, rows, radius, height):
    if rows is None and height / radius * sides > 2000:
        rows = 3
    mesh = shapes.cylinder(radius, height, sides=sides, rows=rows)
    assert_closed(mesh)
    base = sides / 2 * radius**2 * np.sin(2 * np.pi / sides)
    assert volume(mesh) == pytest.approx(base * height, rel=1e-9)
    rim = 2 * sides * radius * np.sin(np.pi / sides)
    assert mesh.area == pytest.approx(2 * base + rim * height, rel=1e-9)


def test_open_cylinder_has_two_rims():
    mesh = shapes.cylinder(sides=10, rows=4, caps=False)
    assert (edge_uses(mesh) == 1).sum() == 20
    assert euler(mesh) == 0
    outward = (mesh.face_normals * mesh.vertices[mesh.faces].mean(axis=1))[:, :2].sum(axis=1)
    assert (outward > 0).all()


def test_cap_triangles_are_even():
    mesh = shapes.cylinder(sides=48)
    assert mesh.edge_lengths.max() / mesh.edge_lengths.min() < 3


@given(rows=st.integers(2, 20), columns=st.integers(2, 20), spacing=lengths)
@pytest.mark.parametrize("diagonal", ["same", "alternating"])
def test_grid(rows, columns, spacing, diagonal):
    mesh = shapes.grid(rows, columns, spacing=spacing, diagonal=diagonal)
    assert mesh.n_vertices == rows * columns
    assert mesh.n_faces == 2 * (rows - 1) * (columns - 1)
    assert np.array_equal(mesh.vertices[columns], [0, spacing, 0])
    np.testing.assert_allclose(mesh.face_areas, spacing**2 / 2)
    assert (mesh.face_normals[:, 2] == 1).all()
    assert euler(mesh) == 1


def test_alternating_grid_alternates():
    degrees = np.bincount(shapes.grid(5, 5, diagonal="alternating").edges.ravel()).reshape(5, 5)
    assert np.array_equal(np.unique(degrees[1:-1, 1:-1]), [4, 8])
    assert (np.bincount(shapes.grid(5, 5).edges.ravel()).reshape(5, 5)[1:-1, 1:-1] == 6).all()


def test_paraboloid_is_the_graph_it_says():
    mesh = shapes.paraboloid(2, -0.5, rows=11, columns=21, size=3)
    x, y, z = mesh.vertices.T
    np.testing.assert_allclose(z, -(2 * x**2 - 0.5 * y**2) / 2, atol=1e-14)
    np.testing.assert_allclose([x.min(), x.max(), y.min(), y.max()], [-1.5, 1.5, -1.5, 1.5])
    assert (mesh.face_normals[:, 2] > 0).all()
    assert np.array_equal(mesh.vertices[5 * 21 + 10], np.zeros(3))


@pytest.mark.parametrize(
    ("solid", "corners", "edge"),
    [
        ("tetrahedron", 4, np.sqrt(8 / 3)),
        ("cube", 8, 2 / np.sqrt(3)),
        ("octahedron", 6, np.sqrt(2)),
        ("dodecahedron", 20, 4 / (np.sqrt(3) * (1 + np.sqrt(5)))),
        ("icosahedron", 12, 4 / np.sqrt(10 + 2 * np.sqrt(5))),
    ],
)
def test_platonic_solids(solid, corners, edge):
    mesh = shapes.platonic(solid, radius=1)
    assert mesh.n_vertices == corners
    assert_closed(mesh)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1)
    assert mesh.edge_lengths.min() == pytest.approx(edge)


@given(seed=st.integers(0, 2**32), amplitude=st.floats(-1, 1), smoothness=st.floats(0.05, 5))
def test_bumpy_sphere_is_star_shaped(seed, amplitude, smoothness):
    mesh = shapes.bumpy_sphere(2, rng=seed, amplitude=amplitude, smoothness=smoothness)
    assert_closed(mesh)
    assert (np.linalg.det(mesh.vertices[mesh.faces]) > 0).all()


def test_bumpy_sphere_same_seed_same_bytes_and_nested():
    first, again = (shapes.bumpy_sphere(3, rng=5) for _ in range(2))
    assert first.vertices.tobytes() == again.vertices.tobytes()
    assert np.array_equal(shapes.bumpy_sphere(3, rng=np.random.default_rng(5)).vertices, first.vertices)
    assert not np.array_equal(shapes.bumpy_sphere(3, rng=6).vertices, first.vertices)
    np.testing.assert_allclose(shapes.bumpy_sphere(4, rng=5).vertices[:642], first.vertices, rtol=1e-12)


def test_bumpy_sphere_has_no_tied_edges_and_converges():
    mesh = shapes.bumpy_sphere(4, rng=1)
    lengths = np.sort(mesh.edge_lengths)
    assert (np.diff(lengths) > 0).all()
    areas = [shapes.bumpy_sphere(k, rng=1).area for k in (3, 4, 5, 6)]
    assert np.log2(np.diff(areas)[:-1] / np.diff(areas)[1:]) == pytest.approx(2, abs=0.2)


def test_bumps_have_the_asked_amplitude():
    spread = [
        np.log(np.linalg.norm(shapes.bumpy_sphere(3, rng=seed, amplitude=0.1).vertices, axis=1))
        for seed in range(30)
    ]
    assert np.mean(np.square(spread)) == pytest.approx(0.01, rel=0.2)


@pytest.mark.parametrize(
    ("call", "about"),
    [
        (lambda: shapes.icosphere(-1), "subdivisions must be between 0 and 9, got -1"),
        (lambda: shapes.icosphere(2.5), "whole number"),
        (lambda: shapes.icosphere(True), "whole number"),
        (lambda: shapes.icosphere(12), "between 0 and 9"),
        (lambda: shapes.icosphere(1, radius=0), "radius must be positive"),
        (lambda: shapes.icosphere(1, radius=float("nan")), "finite"),
        (lambda: shapes.ellipsoid([1, 2]), "three numbers"),
        (lambda: shapes.ellipsoid([1, 2, -3]), "axes must be positive"),
        (lambda: shapes.ellipsoid("abc"), "array of numbers"),
        (lambda: shapes.bumpy_sphere(2, rng=1, amplitude=2), "between -1 and 1"),
        (lambda: shapes.bumpy_sphere(2, rng=1, smoothness=0), "smoothness must be positive"),
        (lambda: shapes.torus(1, 1), "smaller than major"),
        (lambda: shapes.torus(rings=2), "rings must be at least 3"),
        (lambda: shapes.cylinder(1, -1), "height must be positive"),
        (lambda: shapes.cylinder(rows=1), "rows must be at least 2"),
        (lambda: shapes.grid(1, 5), "rows must be at least 2"),
        (lambda: shapes.grid(3, 3, diagonal="other"), "diagonal must be"),
        (lambda: shapes.paraboloid(float("inf")), "kappa1 must be a finite"),
        (lambda: shapes.platonic("prism"), "solid must be one of tetrahedron"),
    ],
)
def test_bad_arguments_are_named(call, about):
    with pytest.raises(InputError, match=about):
        call()
