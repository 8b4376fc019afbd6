"""The CUDA engine against the CPU engine and serial shortest paths: the rows of Fig. 2.10, beside the printed ones.

Distances between all pairs of vertices, whole calls from edges and lengths in memory, after a warm-up on a small mesh.
SciPy's Dijkstra from every vertex is the serial reference (Fig. 2.4(a): Johnson's algorithm, which on lengths that
are not negative is just that); where all sources would take it over a minute it gets a sample, and its time is
scaled. Where there is no device its cells are empty, with the reason.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from .. import mesh as meshes
from .._arrays import IntArray
from ..errors import MissingExtraError, UnavailableError
from ..geodesic import EdgeGraph, GeodesicHierarchy, edge_graph
from ..geodesic.cuda import fixed_point_distances, on_cuda
from ..mesh import Mesh, load_mesh
from .harness import Row

__all__ = ["PRINTED", "run"]

# Times over Boost's Johnson on an i5-2400, with a GTX 480: Fig. 2.10 on shapes of SHREC 2010, and section 2.7.
PRINTED = {"horse, dog, human (Fig. 2.10)": "24 to 31", "cortical surfaces (section 2.7)": "14"}
ENGINES = ("johnson", "cpu", "cuda sweeps", "cuda propagate", "cpu field", "cuda field")
# Sources at once, as the whole matrix of a large mesh does not fit; and sources the serial reference gets.
BLOCK = 4096
SAMPLE = 256


def run(paths: tuple[Path, ...] = (), *, levels: tuple[int, ...] = (5, 6)) -> Iterator[Row]:
    """Measure every engine on every mesh, yielding a row as soon as it is known.

    Parameters
    ----------
    paths : tuple of Path
        Mesh files: the dissertation's are horse, dog and human of 30 to 50 thousand vertices.
    levels : tuple of int
        Subdivisions of bumpy spheres to measure as well: 5, 6 have 10,242 and 40,962 vertices.

    Yields
    ------
    dict
        Keys ``mesh``, ``n``, ``engine``, ``seconds`` (all sources), ``sampled`` (sources run, or None), ``ratio``
        (the serial reference's seconds over its own; None for fields), and ``skipped``, a reason in place of
        figures.
    """
    reason = _no_device()
    named = [(path.name, load_mesh(path)) for path in paths]
    named += [(f"bumpy sphere {level}", meshes.shapes.bumpy_sphere(level, rng=0)) for level in levels]
    for name, mesh in named:
        serial: float | None = None
        for engine in ENGINES:
            row: Row = {
                "mesh": name,
                "n": mesh.n_vertices,
                "engine": engine,
                "seconds": None,
                "sampled": None,
            }
            if engine.startswith("cuda") and reason:
                yield {**row, "ratio": None, "skipped": reason}
                continue
            row |= _measured(engine, mesh)
            serial = row["seconds"] if engine == "johnson" else serial
            compared = serial if not engine.endswith("field") else None
            yield {**row, "ratio": compared / row["seconds"] if compared else None, "skipped": None}


def _no_device() -> str | None:
    try:
        on_cuda("cuda")
    except (MissingExtraError, UnavailableError) as error:
        return str(error)
    return None


def _measured(engine: str, mesh: Mesh) -> Row:
    solve = SOLVERS[engine]
    graph = edge_graph(mesh)
    small = edge_graph(meshes.shapes.bumpy_sphere(2, rng=0))
    solve(small, np.arange(small.n_vertices))
    n = graph.n_vertices
    sources = np.arange(n)
    sampled = engine == "johnson" and n > 5_000
    if sampled:
        sources = np.sort(np.random.default_rng(0).choice(n, SAMPLE, replace=False))
    start = time.perf_counter()
    solve(graph, sources)
    seconds = time.perf_counter() - start
    return {"seconds": seconds * n / len(sources), "sampled": len(sources) if sampled else None}


def _johnson(graph: EdgeGraph, sources: IntArray) -> None:
    from scipy.sparse.csgraph import dijkstra

    matrix = graph.matrix()
    for start in range(0, len(sources), 64):
        dijkstra(matrix, directed=False, indices=sources[start : start + 64])


def _cpu(graph: EdgeGraph, sources: IntArray) -> None:
    for _ in GeodesicHierarchy(graph).blocks(sources):
        pass


def _sweeps(graph: EdgeGraph, sources: IntArray) -> None:
    solver = GeodesicHierarchy(graph)
    for start in range(0, len(sources), BLOCK):
        solver.distances(sources[start : start + BLOCK], device="cuda")


def _propagate(graph: EdgeGraph, sources: IntArray) -> None:
    solver = GeodesicHierarchy(graph)
    for start in range(0, len(sources), BLOCK):
        fixed_point_distances(solver, sources[start : start + BLOCK], method="propagate")


def _cpu_field(graph: EdgeGraph, sources: IntArray) -> None:
    GeodesicHierarchy(graph).betweenness()


def _cuda_field(graph: EdgeGraph, sources: IntArray) -> None:
    GeodesicHierarchy(graph).betweenness(device="cuda")


SOLVERS: dict[str, Callable[[EdgeGraph, IntArray], None]] = {
    "johnson": _johnson,
    "cpu": _cpu,
    "cuda sweeps": _sweeps,
    "cuda propagate": _propagate,
    "cpu field": _cpu_field,
    "cuda field": _cuda_field,
}
