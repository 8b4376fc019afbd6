"""The field itself: meanings, laws, samples, histograms, real meshes."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pliant
from pliant import Mesh
from pliant.geodesic.distances import FEW_SOURCES

STRIP = Mesh([[0, 0, 0], [1, 1, 0], [2, 0, 0], [3, 1, 0]], [[0, 2, 1], [1, 2, 3]])


def test_uniform_is_normalised_betweenness() -> None:
    mesh = pliant.shapes.bumpy_sphere(2, rng=0)
    n = mesh.n_vertices
    raw = pliant.GeodesicHierarchy(mesh).betweenness()
    np.testing.assert_allclose(pliant.gfe(mesh, weights="uniform"), raw / ((n - 1) * (n - 2) / 2), rtol=1e-12)


def test_area_weights_in_closed_form() -> None:
    # Of the six pairs, only 0 and 3 have paths with something between: through 1 and through 2, equally long.
    areas = STRIP.vertex_areas
    expected = np.zeros(4)
    expected[[1, 2]] = 0.5 * 2 * areas[0] * areas[3] / STRIP.area**2 / areas[[1, 2]]
    np.testing.assert_allclose(pliant.gfe(STRIP), expected, rtol=1e-12)


@pytest.mark.parametrize("weights", ["area", "uniform"])
@pytest.mark.parametrize("graph", ["edges", "refined"])
def test_rigid_motion_changes_nothing_and_scale_only_the_unit(weights: str, graph: str) -> None:
    mesh = pliant.shapes.bumpy_sphere(3, rng=1)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    field = pliant.gfe(mesh, weights=weights, graph=graph)  # type: ignore[arg-type]
    moved = pliant.gfe(mesh.transformed(turn).translated([5, 6, 7]), weights=weights, graph=graph)  # type: ignore[arg-type]
    grown = pliant.gfe(mesh.scaled(10), weights=weights, graph=graph)  # type: ignore[arg-type]
    np.testing.assert_allclose(moved, field, rtol=1e-5, atol=1e-6 * field.max())
    unit = 100 if weights == "area" else 1
    np.testing.assert_allclose(grown * unit, field, rtol=1e-5, atol=1e-6 * field.max())


@pytest.mark.parametrize("n", [1, 2])
def test_meshes_without_faces_have_no_traffic(n: int) -> None:
    mesh = Mesh(np.eye(3)[:n], np.zeros((0, 3), int))
    with pytest.warns(pliant.PliantWarning) if n > 1 else contextlib.nullcontext():
        assert not pliant.gfe(mesh).any()


def test_pieces_are_reported() -> None:
    one = pliant.shapes.icosphere(1)
    two = Mesh(
        np.concatenate([one.vertices, one.vertices + 5, [[9, 9, 9]]]),
        np.concatenate([one.faces, one.faces + one.n_vertices]),
    )
    with pytest.warns(pliant.PliantWarning, match="3 pieces"):
        field = pliant.gfe(two)
    assert field[-1] == 0
    np.testing.assert_allclose(field[: one.n_vertices], pliant.gfe(one) / 4, rtol=1e-9)


def test_edges_without_length_and_vertices_without_area_are_refused() -> None:
    doubled = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(pliant.MeshError, match="merged"):
        pliant.gfe(doubled, weights="uniform")
    flat = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [3, 0, 0]], [[0, 1, 2], [1, 3, 4]])
    with pytest.raises(pliant.MeshError, match="2 vertices have faces but no area"):
        pliant.gfe(flat)


def test_wrong_options() -> None:
    mesh = pliant.shapes.icosphere(1)
    with pytest.raises(pliant.InputError, match='"area" or "uniform"'):
        pliant.gfe(mesh, weights="volume")  # type: ignore[arg-type]
    other = mesh.scaled(1.01)
    for strange in (pliant.shapes.icosphere(0), other):
        with pytest.raises(pliant.InputError, match="not of this mesh"):
            pliant.gfe(strange, hierarchy=pliant.GeodesicHierarchy(mesh))
    with pytest.raises(pliant.InputError, match="not of this mesh"):
        pliant.gfe(mesh, graph="refined", hierarchy=pliant.GeodesicHierarchy(mesh))
    with pytest.raises(pliant.InputError, match="between 32 and"):
        pliant.estimate_gfe(mesh, 3)
    with pytest.raises(pliant.InputError, match="confidence"):
        pliant.estimate_gfe(mesh, 32, confidence=1.0)


@pytest.mark.parametrize("weights", ["area", "uniform"])
def test_intervals_cover_what_they_promise(weights: str) -> None:
    mesh = pliant.shapes.bumpy_sphere(4, rng=3)
    solver = pliant.GeodesicHierarchy(mesh)
    exact = pliant.gfe(mesh, weights=weights, hierarchy=solver)  # type: ignore[arg-type]
    covered, total = [], np.zeros(mesh.n_vertices)
    for seed in range(12):
        estimate = pliant.estimate_gfe(mesh, 512, weights=weights, hierarchy=solver, rng=seed)  # type: ignore[arg-type]
        covered.append((abs(estimate.values - exact) <= estimate.half_widths).mean())
        total += estimate.values / 12
    assert 0.90 < np.mean(covered) < 0.985
    # No bias: the mean of twelve is closer than each, and its errors balance.
    assert abs((total - exact).sum()) < 0.01 * exact.sum()
    assert np.median(estimate.half_widths / exact) < 0.5


@pytest.mark.data
@pytest.mark.parametrize("weights", ["area", "uniform"])
def test_intervals_cover_on_a_real_shape(data: Path, weights: str) -> None:
    mesh = pliant.load_mesh(data / "shapes" / "tosca" / "wolf0.ply")
    solver = pliant.GeodesicHierarchy(mesh)
    exact = pliant.gfe(mesh, weights=weights, hierarchy=solver)  # type: ignore[arg-type]
    covered = []
    for seed in range(6):
        estimate = pliant.estimate_gfe(mesh, 1024, weights=weights, hierarchy=solver, rng=seed)  # type: ignore[arg-type]
        covered.append((abs(estimate.values - exact) <= estimate.half_widths).mean())
    assert np.mean(covered) > 0.88


def test_an_estimate_is_0_where_no_path_passes() -> None:
    sphere = pliant.shapes.bumpy_sphere(3, rng=3)
    # An ear on every tenth face: the tip of a triangle outside, which no path passes.
    tips = sphere.vertices[sphere.faces[::10]].mean(axis=1) * 1.4
    corners = sphere.n_vertices + np.arange(len(tips))
    ears = np.column_stack([sphere.faces[::10, :2], corners])
    mesh = pliant.Mesh(np.vstack([sphere.vertices, tips]), np.vstack([sphere.faces, ears]))
    for seed in range(3):
        values = pliant.estimate_gfe(mesh, 64, rng=seed).values
        assert values.min() == 0
        assert not values[corners].any()


def test_a_sample_of_everything_is_exact_and_a_seed_fixes_bytes() -> None:
    mesh = pliant.shapes.bumpy_sphere(2, rng=3)
    whole = pliant.estimate_gfe(mesh, mesh.n_vertices)
    np.testing.assert_array_equal(whole.values, pliant.gfe(mesh))
    assert not whole.half_widths.any()
    one, two = (pliant.estimate_gfe(mesh, 48, rng=5) for _ in range(2))
    assert one.values.tobytes() == two.values.tobytes()
    assert len(one.samples) == len(set(one.samples.tolist())) == 48


def test_nearest_agrees_with_full_distances() -> None:
    mesh = pliant.shapes.bumpy_sphere(3, rng=0)
    distances = pliant.geodesic_distances(mesh, np.arange(mesh.n_vertices))
    near = pliant.nearest(mesh, count=30, n_jobs=2)
    for v in (0, 17, 641):
        np.testing.assert_allclose(
            near.distances[near.offsets[v] : near.offsets[v + 1]], np.sort(distances[v])[:30], rtol=1e-12
        )
        assert near[v][0] == v
        np.testing.assert_allclose(distances[v, near[v]], np.sort(distances[v])[:30], rtol=1e-12)
    ball = pliant.nearest(mesh, [5, 6], radius=0.7)
    for i, v in enumerate((5, 6)):
        assert set(ball[i].tolist()) == set(np.flatnonzero(distances[v] <= 0.7).tolist())


@given(st.integers(1, 200), st.integers(0, 1000))
def test_nearest_takes_ties_by_number(count: int, seed: int) -> None:
    mesh = pliant.shapes.grid(9, 11)
    v = seed % mesh.n_vertices
    found = pliant.nearest(mesh, [v], count=count)
    distances = pliant.geodesic_distances(mesh, [v])[0]
    order = np.lexsort((np.arange(mesh.n_vertices), distances))[:count]
    np.testing.assert_allclose(found.distances, distances[order], atol=1e-12)
    assert len(set(found[0].tolist())) == min(count, mesh.n_vertices)


def test_nearest_refuses() -> None:
    mesh = pliant.shapes.icosphere(1)
    for wrong in ({"count": 0}, {"radius": -1.0}, {"radius": np.nan}, {"count": 3, "radius": 1.0}):
        with pytest.raises(pliant.InputError):
            pliant.nearest(mesh, **wrong)  # type: ignore[arg-type]


def test_histograms_are_numpys() -> None:
    rng = np.random.default_rng(0)
    field = rng.random(100)
    table = rng.integers(0, 100, (7, 20))
    found = pliant.gch(field, table, bins=6)
    edges = pliant.gch_edges(field, bins=6)
    assert edges[0] == field.min()
    assert edges[-1] == np.percentile(field, 98)
    for row, members in zip(found, table, strict=True):
        np.testing.assert_allclose(row, np.histogram(np.minimum(field[members], edges[-1]), edges)[0] / 20)
    outside = pliant.gch(field, table, edges=[0.4, 0.5, 0.6])
    np.testing.assert_allclose(outside.sum(axis=1), 1)


def test_histograms_refuse() -> None:
    with pytest.raises(pliant.InputError, match="not finite"):
        pliant.gch([1.0, np.nan], [[0, 1]])
    with pytest.raises(pliant.InputError, match="ascending"):
        pliant.gch([1.0, 2.0], [[0, 1]], edges=[3, 2, 1])
    with pytest.raises(pliant.InputError, match="outside"):
        pliant.gch([1.0, 2.0], [[0, 2]])


@pytest.mark.parametrize("method", ["graph", "refined", "heat", "exact"])
def test_every_method_answers_alike_about_pieces(method: str) -> None:
    one = pliant.shapes.icosphere(2)
    n = one.n_vertices
    two = Mesh(
        np.concatenate([one.vertices, one.vertices + 5, [[9, 9, 9]]]),
        np.concatenate([one.faces, one.faces + n]),
    )
    found = pliant.geodesic_distances(two, [3, n + 3, 2 * n], method=method)  # type: ignore[arg-type]
    assert found.shape == (3, 2 * n + 1)
    assert np.isinf(found[0, n:]).all()
    assert np.isinf(found[2, : 2 * n]).all()
    assert found[[0, 1, 2], [3, n + 3, 2 * n]].tolist() == [0, 0, 0]
    angle = np.arccos(np.clip(one.vertices @ one.vertices[3], -1, 1))
    assert abs(found[0, :n] - angle).max() < 0.5
    assert np.corrcoef(found[0, :n], angle)[0, 1] > 0.99


@pytest.mark.parametrize("method", ["graph", "refined"])
@pytest.mark.parametrize("limit", [None, 0.7])
def test_few_sources_are_found_as_many_are(method: str, limit: float | None) -> None:
    mesh = pliant.shapes.bumpy_sphere(3, rng=1)
    many = np.arange(FEW_SOURCES + 1)
    every = pliant.geodesic_distances(mesh, many, method=method, max_distance=limit)  # type: ignore[arg-type]
    few = pliant.geodesic_distances(mesh, many[:-1], method=method, max_distance=limit)  # type: ignore[arg-type]
    np.testing.assert_allclose(few, every[:-1], rtol=1e-13)
    one = pliant.geodesic_distances(mesh, 7, method=method, max_distance=limit)  # type: ignore[arg-type]
    assert one.shape == (1, mesh.n_vertices)
    np.testing.assert_array_equal(one[0], few[7])
    assert pliant.geodesic_distances(mesh, [], method=method).shape == (0, mesh.n_vertices)  # type: ignore[arg-type]


@pytest.mark.data
def test_real_shapes(data: Path) -> None:
    for name, pieces in (("tosca/wolf0.ply", 1), ("tosca_remeshed_5k/cat0.ply", None)):
        mesh = pliant.load_mesh(data / "shapes" / name)
        field = pliant.gfe(mesh, weights="uniform")
        assert np.isfinite(field).all()
        assert 0 <= field.min() <= field.max() < 1
        assert pieces is None or pliant.check_up(mesh).components == pieces


@pytest.mark.data
def test_a_bent_shape_keeps_its_field(data: Path) -> None:
    rest, bent, other = (
        pliant.gfe(pliant.load_mesh(data / "shapes" / "tosca" / f"wolf{k}.ply")) for k in (0, 1, 0)
    )
    np.testing.assert_array_equal(rest, other)
    assert np.corrcoef(np.log(rest + 1e-9), np.log(bent + 1e-9))[0, 1] > 0.6
