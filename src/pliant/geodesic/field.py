"""The geodesic field estimate: how likely a shortest path between two random points passes here (section 2.3)."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Literal, TypedDict

import numpy as np
from scipy import stats

from .._arrays import FloatArray, IntArray, frozen
from ..cluster import Scheduler
from ..errors import InputError, MeshError, PliantWarning, first_indices
from ..mesh import Mesh
from .cuda import Device
from .graph import GraphKind, edge_graph
from .hierarchy import GeodesicHierarchy

Weights = Literal["area", "uniform"]


class Where(TypedDict):
    """Who computes, and whether a bar shows it."""

    n_jobs: int | None
    progress: bool
    device: Device
    scheduler: Scheduler | None


# Sampled sources are dealt into this many groups; their spread gives the half-widths.
GROUPS = 16


@dataclass(frozen=True, eq=False)
class FieldEstimate:
    """A sampled field and how far to trust it.

    Parameters
    ----------
    values : (n,) array of float
        Unbiased estimate of :func:`pliant.gfe`, never negative.
    half_widths : (n,) array of float
        Half-width of the confidence interval of each value by itself (not of all values together).
    confidence : float
        The intervals' nominal coverage.
    samples : (k,) array of int
        The sources that were drawn.
    """

    values: FloatArray
    half_widths: FloatArray
    confidence: float
    samples: IntArray

    def __post_init__(self) -> None:
        for name in ("values", "half_widths", "samples"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def gfe(
    mesh: Mesh,
    *,
    weights: Weights = "area",
    graph: GraphKind = "edges",
    hierarchy: GeodesicHierarchy | None = None,
    n_jobs: int | None = None,
    progress: bool = False,
    device: Device = "cpu",
    scheduler: Scheduler | None = None,
) -> FloatArray:
    """Geodesic field estimate: the probability that a shortest path between two random points passes a vertex.

    All pairs of vertices are taken; nothing is sampled.

    Parameters
    ----------
    mesh : Mesh
        Any triangle mesh whose edges have a length.
    weights : {"area", "uniform"}
        ``"area"``: the two points are drawn by surface area, and the probability is given per unit area, as
        section 2.3.1 asks; in 1 / unit². ``"uniform"``: every pair of vertices counts alike, and the result is the
        betweenness centrality normalised by the (n - 1)(n - 2) / 2 pairs of other vertices, a probability.
    graph : {"edges", "refined"}
        Where paths run, see :func:`pliant.edge_graph`.
    hierarchy : GeodesicHierarchy, optional
        One built before from this mesh and kind of graph.
    n_jobs : int, optional
        Threads; all processors by default. The result does not depend on it.
    progress : bool
        Show a bar on a terminal.
    device : {"cpu", "cuda"}
        Where to sweep; ``"cuda"`` needs the extra ``gpu`` and gives the same to rounding. See docs/scaling.md.
    scheduler : str or distributed.Client, optional
        Of a Dask cluster whose workers sweep instead of threads, to the same bytes.

    Returns
    -------
    (n,) array of float

    Raises
    ------
    MeshError
        If an edge has no length, or (by area) a vertex with edges has no area around it.
    UnavailableError
        If there is no such device or cluster.

    Warns
    -----
    PliantWarning
        If the mesh is in several pieces: pairs in different pieces have no path and count as passing nowhere.

    Notes
    -----
    Ties between paths are shared equally. Paths follow edges, so on a regular triangulation the field shows the
    pattern of the triangulation; irregular meshes, and ``graph="refined"``, show the surface. Cost grows a
    little faster than n²: on two cores about 0.8 s at 10,000 vertices, 6 s at 40,000, half a minute at 150,000.

    References
    ----------
    Mukhopadhyay, Geometric Analysis of Shapes, 2014, section 2.3; Brandes 2001.

    Examples
    --------
    >>> from pliant import shapes
    >>> field = gfe(shapes.icosphere(1), weights="uniform")
    >>> bool(field.min() > 0)
    True
    """
    solver = _solver(mesh, graph, hierarchy)
    forth = _point_weights(mesh, weights)
    where: Where = {"n_jobs": n_jobs, "progress": progress, "device": device, "scheduler": scheduler}
    flow = solver.betweenness(forth, forth, **where)
    return flow * _scale(mesh, weights)


def estimate_gfe(
    mesh: Mesh,
    samples: int,
    *,
    confidence: float = 0.95,
    weights: Weights = "area",
    graph: GraphKind = "edges",
    hierarchy: GeodesicHierarchy | None = None,
    rng: np.random.Generator | int | None = None,
    n_jobs: int | None = None,
    progress: bool = False,
    device: Device = "cpu",
    scheduler: Scheduler | None = None,
) -> FieldEstimate:
    """Estimate the field from paths out of randomly drawn vertices, with a confidence half-width for each value.

    Parameters
    ----------
    mesh : Mesh
        Any triangle mesh whose edges have a length.
    samples : int
        How many sources to draw, rounded up to a multiple of 16; at least 32 or, on smaller meshes, all vertices.
    confidence : float
        Nominal coverage of each interval, between 0 and 1.
    weights, graph, hierarchy, n_jobs, progress, device, scheduler
        As in :func:`pliant.gfe`.
    rng : numpy.random.Generator or int, optional
        Source of chance; the same seed gives the same bytes.

    Returns
    -------
    FieldEstimate
        With ``samples`` equal to the number of vertices it is exact and the half-widths are 0.

    Raises
    ------
    InputError
        If ``samples`` or ``confidence`` is out of range.
    MeshError
        As in :func:`pliant.gfe`.

    Notes
    -----
    Unbiased: sources are drawn at random within strata that cover the surface evenly, all targets are taken, and
    paths count by how far their source is, which keeps the variance low (see
    :meth:`GeodesicHierarchy.sampled_betweenness`). The half-width is Student's, from the spread of 16 independent
    groups of sources, corrected for the finite number of vertices. Where traffic is rare the distribution is
    skewed, and with few samples intervals cover less often than they say: docs/field.md has measured shares.

    References
    ----------
    Geisberger, Sanders and Schultes, Better approximation of betweenness centrality, 2008.

    Examples
    --------
    >>> from pliant import shapes
    >>> estimate = estimate_gfe(shapes.icosphere(3), 64, rng=0)
    >>> estimate.values.shape
    (642,)
    """
    n = mesh.n_vertices
    least = min(n, 2 * GROUPS)
    if not least <= samples <= n:
        message = f"samples must be between {least} and the number of vertices, {n}; got {samples}"
        raise InputError(message)
    if not 0 < confidence < 1:
        message = f"confidence must lie between 0 and 1, got {confidence}"
        raise InputError(message)
    solver = _solver(mesh, graph, hierarchy)
    where: Where = {"n_jobs": n_jobs, "progress": progress, "device": device, "scheduler": scheduler}
    back = _point_weights(mesh, weights)
    scale = _scale(mesh, weights)
    n_strata = -(-samples // GROUPS)
    if n_strata * GROUPS >= n:
        exact = solver.betweenness(back, back, **where)
        return FieldEstimate(exact * scale, np.zeros(n), confidence, np.arange(n))
    groups, stands_for = _stratified(solver.order, n_strata, np.random.default_rng(rng))
    found = solver.sampled_betweenness(list(groups), back, stands_for, **where)
    estimates = found * scale
    missing = 1 - n_strata * GROUPS / n
    error = np.sqrt(estimates.var(axis=0, ddof=1) / GROUPS * missing)
    half = stats.t.ppf(0.5 + confidence / 2, GROUPS - 1) * error
    return FieldEstimate(estimates.mean(axis=0), half, confidence, np.sort(groups.ravel()))


def _stratified(order: IntArray, n_strata: int, rng: np.random.Generator) -> tuple[IntArray, FloatArray]:
    """Draw one source a stratum for each group; a source stands for as many vertices as its stratum has.

    Strata are runs of the elimination order, which keeps neighbours together, so that every group covers the surface.
    """
    strata = np.array_split(order, n_strata)
    groups = np.stack([rng.choice(stratum, GROUPS, replace=False) for stratum in strata], axis=1)
    stands_for = np.empty(len(order))
    for stratum in strata:
        stands_for[stratum] = len(stratum)
    return groups, stands_for


def _solver(mesh: Mesh, graph: GraphKind, hierarchy: GeodesicHierarchy | None) -> GeodesicHierarchy:
    metric = edge_graph(mesh, graph)
    solver = GeodesicHierarchy(metric) if hierarchy is None else hierarchy
    own = solver.graph
    # Poses of one shape share their faces: lengths tell them apart.
    if not (np.array_equal(own.edges, metric.edges) and np.array_equal(own.lengths, metric.lengths)):
        message = (
            f"the hierarchy ({own.n_vertices} vertices, {own.n_edges} edges) is not of this mesh and graph={graph!r} "
            f"({metric.n_vertices} vertices, {metric.n_edges} edges)"
        )
        raise InputError(message)
    pieces = int(solver.components.max()) + 1
    if pieces > 1:
        message = (
            f"the mesh is in {pieces} pieces; no path joins them and such pairs pass nowhere "
            "(pliant.largest_component keeps the largest)"
        )
        warnings.warn(message, PliantWarning, stacklevel=3)
    return solver


def _point_weights(mesh: Mesh, weights: Weights) -> FloatArray:
    if weights == "uniform":
        return np.ones(mesh.n_vertices)
    if weights != "area":
        message = f'weights must be "area" or "uniform", got {weights!r}'
        raise InputError(message)
    areas = mesh.vertex_areas
    bad = np.flatnonzero((areas <= 0) & (np.bincount(mesh.edges.ravel(), minlength=mesh.n_vertices) > 0))
    if bad.size:
        message = (
            f"{bad.size} vertices have faces but no area around them, first {first_indices(bad)}; drop degenerate "
            'faces first, or use weights="uniform"'
        )
        raise MeshError(message)
    return areas / max(mesh.area, np.finfo(float).tiny)


def _scale(mesh: Mesh, weights: Weights) -> FloatArray:
    """From half the sum over ordered pairs to the field."""
    n = mesh.n_vertices
    if weights == "uniform":
        return np.full(n, 2.0 / max((n - 1) * (n - 2), 1))
    areas = mesh.vertex_areas
    # A vertex of no face has no area, and no path passes it.
    scale: FloatArray = np.divide(2.0, areas, out=np.zeros(n), where=areas > 0)
    return scale
