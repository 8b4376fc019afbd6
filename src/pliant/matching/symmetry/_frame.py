"""What every stage of the search for symmetry shares: a spectrum's scale, embedding, signature and samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from ..._arrays import FloatArray, IntArray, frozen
from ...descriptors import wks
from ...errors import InputError
from ...mesh import Mesh
from ...spectral import Spectrum
from ...spectral.kernels import biharmonic_embedding
from .._neighbours import nearest_rows
from ..sampling import farthest_points

_ENERGIES = 100
_WIDTH = 7
# Channels of the signature have mean 1 on a surface; variation below this is the mesh's, not the shape's.
_FLOOR = 0.02
# Channels of low energy: finer ones show the mesh.
_SMOOTH = 60
# Higher pairs change biharmonic distances by less than the spacing of samples.
_EMBEDDED = 60
_SPACED = 20
# Samples that are kept: the first of many farthest points are those of few.
_SAMPLED = 1500


@dataclass(frozen=True, eq=False, repr=False)
class Frame:
    """A mesh and its spectrum, seen the way the search for symmetry needs them; parts are made when asked for."""

    mesh: Mesh
    spectrum: Spectrum

    def __post_init__(self) -> None:
        if self.spectrum.n_vertices != self.mesh.n_vertices:
            message = f"the spectrum has {self.spectrum.n_vertices} vertices, the mesh {self.mesh.n_vertices}"
            raise InputError(message)
        if self.spectrum.n_zero != 1:
            message = (
                f"the surface has {self.spectrum.n_zero} pieces; symmetry is sought on one: take "
                "pliant.largest_component(mesh)"
            )
            raise InputError(message)
        if self.spectrum.k < 30:
            message = f"the search for symmetry needs 30 eigenpairs at least, got {self.spectrum.k}"
            raise InputError(message)

    @cached_property
    def areas(self) -> FloatArray:
        """(n,) share of each vertex in the surface's area."""
        masses: FloatArray = np.asarray(self.spectrum.mass.sum(axis=1)).ravel()
        return frozen(masses / masses.sum())

    @cached_property
    def scale(self) -> float:
        """Root mean square of the biharmonic distance between two random points."""
        return float(np.sqrt(2 / self.spectrum.area * (self.spectrum.values[1:] ** -2.0).sum()))

    @cached_property
    def embedding(self) -> FloatArray:
        """(n, d) biharmonic embedding in units of :attr:`scale`."""
        return frozen(
            biharmonic_embedding(self.spectrum.truncated(min(_EMBEDDED, self.spectrum.k))) / self.scale
        )

    @cached_property
    def _channels(self) -> FloatArray:
        """(n, T) wave kernel signature (Aubry 2011), each channel's mean, 1 on every surface, taken off."""
        low, high = np.log(self.spectrum.values[[1, -1]])
        step = (high - low) / (_ENERGIES - 1 + 4 * _WIDTH)
        energies = low + step * (2 * _WIDTH + np.arange(_ENERGIES))
        channels = self.spectrum.area * wks(self.spectrum, energies=energies, width=_WIDTH * step)
        return frozen(channels - self.areas @ channels)

    @cached_property
    def signature(self) -> FloatArray:
        """(n, T) wave kernel signature, each channel over its standard deviation on the surface."""
        spread = np.sqrt(self.areas @ self._channels**2)
        return frozen(self._channels / np.maximum(spread, _FLOOR))

    @cached_property
    def variation(self) -> float:
        """Mean square of the signature: 1 unless channels vary so little that their scale was held up."""
        return float((self.areas @ self.signature**2).mean())

    @cached_property
    def weak_direction(self) -> float:
        """How much the signature changes along its weaker direction, over the stronger, on the mean: 0 to 1.

        Along the orbits of a continuous symmetry nothing changes, so there it is 0 but for the mesh's noise.
        """
        mesh = self.mesh
        first = mesh.vertices[mesh.faces[:, 1]] - mesh.vertices[mesh.faces[:, 0]]
        second = mesh.vertices[mesh.faces[:, 2]] - mesh.vertices[mesh.faces[:, 0]]
        # Channels as they are: those that vary little hold mostly the mesh's noise.
        low = self._channels[:, :_SMOOTH][mesh.faces]
        changes = np.stack([low[:, 1] - low[:, 0], low[:, 2] - low[:, 0]], axis=1)
        edges = np.stack([first, second], axis=1)
        metric = edges @ edges.transpose(0, 2, 1)
        good = np.linalg.det(metric) > 1e-8 * np.trace(metric, axis1=1, axis2=2) ** 2
        slopes = np.linalg.inv(metric[good]) @ changes[good] @ changes[good].transpose(0, 2, 1)
        trace, determinant = np.trace(slopes, axis1=1, axis2=2), np.linalg.det(slopes)
        root = np.sqrt(np.maximum(trace**2 / 4 - determinant, 0))
        strong, weak = trace / 2 + root, np.maximum(trace / 2 - root, 0)
        ratio = np.sqrt(np.divide(weak, strong, out=np.zeros_like(weak), where=strong > 0))
        return float(mesh.face_areas[good] @ ratio / mesh.face_areas[good].sum())

    @cached_property
    def neighbours(self) -> sp.csr_array:
        """(n, n) edges of the mesh, both ways."""
        tails, heads = self.mesh.edges.T
        both = (np.concatenate([tails, heads]), np.concatenate([heads, tails]))
        return sp.csr_array((np.ones(len(both[0])), both), shape=(self.mesh.n_vertices,) * 2)

    @cached_property
    def _outermost(self) -> IntArray:
        count = min(_SAMPLED, self.mesh.n_vertices)
        return frozen(farthest_points(self.embedding[:, :_SPACED], count))

    def samples(self, count: int, rng: int | np.random.Generator | None = None) -> IntArray:
        """Farthest points by biharmonic distance, from the one farthest out or from a random one."""
        if rng is None and count <= _SAMPLED:
            return self._outermost[:count]
        return farthest_points(self.embedding[:, :_SPACED], min(count, self.mesh.n_vertices), rng=rng)

    def distances(self, a: IntArray, b: IntArray) -> FloatArray:
        """(s, t) biharmonic distances between vertices, in units of :attr:`scale`."""
        left, right = self.embedding[a], self.embedding[b]
        squares = (left**2).sum(axis=1)[:, None] + (right**2).sum(axis=1) - 2 * left @ right.T
        distances: FloatArray = np.sqrt(np.maximum(squares, 0))
        return distances

    def signature_gaps(self, a: IntArray, b: IntArray) -> FloatArray:
        """(s,) squared distance of signatures over twice the number of channels: about 1 at random."""
        gaps = self.signature[a] - self.signature[b]
        squares: FloatArray = np.einsum("ij,ij->i", gaps, gaps) / (2 * gaps.shape[1])
        return squares


@dataclass(frozen=True, eq=False, repr=False)
class Coarse:
    """A surface reduced to samples that stand for the cells around them."""

    frame: Frame
    samples: IntArray

    @cached_property
    def cells(self) -> IntArray:
        """(n,) the nearest sample, by its place among the samples, of each vertex."""
        embedding = self.frame.embedding[:, :_SPACED]
        return frozen(nearest_rows(embedding[self.samples], embedding))

    @cached_property
    def weights(self) -> FloatArray:
        """(s,) share of each cell in the area."""
        return frozen(np.bincount(self.cells, weights=self.frame.areas, minlength=len(self.samples)))

    @cached_property
    def basis(self) -> FloatArray:
        """(s, k) eigenvectors at the samples, on the surface scaled to unit area."""
        spectrum = self.frame.spectrum
        return frozen(spectrum.vectors[self.samples] * spectrum.area**0.5)

    @cached_property
    def distances(self) -> FloatArray:
        """(s, s) biharmonic distances between samples, in units of the scale."""
        return frozen(self.frame.distances(self.samples, self.samples))

    @cached_property
    def faces(self) -> IntArray:
        """(s, 3) the corners of one face at each sample."""
        mesh = self.frame.mesh
        face = np.zeros(mesh.n_vertices, dtype=np.int64)
        face[mesh.faces.ravel()] = np.repeat(np.arange(mesh.n_faces), 3)
        return frozen(mesh.faces[face[self.samples]])

    def first(self, count: int) -> Coarse:
        """Return the reduction to the first samples, themselves farthest points."""
        return self if count >= len(self.samples) else Coarse(self.frame, self.samples[:count])
