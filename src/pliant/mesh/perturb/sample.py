"""The perturbation that samples the surface more coarsely."""

from __future__ import annotations

import numpy as np

from ..adjacency import Stars
from ..surface import Mesh
from ..topology import edge_faces
from ._collapse import collapse_pass
from .result import Perturbed, Seed, checked_strength, mean_edge_length, moved, without_faces

__all__ = ["sampling"]

# Thinness a new triangle may have (1 = equilateral), raised when nothing else is left to merge.
_BADNESS = (3.0, 8.0, 40.0)


def sampling(mesh: Mesh, *, strength: int, rng: Seed) -> Perturbed:
    """Take away 16 % of the vertices times the strength, at random: up to 80 %.

    Vertices are merged into neighbours (half-edge collapses), so those that stay keep their exact positions and
    the map back is exact. Topology is kept: the same components, genus and boundary loops, no new non-manifold
    edge, no triangle turned by more than 60 degrees at a time. Boundary vertices merge along the boundary;
    vertices on non-manifold edges stay. A small or awkward mesh may keep more vertices than asked (the
    description counts them). Parameters, errors and result as for :func:`perturbed`.

    Examples
    --------
    >>> from pliant import shapes
    >>> sampling(shapes.icosphere(3), strength=5, rng=0)
    Perturbed(sampling 5: 128 vertices, 514 of 642 vertices taken away)
    """
    strength = checked_strength(strength)
    if not strength:
        return moved(mesh, mesh, "sampling", 0, "unchanged")
    rng = np.random.default_rng(rng)
    mean_edge_length(mesh)
    wanted = round(0.16 * strength * mesh.n_vertices)
    faces, alive = mesh.faces.copy(), np.ones(mesh.n_faces, dtype=bool)
    rim, locked = Stars(mesh).at_rim, np.zeros(mesh.n_vertices, dtype=bool)
    locked[mesh.edges[edge_faces(mesh).counts > 2]] = True
    present = np.ones(mesh.n_vertices, dtype=bool)
    left = wanted
    for badness in _BADNESS:
        while left:
            order = rng.permutation(np.flatnonzero(present))
            gone = collapse_pass(order, left, badness, mesh.vertices, faces, alive, rim, locked)
            present[gone] = False
            left -= len(gone)
            # Passes that hardly get on have come to the end of what this thinness allows.
            if len(gone) <= 0.002 * len(order):
                break
    coarse, source = without_faces(Mesh(mesh.vertices, faces), ~alive)
    text = f"{wanted - left} of {mesh.n_vertices} vertices taken away"
    return Perturbed(coarse, source, "sampling", strength, text)
