"""One side of a search for a map: a surface scaled to unit area, seen at its samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import FloatArray, IntArray
from ..mesh import Mesh
from ..mesh.topology import edge_faces
from ..spectral import Spectrum
from ..spectral.kernels import biharmonic_embedding
from .functional_map import unit_vectors
from .refine import biharmonic_samples

# Eigenfunctions whose Jacobians tell the orientation of a map.
TURNING = 8


@dataclass(frozen=True, eq=False)
class Side:
    """What the search for a map reads of a surface.

    Parameters
    ----------
    spectrum : Spectrum
    samples : (s,) array of int
        Farthest points by biharmonic distance.
    basis : (s, k) array of float
        Eigenfunctions of the unit-area surface at the samples.
    values : (k,) array of float
        Its eigenvalues.
    places : (s, k') array of float
        Samples in the embedding of the biharmonic distance.
    descriptors : (s, d) array of float
    turns : (s, TURNING, TURNING) array of float or None
        Signed areas that each pair of eigenfunctions spans around each sample; None without an oriented mesh.
    """

    spectrum: Spectrum
    samples: IntArray
    basis: FloatArray
    values: FloatArray
    places: FloatArray
    descriptors: FloatArray
    turns: FloatArray | None

    def first(self, count: int) -> Side:
        """Return the same with the first samples only: they are farthest points too."""
        return Side(
            self.spectrum,
            self.samples[:count],
            self.basis[:count],
            self.values,
            self.places[:count],
            self.descriptors[:count],
            None if self.turns is None else self.turns[:count],
        )


def side_of(mesh: Mesh | None, spectrum: Spectrum, descriptors: FloatArray, samples: int, k: int) -> Side:
    """Prepare a surface; ``descriptors`` are (n, d), ``k`` how many eigenfunctions the search will use."""
    at = biharmonic_samples(spectrum, samples)
    return Side(
        spectrum,
        at,
        unit_vectors(spectrum, k)[at],
        spectrum.values[:k] * spectrum.area,
        biharmonic_embedding(spectrum.truncated(k))[at] / spectrum.area**0.5,
        descriptors[at],
        None if mesh is None or not is_oriented(mesh) else _turns(mesh, unit_vectors(spectrum, TURNING))[at],
    )


def is_oriented(mesh: Mesh) -> bool:
    """Return whether neighbouring triangles are wound alike, so that the surface has two sides."""
    sides = edge_faces(mesh)
    return bool(sides.agree.all()) and int(sides.counts.max(initial=0)) <= 2


def winding(mesh: Mesh) -> int:
    """Return -1 for a closed mesh wound inwards, else 1: of an open one the winding is taken at its word."""
    sides = edge_faces(mesh)
    if not (sides.counts == 2).all():
        return 1
    corners = mesh.vertices[mesh.faces] - mesh.vertices.mean(axis=0)
    return 1 if np.linalg.det(corners).sum() >= 0 else -1


def _turns(mesh: Mesh, functions: FloatArray) -> FloatArray:
    """(n, d, d): (grad f_i x grad f_j) . normal, averaged over the triangles around each vertex."""
    corners = functions[mesh.faces]  # (m, 3, d)
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # The area of the triangle's image in the plane (f_i, f_j), twice; dividing by the area comes at the end.
    images = u[:, :, None] * v[:, None, :] - v[:, :, None] * u[:, None, :]
    total = np.zeros((mesh.n_vertices, *images.shape[1:]))
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], images)
    areas = np.maximum(mesh.vertex_areas, 1e-12 * mesh.area)
    result: FloatArray = winding(mesh) * mesh.area * total / (6 * areas[:, None, None])
    return result
