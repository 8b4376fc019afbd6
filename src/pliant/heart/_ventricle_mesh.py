"""The endocardial surface of an analytic ventricle as a triangle mesh whose vertices lie on it."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from .._arrays import BoolArray, FloatArray, IntArray
from ..errors import InputError, NumericalError, require
from ..mesh import Mesh, largest_component
from ._ventricle import Ventricle

_SMOOTHING_ROUNDS = 4


def ventricle_mesh(ventricle: Ventricle, step: float) -> Mesh:
    """Triangulate the zero set below z = 0, closed by its flat cut there, in the heart frame.

    Marching cubes on a grid of the given step (mm) gives the triangles; their vertices are then evened out along the
    surface and moved onto it by Newton steps. Vertices of the cut have z = 0 exactly.
    """
    if not 0.2 <= step <= 4:
        message = f"the mesh's step must be between 0.2 and 4 mm, got {step}"
        raise InputError(message)
    mesh = largest_component(_cubes(ventricle, step)).mesh
    flat = mesh.vertices[:, 2] > -1e-3 * step
    vertices = mesh.vertices.copy()
    vertices[flat, 2] = 0
    kinds = _kinds(mesh, flat)
    average = _neighbour_average(mesh, kinds)
    for _ in range(_SMOOTHING_ROUNDS):
        moved = vertices + 0.5 * (average @ vertices - vertices)
        vertices = _on_surface(ventricle, moved, kinds, rounds=3)
    vertices = _on_surface(ventricle, vertices, kinds, rounds=12)
    worst = float(np.abs(ventricle.distances(vertices[kinds < 2])).max())
    if worst > 0.02:
        message = f"the surface was missed by {worst:.3g} mm; use a finer step than {step} mm"
        raise NumericalError(message)
    return Mesh(vertices, mesh.faces)


def _cubes(ventricle: Ventricle, step: float) -> Mesh:
    measure = require("skimage.measure", "heart")
    reach = np.ceil((ventricle.wall[:2] + 3) / step) * step
    depth = np.ceil((ventricle.wall[2] - ventricle.wall[4] + 3) / step) * step
    axes = [np.arange(-r, r + step / 2, step) for r in reach] + [np.arange(-depth, step / 2, step)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = ventricle.distances(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    # A wall of large values right above the basal plane closes the surface there, in the plane up to a millionth.
    closed = np.concatenate([values, np.full((*values.shape[:2], 1), 1e6)], axis=2)
    vertices, faces, _, _ = measure.marching_cubes(closed, 0.0, gradient_direction="descent")
    return Mesh(vertices * step + [-reach[0], -reach[1], -depth], faces)


def _kinds(mesh: Mesh, flat: BoolArray) -> IntArray:
    """0 on the wall, 1 on the rim of the cut, 2 inside it."""
    flat_face = flat[mesh.faces].all(axis=1)
    on_wall = np.zeros(mesh.n_vertices, dtype=bool)
    on_wall[mesh.faces[~flat_face].ravel()] = True
    return np.where(flat, np.where(on_wall, 1, 2), 0).astype(np.int64)


def _neighbour_average(mesh: Mesh, kinds: IntArray) -> sparse.csr_array:
    """Mean over the neighbours; for a vertex of the rim, over its neighbours along the rim."""
    i, j = np.concatenate([mesh.edges, mesh.edges[:, ::-1]]).T
    kept = (kinds[i] != 1) | (kinds[j] == 1)
    i, j = i[kept], j[kept]
    ones = np.ones(len(i))
    degree = np.bincount(i, minlength=mesh.n_vertices)
    return sparse.csr_array((ones / degree[i], (i, j)), shape=(mesh.n_vertices, mesh.n_vertices))


def _on_surface(ventricle: Ventricle, vertices: FloatArray, kinds: IntArray, rounds: int) -> FloatArray:
    moved = vertices.copy()
    wall = np.flatnonzero(kinds < 2)
    moved[wall] = ventricle.projected(vertices[wall], in_plane=kinds[wall] == 1, rounds=rounds)
    return moved
