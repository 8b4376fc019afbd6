"""Figure 2.10: all pairs of shortest paths, against Johnson's algorithm."""

from __future__ import annotations

import time

import numpy as np
from scipy.sparse import csgraph

from ..geodesic import EdgeGraph, GeodesicHierarchy, edge_graph
from ..mesh import Mesh, load_mesh, shapes
from .bench import Bench
from .findings import Experiment, Findings, Row, row_of

SHAPES = ("horse0", "dog0", "victoria0")


def _run(bench: Bench) -> Findings:
    meshes, said = _meshes(bench)
    rows: list[Row] = []
    ratios = []
    for name, mesh in meshes.items():
        found = [_ratio(edge_graph(mesh), 64 if bench.quick else 256, bench.seed + i) for i in range(3)]
        ratios.append(np.median(found))
        rows.append(row_of(f"{name}, {mesh.n_vertices} vertices: times Johnson's algorithm", 24.0, found))
    rows.append(Row("the dissertation's kernel on this machine's device", 31.0, None, note=_device()))
    least = min(ratios)
    span = f"{least:.1f}" if len(ratios) == 1 else f"{least:.1f} to {max(ratios):.1f}"
    return Findings(
        "holds" if least >= 24 else "holds partly" if least >= 2 else "does not hold",
        f"Without a graphics card, one thread against one, the hierarchy is {span} times as fast "
        "as SciPy's Johnson (one Dijkstra a source), and exact. The printed 24 to 31 compare a GTX 480 with Boost on "
        "an i5-2400.",
        f"{said} Processor times per source, of one thread: the hierarchy's over {64 * 16} sources without "
        f"its set-up, which all "
        "sources share, Johnson's over the same number of sources drawn at random. Intervals over three "
        "runs.",
        tuple(rows),
        {"printed range": "24 to 31", "sources timed by Johnson": 64 if bench.quick else 256},
    )


def _meshes(bench: Bench) -> tuple[dict[str, Mesh], str]:
    folder = bench.path("shapes/tosca")
    if folder is None:
        mesh = shapes.quadruped(10_000 if bench.quick else 20_000).mesh
        return {"quadruped": mesh}, "A synthetic quadruped stands in for SHREC 2010's horse, dog and human."
    names = SHAPES[:1] if bench.quick else SHAPES
    return {
        name: load_mesh(folder / f"{name}.ply") for name in names
    }, "TOSCA's shapes, SHREC 2010's null shapes."


def _ratio(graph: EdgeGraph, count: int, seed: int) -> float:
    """How many times as long Johnson's algorithm takes for a source, after checking that both agree."""
    n = graph.n_vertices
    hierarchy = GeodesicHierarchy(graph)
    drawn = np.random.default_rng(seed).choice(n, 64 * 16, replace=False)
    hierarchy.distances(drawn[:64], n_jobs=1)
    start = time.process_time()
    ours = hierarchy.distances(drawn, n_jobs=1)
    fast = (time.process_time() - start) / len(drawn)
    start = time.process_time()
    theirs = csgraph.dijkstra(graph.matrix(), directed=False, indices=drawn[:count])
    slow = (time.process_time() - start) / count
    if not np.allclose(ours[:count], theirs, rtol=1e-5):
        raise ArithmeticError("the hierarchy and Johnson's algorithm disagree about distances")
    return slow / fast


def _device() -> str:
    return "not measured: no CUDA device on this machine"


EXPERIMENT = Experiment(
    "figure-2.10",
    "All pairs of shortest paths against Johnson's algorithm",
    "A parallel kernel is 24 to 31 times as fast as Johnson's algorithm on one processor.",
    "Pliant's engine is at least 24 times as fast as SciPy's Johnson on every shape; in part from twice.",
    _run,
    uses=("shapes/tosca",),
)
