"""Shortest paths as polylines, and distances to sets: laws, closed forms, SciPy, hypothesis, real surfaces."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import Delaunay

import pliant
from pliant import EdgeGraph, GeodesicPath, InputError, Mesh, edge_graph, shapes
from pliant.geodesic import GeodesicHierarchy
from pliant.geodesic.forest import shortest_path_forest
from pliant.geodesic.graph import GraphKind
from pliant.mesh import boundary_edges, boundary_loops

KINDS: tuple[GraphKind, GraphKind] = ("edges", "refined")
HALF = np.sqrt(0.5)
# Two right triangles of a unit square, folded by 90 degrees along the diagonal they share.
FOLDED = Mesh([[0, 0, 0], [HALF, HALF, 0], [2 * HALF, 0, 0], [HALF, 0, HALF]], [[0, 2, 1], [0, 3, 2]])


def distances(mesh: Mesh, source: int, kind: GraphKind) -> NDArray[np.float64]:
    """By the hierarchy: another engine than the paths'."""
    return GeodesicHierarchy(mesh, kind).distances([source])[0]


def crumpled(seed: int, n: int = 60) -> Mesh:
    """A random triangulated, rough terrain: no two paths of one length."""
    rng = np.random.default_rng(seed)
    flat = rng.random((n, 2))
    return Mesh(np.column_stack([flat, 0.4 * rng.random(n)]), Delaunay(flat).simplices)


def check(mesh: Mesh, path: GeodesicPath, kind: GraphKind) -> None:
    """What holds of every path that there is."""
    assert path.along[0] == 0
    assert (np.diff(path.along) >= 0).all()
    pieces = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    assert path.length == pytest.approx(pieces.sum(), rel=1e-12)
    at_vertex = path.vertices >= 0
    assert at_vertex[[0, -1]].all()
    np.testing.assert_array_equal(path.points[at_vertex], mesh.vertices[path.vertices[at_vertex]])
    np.testing.assert_array_equal(
        path.edges[at_vertex], np.repeat(path.vertices[at_vertex], 2).reshape(-1, 2)
    )
    assert ((path.fractions[~at_vertex] > 0) & (path.fractions[~at_vertex] < 1)).all()
    np.testing.assert_allclose(path.interpolated(mesh.vertices), path.points, atol=1e-12)
    graph = {tuple(edge) for edge in edge_graph(mesh, kind).edges.tolist()}
    steps = path.vertices[at_vertex].tolist()
    assert all((min(a, b), max(a, b)) in graph for a, b in itertools.pairwise(steps))
    faces = [set(face) for face in mesh.faces.tolist()]
    places = [set(edge) for edge in path.edges.tolist()]
    for one, other in itertools.pairwise(places):  # each piece lies in one face
        assert any(one | other <= face for face in faces)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "mesh",
    [shapes.icosphere(2), shapes.torus(rings=24, sides=12), crumpled(0), FOLDED],
    ids=["sphere", "torus", "crumpled", "fold"],
)
def test_paths_lie_on_the_surface_and_are_as_long_as_the_distance(mesh: Mesh, kind: GraphKind) -> None:
    truth = distances(mesh, 1, kind)
    targets = np.arange(0, mesh.n_vertices, max(1, mesh.n_vertices // 40))
    paths = pliant.geodesic_paths(mesh, 1, targets, graph=kind)
    for target, path in zip(targets, paths, strict=True):
        check(mesh, path, kind)
        assert path.vertices[[0, -1]].tolist() == [1, target]
        assert path.length == pytest.approx(truth[target], rel=1e-10)
        back = pliant.geodesic_path(mesh, int(target), 1, graph=kind)
        assert back.length == pytest.approx(path.length, rel=1e-10)


@pytest.mark.parametrize("kind", KINDS)
@given(st.integers(0, 10_000))
def test_random_surfaces(kind: GraphKind, seed: int) -> None:
    mesh = crumpled(seed, 25)
    source, target = np.random.default_rng(seed).integers(0, 25, 2).tolist()
    path = pliant.geodesic_path(mesh, source, target, graph=kind)
    check(mesh, path, kind)
    matrix = edge_graph(mesh, kind).matrix()
    truth, before = sp.csgraph.dijkstra(matrix, indices=source, return_predecessors=True)
    assert path.length == pytest.approx(truth[target], rel=1e-12)
    theirs = [target]
    while theirs[-1] != source:
        theirs.append(int(before[theirs[-1]]))
    assert path.vertices[path.vertices >= 0].tolist() == theirs[::-1]


@given(st.integers(2, 14), st.integers(0, 10_000))
def test_forests_of_random_graphs_with_ties_and_edges_of_no_length(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree = [[int(rng.integers(0, i)), i] for i in range(1, n)]
    edges = np.array(tree + rng.integers(0, n, (n, 2)).tolist())
    graph = EdgeGraph(n, edges, rng.integers(0, 4, len(edges)).astype(float))
    sources = rng.integers(0, n, rng.integers(1, 4))
    found, nearest = pliant.distance_to_set(graph, sources)
    truth = sp.csgraph.dijkstra(graph.matrix(), indices=sources)
    np.testing.assert_array_equal(found, truth.min(axis=0))
    np.testing.assert_array_equal(nearest, truth.argmin(axis=0))  # the first of those that tie


def test_along_an_axis_of_a_grid_the_path_is_the_straight_line() -> None:
    grid = shapes.grid(9, 5)
    row = np.flatnonzero(grid.vertices[:, 1] == grid.vertices[0, 1])
    row = row[np.argsort(grid.vertices[row, 0])]
    for kind in KINDS:
        path = pliant.geodesic_path(grid, int(row[0]), int(row[-1]), graph=kind)
        assert path.vertices.tolist() == row.tolist()
        np.testing.assert_allclose(path.along, grid.vertices[row, 0] - grid.vertices[row[0], 0], atol=1e-12)


def test_half_way_round_a_sphere() -> None:
    sphere = shapes.icosphere(4)
    opposite = int(np.argmin(sphere.vertices @ sphere.vertices[40]))
    edges = pliant.geodesic_path(sphere, 40, opposite).length
    refined = pliant.geodesic_path(sphere, 40, opposite, graph="refined").length
    assert np.pi * 0.999 < refined < edges < np.pi * 1.15
    assert refined < np.pi * 1.03


def test_no_path_is_shorter_than_the_surface_allows() -> None:
    mesh = crumpled(7)
    exact = pliant.geodesic_distances(mesh, 0, method="exact")[0]
    everywhere = np.arange(mesh.n_vertices)
    edges, refined = (
        np.array([path.length for path in pliant.geodesic_paths(mesh, 0, everywhere, graph=kind)])
        for kind in KINDS
    )
    assert (exact <= refined + 1e-9).all()
    assert (refined <= edges + 1e-12).all()
    assert (refined < edges - 1e-3).sum() > 20


def test_a_step_over_a_fold_crosses_it_at_a_point() -> None:
    path = pliant.geodesic_path(FOLDED, 1, 3, graph="refined")
    assert path.vertices.tolist() == [1, -1, 3]
    assert path.edges.tolist() == [[1, 1], [0, 2], [3, 3]]
    np.testing.assert_allclose(path.points[1], [HALF, 0, 0], atol=1e-15)
    assert path.fractions[1] == pytest.approx(0.5)
    assert path.length == pytest.approx(2 * HALF)


def test_where_an_edge_and_a_diagonal_join_the_same_vertices_the_graph_says_which() -> None:
    # 0 and 1 are joined by a long edge through face 0-1-4, and by a short way over the edge 2-3.
    mesh = Mesh(
        [[-1, 0, 0], [1, 0, 0], [0, -1, -0.9], [0, 1, -0.9], [0, -1, 5.0]],
        [[0, 2, 3], [1, 3, 2], [0, 1, 4], [0, 4, 2], [1, 2, 4]],
    )
    low = mesh.with_vertices(mesh.vertices * [1, 1, 0.1])
    edge = pliant.geodesic_path(low, 0, 1)
    assert edge.vertices.tolist() == [0, 1]
    for kind in KINDS:
        path = pliant.geodesic_path(low, 0, 1, graph=kind)
        assert path.length == pytest.approx(distances(low, 0, kind)[1], rel=1e-12)
        check(low, path, kind)
    # The same pair bent so that the way over the edge is the only short one: with an edge of its own, longer.
    graph = edge_graph(low)
    longer = EdgeGraph(5, graph.edges, np.where((graph.edges == [0, 1]).all(axis=1), 2.05, graph.lengths))
    over = pliant.geodesic_path(low, 0, 1, graph=longer)
    assert over.vertices.tolist() == [0, -1, 1]


def test_numbering_does_not_move_a_path() -> None:
    mesh = crumpled(3)
    new = np.random.default_rng(0).permutation(mesh.n_vertices)
    vertices = np.empty_like(mesh.vertices)
    vertices[new] = mesh.vertices
    other = Mesh(vertices, new[mesh.faces])
    for kind in KINDS:
        one = pliant.geodesic_path(mesh, 0, 50, graph=kind)
        two = pliant.geodesic_path(other, int(new[0]), int(new[50]), graph=kind)
        np.testing.assert_allclose(one.points, two.points, atol=1e-12)


def test_bigger_or_elsewhere_is_the_same_path() -> None:
    mesh = crumpled(4)
    moved = mesh.scaled(1e3).translated([5.0, -2, 1])
    for kind in KINDS:
        one, two = (pliant.geodesic_path(m, 0, 50, graph=kind) for m in (mesh, moved))
        assert one.vertices.tolist() == two.vertices.tolist()
        assert two.length == pytest.approx(1e3 * one.length, rel=1e-9)


def test_ties_go_to_few_steps_and_then_to_low_numbers() -> None:
    # From 0 to 7 in three steps over 1 and 2, in two over 3 or over 4, all of length 2.
    ways = [[0, 1], [1, 2], [2, 7], [0, 3], [3, 7], [0, 4], [4, 7]]
    graph = EdgeGraph(8, np.array(ways), np.array([1, 0.5, 0.5, 1, 1, 1, 1]))
    assert shortest_path_forest(graph, np.array([0])).before[7] == 3
    mirrored = EdgeGraph(8, 7 - np.array(ways), np.array([1, 0.5, 0.5, 1, 1, 1, 1]))
    assert shortest_path_forest(mirrored, np.array([7])).before[0] == 3  # 4 and 3 changed places


def test_rounding_does_not_choose_between_ties() -> None:
    square = shapes.grid(7, 7, spacing=0.1)
    noise = 1 + 1e-14 * np.random.default_rng(0).random((49, 3))
    shaken = square.with_vertices(square.vertices * noise)
    everywhere = np.arange(49)
    for one, two in zip(*(pliant.geodesic_paths(m, 0, everywhere) for m in (square, shaken)), strict=True):
        assert one.vertices.tolist() == two.vertices.tolist()
    labels = [pliant.distance_to_set(mesh, [48, 6, 42])[1].tolist() for mesh in (square, shaken)]
    assert labels[0] == labels[1]


def test_doubled_points_end() -> None:
    # All vertices in two places: edges of no length in circles, which lead nowhere.
    places = np.array([[0.0, 0, 0]] * 4 + [[1.0, 0, 0]] * 4)
    faces = [[0, 1, 2], [1, 2, 3], [0, 2, 3], [3, 4, 5], [4, 5, 6], [5, 6, 7]]
    mesh = Mesh(places, faces)
    for kind in KINDS:
        path = pliant.geodesic_path(mesh, 0, 7, graph=kind)
        assert path.length == 1
        assert len(set(path.vertices.tolist())) == len(path)
        check(mesh, path, kind)


def test_from_a_vertex_to_itself() -> None:
    path = pliant.geodesic_path(shapes.icosphere(1), 7, 7, graph="refined")
    assert path.vertices.tolist() == [7]
    assert path.length == 0
    assert repr(path) == "GeodesicPath(7 to 7, 1 points, length 0)"


def test_where_no_path_leads() -> None:
    sphere = shapes.icosphere(1)
    n = sphere.n_vertices
    two = Mesh(np.vstack([sphere.vertices, sphere.vertices + 3]), np.vstack([sphere.faces, sphere.faces + n]))
    there, nowhere = pliant.geodesic_paths(two, 0, [1, n], graph="refined")
    assert np.isfinite(there.length)
    assert nowhere.length == np.inf
    assert len(nowhere) == 0
    assert nowhere.points.shape == (0, 3)
    assert nowhere.interpolated(np.ones(2 * n)).shape == (0,)
    assert repr(nowhere) == "GeodesicPath(no path)"
    far, nearest = pliant.distance_to_set(two, [3])
    assert np.isinf(far[n:]).all()
    assert (nearest[n:] == -1).all()
    assert (nearest[:n] == 0).all()


def test_no_targets_and_a_graph_built_before() -> None:
    mesh = crumpled(5)
    assert pliant.geodesic_paths(mesh, 0, []) == ()
    for kind in KINDS:
        one = pliant.geodesic_path(mesh, 0, 50, graph=kind)
        two = pliant.geodesic_path(mesh, 0, 50, graph=edge_graph(mesh, kind))
        np.testing.assert_array_equal(one.points, two.points)


def test_lengths_of_ones_own_decide_on_the_path_and_not_on_its_length() -> None:
    grid = shapes.grid(5, 9)
    graph = edge_graph(grid)
    ends = [0, 8]
    in_first_row = (graph.edges < 9).all(axis=1)
    dear = EdgeGraph(graph.n_vertices, graph.edges, np.where(in_first_row, 100.0, graph.lengths))
    assert pliant.geodesic_path(grid, *ends, graph=graph).length == 8
    path = pliant.geodesic_path(grid, *ends, graph=dear)
    assert (path.vertices[1:-1] >= 9).all()
    assert path.length == pytest.approx(8 + np.sqrt(2))  # up, seven along, down a diagonal


def test_values_go_along() -> None:
    sphere = shapes.icosphere(3)
    path = pliant.geodesic_path(sphere, 0, 77, graph="refined")
    values = np.random.default_rng(0).random(sphere.n_vertices)
    taken = path.interpolated(values)
    at_vertex = path.vertices >= 0
    np.testing.assert_array_equal(taken[at_vertex], values[path.vertices[at_vertex]])
    bounds = np.sort(values[path.edges], axis=1)
    assert ((taken >= bounds[:, 0]) & (taken <= bounds[:, 1])).all()
    stretched = sphere.vertices * [1, 2, 3]
    np.testing.assert_allclose(path.interpolated(stretched), path.points * [1, 2, 3], atol=1e-12)
    with pytest.raises(InputError, match=r"one row a vertex .* \(5,\)"):
        path.interpolated(values[:5])


def test_what_cannot_be_a_path() -> None:
    mesh = shapes.icosphere(1)
    n = mesh.n_vertices
    with pytest.raises(InputError, match=f"source: 1 of 1 are outside 0..{n - 1}"):
        pliant.geodesic_path(mesh, n, 0)
    with pytest.raises(InputError, match="target: 1 of 1 are outside"):
        pliant.geodesic_path(mesh, 0, -1)
    with pytest.raises(InputError, match="targets: 1 of 2 are outside"):
        pliant.geodesic_paths(mesh, 0, [1, n])
    with pytest.raises(InputError, match="source must be one vertex number, got 2"):
        pliant.geodesic_paths(mesh, [0, 1], [2])  # type: ignore[arg-type]
    with pytest.raises(
        InputError, match="target must be one vertex number, got 2; geodesic_paths takes many"
    ):
        pliant.geodesic_path(mesh, 0, [1, 2])  # type: ignore[arg-type]
    with pytest.raises(InputError, match='"edges" or "refined"'):
        pliant.geodesic_path(mesh, 0, 1, graph="fine")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="3 vertices and the mesh 42"):
        pliant.geodesic_path(mesh, 0, 1, graph=EdgeGraph(3, [[0, 1]], [1.0]))
    bridge = EdgeGraph(n, [[0, 3]], [1.0])
    with pytest.raises(
        InputError, match=r"1 steps .* neither edges of the mesh nor diagonals .* first 0 to 3"
    ):
        pliant.geodesic_path(mesh, 0, 3, graph=bridge)
    fins = Mesh(
        [[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1]], [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
    )
    with pytest.raises(InputError, match="neither edges of the mesh nor diagonals"):
        pliant.geodesic_path(fins, 2, 3, graph=EdgeGraph(5, [[2, 3]], [2.0]))  # three faces meet there


def test_the_distance_to_a_boundary() -> None:
    tube = shapes.cylinder(height=2.0, rows=17, caps=False)
    rims = boundary_loops(tube)
    for kind in KINDS:
        found, nearest = pliant.distance_to_set(tube, boundary_edges(tube)[:, 0], graph=kind)
        np.testing.assert_allclose(
            found, np.minimum(tube.vertices[:, 2], 2 - tube.vertices[:, 2]), atol=1e-12
        )
        ends = tube.vertices[boundary_edges(tube)[nearest, 0]]
        np.testing.assert_allclose(np.abs(ends[:, 2] - tube.vertices[:, 2]), found, atol=1e-12)
    one, _ = pliant.distance_to_set(tube, rims[0])
    assert one.max() == pytest.approx(2.0)


@pytest.mark.parametrize("kind", KINDS)
def test_cells_are_those_of_distances_from_each_source(kind: GraphKind) -> None:
    mesh = crumpled(6, 300)
    sources = np.random.default_rng(1).choice(300, 12, replace=False)
    found, nearest = pliant.distance_to_set(mesh, sources, graph=kind)
    each = GeodesicHierarchy(mesh, kind).distances(sources)
    np.testing.assert_allclose(found, each.min(axis=0), rtol=1e-12)
    np.testing.assert_array_equal(nearest, each.argmin(axis=0))
    near, cells = pliant.distance_to_set(mesh, sources, graph=kind, max_distance=0.1)
    np.testing.assert_array_equal(near, np.where(found <= 0.1, found, np.inf))
    np.testing.assert_array_equal(cells, np.where(found <= 0.1, nearest, -1))


def test_sets_that_are_empty_or_say_a_vertex_twice() -> None:
    mesh = shapes.icosphere(1)
    found, nearest = pliant.distance_to_set(mesh, [])
    assert np.isinf(found).all()
    assert (nearest == -1).all()
    found, nearest = pliant.distance_to_set(mesh, [5, 5])
    assert (nearest == 0).all()
    with pytest.raises(InputError, match="sources: 1 of 2"):
        pliant.distance_to_set(mesh, [0, 999])
    with pytest.raises(InputError, match="max_distance must be 0 or more"):
        pliant.distance_to_set(mesh, [0], max_distance=-1.0)


@pytest.mark.data
def test_on_a_cortical_surface(data: Path) -> None:
    mesh = pliant.load_mesh(data / "cortex" / "slam" / "example_mesh.gii")
    truth = distances(mesh, 0, "refined")
    targets = np.linspace(1000, mesh.n_vertices - 1, 8).astype(int)
    for target, path in zip(targets, pliant.geodesic_paths(mesh, 0, targets, graph="refined"), strict=True):
        assert path.length == pytest.approx(truth[target], rel=1e-9)
        assert path.length > np.linalg.norm(mesh.vertices[target] - mesh.vertices[0])
        assert (path.vertices == -1).any()
