"""The engine against closed forms, an oracle of another kind, and other people's implementations."""

from __future__ import annotations

import itertools
from pathlib import Path

import igraph
import networkit
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import Delaunay

import pliant
from pliant import EdgeGraph, GeodesicHierarchy, Mesh
from pliant.geodesic import hierarchy as engine

Floats = NDArray[np.float64]


@pytest.fixture(params=["swept", "plain"])
def solver(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Run a test on the sweeps and on the plain path alike, whatever the size."""
    monkeypatch.setattr(engine, "SMALLEST_SWEPT", 0 if request.param == "swept" else 10**9)
    return str(request.param)


@pytest.fixture
def swept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "SMALLEST_SWEPT", 0)


def path_graph(n: int) -> EdgeGraph:
    return EdgeGraph(n, np.column_stack([np.arange(n - 1), np.arange(1, n)]), np.ones(n - 1))


def lattice(rows: int, columns: int) -> EdgeGraph:
    """Join unit squares, each with one diagonal: many ties."""
    number = np.arange(rows * columns).reshape(rows, columns)
    pairs = [
        (number[:-1], number[1:], 1.0),
        (number[:, :-1], number[:, 1:], 1.0),
        (number[:-1, :-1], number[1:, 1:], np.sqrt(2)),
    ]
    edges = np.concatenate([np.column_stack([a.ravel(), b.ravel()]) for a, b, _ in pairs])
    lengths = np.concatenate([np.full(a.size, length) for a, _, length in pairs])
    return EdgeGraph(rows * columns, edges, lengths)


def counted_pairs(graph: EdgeGraph, forth: Floats, back: Floats) -> Floats:
    """Betweenness from distance and path-count matrices, term by term; lengths must be whole numbers."""
    n = graph.n_vertices
    distance = np.full((n, n), np.inf)
    np.fill_diagonal(distance, 0)
    for (a, b), length in zip(graph.edges, graph.lengths, strict=True):
        distance[a, b] = distance[b, a] = length
    for k in range(n):
        distance = np.minimum(distance, distance[:, k, None] + distance[None, k])
    paths = np.zeros((n, n))
    for s in range(n):
        paths[s, s] = 1
        for t in np.argsort(distance[s], kind="stable"):
            for (a, b), length in zip(graph.edges, graph.lengths, strict=True):
                u = b if a == t else a if b == t else None
                if (
                    u is not None
                    and np.isfinite(distance[s, t])
                    and distance[s, u] + length == distance[s, t]
                ):
                    paths[s, t] += paths[s, u]
    total = np.zeros(n)
    for s, t in itertools.permutations(range(n), 2):
        if not np.isfinite(distance[s, t]):
            continue
        for x in set(range(n)) - {s, t}:
            if distance[s, x] + distance[x, t] == distance[s, t]:
                total[x] += forth[s] * back[t] * paths[s, x] * paths[x, t] / paths[s, t]
    return total / 2


def igraph_betweenness(graph: EdgeGraph) -> Floats:
    other = igraph.Graph(n=graph.n_vertices, edges=graph.edges.tolist())
    return np.array(other.betweenness(weights=graph.lengths.tolist() or None))


@pytest.mark.parametrize("n", [1, 2, 3, 63, 64, 65, 130])
def test_path_in_closed_form(n: int, solver: str) -> None:
    found = GeodesicHierarchy(path_graph(n)).betweenness()
    before = np.arange(n)
    np.testing.assert_allclose(found, before * (n - 1 - before), rtol=1e-13)


@pytest.mark.parametrize("leaves", [2, 63, 64, 200])
def test_star_in_closed_form(leaves: int, solver: str) -> None:
    edges = np.column_stack([np.zeros(leaves, int), np.arange(1, leaves + 1)])
    found = GeodesicHierarchy(EdgeGraph(leaves + 1, edges, np.linspace(1, 2, leaves))).betweenness()
    assert found[0] == pytest.approx(leaves * (leaves - 1) / 2, rel=1e-13)
    assert not found[1:].any()


@given(st.integers(4, 24), st.integers(0, 2**32 - 1), st.booleans())
def test_random_planar_graphs_with_ties(n: int, seed: int, weighted: bool) -> None:
    rng = np.random.default_rng(seed)
    triangles = Delaunay(rng.random((n, 2))).simplices
    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1), axis=0)
    edges = edges[rng.random(len(edges)) < 0.85]
    graph = EdgeGraph(n, edges, rng.integers(1, 5, len(edges)))
    forth = rng.integers(0, 4, n).astype(float) if weighted else np.ones(n)
    back = rng.integers(0, 4, n).astype(float) if weighted else np.ones(n)
    expected = counted_pairs(graph, forth, back)
    saved = engine.SMALLEST_SWEPT
    try:
        for size in (0, 10**9):
            engine.SMALLEST_SWEPT = size
            found = GeodesicHierarchy(graph).betweenness(forth, back)
            np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)
    finally:
        engine.SMALLEST_SWEPT = saved


@given(st.integers(0, 2**32 - 1), st.integers(1, 90))
def test_distances_from_any_sources_are_dijkstras(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    n = 150
    matrix = sp.random_array((n, n), density=0.02, rng=rng)
    graph = GeodesicHierarchy(matrix).graph
    sources = rng.integers(0, n, count)
    found = GeodesicHierarchy(graph).distances(sources)
    expected = sp.csgraph.dijkstra(graph.matrix(), directed=False, indices=sources)
    np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_distances_on_a_sphere(swept: None) -> None:
    mesh = pliant.shapes.bumpy_sphere(3, rng=1)
    solver = GeodesicHierarchy(mesh)
    everything = solver.distances(np.arange(mesh.n_vertices))
    expected = sp.csgraph.dijkstra(solver.graph.matrix(), directed=False)
    np.testing.assert_allclose(everything, expected, rtol=1e-13)
    np.testing.assert_array_equal(everything, solver.distances(np.arange(mesh.n_vertices), n_jobs=1))
    limited = solver.distances([3, 3, 70], max_distance=0.8)
    reference = everything[[3, 3, 70]]
    np.testing.assert_array_equal(limited, np.where(reference <= 0.8, reference, np.inf))
    blocks = list(solver.blocks([9, 4, 100], size=2))
    assert [len(b[0]) for b in blocks] == [2, 1]
    assert sorted(np.concatenate([b[0] for b in blocks]).tolist()) == [4, 9, 100]
    for block_sources, block in blocks:
        np.testing.assert_array_equal(block, everything[block_sources])


@pytest.mark.parametrize("shape", [(9, 14), (17, 17), (2, 40)])
def test_regular_grids_with_ties_agree_with_igraph(shape: tuple[int, int], solver: str) -> None:
    graph = lattice(*shape)
    np.testing.assert_allclose(GeodesicHierarchy(graph).betweenness(), igraph_betweenness(graph), rtol=1e-10)


def test_a_large_regular_grid_stays_finite_and_symmetric() -> None:
    side = 300
    # Without diagonals the number of shortest paths between corners is C(598, 299), about 1e178.
    number = np.arange(side * side).reshape(side, side)
    edges = np.concatenate(
        [
            np.column_stack([number[:-1].ravel(), number[1:].ravel()]),
            np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()]),
        ]
    )
    solver = GeodesicHierarchy(EdgeGraph(side * side, edges, np.ones(len(edges))))
    corners = number[[0, 0, -1, -1], [0, -1, 0, -1]]
    field = solver.betweenness(sources=corners).reshape(side, side)
    assert np.isfinite(field).all()
    for image in (field.T, field[::-1], field[:, ::-1]):
        np.testing.assert_allclose(field, image, rtol=1e-9)
    # Every path passes as many vertices as its ends are apart, less one.
    rows, columns = np.indices((side, side))
    steps = sum(abs(rows - r) + abs(columns - c) for r in (0, side - 1) for c in (0, side - 1))
    assert field.sum() == pytest.approx(((steps - 4).sum() + 4) / 2, rel=1e-9)


def test_path_counts_beyond_float64_are_damped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pliant.geodesic.flow.LARGEST_COUNT", 1e3)
    graph = lattice(14, 14)
    np.testing.assert_allclose(GeodesicHierarchy(graph).betweenness(), igraph_betweenness(graph), rtol=1e-10)


def test_path_counts_that_cannot_be_damped_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pliant.geodesic.flow.LARGEST_COUNT", 1e-300)
    with pytest.raises(pliant.NumericalError, match="more shortest paths"):
        GeodesicHierarchy(lattice(14, 14)).betweenness()


def test_a_generic_mesh_agrees_with_networkit() -> None:
    mesh = pliant.shapes.bumpy_sphere(4, rng=2)
    solver = GeodesicHierarchy(mesh)
    found = solver.betweenness()
    other = networkit.Graph(mesh.n_vertices, weighted=True)
    for (a, b), length in zip(mesh.edges, mesh.edge_lengths, strict=True):
        other.addEdge(int(a), int(b), float(length))
    expected = np.array(networkit.centrality.Betweenness(other).run().scores())
    expected *= igraph_scale(expected, solver.graph)
    assert found.sum() == pytest.approx(expected.sum(), rel=1e-7)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * expected.max())


def igraph_scale(expected: Floats, graph: EdgeGraph) -> float:
    """NetworKit has counted pairs once or twice in different versions; hops settle which."""
    reference = igraph_betweenness(graph)
    return float(np.rint(2 * reference.sum() / expected.sum()) / 2)


def test_disconnected_pieces_do_not_meet(swept: None) -> None:
    one, two = pliant.shapes.bumpy_sphere(2, rng=0), pliant.shapes.bumpy_sphere(3, rng=1).scaled(40)
    n = one.n_vertices
    both = EdgeGraph(
        n + two.n_vertices + 2,
        np.concatenate([one.edges, two.edges + n + 1]),
        np.concatenate([one.edge_lengths, two.edge_lengths]),
    )
    solver = GeodesicHierarchy(both)
    found = solver.betweenness()
    np.testing.assert_allclose(found[:n], GeodesicHierarchy(one).betweenness(), rtol=1e-9)
    np.testing.assert_allclose(found[n + 1 : -1], GeodesicHierarchy(two).betweenness(), rtol=1e-9)
    assert found[n] == found[-1] == 0
    assert np.isinf(solver.distances([0])[0, n:]).all()
    assert solver.distances([n])[0, n] == 0


def test_flow_on_edges_adds_up(solver: str) -> None:
    mesh = pliant.shapes.bumpy_sphere(2, rng=5)
    hierarchy = GeodesicHierarchy(mesh)
    n = mesh.n_vertices
    flow = hierarchy.edge_flow()
    # Flow times length is the sum of all distances; flow alone that of all hops.
    distances = hierarchy.distances(np.arange(n))
    assert flow @ mesh.edge_lengths == pytest.approx(distances.sum() / 2, rel=1e-8)
    assert flow.sum() == pytest.approx(hierarchy.betweenness().sum() + n * (n - 1) / 2, rel=1e-12)


def test_some_sources_add_up_to_all(solver: str) -> None:
    mesh = pliant.shapes.bumpy_sphere(2, rng=3)
    hierarchy = GeodesicHierarchy(mesh)
    rng = np.random.default_rng(0)
    forth, back = rng.random(mesh.n_vertices), rng.random(mesh.n_vertices)
    groups = np.array_split(rng.permutation(mesh.n_vertices), 3)
    parts = [hierarchy.betweenness(forth, back, sources=group) for group in groups]
    np.testing.assert_allclose(sum(parts), hierarchy.betweenness(forth, back), rtol=1e-9, atol=1e-9)
    twice = hierarchy.betweenness(sources=[7, 7])
    np.testing.assert_allclose(twice, 2 * hierarchy.betweenness(sources=[7]), rtol=1e-12)


@pytest.mark.parametrize("graph", [lattice(13, 12), path_graph(70), None], ids=["ties", "path", "mesh"])
def test_scaling_by_distance_is_exact_over_all_sources(graph: EdgeGraph | None) -> None:
    hierarchy = GeodesicHierarchy(pliant.shapes.bumpy_sphere(3, rng=3) if graph is None else graph)
    n = hierarchy.n_vertices
    weights = np.random.default_rng(0).random(n)
    exact = hierarchy.betweenness(weights, weights)
    groups = np.array_split(np.random.default_rng(1).permutation(n), 5)
    parts = hierarchy.sampled_betweenness(groups, weights)
    np.testing.assert_allclose(parts.sum(axis=0), exact, rtol=1e-9, atol=1e-9 * exact.max())
    np.testing.assert_array_equal(parts, hierarchy.sampled_betweenness(groups, weights, n_jobs=1))
    doubled = hierarchy.sampled_betweenness(groups[:1], weights, np.full(n, 2.0))
    np.testing.assert_allclose(doubled[0], 2 * parts[0], rtol=1e-12)


def test_the_result_does_not_depend_on_threads_or_history() -> None:
    solver = GeodesicHierarchy(pliant.shapes.bumpy_sphere(4, rng=7))
    first = solver.betweenness(n_jobs=1)
    np.testing.assert_array_equal(first, solver.betweenness(n_jobs=3))
    np.testing.assert_array_equal(first, solver.betweenness(n_jobs=2))


def test_renumbering_and_scaling_change_nothing_else(swept: None) -> None:
    mesh = pliant.shapes.bumpy_sphere(3, rng=4)
    order = np.random.default_rng(1).permutation(mesh.n_vertices)
    place = np.argsort(order)
    renumbered = Mesh(mesh.vertices[order], place[mesh.faces])
    found = GeodesicHierarchy(mesh).betweenness()
    np.testing.assert_allclose(
        GeodesicHierarchy(renumbered).betweenness(), found[order], rtol=1e-6, atol=1e-6
    )
    for factor in (1e-9, 1e9):
        scaled = GeodesicHierarchy(mesh.scaled(factor))
        np.testing.assert_allclose(scaled.betweenness(), found, rtol=1e-6, atol=1e-6)


def test_save_and_load(tmp_path: Path) -> None:
    path = tmp_path / "hierarchy.npz"
    solver = GeodesicHierarchy(pliant.shapes.bumpy_sphere(3, rng=4))
    solver.save(path)
    loaded = GeodesicHierarchy.load(path)
    np.testing.assert_array_equal(loaded.distances([4, 9]), solver.distances([4, 9]))
    np.testing.assert_array_equal(loaded.betweenness(), solver.betweenness())
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(pliant.FileFormatError):
        GeodesicHierarchy.load(path)
    np.savez(path, format="something else")
    with pytest.raises(pliant.FileFormatError):
        GeodesicHierarchy.load(path)
    np.savez(path, format=engine.FORMAT, edges=[[0, 1]], lengths=[1.0], order=np.array([0, 0, 2]))
    with pytest.raises(pliant.FileFormatError, match="permutation"):
        GeodesicHierarchy.load(path)


def test_bad_arguments() -> None:
    solver = GeodesicHierarchy(path_graph(5))
    with pytest.raises(pliant.InputError, match=r"outside 0\.\.4, first \[5, -1\]"):
        solver.distances([0, 5, -1])
    with pytest.raises(pliant.InputError, match="max_distance"):
        solver.distances([0], max_distance=np.nan)
    with pytest.raises(pliant.InputError, match="source_weights"):
        solver.betweenness([1, 2, 3])
    with pytest.raises(pliant.InputError, match="not finite"):
        solver.betweenness(target_weights=[1, 2, np.nan, 4, -5])
    with pytest.raises(pliant.InputError, match="n_jobs"):
        GeodesicHierarchy(path_graph(200)).distances([0], n_jobs=0)
    with pytest.raises(pliant.InputError, match="edges name vertices"):
        EdgeGraph(2, [[0, 2]], [1.0])
    with pytest.raises(pliant.InputError, match="negative"):
        EdgeGraph(2, [[0, 1]], [-1.0])
    with pytest.raises(pliant.InputError, match="empty"):
        EdgeGraph(0, np.zeros((0, 2)), [])
    with pytest.raises(pliant.MeshError, match="1 of 2 have none"):
        GeodesicHierarchy(EdgeGraph(3, [[0, 1], [1, 2]], [0.0, 1.0])).betweenness()
    assert GeodesicHierarchy(EdgeGraph(3, [[0, 1], [1, 2]], [0.0, 1.0])).distances([0]).tolist() == [
        [0, 0, 1]
    ]
