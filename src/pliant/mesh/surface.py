"""The triangle mesh every other room takes: a frozen value whose verbs return new meshes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, as_floats, as_indices, frozen
from ..errors import MeshError, first_indices


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """A triangle mesh: vertex positions and the triangles between them.

    Arrays are copied once, made C-ordered float64 / int64 and read-only. Vertices and faces keep their
    order and number; nothing is merged, dropped or flipped. :func:`pliant.check_up` says what is wrong
    with a mesh and which call mends it.

    Parameters
    ----------
    vertices : (n, 3) array_like of float
        Positions, in the mesh's own unit (millimetres for medical data).
    faces : (m, 3) array_like of int
        Vertex numbers of each triangle, from 0.

    Raises
    ------
    MeshError
        If an array has the wrong shape, a coordinate is not finite, a face names a vertex that is not
        there, or there are three vertices or more and no face (a point cloud).

    Notes
    -----
    Fewer than three vertices cannot carry a face; such a mesh is allowed and every field on it is 0.

    Examples
    --------
    >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> mesh
    Mesh(3 vertices, 1 faces)
    >>> mesh.scaled(2).area
    2.0
    """

    vertices: FloatArray
    faces: IntArray

    def __post_init__(self) -> None:
        vertices = _checked_vertices(self.vertices)
        faces = _checked_faces(self.faces, len(vertices))
        object.__setattr__(self, "vertices", frozen(vertices))
        object.__setattr__(self, "faces", frozen(faces))

    def __repr__(self) -> str:
        return f"Mesh({self.n_vertices} vertices, {self.n_faces} faces)"

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    @property
    def n_faces(self) -> int:
        """Number of triangles."""
        return len(self.faces)

    # Derived arrays are computed once: the mesh cannot change under them.

    @cached_property
    def edges(self) -> IntArray:
        """(e, 2) vertex numbers of each undirected edge, smaller first, in ascending order."""
        n = np.int64(max(self.n_vertices, 1))
        one, other = self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()
        keys = np.minimum(one, other) * n + np.maximum(one, other)
        keys = np.unique(keys[one != other])
        low = keys // n
        return frozen(np.column_stack([low, keys - low * n]))

    @cached_property
    def edge_lengths(self) -> FloatArray:
        """(e,) Euclidean length of each of :attr:`edges`."""
        ends = self.vertices[self.edges]
        return frozen(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    @cached_property
    def face_areas(self) -> FloatArray:
        """(m,) area of each triangle."""
        return frozen(0.5 * np.linalg.norm(self._face_crosses, axis=1))

    @cached_property
    def face_normals(self) -> FloatArray:
        """(m, 3) unit normal of each triangle, by the right-hand rule; zero where the area is zero."""
        return frozen(_unit_rows(self._face_crosses))

    @cached_property
    def vertex_areas(self) -> FloatArray:
        """(n,) a third of the area of the triangles around each vertex."""
        corners = np.repeat(self.face_areas / 3, 3)
        return frozen(np.bincount(self.faces.ravel(), weights=corners, minlength=self.n_vertices))

    @cached_property
    def vertex_normals(self) -> FloatArray:
        """(n, 3) unit normals, triangle normals averaged by area; zero where there is none."""
        total = np.zeros((self.n_vertices, 3))
        for corner in range(3):
            for axis in range(3):
                total[:, axis] += np.bincount(
                    self.faces[:, corner], weights=self._face_crosses[:, axis], minlength=self.n_vertices
                )
        return frozen(_unit_rows(total))

    @property
    def area(self) -> float:
        """Total surface area."""
        return float(self.face_areas.sum())

    @cached_property
    def _face_crosses(self) -> FloatArray:
        a, b, c = (self.vertices[self.faces[:, i]] for i in range(3))
        return frozen(np.cross(b - a, c - a).reshape(-1, 3))

    def with_vertices(self, vertices: ArrayLike) -> Mesh:
        """Return the same triangles over other positions, (n, 3)."""
        moved = Mesh(vertices, self.faces)  # type: ignore[arg-type]
        if moved.n_vertices != self.n_vertices:
            message = f"with_vertices needs {self.n_vertices} positions, got {moved.n_vertices}"
            raise MeshError(message)
        return moved

    def scaled(self, factor: float) -> Mesh:
        """Return the mesh scaled about the origin."""
        return Mesh(self.vertices * float(factor), self.faces)

    def translated(self, offset: ArrayLike) -> Mesh:
        """Return the mesh moved by a vector, (3,)."""
        return Mesh(self.vertices + as_floats(offset, "offset"), self.faces)

    def transformed(self, matrix: ArrayLike) -> Mesh:
        """Return the mesh under a (3, 3) linear or (4, 4) affine matrix acting on column vectors."""
        matrix = as_floats(matrix, "matrix")
        if matrix.shape == (3, 3):
            return Mesh(self.vertices @ matrix.T, self.faces)
        if matrix.shape == (4, 4):
            return Mesh(self.vertices @ matrix[:3, :3].T + matrix[:3, 3], self.faces)
        message = f"matrix must have shape (3, 3) or (4, 4), got {matrix.shape}"
        raise MeshError(message)

    def flipped(self) -> Mesh:
        """Return the mesh with every triangle's winding, and so every normal, reversed."""
        return Mesh(self.vertices, self.faces[:, ::-1])


def _checked_vertices(values: ArrayLike) -> FloatArray:
    try:
        vertices = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        message = f"vertices must be an (n, 3) array of numbers: {error}"
        raise MeshError(message) from error
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        message = f"vertices must have shape (n, 3), got {vertices.shape}"
        raise MeshError(message)
    if not len(vertices):
        raise MeshError("the mesh is empty: it has no vertices")
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if bad.size:
        message = (
            f"{bad.size} of {len(vertices)} vertices have NaN or infinite coordinates, first at "
            f"{first_indices(bad)}; drop or fill them before building the mesh"
        )
        raise MeshError(message)
    return vertices


def _checked_faces(values: ArrayLike, n_vertices: int) -> IntArray:
    try:
        faces = as_indices(values, "faces")
    except ValueError as error:
        raise MeshError(str(error)) from error
    if faces.size == 0:
        faces = faces.reshape(0, 3)
    if faces.ndim != 2 or faces.shape[1] != 3:
        message = f"faces must have shape (m, 3), got {faces.shape}; split polygons into triangles first"
        raise MeshError(message)
    if not len(faces) and n_vertices >= 3:
        message = (
            f"{n_vertices} vertices and no faces: this is a point cloud, not a mesh; reconstruct a surface "
            "first, or use the functions that take points"
        )
        raise MeshError(message)
    bad = np.flatnonzero(((faces < 0) | (faces >= n_vertices)).any(axis=1))
    if bad.size:
        hint = "; faces count from 0, these may count from 1" if faces.min() >= 1 else ""
        message = (
            f"{bad.size} of {len(faces)} faces name vertices outside 0..{n_vertices - 1}, first faces "
            f"{first_indices(bad)}{hint}"
        )
        raise MeshError(message)
    return faces


def _unit_rows(rows: FloatArray) -> FloatArray:
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    unit: FloatArray = np.divide(rows, lengths, out=np.zeros_like(rows), where=lengths > 0)
    return unit
