"""Perturbations that take triangles away: many one-ring holes, or a few big ones."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ..._arrays import BoolArray, IntArray
from ...errors import MeshError
from ..adjacency import Stars, edge_matrix, path_lengths
from ..surface import Mesh
from ..topology import grouped
from .result import Perturbed, Seed, checked_strength, mean_edge_length, moved, without_faces

__all__ = ["holes", "micro_holes"]

_SHARE = 0.02
_TRIES = 60
# A patch wrapped around a limb cuts it off; half a cylinder has 0.64.
_LEAST_FACING = 0.6


def micro_holes(mesh: Mesh, *, strength: int, rng: Seed) -> Perturbed:
    """Punch one-ring holes: 0.5 % of the vertices times the strength go, each with the triangles around it.

    Holes share no vertex with each other or with the boundary, so the surface stays manifold and each hole is
    one more boundary loop. Where the mesh is too small for as many, there are fewer (the description counts
    them). Parameters, errors and result as for :func:`perturbed`.

    Examples
    --------
    >>> from pliant import shapes
    >>> micro_holes(shapes.icosphere(3), strength=2, rng=0)
    Perturbed(micro_holes 2: 636 vertices, 6 one-ring holes)
    """
    strength = checked_strength(strength)
    if not strength:
        return moved(mesh, mesh, "micro_holes", 0, "unchanged")
    rng = np.random.default_rng(rng)
    stars = Stars(mesh)
    taken = stars.at_rim.copy()
    dropped = np.zeros(mesh.n_faces, dtype=bool)
    wanted, made = max(1, round(0.005 * strength * mesh.n_vertices)), 0
    for vertex in rng.permutation(mesh.n_vertices):
        if made == wanted:
            break
        ring = None if taken[vertex] else stars.ring(vertex)
        if ring is None or taken[ring].any():
            continue
        taken[ring], taken[vertex] = True, True
        dropped[stars.faces_of(vertex)] = True
        made += 1
    if not made:
        raise _no_place()
    new, source = without_faces(mesh, dropped)
    return Perturbed(new, source, "micro_holes", strength, f"{made} one-ring holes")


def holes(mesh: Mesh, *, strength: int, rng: Seed) -> Perturbed:
    """Cut as many big holes as the strength says, geodesic discs of about 2 % of the surface each.

    A disc that would meet the boundary, another hole, or itself around a limb is moved or shrunk, so the
    surface stays manifold and in one piece, and each hole is one more boundary loop. Where no more fit there
    are fewer (the description counts them). Parameters, errors and result as for :func:`perturbed`.

    Examples
    --------
    >>> from pliant import shapes
    >>> holes(shapes.icosphere(4), strength=2, rng=0).description
    '2 holes, 5.5 % of the area'
    """
    strength = checked_strength(strength)
    if not strength:
        return moved(mesh, mesh, "holes", 0, "unchanged")
    rng = np.random.default_rng(rng)
    mean_edge_length(mesh)
    graph, taken = edge_matrix(mesh), Stars(mesh).at_rim.copy()
    dropped = np.zeros(mesh.n_faces, dtype=bool)
    # Paths along edges are about a tenth longer than paths across faces.
    radius = 1.1 * float(np.sqrt(_SHARE * mesh.area / np.pi))
    made = 0
    for attempt in range(_TRIES):
        open_vertices = np.flatnonzero(~taken)
        if made == strength or not len(open_vertices):
            break
        centre = int(rng.choice(open_vertices))
        patch = _disc(mesh, graph, centre, radius, taken, insist=attempt < _TRIES // 2)
        if patch is not None:
            dropped |= patch
            taken[mesh.faces[patch]] = True
            made += 1
    if not made:
        raise _no_place()
    share = float(mesh.face_areas[dropped].sum() / mesh.area) if mesh.area > 0 else 0.0
    new, source = without_faces(mesh, dropped)
    return Perturbed(new, source, "holes", strength, f"{made} holes, {100 * share:.1f} % of the area")


def _disc(
    mesh: Mesh, graph: sp.csr_array, centre: int, radius: float, taken: BoolArray, *, insist: bool
) -> BoolArray | None:
    """Faces that touch a geodesic disc, if they are a topological disc away from what is taken.

    To insist is to want nearly the whole radius, and faces that look the same way; else any disc will do.
    """
    distance = path_lengths(graph, centre, limit=radius)
    for reach in radius * 0.85 ** np.arange(3 if insist else 20):
        inside = distance <= reach
        patch: BoolArray = inside[mesh.faces].any(axis=1)
        if taken[mesh.faces[patch]].any() or not is_disc(mesh.faces[patch]):
            continue
        if not insist or _facing(mesh, patch) >= _LEAST_FACING:
            return patch
    return None


def _facing(mesh: Mesh, patch: BoolArray) -> float:
    """Length of the mean normal: 1 where all faces look the same way."""
    areas = mesh.face_areas[patch]
    return float(np.linalg.norm(areas @ mesh.face_normals[patch]) / max(areas.sum(), np.finfo(float).tiny))


def is_disc(faces: IntArray) -> bool:
    """Whether some triangles form one disc, bounded by one simple loop."""
    if not len(faces):
        return False
    corners, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    if uses.max() > 2 or len(corners) - len(edges) + len(faces) != 1:
        return False
    rim = edges[uses == 1]
    rim_vertices, degree = np.unique(rim, return_counts=True)
    if (degree != 2).any():
        return False
    # Vertices off the rim count as pieces of their own.
    n_loops = grouped(len(corners), rim)[0] - (len(corners) - len(rim_vertices))
    return n_loops == 1 and grouped(len(corners), edges)[0] == 1


def _no_place() -> MeshError:
    return MeshError(
        "there is no place for a hole: every vertex is on or next to the boundary, on a non-manifold edge, or "
        "inconsistently wound; use a finer mesh, or see check_up"
    )
