"""Even triangles on the implicit surface of a figure, as many as asked, mirrored exactly.

Isotropic remeshing (Botsch & Kobbelt 2004): split long edges, contract short ones, turn edges until
Delaunay, move vertices within the surface to the centre of their neighbourhood, project them back. All of
it happens on the half x >= 0; the mirror image is glued on at the end, so the symmetry is exact.
"""

from __future__ import annotations

import numpy as np

from ..._arrays import BoolArray, FloatArray, IntArray
from ...errors import NumericalError
from ._body import Flesh
from ._edits import boundary_mask, collapse_edges, edge_table, flip_edges, relative_lengths, split_edges
from ._field import field, local_radius, projected
from ._polygonise import half_surface

_ROUNDS = 6
_POLISH = 8


def symmetric_surface(
    flesh: Flesh, n_vertices: int, low: FloatArray, high: FloatArray, *, spacing: float, thickness: float
) -> tuple[FloatArray, IntArray, IntArray]:
    """Mesh the surface with about ``n_vertices``; return vertices, faces and the mirror map.

    ``spacing`` is the lattice that resolves the finest part, ``thickness`` the limb radius from which
    triangles stop growing: thinner limbs get smaller ones.
    """
    vertices, faces = _half_disc(flesh, low, high, spacing)
    vertices, faces = _remeshed(vertices, faces, flesh, n_vertices, thickness)
    return _glued(vertices, faces)


def _half_disc(
    flesh: Flesh, low: FloatArray, high: FloatArray, spacing: float
) -> tuple[FloatArray, IntArray]:
    """Polygonise on ever finer lattices until half the surface is a disc, as it is when nothing is missed."""
    for finer in (1.0, 0.8, 0.6, 0.45):
        vertices, faces = half_surface(lambda points: field(points, flesh), low, high, finer * spacing)
        edges, _ = edge_table(faces, len(vertices))
        if len(vertices) - len(edges) + len(faces) == 1:
            return vertices, faces
    message = "the figure's limbs touch, so its surface is no sphere; take proportions closer to 1"
    raise NumericalError(message)


def _remeshed(
    points: FloatArray, faces: IntArray, flesh: Flesh, n_vertices: int, thickness: float
) -> tuple[FloatArray, IntArray]:
    # The fourth column is the size triangles should have there; splits and contractions average it.
    vertices = np.column_stack([points, _sizes(points, flesh, thickness)])
    for _ in range(_ROUNDS):
        unit = _unit_length(vertices, faces, n_vertices)
        vertices, faces = _split_long(vertices, faces, flesh, 4 / 3 * unit)
        vertices, faces = _collapse_short(vertices, faces, 4 / 5 * unit)
        vertices[:, 3] = _sizes(vertices[:, :3], flesh, thickness)
        vertices, faces = _relaxed(vertices, faces, flesh, 2)
    for _ in range(2):
        vertices, faces = _exact_count(vertices, faces, flesh, n_vertices)
        vertices[:, 3] = _sizes(vertices[:, :3], flesh, thickness)
        vertices, faces = _relaxed(vertices, faces, flesh, _POLISH)
    return projected(vertices, flesh, step=np.inf, rounds=4)[:, :3], faces


def _sizes(points: FloatArray, flesh: Flesh, thickness: float) -> FloatArray:
    radius = local_radius(points, flesh, softness=thickness / 4)
    return np.sqrt(np.clip(radius / thickness, 0.1, 1))


def _unit_length(vertices: FloatArray, faces: IntArray, n_vertices: int) -> float:
    """Edge length at size 1 that gives the asked number of vertices: one vertex fills two even triangles."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    doubled = np.linalg.norm(np.cross((b - a)[:, :3], (c - a)[:, :3]), axis=1)
    sizes = (a[:, 3] + b[:, 3] + c[:, 3]) / 3
    return float(np.sqrt((doubled / sizes**2).sum() / n_vertices * 2 / np.sqrt(3)))


def _split_long(
    vertices: FloatArray, faces: IntArray, flesh: Flesh, longest: float
) -> tuple[FloatArray, IntArray]:
    for _ in range(8):
        edges, sides = edge_table(faces, len(vertices))
        excess = relative_lengths(vertices, edges) - longest
        if not (excess > 0).any():
            break
        before = len(vertices)
        vertices, faces = split_edges(vertices, faces, excess, edges, sides, 2 * len(edges))
        vertices[before:] = projected(vertices[before:], flesh, step=longest / 4)
    return vertices, faces


def _collapse_short(vertices: FloatArray, faces: IntArray, shortest: float) -> tuple[FloatArray, IntArray]:
    for _ in range(40):
        edges, sides = edge_table(faces, len(vertices))
        excess = shortest - relative_lengths(vertices, edges)
        before = len(vertices)
        vertices, faces = collapse_edges(vertices, faces, excess, edges, sides, 2 * len(edges))
        if before - len(vertices) <= before // 30:
            break
    return vertices, faces


def _exact_count(
    vertices: FloatArray, faces: IntArray, flesh: Flesh, n_vertices: int
) -> tuple[FloatArray, IntArray]:
    """Split the longest or contract the shortest edges until the glued mesh has the asked count."""
    for _ in range(20):
        edges, sides = edge_table(faces, len(vertices))
        surplus = 2 * len(vertices) - int(boundary_mask(len(vertices), edges, sides).sum()) - n_vertices
        if surplus == 0:
            break
        lengths = relative_lengths(vertices, edges)
        if surplus > 0:
            excess = 2 * lengths.max() - lengths
            vertices, faces = collapse_edges(vertices, faces, excess, edges, sides, surplus)
        else:
            before = len(vertices)
            vertices, faces = split_edges(vertices, faces, lengths, edges, sides, -surplus)
            vertices[before:] = projected(vertices[before:], flesh, step=float(lengths.mean()) / 4)
    return vertices, faces


def _relaxed(vertices: FloatArray, faces: IntArray, flesh: Flesh, rounds: int) -> tuple[FloatArray, IntArray]:
    on_plane = boundary_mask(len(vertices), *edge_table(faces, len(vertices)))
    for _ in range(rounds):
        vertices = _centred(vertices, faces, on_plane)
        edge = (vertices[faces[:, 1]] - vertices[faces[:, 0]])[:, :3]
        length = float(np.linalg.norm(edge, axis=1).mean())
        vertices[~on_plane, 0] = np.maximum(vertices[~on_plane, 0], 0.1 * length)
        vertices = projected(vertices, flesh, step=length / 4)
        for _ in range(4):
            faces, count = flip_edges(vertices, faces)
            if not count:
                break
    return vertices, faces


def _centred(vertices: FloatArray, faces: IntArray, on_plane: BoolArray) -> FloatArray:
    """Move every vertex within its tangent plane towards the weighted centroid of its triangles."""
    corners = vertices[faces]
    points = corners[:, :, :3]
    crosses = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    weights = np.linalg.norm(crosses, axis=1) * corners[:, :, 3].mean(axis=1) ** -4
    moments = points.mean(axis=1) * weights[:, None]
    totals = _at_vertices(np.column_stack([weights, moments, crosses]), faces, len(vertices))
    # On the mirror plane the other half of the neighbourhood is the mirror image: x cancels out.
    totals[on_plane, 1] = 0
    totals[on_plane, 4] = 0
    normals = totals[:, 4:] / np.maximum(np.linalg.norm(totals[:, 4:], axis=1, keepdims=True), 1e-300)
    shift = totals[:, 1:4] / np.maximum(totals[:, :1], 1e-300) - vertices[:, :3]
    shift -= normals * (shift * normals).sum(axis=1, keepdims=True)
    return np.column_stack([vertices[:, :3] + 0.8 * shift, vertices[:, 3]])


def _at_vertices(values: FloatArray, faces: IntArray, n_vertices: int) -> FloatArray:
    corners = faces.ravel()
    columns = [np.bincount(corners, weights=np.repeat(v, 3), minlength=n_vertices) for v in values.T]
    return np.stack(columns, axis=1)


def _glued(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, IntArray]:
    """Add the mirror image; vertices of the plane x = 0 are their own mirror images."""
    on_plane = vertices[:, 0] == 0
    mirror = np.arange(len(vertices))
    mirror[~on_plane] = len(vertices) + np.arange((~on_plane).sum())
    both = np.vstack([vertices, vertices[~on_plane] * [-1, 1, 1]])
    symmetry = np.concatenate([mirror, np.flatnonzero(~on_plane)])
    return both, np.vstack([faces, mirror[faces[:, ::-1]]]), symmetry
