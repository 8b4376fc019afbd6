"""Edges of a mesh as a sparse matrix: what walks along the surface inside this room starts from it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from .surface import Mesh


def edge_matrix(mesh: Mesh) -> sp.csr_array:
    """Symmetric (n, n) matrix of edge lengths, neighbours in ascending order; zero lengths stay stored."""
    tails, heads = mesh.edges.T
    both = (np.concatenate([tails, heads]), np.concatenate([heads, tails]))
    lengths = np.concatenate([mesh.edge_lengths, mesh.edge_lengths])
    matrix = sp.csr_array((lengths, both), shape=(mesh.n_vertices, mesh.n_vertices))
    matrix.sort_indices()
    return matrix
