"""As-rigid-as-possible fit: positions from rotations and rotations from positions, factored once."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from ..._arrays import FloatArray, IntArray
from ..surface import Mesh


class RigidFit:
    """Alternate between the positions that follow given rotations best, and the rotations of given positions.

    Parameters
    ----------
    mesh : Mesh
        The rest shape.
    pins : (c,) array of int
        One vertex of each connected piece; it keeps its place, since rotations say nothing about it.
    """

    def __init__(self, mesh: Mesh, pins: IntArray) -> None:
        n = mesh.n_vertices
        self._rest, self._pins = mesh.vertices, pins
        self._tails, self._heads = mesh.edges.T
        self._weights = _edge_weights(mesh)
        self._sides = self._rest[self._tails] - self._rest[self._heads]
        edges = np.arange(len(self._weights))
        ones = np.ones(len(edges))
        self._leaving = sp.csr_array((ones, (self._tails, edges)), shape=(n, len(edges)))
        self._entering = sp.csr_array((ones, (self._heads, edges)), shape=(n, len(edges)))
        difference = self._leaving - self._entering
        anchors = np.zeros(n)
        anchors[pins] = self._weights.mean()
        self._anchors = anchors
        matrix = difference @ sp.diags_array(self._weights) @ difference.T + sp.diags_array(anchors)
        options = {"SymmetricMode": True}
        self._factor = splu(sp.csc_matrix(matrix), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        self._difference = sp.csr_array(difference)

    def positions(self, rotations: FloatArray) -> FloatArray:
        """(n, 3) positions whose edges are nearest to the rest edges under the rotations (n, 3, 3) of their ends."""
        turned = np.einsum("eij,ej->ei", rotations[self._tails] + rotations[self._heads], self._sides)
        right = (
            self._difference @ (0.5 * self._weights[:, None] * turned) + self._anchors[:, None] * self._rest
        )
        found: FloatArray = self._factor.solve(right)
        return found

    def best_rotations(self, positions: FloatArray) -> FloatArray:
        """(n, 3, 3) rotations that carry the rest edges around each vertex nearest to the given ones."""
        sides = positions[self._tails] - positions[self._heads]
        outer = (self._weights[:, None, None] * sides[:, :, None] * self._sides[:, None, :]).reshape(-1, 9)
        left, _, right = np.linalg.svd((self._leaving @ outer + self._entering @ outer).reshape(-1, 3, 3))
        left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
        rotations: FloatArray = left @ right
        return rotations


def _edge_weights(mesh: Mesh) -> FloatArray:
    """Cotangent weights, kept between 0.05 and 5 so that slivers neither tear nor freeze the surface."""
    corners = mesh.vertices[mesh.faces]
    total = sp.csr_array((mesh.n_vertices, mesh.n_vertices))
    for k in range(3):
        a, b = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        doubled = np.linalg.norm(np.cross(a, b), axis=1)
        cotangent = np.divide(np.einsum("ij,ij->i", a, b), doubled, out=np.zeros(len(a)), where=doubled > 0)
        ends = np.sort(mesh.faces[:, [(k + 1) % 3, (k + 2) % 3]], axis=1)
        total = total + sp.csr_array((0.5 * cotangent, (ends[:, 0], ends[:, 1])), shape=total.shape)
    weights: FloatArray = np.asarray(total[mesh.edges[:, 0], mesh.edges[:, 1]]).ravel()
    return np.clip(weights, 0.05, 5.0)
