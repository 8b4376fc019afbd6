"""The weighted graph on which shortest paths are sought: a mesh's edges, or a refinement of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, IntArray, as_floats, as_indices, frozen
from ..errors import InputError, first_indices
from ..mesh import Mesh

GraphKind = Literal["edges", "refined"]


@dataclass(frozen=True, eq=False, repr=False)
class EdgeGraph:
    """An undirected graph with a length on every edge.

    Self-loops are dropped; of parallel edges the shortest is kept. Neither changes a shortest path.

    Parameters
    ----------
    n_vertices : int
        Number of vertices.
    edges : (e, 2) array_like of int
        The two ends of each edge.
    lengths : (e,) array_like of float
        Length of each edge, finite and not negative.

    Raises
    ------
    InputError
        If a shape is wrong, an end is out of range, or a length is negative or not finite.

    Examples
    --------
    >>> EdgeGraph(3, [[0, 1], [1, 2], [1, 0]], [1.0, 2.0, 5.0])
    EdgeGraph(3 vertices, 2 edges)
    """

    n_vertices: int
    edges: IntArray
    lengths: FloatArray

    def __post_init__(self) -> None:
        n = int(self.n_vertices)
        edges = as_indices(self.edges, "edges").reshape(-1, 2)
        lengths = as_floats(self.lengths, "lengths").ravel()
        _check_edges(n, edges, lengths)
        edges, lengths = _simple(n, edges, lengths)
        object.__setattr__(self, "n_vertices", n)
        object.__setattr__(self, "edges", frozen(edges))
        object.__setattr__(self, "lengths", frozen(lengths))

    def __repr__(self) -> str:
        return f"EdgeGraph({self.n_vertices} vertices, {self.n_edges} edges)"

    @property
    def n_edges(self) -> int:
        """Number of edges."""
        return len(self.edges)

    def matrix(self) -> sp.csr_array[np.float64]:
        """Return the symmetric (n, n) sparse matrix of lengths; zero lengths are stored entries."""
        rows = np.concatenate([self.edges[:, 0], self.edges[:, 1]])
        columns = np.concatenate([self.edges[:, 1], self.edges[:, 0]])
        values = np.concatenate([self.lengths, self.lengths])
        return sp.csr_array((values, (rows, columns)), shape=(self.n_vertices, self.n_vertices))


def edge_graph(mesh: Mesh, kind: GraphKind = "edges") -> EdgeGraph:
    """Build the graph of a mesh on which geodesics are shortest paths.

    Parameters
    ----------
    mesh : Mesh
        Any triangle mesh.
    kind : {"edges", "refined"}
        ``"edges"``: the mesh's edges, whose paths are about a tenth longer than the surface's own, and a fifth
        or more in the worst directions. ``"refined"``: also the diagonal of every pair of neighbouring triangles,
        unfolded into a plane, where that straight segment stays inside the pair; the overestimate falls
        to a few per cent, and a diagonal is a path over the surface, so distances stay upper bounds.

    Returns
    -------
    EdgeGraph

    Raises
    ------
    InputError
        If the kind is unknown.

    Notes
    -----
    Diagonals are added only across edges that exactly two triangles share.

    Examples
    --------
    >>> from pliant import Mesh
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> edge_graph(square).n_edges, edge_graph(square, "refined").n_edges
    (5, 6)
    """
    if kind == "edges":
        return EdgeGraph(mesh.n_vertices, mesh.edges, mesh.edge_lengths)
    if kind != "refined":
        message = f'graph must be "edges" or "refined", got {kind!r}'
        raise InputError(message)
    diagonals = unfolded_diagonals(mesh)
    return EdgeGraph(
        mesh.n_vertices,
        np.concatenate([mesh.edges, diagonals.ends]),
        np.concatenate([mesh.edge_lengths, diagonals.lengths]),
    )


def as_graph(source: Mesh | EdgeGraph | sp.sparray, kind: GraphKind = "edges") -> EdgeGraph:
    """Take a mesh, a graph or a sparse matrix of lengths to a graph."""
    if isinstance(source, EdgeGraph):
        return source
    if isinstance(source, Mesh):
        return edge_graph(source, kind)
    if sp.issparse(source):
        upper: Any = source.tocoo()  # type: ignore[attr-defined]
        if upper.shape[0] != upper.shape[1]:
            message = f"a matrix of edge lengths must be square, got {upper.shape}"
            raise InputError(message)
        return EdgeGraph(upper.shape[0], np.column_stack(upper.coords), upper.data)
    message = f"expected a Mesh, an EdgeGraph or a sparse matrix of lengths, got {type(source).__name__}"
    raise InputError(message)


def _check_edges(n: int, edges: IntArray, lengths: FloatArray) -> None:
    if n < 1:
        raise InputError("the graph is empty: it has no vertices")
    if len(edges) != len(lengths):
        message = f"{len(edges)} edges but {len(lengths)} lengths"
        raise InputError(message)
    bad = np.flatnonzero(((edges < 0) | (edges >= n)).any(axis=1))
    if bad.size:
        message = f"{bad.size} edges name vertices outside 0..{n - 1}, first edges {first_indices(bad)}"
        raise InputError(message)
    bad = np.flatnonzero(~(np.isfinite(lengths) & (lengths >= 0)))
    if bad.size:
        message = f"{bad.size} edge lengths are negative or not finite, first edges {first_indices(bad)}"
        raise InputError(message)


def _simple(n: int, edges: IntArray, lengths: FloatArray) -> tuple[IntArray, FloatArray]:
    """Drop self-loops and keep the shortest of parallel edges; ends and edges ascending."""
    keys = edges[:, 0] * np.int64(n) + edges[:, 1]
    if (edges[:, 0] < edges[:, 1]).all() and (keys[1:] > keys[:-1]).all():
        return edges, lengths.copy()  # as those of a mesh are
    proper = edges[:, 0] != edges[:, 1]
    ends = np.sort(edges[proper], axis=1)
    lengths = lengths[proper]
    keys = ends[:, 0] * np.int64(n) + ends[:, 1]
    order = np.lexsort((lengths, keys))
    keys, first = np.unique(keys[order], return_index=True)
    chosen = order[first]
    return ends[chosen], lengths[chosen]


class Diagonals(NamedTuple):
    """Segments across an edge: their ends, their lengths, the edges they cross and how far along these."""

    ends: IntArray
    lengths: FloatArray
    across: IntArray
    fractions: FloatArray


def unfolded_diagonals(mesh: Mesh) -> Diagonals:
    """Segments between the far corners of neighbouring triangles that stay inside the unfolded pair."""
    left, right, far = _neighbouring_pairs(mesh)
    a, b = mesh.vertices[left], mesh.vertices[right]
    base = np.linalg.norm(b - a, axis=1)
    proper = (base > 0) & (far[:, 0] != far[:, 1])
    left, right, far, a, b, base = (x[proper] for x in (left, right, far, a, b, base))
    x0, y0 = _in_plane(a, b, base, mesh.vertices[far[:, 0]])
    x1, y1 = _in_plane(a, b, base, mesh.vertices[far[:, 1]])
    height = y0 + y1
    crossing = np.divide(x0 * y1 + x1 * y0, height, out=np.full_like(height, -1.0), where=height > 0)
    inside: BoolArray = (y0 > 0) & (y1 > 0) & (crossing > 0) & (crossing < base)
    return Diagonals(
        far[inside],
        np.hypot(x1 - x0, height)[inside],
        np.column_stack([left, right])[inside],
        (crossing / base)[inside],
    )


def _neighbouring_pairs(mesh: Mesh) -> tuple[IntArray, IntArray, IntArray]:
    """List the ends of each edge that exactly two triangles share, and the two corners across it."""
    faces = mesh.faces
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    across = faces[:, [2, 0, 1]].ravel()
    keys = ends[:, 0] * np.int64(mesh.n_vertices) + ends[:, 1]
    order = np.argsort(keys, kind="stable")
    _, first, count = np.unique(keys[order], return_index=True, return_counts=True)
    first = first[count == 2]
    one, two = order[first], order[first + 1]
    return ends[one, 0], ends[one, 1], np.column_stack([across[one], across[two]])


def _in_plane(
    a: FloatArray, b: FloatArray, base: FloatArray, corner: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coordinates of a corner along, and its distance from, the edge from a to b."""
    along = np.einsum("ij,ij->i", corner - a, b - a) / base
    height = np.linalg.norm(np.cross(b - a, corner - a).reshape(-1, 3), axis=1) / base
    return along, height


def component_labels(graph: EdgeGraph) -> tuple[int, IntArray]:
    """Count connected components and label every vertex with its own."""
    count, labels = sp.csgraph.connected_components(graph.matrix(), directed=False)
    return int(count), as_indices(np.asarray(labels), "labels")


def as_weights(values: ArrayLike | None, n_vertices: int, name: str) -> FloatArray:
    """Coerce weights, one finite and not negative number a vertex; None means 1 for each."""
    if values is None:
        return np.ones(n_vertices)
    weights = as_floats(values, name).ravel()
    if len(weights) != n_vertices:
        message = f"{name} must have one value for each of {n_vertices} vertices, got {len(weights)}"
        raise InputError(message)
    bad = np.flatnonzero(~(np.isfinite(weights) & (weights >= 0)))
    if bad.size:
        message = f"{name}: {bad.size} are negative or not finite, first at vertices {first_indices(bad)}"
        raise InputError(message)
    return weights
