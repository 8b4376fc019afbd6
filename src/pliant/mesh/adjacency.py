"""Edges of a mesh as a sparse matrix: what walks along the surface inside this room starts from it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from .._arrays import FloatArray, IntArray
from .surface import Mesh
from .topology import edge_faces


def edge_matrix(mesh: Mesh) -> sp.csr_array:
    """Symmetric (n, n) matrix of edge lengths, neighbours in ascending order; zero lengths stay stored."""
    tails, heads = mesh.edges.T
    both = (np.concatenate([tails, heads]), np.concatenate([heads, tails]))
    lengths = np.concatenate([mesh.edge_lengths, mesh.edge_lengths])
    matrix = sp.csr_array((lengths, both), shape=(mesh.n_vertices, mesh.n_vertices))
    matrix.sort_indices()
    return matrix


def path_lengths(edges: sp.csr_array, source: int, limit: float = np.inf) -> FloatArray:
    """(n,) lengths of the shortest paths along edges from one vertex; inf past the limit."""
    lengths: FloatArray = dijkstra(edges, indices=np.array([source]), limit=limit)[0]
    return lengths


class Stars:
    """The triangles around each vertex of a mesh, and the ring of vertices they close.

    ``at_rim`` (n,) says which vertices are on an edge that has one face, or more than two.
    """

    def __init__(self, mesh: Mesh) -> None:
        self._faces = mesh.faces
        corners = mesh.faces.ravel()
        self._order = np.argsort(corners, kind="stable") // 3
        self._starts = np.concatenate([[0], np.cumsum(np.bincount(corners, minlength=mesh.n_vertices))])
        self.at_rim = np.zeros(mesh.n_vertices, dtype=bool)
        self.at_rim[mesh.edges[edge_faces(mesh).counts != 2]] = True

    def faces_of(self, vertex: int) -> IntArray:
        """Return the numbers of the faces around a vertex."""
        faces: IntArray = self._order[self._starts[vertex] : self._starts[vertex + 1]]
        return faces

    def corners_of(self, vertex: int) -> list[int]:
        """Return the corners of those faces, repeated as they come."""
        corners: list[int] = self._faces[self.faces_of(vertex)].ravel().tolist()
        return corners

    def ring(self, vertex: int) -> list[int] | None:
        """Return the neighbours in winding order if the faces around a vertex are one closed fan, else None."""
        follower: dict[int, int] = {}
        faces = self._faces[self.faces_of(vertex)].tolist()
        for a, b, c in faces:
            first, second = (b, c) if a == vertex else (c, a) if b == vertex else (a, b)
            follower[first] = second
        if len(follower) != len(faces) or len(faces) < 3:
            return None
        ring = [faces[0][0] if faces[0][0] != vertex else faces[0][1]]
        while len(ring) <= len(follower):
            following = follower.get(ring[-1])
            if following is None:
                return None
            if following == ring[0]:
                return ring if len(ring) == len(follower) else None
            ring.append(following)
        return None
