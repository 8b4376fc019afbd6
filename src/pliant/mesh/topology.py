"""How a mesh hangs together: edges and their faces, components, boundaries, fans. Linear time, vectorised."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .._arrays import BoolArray, IntArray, frozen
from .surface import Mesh

__all__ = [
    "EdgeFaces",
    "boundary_edges",
    "boundary_loops",
    "edge_faces",
    "face_fans",
    "first_members",
    "grouped",
    "vertex_components",
]


@dataclass(frozen=True, eq=False)
class EdgeFaces:
    """Which faces meet at which edge.

    Sides of faces are numbered face by face: side ``3 * f + k`` runs from corner k of face f to the next.
    A side whose two ends are one vertex belongs to no edge.

    Parameters
    ----------
    edges : (e, 2) int array
        As :attr:`Mesh.edges`.
    edge_of_side : (3 m,) int array
        Edge of each side, -1 where it has none.
    along : (3 m,) bool array
        Whether the side runs from the smaller vertex number to the larger.
    """

    edges: IntArray
    edge_of_side: IntArray
    along: BoolArray

    @cached_property
    def counts(self) -> IntArray:
        """(e,) number of face sides at each edge: 1 at the boundary, 2 inside, more where crowded."""
        sides = self.edge_of_side[self.edge_of_side >= 0]
        return frozen(np.bincount(sides, minlength=len(self.edges)))

    @cached_property
    def pairs(self) -> IntArray:
        """(p, 2) the two sides at each edge that has exactly two, in the order of the edges."""
        sides = np.flatnonzero(self.edge_of_side >= 0)
        sides = sides[self.counts[self.edge_of_side[sides]] == 2]
        order = np.argsort(self.edge_of_side[sides], kind="stable")
        return frozen(sides[order].reshape(-1, 2))

    @property
    def agree(self) -> BoolArray:
        """(p,) whether the faces of each of :attr:`pairs` are wound alike: they run along it both ways."""
        directions = self.along[self.pairs]
        result: BoolArray = directions[:, 0] != directions[:, 1]
        return result


def edge_faces(mesh: Mesh) -> EdgeFaces:
    """Find which faces meet at which edge.

    Parameters
    ----------
    mesh : Mesh
        Any mesh, manifold or not.

    Returns
    -------
    EdgeFaces

    Examples
    --------
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> edge_faces(square).counts.tolist()
    [1, 2, 1, 1, 1]
    """
    starts = mesh.faces.ravel()
    stops = mesh.faces[:, [1, 2, 0]].ravel()
    step = np.int64(mesh.n_vertices)
    keys = np.minimum(starts, stops) * step + np.maximum(starts, stops)
    edge_keys = mesh.edges[:, 0] * step + mesh.edges[:, 1]
    edge_of_side = np.searchsorted(edge_keys, keys)
    edge_of_side[starts == stops] = -1
    return EdgeFaces(mesh.edges, frozen(edge_of_side), frozen(starts < stops))


def grouped(n_items: int, pairs: IntArray) -> tuple[int, IntArray]:
    """Find the groups that pairs join items into, numbered by their first item.

    Parameters
    ----------
    n_items : int
        How many items.
    pairs : (p, 2) int array
        Items that belong together.

    Returns
    -------
    count : int
    labels : (n_items,) ndarray of int64
    """
    graph = coo_array(
        (np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(n_items, n_items)
    )
    count, labels = connected_components(graph.tocsr(), directed=False)
    # scipy promises no order; number the groups as their first members come.
    rank = np.empty(int(count), dtype=np.int64)
    rank[np.argsort(first_members(int(count), labels))] = np.arange(int(count))
    return int(count), rank[labels]


def first_members(count: int, labels: NDArray[np.integer]) -> IntArray:
    """(count,) number of the first item of each group, without sorting."""
    first = np.zeros(count, dtype=np.int64)
    # Written back to front, so that the first of each group is the last to be written.
    first[labels[::-1]] = np.arange(len(labels) - 1, -1, -1)
    return first


def vertex_components(mesh: Mesh) -> tuple[int, IntArray]:
    """Find the pieces of a mesh that edges hold together.

    A vertex without a face is a component of its own. Pieces that merely touch, at equal positions
    without a shared vertex, are apart; join them with ``merged(mesh)``.

    Parameters
    ----------
    mesh : Mesh
        Any mesh.

    Returns
    -------
    count : int
        Number of components.
    labels : (n,) ndarray of int64
        Component of each vertex, numbered by their first vertex.

    Examples
    --------
    >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], [[0, 1, 2]])
    >>> count, labels = vertex_components(mesh)
    >>> count, labels.tolist()
    (2, [0, 0, 0, 1])
    """
    return grouped(mesh.n_vertices, mesh.edges)


def face_fans(mesh: Mesh, sides: EdgeFaces, *, through_crowded: bool) -> tuple[int, IntArray]:
    """Find the fans of faces around the vertices: corners joined across the edges that hold them.

    A manifold vertex has one fan; a vertex where two sheets touch in a point has two.

    Parameters
    ----------
    mesh : Mesh
        Any mesh.
    sides : EdgeFaces
        Of this mesh.
    through_crowded : bool
        Whether faces also hang together across an edge of three faces or more.

    Returns
    -------
    count : int
    labels : (3 m,) ndarray of int64
        Fan of each corner, faces row by row.
    """
    pairs = _chained_sides(sides) if through_crowded else sides.pairs
    # At either end of the shared edge, the corner of one face joins the corner of the other there.
    corner_starts, corner_stops = _side_ends(pairs)
    faces = mesh.faces.ravel()
    alike = faces[corner_starts[:, 0]] == faces[corner_starts[:, 1]]
    partner_of_start = np.where(alike, corner_starts[:, 1], corner_stops[:, 1])
    partner_of_stop = np.where(alike, corner_stops[:, 1], corner_starts[:, 1])
    joined = np.concatenate(
        [
            np.column_stack([corner_starts[:, 0], partner_of_start]),
            np.column_stack([corner_stops[:, 0], partner_of_stop]),
        ]
    )
    return grouped(faces.size, joined)


def boundary_edges(mesh: Mesh) -> IntArray:
    """Edges that have one face only, each in the direction its face runs along it.

    Parameters
    ----------
    mesh : Mesh
        Any mesh.

    Returns
    -------
    (b, 2) ndarray of int64
        In the order of the faces.

    Examples
    --------
    >>> boundary_edges(Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).tolist()
    [[0, 1], [1, 2], [2, 0]]
    """
    starts, stops = _side_ends(_boundary_sides(edge_faces(mesh)))
    faces = mesh.faces.ravel()
    return np.column_stack([faces[starts], faces[stops]])


def boundary_loops(mesh: Mesh, sides: EdgeFaces | None = None) -> tuple[IntArray, ...]:
    """Walk around every hole.

    Where several holes touch in one vertex, each fan of faces there belongs to one of them, so the
    loops stay apart and that vertex is in each.

    Parameters
    ----------
    mesh : Mesh
        Any mesh. Around edges of three faces or more a boundary may end; it is then an open chain.
    sides : EdgeFaces, optional
        Of this mesh, where it is at hand.

    Returns
    -------
    tuple of (k,) ndarray of int64
        Vertex numbers of each loop in the direction of its first face, the first not repeated at the
        end; longest loop first, then by first vertex.

    Examples
    --------
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> [loop.tolist() for loop in boundary_loops(square)]
    [[0, 1, 2, 3]]
    """
    sides = edge_faces(mesh) if sides is None else sides
    border = _boundary_sides(sides)
    if not border.size:
        return ()
    _, fans = face_fans(mesh, sides, through_crowded=False)
    starts, stops = _side_ends(border)
    links: dict[int, list[tuple[int, int]]] = {}
    for number, (a, b) in enumerate(zip(fans[starts].tolist(), fans[stops].tolist(), strict=True)):
        links.setdefault(a, []).append((number, b))
        links.setdefault(b, []).append((number, a))
    vertex_of_fan = np.empty(int(fans.max()) + 1, dtype=np.int64)
    vertex_of_fan[fans] = mesh.faces.ravel()
    walks = _walks(links, fans[starts].tolist())
    loops = [vertex_of_fan[walk] for walk in walks]
    return tuple(frozen(loop) for loop in sorted(loops, key=lambda loop: (-len(loop), int(loop[0]))))


def _walks(links: dict[int, list[tuple[int, int]]], starts: list[int]) -> list[list[int]]:
    """Chains of fans along boundary edges, each edge walked once; open ends are begun with."""
    ends = [fan for fan, around in links.items() if len(around) == 1]
    used: set[int] = set()
    walks = []
    for start in ends + starts:
        at, walk = start, [start]
        while (step := next((link for link in links[at] if link[0] not in used), None)) is not None:
            used.add(step[0])
            at = step[1]
            walk.append(at)
        if len(walk) > 1:
            walks.append(walk[:-1] if at == start else walk)
    return walks


def _boundary_sides(sides: EdgeFaces) -> IntArray:
    edge = sides.edge_of_side
    alone = (edge >= 0) & (sides.counts[np.maximum(edge, 0)] == 1) if len(sides.edges) else edge >= 0
    return np.flatnonzero(alone)


def _chained_sides(sides: EdgeFaces) -> IntArray:
    """Pairs of sides that follow each other at an edge, however many meet there."""
    there = np.flatnonzero(sides.edge_of_side >= 0)
    order = there[np.argsort(sides.edge_of_side[there], kind="stable")]
    same = sides.edge_of_side[order[1:]] == sides.edge_of_side[order[:-1]]
    return np.column_stack([order[:-1][same], order[1:][same]])


def _side_ends(sides: IntArray) -> tuple[IntArray, IntArray]:
    """Corners at which sides start and stop."""
    stops = sides - sides % 3 + (sides % 3 + 1) % 3
    return sides, cast(IntArray, stops)
