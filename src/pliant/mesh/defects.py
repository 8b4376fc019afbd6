"""Defects as masks over faces and groups of vertices; what check-up and repair share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import BoolArray, FloatArray, IntArray
from .surface import Mesh
from .topology import EdgeFaces, grouped

__all__ = [
    "Winding",
    "degenerate_faces",
    "duplicate_faces",
    "equal_positions",
    "misoriented",
    "repeats_vertex",
]

# A triangle whose height is below this part of its longest edge has an area of rounding errors only.
_FLAT = 1e-12


def degenerate_faces(mesh: Mesh) -> BoolArray:
    """(m,) whether each face names a vertex twice, or has no area beyond rounding."""
    # Measured on the mesh scaled to its own size, so that no square over- or underflows.
    extent = np.abs(mesh.vertices).max()
    corners = (mesh.vertices / extent if extent > 0 else mesh.vertices)[mesh.faces]
    sides = corners[:, [1, 2, 0]] - corners
    longest = np.linalg.norm(sides, axis=2).max(axis=1, initial=0)
    unit = sides / np.where(longest > 0, longest, 1)[:, np.newaxis, np.newaxis]
    doubled = np.linalg.norm(np.cross(unit[:, 0], unit[:, 1]).reshape(-1, 3), axis=1)
    flat: BoolArray = doubled <= _FLAT
    return flat | repeats_vertex(mesh.faces)


def duplicate_faces(mesh: Mesh) -> BoolArray:
    """(m,) whether an earlier face has the same three vertices."""
    rows = np.sort(mesh.faces, axis=1)
    order = np.lexsort(rows.T)  # stable: the first of equals stays first
    again = np.zeros(mesh.n_faces, dtype=bool)
    again[order[1:]] = (rows[order[1:]] == rows[order[:-1]]).all(axis=1)
    return again


def equal_positions(vertices: FloatArray) -> IntArray:
    """(n,) group of each vertex among those at exactly its position, numbered by first vertex."""
    vertices = vertices + 0.0  # -0.0 is where 0.0 is
    order = np.lexsort(vertices.T)
    same = (vertices[order[1:]] == vertices[order[:-1]]).all(axis=1)
    return grouped(len(vertices), np.column_stack([order[:-1][same], order[1:][same]]))[1]


def repeats_vertex(faces: IntArray) -> BoolArray:
    """(m,) whether each row of (m, 3) names a vertex twice."""
    repeats: BoolArray = (faces == faces[:, [1, 2, 0]]).any(axis=1)
    return repeats


@dataclass(frozen=True, eq=False)
class Winding:
    """How the faces of a mesh are wound.

    Parameters
    ----------
    minority : (m,) bool array
        Faces wound against most of their piece.
    inward : (m,) bool array
        Faces of closed pieces whose majority points inwards.
    twisted : (m,) bool array
        Faces of pieces that cannot be wound alike.
    """

    minority: BoolArray
    inward: BoolArray
    twisted: BoolArray

    @property
    def turned(self) -> BoolArray:
        """(m,) faces that :func:`orient` turns."""
        return self.minority ^ self.inward


def misoriented(mesh: Mesh, sides: EdgeFaces) -> Winding:
    """Find faces wound against their piece, closed pieces turned inside out, and one-sided pieces."""
    neighbours = sides.pairs // 3
    _, piece = grouped(mesh.n_faces, neighbours)
    against, twisted = _against_first(mesh.n_faces, neighbours, sides.agree)
    n_pieces = int(piece.max()) + 1 if mesh.n_faces else 0
    sizes = np.bincount(piece, minlength=n_pieces)
    most_against = 2 * np.bincount(piece, weights=against, minlength=n_pieces) > sizes
    minority = (against ^ most_against[piece]) & ~twisted
    # Volumes of the consistently wound pieces, about the middle of the box to lose fewer digits.
    centred = mesh.vertices - (mesh.vertices.min(axis=0) / 2 + mesh.vertices.max(axis=0) / 2)
    centred /= max(float(np.abs(centred).max()), np.finfo(float).tiny)
    a, b, c = (centred[mesh.faces[:, k]] for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c).reshape(-1, 3)) * np.where(minority, -1, 1)
    volume = np.bincount(piece, weights=volumes, minlength=n_pieces)
    certain = 1e-12 * np.bincount(piece, weights=np.abs(volumes), minlength=n_pieces)
    inward = ((volume < -certain) & _closed(sides, piece, n_pieces))[piece] & ~twisted
    return Winding(minority, inward, twisted)


def _closed(sides: EdgeFaces, piece: IntArray, n_pieces: int) -> BoolArray:
    single = (sides.edge_of_side < 0) | (sides.counts[sides.edge_of_side] != 2)
    border = np.bincount(np.repeat(piece, 3), weights=single, minlength=n_pieces)
    closed: BoolArray = border == 0
    return closed


def _against_first(n_faces: int, neighbours: IntArray, agree: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Faces wound against the first face of their piece, and faces of pieces where that has no answer."""
    nothing = np.zeros(n_faces, dtype=bool)
    if agree.all():
        return nothing, nothing.copy()
    # The double cover: each face twice, as it is and turned. Two copies hang together where they are
    # wound alike; a face connected to its own turned copy sits on a one-sided surface.
    f, g = neighbours[:, 0], neighbours[:, 1]
    shift = np.where(agree, 0, n_faces)
    as_is = np.column_stack([f, g + shift])
    as_turned = np.column_stack([f + n_faces, g + n_faces - shift])
    _, label = grouped(2 * n_faces, np.concatenate([as_is, as_turned]))
    kept, turned = label[:n_faces], label[n_faces:]
    # Labels are numbered by first member, so the first face's own copy has the smaller one.
    return turned < kept, kept == turned
