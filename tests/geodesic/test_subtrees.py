"""Customisation by several threads: the arcs are right, and no cut of the tree changes a byte."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra

from pliant import shapes
from pliant.geodesic import EdgeGraph, GeodesicHierarchy
from pliant.geodesic.customise import counted_arcs, fixed_point_lengths, metric_arcs, unpack
from pliant.geodesic.elimination import eliminate
from pliant.geodesic.engines import PARTS, RUNS, _runs
from pliant.geodesic.subtrees import Subtrees, arcs_by_head


@st.composite
def graphs(draw: st.DrawFn) -> EdgeGraph:
    n = draw(st.integers(1, 40))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    edges = rng.integers(0, n, (draw(st.integers(0, 3 * n)), 2))
    return EdgeGraph(n, edges, rng.integers(1, 4, len(edges)).astype(float))


@given(graphs(), st.integers(2, 9))
@settings(max_examples=60, deadline=None)
def test_every_rank_is_in_one_part_and_below_its_ancestors(graph: EdgeGraph, threads: int) -> None:
    skeleton = eliminate(graph)
    plan = Subtrees(skeleton, threads)
    ranks = np.concatenate([plan.above, *plan.below])
    np.testing.assert_array_equal(np.sort(ranks), np.arange(graph.n_vertices))
    part = np.empty(graph.n_vertices, int)
    for i, members in enumerate([plan.above, *plan.below]):
        part[members] = i
    tails = np.repeat(np.arange(graph.n_vertices), np.diff(skeleton.rows))
    ends = part[skeleton.heads]
    assert ((ends == part[tails]) | (ends == 0)).all()


@given(graphs(), st.integers(2, 9))
@settings(max_examples=60, deadline=None)
def test_threads_change_nothing(graph: EdgeGraph, threads: int) -> None:
    skeleton = eliminate(graph)
    fixed = fixed_point_lengths(graph, GeodesicHierarchy(graph).components)
    one, many = (counted_arcs(skeleton, graph, fixed, n_jobs=n) for n in (1, threads))
    for name in ("rows", "heads", "lengths", "counts", "edge", "edge_share"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))
    flow = np.random.default_rng(0).random(len(one.heads))
    flows = (flow.copy(), flow.copy())
    for arcs, carried in zip((one, many), flows, strict=True):
        unpack(carried, arcs.counts, arcs.whole, arcs.first, arcs.second)
    np.testing.assert_array_equal(*flows)
    np.testing.assert_array_equal(
        metric_arcs(skeleton, graph, 1).lengths, metric_arcs(skeleton, graph, threads).lengths
    )


@pytest.mark.parametrize("threads", [1, 3])
def test_kept_arcs_are_as_long_as_the_shortest_path_between_their_ends(threads: int) -> None:
    graph = GeodesicHierarchy(shapes.bumpy_sphere(3, rng=0)).graph
    skeleton = eliminate(graph)
    arcs = metric_arcs(skeleton, graph, threads)
    true = dijkstra(graph.matrix(), directed=False)[np.ix_(skeleton.order, skeleton.order)]
    tails = np.repeat(np.arange(graph.n_vertices), np.diff(arcs.rows))
    np.testing.assert_allclose(arcs.lengths, true[tails, arcs.heads], rtol=1e-12)


def test_several_threads_share_a_mesh_of_some_size() -> None:
    plan = Subtrees(eliminate(GeodesicHierarchy(shapes.icosphere(4)).graph), 2)
    sizes = [len(part) for part in plan.below]
    assert len(sizes) >= 2
    assert sum(sizes) > 2000


def test_arcs_by_head_are_those_of_the_rows() -> None:
    skeleton = eliminate(GeodesicHierarchy(shapes.grid(5, 6)).graph)
    start, arcs, tails = arcs_by_head(skeleton.rows, skeleton.heads)
    heads = np.repeat(np.arange(len(skeleton.parent)), np.diff(start))
    np.testing.assert_array_equal(skeleton.heads[arcs], heads)
    np.testing.assert_array_equal(np.searchsorted(skeleton.rows, arcs, side="right") - 1, tails)


@pytest.mark.parametrize("count", [0, 1, 3, 31, 32, 33, 640])
def test_runs_hold_every_batch_once_and_cost_the_same(count: int) -> None:
    lanes = [np.array([i]) for i in range(count)]
    runs = _runs(lanes)
    found = sorted(int(lane[0]) for run in runs for part in run for lane in part)
    assert found == list(range(count))
    if count >= 10 * PARTS:
        cost = [sum(count - int(lane[0]) for part in run for lane in part) for run in runs]
        assert len(runs) == RUNS
        assert max(cost) < 1.02 * min(cost)


def test_no_sources_make_no_traffic() -> None:
    assert not GeodesicHierarchy(shapes.icosphere(3)).betweenness(sources=[]).any()
