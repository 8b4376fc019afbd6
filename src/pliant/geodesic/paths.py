"""Shortest paths as polylines on the surface: along edges, or also across pairs of neighbouring triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, IntArray, as_floats, frozen, vertex_indices
from ..errors import InputError
from ..mesh import Mesh
from .forest import Forest, shortest_path_forest
from .graph import EdgeGraph, GraphKind, edge_graph, unfolded_diagonals


@dataclass(frozen=True, eq=False, repr=False)
class GeodesicPath:
    """A path over a surface, from a source to a target; no points at all where no path leads.

    Every point lies on an edge, at a vertex or between two, so a path is carried to another pose of the same mesh,
    and values at vertices to the path, by :meth:`interpolated`.

    Parameters
    ----------
    vertices : (k,) array of int
        Vertex number of each point, source first; -1 where the path crosses an edge between its ends.
    points : (k, 3) array of float
        The polyline, in the mesh's unit. All of it lies on the surface.
    along : (k,) array of float
        Length of the path up to each point.
    edges : (k, 2) array of int
        The ends of the edge that each point lies on; at a vertex, that vertex twice.
    fractions : (k,) array of float
        How far along that edge, from 0 to 1; at a vertex 0.

    Examples
    --------
    >>> from pliant import geodesic_path, shapes
    >>> geodesic_path(shapes.icosphere(2), 0, 3)
    GeodesicPath(0 to 3, 13 points, length 3.31)
    """

    vertices: IntArray
    points: FloatArray
    along: FloatArray
    edges: IntArray
    fractions: FloatArray

    def __post_init__(self) -> None:
        for name in ("vertices", "points", "along", "edges", "fractions"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.vertices)

    def __repr__(self) -> str:
        if not len(self):
            return "GeodesicPath(no path)"
        ends = f"{self.vertices[0]} to {self.vertices[-1]}"
        return f"GeodesicPath({ends}, {len(self)} points, length {self.length:.3g})"

    @property
    def length(self) -> float:
        """Length of the path, in the mesh's unit; inf where no path leads."""
        return float(self.along[-1]) if len(self) else np.inf

    def interpolated(self, values: ArrayLike) -> FloatArray:
        """Values at vertices, (n,) or (n, d), taken to the points of the path, linearly along edges.

        Raises
        ------
        InputError
            If there are fewer values than the path's vertices need.
        """
        given = as_floats(values, "values")
        if given.ndim == 0 or len(given) <= self.edges.max(initial=-1):
            message = f"values must have one row a vertex of the mesh, got shape {given.shape}"
            raise InputError(message)
        share = self.fractions.reshape(-1, *[1] * (given.ndim - 1))
        first = given[self.edges[:, 0]]
        # Not (1 - share) * first + share * second: at vertices values stay what they are, to the last bit.
        return first + share * (given[self.edges[:, 1]] - first)


def geodesic_path(
    mesh: Mesh, source: int, target: int, *, graph: GraphKind | EdgeGraph = "edges"
) -> GeodesicPath:
    """Shortest path between two vertices, as vertices and as a polyline on the surface.

    Parameters
    ----------
    mesh : Mesh
        Any triangle mesh.
    source, target : int
        Vertex numbers.
    graph : {"edges", "refined"} or EdgeGraph
        Where the path may run, see :func:`pliant.edge_graph`. Over ``"refined"`` it also crosses edges, with a
        point where it does. A graph built before from this mesh saves building it again; if its lengths are others
        (small where a sulcus is deep, say), they decide on the path, and its length is still measured on the surface.

    Returns
    -------
    GeodesicPath
        Its length is that of :func:`pliant.geodesic_distances`, to rounding; no points and length inf where no path
        leads.

    Raises
    ------
    InputError
        If a number is not a vertex, the kind of graph is unknown, or a path of the graph leaves the surface.

    Notes
    -----
    Dijkstra's algorithm, O(n log n): 25 ms over edges at 41,000 vertices, and over refined paths .23 s, of which all
    but 40 ms builds the graph. For many targets of one source see :func:`pliant.geodesic_paths`.

    Among paths of one length (to 1e-12 of it) the one of fewest steps is taken, and then, from the target
    backwards, the one of lowest vertices.

    Paths over edges zigzag: they are about a tenth longer than the surface's own (docs/field.md; 7 to 11 % in the
    mean, 20 % in the worst directions) and may run far beside them. Refined paths are 1.5 to 3 % longer. Where the
    course itself matters on a coarse mesh, neither will do: shorten the path by edge flips (potpourri3d has them).

    Examples
    --------
    >>> from pliant import shapes
    >>> sphere = shapes.icosphere(4)
    >>> path = geodesic_path(sphere, 0, 3)  # half way round
    >>> round(path.length, 2), round(geodesic_path(sphere, 0, 3, graph="refined").length, 2)
    (3.32, 3.14)
    >>> heights = path.interpolated(sphere.vertices[:, 2])  # a profile along the path
    """
    ends = vertex_indices(target, mesh.n_vertices, "target")
    if len(ends) != 1:
        message = f"target must be one vertex number, got {len(ends)}; geodesic_paths takes many"
        raise InputError(message)
    return geodesic_paths(mesh, source, ends, graph=graph)[0]


def geodesic_paths(
    mesh: Mesh, source: int, targets: ArrayLike, *, graph: GraphKind | EdgeGraph = "edges"
) -> tuple[GeodesicPath, ...]:
    """Shortest paths from one vertex to many, solved once.

    Parameters
    ----------
    mesh : Mesh
        Any triangle mesh.
    source : int
        Vertex number.
    targets : (t,) array_like of int
        Vertex numbers.
    graph : {"edges", "refined"} or EdgeGraph
        As in :func:`pliant.geodesic_path`.

    Returns
    -------
    tuple of t GeodesicPath
        One a target, in the order given. Paths that part do not meet again: together they are a tree.

    Raises
    ------
    InputError
        If a number is not a vertex, the kind of graph is unknown, or a path of the graph leaves the surface.

    Notes
    -----
    As much as one path, and about .3 ms for each further target at 41,000 vertices.

    Examples
    --------
    >>> from pliant import shapes
    >>> paths = geodesic_paths(shapes.icosphere(2), 0, [3, 0])
    >>> [len(path) for path in paths]
    [13, 1]
    """
    roots = vertex_indices(source, mesh.n_vertices, "source")
    if len(roots) != 1:
        message = f"source must be one vertex number, got {len(roots)}; call once for each"
        raise InputError(message)
    wanted = vertex_indices(targets, mesh.n_vertices, "targets")
    metric = graph if isinstance(graph, EdgeGraph) else edge_graph(mesh, graph)
    if metric.n_vertices != mesh.n_vertices:
        message = f"the graph has {metric.n_vertices} vertices and the mesh {mesh.n_vertices}"
        raise InputError(message)
    forest = shortest_path_forest(metric, roots)
    chains = [_chain(forest, int(target)) for target in wanted]
    crossings = _Crossings(mesh)
    if not isinstance(graph, str) or graph == "refined":
        crossings.find(forest, np.unique(np.concatenate([chain[1:] for chain in chains] + [roots[:0]])))
    return tuple(_on_surface(mesh, chain, crossings) for chain in chains)


def _chain(forest: Forest, target: int) -> IntArray:
    """Vertices from the source to a target; none where no path leads."""
    if forest.labels[target] < 0:
        return np.zeros(0, dtype=np.int64)
    backwards = [target]
    while (before := int(forest.before[backwards[-1]])) >= 0:
        backwards.append(before)
    return np.array(backwards[::-1], dtype=np.int64)


class _Crossings:
    """Where the step that leads to a vertex crosses an edge: the edge's ends, -1 for a step along one, and how far."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.across = np.full((mesh.n_vertices, 2), -1)
        self.fractions = np.zeros(mesh.n_vertices)

    def find(self, forest: Forest, reached: IntArray) -> None:
        """Tell for the steps that lead to some vertices whether each is an edge, or which diagonal it is."""
        if not reached.size:
            return
        n = np.int64(self.mesh.n_vertices)
        before = forest.before[reached]
        part = _around(self.mesh, np.concatenate([reached, before]))
        diagonals = unfolded_diagonals(part)
        ends = np.concatenate([part.edges, np.sort(diagonals.ends, axis=1)])
        lengths = np.concatenate([part.edge_lengths, diagonals.lengths])
        # Stable: of an edge and a diagonal that fit alike the edge comes first, and is taken.
        order = np.argsort(ends[:, 0] * n + ends[:, 1], kind="stable")
        keys = (ends[:, 0] * n + ends[:, 1])[order]
        sought = np.minimum(before, reached) * n + np.maximum(before, reached)
        first, stop = np.searchsorted(keys, sought), np.searchsorted(keys, sought, side="right")
        _refuse_steps_off_surface(before, reached, first == stop)
        chosen = first.copy()
        for i in np.flatnonzero(stop - first > 1):
            misfit = np.abs(lengths[order[first[i] : stop[i]]] - forest.steps[reached[i]])
            chosen[i] += np.argmin(misfit)
        diagonal = order[chosen] - len(part.edges)
        crossing = diagonal >= 0
        self.across[reached[crossing]] = diagonals.across[diagonal[crossing]]
        self.fractions[reached[crossing]] = diagonals.fractions[diagonal[crossing]]


def _around(mesh: Mesh, vertices: IntArray) -> Mesh:
    """Keep the faces at some vertices and the faces that touch these: all that decides on diagonals between them."""
    near = np.zeros(mesh.n_vertices, dtype=bool)
    near[vertices] = True
    for _ in range(2):
        faces = mesh.faces[near[mesh.faces].any(axis=1)]
        near[faces] = True
    return Mesh(mesh.vertices, faces)


def _refuse_steps_off_surface(before: IntArray, reached: IntArray, missing: BoolArray) -> None:
    bad = np.flatnonzero(missing)
    if bad.size:
        steps = ", ".join(f"{before[i]} to {reached[i]}" for i in bad[:5])
        message = (
            f"{bad.size} steps of the graph's paths are neither edges of the mesh nor diagonals across one, first "
            f"{steps}; give a graph of this mesh's edges, or graph='refined'"
        )
        raise InputError(message)


def _on_surface(mesh: Mesh, chain: IntArray, crossings: _Crossings) -> GeodesicPath:
    crossed = np.flatnonzero(crossings.across[chain[1:], 0] >= 0)
    leading_to = chain[1:][crossed]
    edges = np.insert(np.column_stack([chain, chain]), crossed + 1, crossings.across[leading_to], axis=0)
    fractions = np.insert(np.zeros(len(chain)), crossed + 1, crossings.fractions[leading_to])
    first = mesh.vertices[edges[:, 0]]
    points = first + fractions[:, None] * (mesh.vertices[edges[:, 1]] - first)
    pieces = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return GeodesicPath(
        vertices=np.insert(chain, crossed + 1, -1),
        points=points,
        along=np.concatenate([[0.0], np.cumsum(pieces)])[: len(points)],
        edges=edges,
        fractions=fractions,
    )
