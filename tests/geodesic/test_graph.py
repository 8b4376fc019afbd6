"""Edge graphs: what is kept, what is refined, and how much closer refined paths come to the surface."""

from __future__ import annotations

import numpy as np
import pytest

import pliant
from pliant import EdgeGraph, Mesh, edge_graph


def test_parallel_edges_and_loops() -> None:
    graph = EdgeGraph(3, [[1, 0], [0, 1], [2, 2], [1, 2]], [3.0, 2.0, 1.0, 5.0])
    assert graph.edges.tolist() == [[0, 1], [1, 2]]
    assert graph.lengths.tolist() == [2.0, 5.0]


def test_a_graph_owns_its_arrays() -> None:
    edges, lengths = np.array([[0, 1], [0, 2], [1, 2]]), np.array([1.0, 2.0, 3.0])
    seen = lengths.view()
    seen.flags.writeable = False
    graph = EdgeGraph(3, edges, seen)
    edges[0], lengths[0] = (1, 2), 9.0
    assert graph.edges.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert graph.lengths.tolist() == [1.0, 2.0, 3.0]


def test_a_diagonal_is_as_long_as_the_unfolded_pair_is_wide() -> None:
    # Two right triangles of a unit square, folded along the diagonal they share by 90 degrees.
    half = np.sqrt(0.5)
    folded = Mesh([[0, 0, 0], [half, half, 0], [2 * half, 0, 0], [half, 0, half]], [[0, 2, 1], [0, 3, 2]])
    graph = edge_graph(folded, "refined")
    added = {tuple(e): length for e, length in zip(graph.edges.tolist(), graph.lengths, strict=True)}
    assert added[1, 3] == pytest.approx(2 * half)
    assert graph.n_edges == 6


def test_no_diagonal_leaves_its_pair_of_triangles() -> None:
    # The straight line between the far corners would pass outside the shared edge.
    slanted = Mesh([[0, 0, 0], [1, 0, 0], [3, 1, 0], [3, -1, 0]], [[0, 1, 2], [1, 0, 3]])
    assert edge_graph(slanted, "refined").n_edges == edge_graph(slanted).n_edges


def test_refined_paths_lie_between_surface_and_edges() -> None:
    mesh = pliant.shapes.icosphere(4)
    pole = [0, 77]
    exact = np.arccos(np.clip(mesh.vertices[pole] @ mesh.vertices.T, -1, 1))
    away = exact > 0.3
    edges = pliant.geodesic_distances(mesh, pole)
    refined = pliant.geodesic_distances(mesh, pole, method="refined")
    assert (refined <= edges + 1e-12).all()
    assert (refined[away] / exact[away]).min() > 0.99
    assert (refined[away] / exact[away]).mean() < (edges[away] / exact[away]).mean() - 0.03


def test_unknown_kind() -> None:
    with pytest.raises(pliant.InputError, match='"edges" or "refined"'):
        edge_graph(pliant.shapes.icosphere(1), "fine")  # type: ignore[arg-type]


def test_what_is_no_graph() -> None:
    with pytest.raises(pliant.InputError, match="expected a Mesh"):
        pliant.GeodesicHierarchy("mesh.ply")  # type: ignore[arg-type]
