"""The geodesic engine against NetworKit, igraph and SciPy: exact betweenness, and many-source distances.

Every figure is taken in a process of its own, on the same graph, after a warm-up on a small one, from edges and lengths
in memory to the result: for Pliant that includes ordering and customisation, for the others the building of their
graph. Peers run with all cores where they can. Where all sources would take a peer over a minute, it gets a sample
of them, and its time is scaled to all; such rows say so.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .. import mesh as meshes
from .._arrays import FloatArray, IntArray
from ..geodesic import EdgeGraph, GeodesicHierarchy, edge_graph
from .harness import Row, measured, peak_megabytes

SUBDIVISIONS = (4, 5, 6, 7)
PEERS = ("numpy", "scipy", "numba", "networkit", "igraph")
# Sources a peer is given where all would take more than about a minute.
SAMPLED = {"networkit": 20_000, "igraph": 5_000, "scipy": 20_000}
SAMPLE = 256
# Distances from all vertices come in blocks of sources, as the whole matrix would not fit; each is as small as its
# engine likes it, and a few columns are summed as proof of work.
BLOCK = 64
COLUMNS = slice(None, None, 61)


def run(
    *, subdivisions: tuple[int, ...] = SUBDIVISIONS, repeats: int = 3, distances: bool = True
) -> Iterator[Row]:
    """Measure, smallest mesh first, yielding a row as soon as it is known.

    Parameters
    ----------
    subdivisions : tuple of int
        Of the bumpy sphere: 4, 5, 6, 7 have 2,562, 10,242, 40,962 and 163,842 vertices.
    repeats : int
        Runs of each measurement; the largest mesh gets one.
    distances : bool
        Also measure distances from all vertices.

    Yields
    ------
    dict
        Keys ``what``, ``engine``, ``n``, ``seconds`` (for all sources), ``sampled`` (sources run, or None),
        ``ms_per_source``, ``peak_mb``, ``ratio`` (its time over Pliant's), ``checksum``.
    """
    tasks = {"betweenness": ("pliant", "networkit", "igraph")}
    if distances:
        tasks["distances"] = ("pliant", "networkit", "scipy")
    for level in subdivisions:
        for what, engines in tasks.items():
            ours: float | None = None
            for engine in engines:
                row = _measure(what, engine, level, repeats if level < 7 else 1)
                if "skipped" not in row:
                    ours = row["seconds"] if engine == "pliant" else ours
                    row["ratio"] = row["seconds"] / ours if ours else None
                yield row


def _measure(what: str, engine: str, level: int, repeats: int) -> Row:
    n = 10 * 4**level + 2
    sampled = SAMPLE if n > SAMPLED.get(engine, n) else None
    row = measured(__name__, f"{what}:{engine}", {"level": level, "sampled": sampled}, repeats=repeats)
    row.update(what=what, engine=engine, n=n, sampled=sampled)
    if "seconds" in row:
        row["ms_per_source"] = 1e3 * row["seconds"] / (sampled or n)
        # Building a graph is not repeated for every source: only what grows with sources is scaled.
        if sampled:
            row["seconds"] = row["seconds_fixed"] + (row["seconds"] - row["seconds_fixed"]) * n / sampled
    return row


def _pliant_betweenness(graph: EdgeGraph, sources: IntArray | None) -> tuple[float, FloatArray]:
    return 0.0, GeodesicHierarchy(graph).betweenness(sources=sources)


def _pliant_distances(graph: EdgeGraph, sources: IntArray | None) -> tuple[float, FloatArray]:
    total = np.zeros(graph.n_vertices)[COLUMNS]
    for _, found in GeodesicHierarchy(graph).blocks(sources, size=BLOCK):
        total += found[:, COLUMNS].sum(axis=0)
    return 0.0, total


def _networkit_graph(graph: EdgeGraph) -> Any:
    import networkit

    other = networkit.Graph(graph.n_vertices, weighted=True)
    ends = np.ascontiguousarray(graph.edges.T.astype(np.uint64))
    other.addEdges((graph.lengths.copy(), (ends[0].copy(), ends[1].copy())))
    return other


def _networkit_betweenness(graph: EdgeGraph, sources: IntArray | None) -> tuple[float, FloatArray]:
    import networkit

    start = time.perf_counter()
    other = _networkit_graph(graph)
    fixed = time.perf_counter() - start
    if sources is None:
        scores = networkit.centrality.Betweenness(other).run().scores()
    else:
        scores = networkit.centrality.EstimateBetweenness(other, len(sources), False, True).run().scores()
    return fixed, np.array(scores)


def _networkit_distances(graph: EdgeGraph, sources: IntArray | None) -> tuple[float, FloatArray]:
    import networkit

    start = time.perf_counter()
    other = _networkit_graph(graph)
    fixed = time.perf_counter() - start
    wanted = np.arange(graph.n_vertices) if sources is None else sources
    total = np.zeros(graph.n_vertices)[COLUMNS]
    for begin in range(0, len(wanted), BLOCK):
        solver = networkit.distance.SPSP(other, wanted[begin : begin + BLOCK].tolist())
        total += np.array(solver.run().getDistances(asarray=True))[:, COLUMNS].sum(axis=0)
    return fixed, total


def _igraph_betweenness(graph: EdgeGraph, sources: IntArray | None) -> tuple[float, FloatArray]:
    import igraph

    start = time.perf_counter()
    other = igraph.Graph(n=graph.n_vertices, edges=graph.edges.tolist())
    weights = graph.lengths.tolist()
    fixed = time.perf_counter() - start
    chosen = None if sources is None else sources.tolist()
    return fixed, np.array(other.betweenness(weights=weights, sources=chosen))


def _scipy_distances(graph: EdgeGraph, sources: IntArray | None) -> tuple[float, FloatArray]:
    from scipy.sparse.csgraph import dijkstra

    matrix = graph.matrix()
    wanted = np.arange(graph.n_vertices) if sources is None else sources
    total = np.zeros(graph.n_vertices)[COLUMNS]
    for begin in range(0, len(wanted), BLOCK):
        found = dijkstra(matrix, directed=False, indices=wanted[begin : begin + BLOCK])
        total += found[:, COLUMNS].sum(axis=0)
    return 0.0, total


TASKS: dict[str, Callable[[EdgeGraph, IntArray | None], tuple[float, FloatArray]]] = {
    "betweenness:pliant": _pliant_betweenness,
    "betweenness:networkit": _networkit_betweenness,
    "betweenness:igraph": _igraph_betweenness,
    "distances:pliant": _pliant_distances,
    "distances:networkit": _networkit_distances,
    "distances:scipy": _scipy_distances,
}


def _graph(level: int) -> EdgeGraph:
    return edge_graph(meshes.shapes.bumpy_sphere(level, rng=0))


def _one(task: str, settings: Row) -> Row:
    """Measure one task in this process."""
    solve = TASKS[task]
    try:
        solve(_graph(2), None)
    except ImportError as error:
        return {"skipped": f"{error.name} is not installed"}
    graph = _graph(settings["level"])
    count = settings["sampled"]
    sources: IntArray | None = None
    if count is not None:
        sources = np.random.default_rng(0).choice(np.arange(graph.n_vertices), count, replace=False)
    start = time.perf_counter()
    fixed, result = solve(graph, sources)
    seconds = time.perf_counter() - start
    return {
        "seconds": seconds,
        "seconds_fixed": fixed,
        "peak_mb": peak_megabytes(),
        "checksum": float(result.sum()),
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_one(sys.argv[1], json.loads(sys.argv[2]))) + "\n")
