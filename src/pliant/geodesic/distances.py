"""Geodesic distances by the method of one's choice, under one contract: (s, n), inf where nothing leads."""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, vertex_indices
from ..errors import InputError, MeshError, require
from ..mesh import Mesh
from .cuda import Device, on_cuda
from .forest import shortest_path_forest
from .graph import EdgeGraph, GraphKind, as_graph, component_labels, edge_graph
from .hierarchy import GeodesicHierarchy
from .sweeps import checked_limit

DistanceMethod = Literal["graph", "refined", "heat", "exact"]

# Up to so many sources are found one by one before a hierarchy, built once for the mesh, would be.
FEW_SOURCES = 32


def geodesic_distances(
    mesh: Mesh,
    sources: ArrayLike,
    *,
    method: DistanceMethod = "graph",
    max_distance: float | None = None,
    n_jobs: int | None = None,
    progress: bool = False,
    device: Device = "cpu",
) -> FloatArray:
    """Geodesic distances from each source to every vertex.

    Parameters
    ----------
    mesh : Mesh
        Any triangle mesh.
    sources : int or (s,) array_like of int
        Vertex numbers. Each gets a row of its own; :func:`pliant.distance_to_set` takes them as one.
    method : {"graph", "refined", "heat", "exact"}
        ``"graph"``: shortest paths along edges; exact for the graph, about a tenth above the surface distance,
        a fifth or more in the worst directions.
        ``"refined"``: along edges and unfolded diagonals; a few per cent above. ``"heat"``: the heat method of
        Crane et al. 2013 on an intrinsic Delaunay triangulation; smooth, close on good triangles, neither
        bound nor metric on bad ones. ``"exact"``: polyhedral geodesics (Mitchell, Mount and Papadimitriou
        1987); the truth, far slower. The last two need the extra ``geodesics``.
    max_distance : float, optional
        Distances above this are returned as inf.
    n_jobs : int, optional
        Threads, for the first two methods; all processors by default.
    progress : bool
        Show a bar on a terminal.
    device : {"cpu", "cuda"}
        Where to sweep, for the first two methods; the result is the same to the last bit, or to rounding up to 32
        sources. ``"cuda"`` needs the extra ``gpu``.

    Returns
    -------
    (s, n) array of float
        In the mesh's unit; inf where no path leads.

    Raises
    ------
    InputError
        If a source is not a vertex or an option is unknown.
    MeshError
        If the heat method or the exact one cannot work on this mesh.
    MissingExtraError
        If the extra ``geodesics`` or ``gpu`` is needed and not installed.
    UnavailableError
        If there is no such device.

    Notes
    -----
    At 41,000 vertices up to 32 sources take 10 ms each, by SciPy's Dijkstra; more take 0.8 s for a hierarchy and then
    0.2 to 0.3 ms each. For sources that come bit by bit keep a :class:`pliant.GeodesicHierarchy`.

    Examples
    --------
    >>> from pliant import shapes
    >>> sphere = shapes.icosphere(3)
    >>> distances = geodesic_distances(sphere, [0])
    >>> bool(3.14 < distances.max() < 3.7)
    True
    """
    wanted = vertex_indices(sources, mesh.n_vertices, "sources")
    limit = checked_limit(max_distance)
    if method in ("graph", "refined"):
        on_cuda(device)  # rather than after the hierarchy is built
        metric = edge_graph(mesh, "refined" if method == "refined" else "edges")
        if 0 < len(wanted) <= FEW_SOURCES and device == "cpu":
            return np.atleast_2d(sp.csgraph.dijkstra(metric.matrix(), indices=wanted, limit=limit))
        return GeodesicHierarchy(metric).distances(
            wanted, max_distance=max_distance, n_jobs=n_jobs, progress=progress, device=device
        )
    if method not in ("heat", "exact"):
        message = f'method must be "graph", "refined", "heat" or "exact", got {method!r}'
        raise InputError(message)
    if device != "cpu":
        message = f'device={device!r} works for the methods "graph" and "refined" only, not for {method!r}'
        raise InputError(message)
    found = _by_component(mesh, wanted, method)
    found[found > limit] = np.inf
    return found


def distance_to_set(
    mesh: Mesh | EdgeGraph | sp.sparray,
    sources: ArrayLike,
    *,
    graph: GraphKind = "edges",
    max_distance: float | None = None,
) -> tuple[FloatArray, IntArray]:
    """Geodesic distance of every vertex to a set of vertices, and which of them is nearest.

    A curve, a boundary or a region are sets: list their vertices. The vertices with one nearest source are its
    geodesic Voronoi cell, cut along the graph.

    Parameters
    ----------
    mesh : Mesh, EdgeGraph or sparse matrix
        Where to measure.
    sources : int or (s,) array_like of int
        Vertex numbers of the set; none are a set that is infinitely far.
    graph : {"edges", "refined"}
        Where paths run, see :func:`pliant.edge_graph`.
    max_distance : float, optional
        Go no farther than this, which saves the time for the rest.

    Returns
    -------
    distances : (n,) array of float
        In the mesh's unit; inf where no path leads or beyond ``max_distance``.
    nearest : (n,) array of int
        Places in ``sources`` (``sources[nearest]`` are vertices), -1 where the distance is inf. Of sources at one
        distance, to 1e-12 of it, the first listed.

    Raises
    ------
    InputError
        If a source is not a vertex, the kind of graph is unknown, or ``max_distance`` is negative or NaN.

    Notes
    -----
    One run of Dijkstra's algorithm from all sources together (SciPy's), O(n log n) however many they are: 30 ms over
    edges at 41,000 vertices, .23 s over refined paths, most of it for the graph.

    Distances are too long, by as much as :func:`pliant.geodesic_distances` says of its methods ``"graph"`` and
    ``"refined"``; over edges the borders of cells show the grain of the triangulation.

    Examples
    --------
    >>> from pliant import shapes
    >>> from pliant.mesh import boundary_edges
    >>> tube = shapes.cylinder(height=2.0, rows=17, caps=False)
    >>> distances, _ = distance_to_set(tube, boundary_edges(tube)[:, 0])
    >>> round(float(distances.max()), 6)  # half way between the rims
    1.0
    """
    metric = as_graph(mesh, graph)
    wanted = vertex_indices(sources, metric.n_vertices, "sources")
    found = shortest_path_forest(metric, wanted, checked_limit(max_distance))
    return found.distances, found.labels


def _by_component(mesh: Mesh, sources: IntArray, method: Literal["heat", "exact"]) -> FloatArray:
    """Solve on each connected piece by itself: the packages answer differently about the others."""
    labels = component_labels(edge_graph(mesh))[1]
    result = np.full((len(sources), mesh.n_vertices), np.inf)
    for label in np.unique(labels[sources]):
        members = np.flatnonzero(labels == label)
        rows = np.flatnonzero(labels[sources] == label)
        if len(members) == 1:
            result[rows, members[0]] = 0.0
            continue
        new_number = np.full(mesh.n_vertices, -1)
        new_number[members] = np.arange(len(members))
        faces = new_number[mesh.faces[labels[mesh.faces[:, 0]] == label]]
        solve = _heat if method == "heat" else _exact
        result[np.ix_(rows, members)] = solve(mesh.vertices[members], faces, new_number[sources[rows]])
    return result


def _heat(vertices: FloatArray, faces: IntArray, sources: IntArray) -> FloatArray:
    package = require("potpourri3d", "geodesics")
    try:
        solver = package.MeshHeatMethodDistanceSolver(vertices, faces)
        found = np.stack([solver.compute_distance(int(source)) for source in sources])
    except Exception as error:
        message = (
            f"the heat method failed on this mesh ({error}); see pliant.check_up(mesh), or use method='graph'"
        )
        raise MeshError(message) from error
    if not np.isfinite(found).all():
        bad = int((~np.isfinite(found)).sum())
        message = f"the heat method gave {bad} values that are not finite; see pliant.check_up(mesh)"
        raise MeshError(message)
    return found


def _exact(vertices: FloatArray, faces: IntArray, sources: IntArray) -> FloatArray:
    package = require("pygeodesic.geodesic", "geodesics")
    try:
        solver = package.PyGeodesicAlgorithmExact(vertices, faces)
        found = np.stack([solver.geodesicDistances(np.array([source]))[0] for source in sources])
    except Exception as error:
        message = (
            f"exact geodesics failed on this mesh ({error}); see pliant.check_up(mesh), or use method='graph'"
        )
        raise MeshError(message) from error
    found[np.arange(len(sources)), sources] = 0.0
    return np.where(found < 1e30, found, np.inf)
