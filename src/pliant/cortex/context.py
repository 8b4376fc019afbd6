"""The geodesic context histogram with everything that sets it, so that shapes are compared alike."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats
from ..errors import InputError, MeshError
from ..geodesic import estimate_gfe, gch, gch_edges, gfe, nearest
from ..geodesic.field import Weights
from ..geodesic.graph import GraphKind
from ..mesh import Mesh

__all__ = ["ContextSignature"]

_FLOOR = 1e-3


@dataclass(frozen=True)
class ContextSignature:
    """How geodesic context histograms are made: a function of a mesh, with its settings written down.

    Parameters
    ----------
    count : int, optional
        Vertices a neighbourhood; 50 where neither ``count`` nor ``radius`` is given (the dissertation's choice).
    radius : float, optional
        Geodesic radius of a neighbourhood instead, in the mesh's unit: comparable between resolutions.
    bins : int
        Bins a histogram.
    edges : tuple of float, optional
        Bin edges common to all that is compared; see :meth:`with_edges_of`. Without, each mesh gets its own.
    weights, graph
        As in :func:`pliant.gfe`.
    smoothing : int
        Before distances are measured, so many rounds in which each vertex moves half-way to the mean of its
        neighbours. Three remove most of what noise at the scale of an edge does to the field.
    scale : {"linear", "log"}
        Bins over the field, or over its natural logarithm. Traffic differs between places by orders of magnitude:
        linear bins see mostly how it changes where there is much of it, logarithmic ones see relative changes.
    percentile : float
        Common bins end at this percentile of all values, and begin at 100 less it where there are logarithms or
        negative values; what lies beyond counts in the outer bins. 99.9 for cumulative deviations, which need
        room on both sides.
    samples : int, optional
        On meshes of more vertices than this, estimate the field from so many sources; see
        :func:`pliant.estimate_gfe`. The draw is fixed, so the same mesh gives the same bytes.

    Examples
    --------
    >>> from pliant import shapes
    >>> ball, egg = shapes.icosphere(2), shapes.ellipsoid([1, 1, 1.4], 2)
    >>> signature = ContextSignature(count=20)
    >>> signature = signature.with_edges_of(signature.field(ball), signature.field(egg))
    >>> signature(ball).shape, len(signature.edges)
    ((162, 10), 11)
    """

    count: int | None = None
    radius: float | None = None
    bins: int = 10
    edges: tuple[float, ...] | None = None
    weights: Weights = "area"
    graph: GraphKind = "edges"
    smoothing: int = 0
    scale: Literal["linear", "log"] = "linear"
    percentile: float = 98.0
    samples: int | None = None

    def __post_init__(self) -> None:
        if self.count is not None and self.radius is not None:
            raise InputError("give count or radius, not both")
        if self.smoothing < 0:
            message = f"smoothing must be a number of rounds, at least 0, got {self.smoothing}"
            raise InputError(message)
        if self.scale not in ("linear", "log"):
            message = f'scale must be "linear" or "log", got {self.scale!r}'
            raise InputError(message)
        if not 50 < self.percentile <= 100:
            message = f"percentile must lie in (50, 100], got {self.percentile}"
            raise InputError(message)
        if self.samples is not None and self.samples < 32:
            message = f"samples must be at least 32, got {self.samples}"
            raise InputError(message)

    def surface(self, mesh: Mesh) -> Mesh:
        """Return the mesh as it is measured: smoothed where that is asked for."""
        return _smoothed(mesh, self.smoothing) if self.smoothing else mesh

    def field(self, mesh: Mesh, *, n_jobs: int | None = None) -> FloatArray:
        """(n,) geodesic field estimate of the smoothed mesh, or its logarithm.

        Where no path passes the logarithm is that of a thousandth of the median.
        """
        values = self._traffic(self.surface(mesh), n_jobs)
        return values if self.scale == "linear" else self.logarithm(values)

    def logarithm(self, field: ArrayLike) -> FloatArray:
        """(n,) natural logarithm of a field, floored at a thousandth of its median."""
        values = as_floats(field, "field")
        floor = _FLOOR * float(np.median(values))
        if not floor > 0:
            raise MeshError("paths pass less than half of the vertices: the field has no useful logarithm")
        logarithms: FloatArray = np.log(np.maximum(values, floor))
        return logarithms

    def _traffic(self, mesh: Mesh, n_jobs: int | None) -> FloatArray:
        if self.samples is None or mesh.n_vertices <= self.samples:
            return gfe(mesh, weights=self.weights, graph=self.graph, n_jobs=n_jobs)
        estimate = estimate_gfe(
            mesh, self.samples, weights=self.weights, graph=self.graph, rng=0, n_jobs=n_jobs
        )
        return estimate.values

    def histograms(
        self, mesh: Mesh, field: ArrayLike, vertices: ArrayLike | None = None, *, n_jobs: int | None = None
    ) -> FloatArray:
        """(s, bins) histograms of any per-vertex field around some vertices, or all."""
        near = nearest(
            self.surface(mesh),
            vertices,
            count=self.count,
            radius=self.radius,
            graph=self.graph,
            n_jobs=n_jobs,
        )
        return gch(field, near, bins=self.bins, edges=self.edges)

    def with_edges_of(self, *fields: ArrayLike) -> ContextSignature:
        """Return the same settings with bin edges that suit all the given fields together."""
        percentile = self.percentile
        edges = gch_edges(*fields, bins=self.bins, percentile=percentile)
        low = float(np.percentile(np.concatenate([np.ravel(field) for field in fields]), 100 - percentile))
        # Logarithms, curvature and depth have a tail on both sides.
        if (self.scale == "log" or edges[0] < 0) and low < edges[-1]:
            edges = np.linspace(low, edges[-1], self.bins + 1)
        return replace(self, edges=tuple(edges.tolist()))

    def __call__(self, mesh: Mesh) -> FloatArray:
        """(n, bins) histograms of the mesh's own field around every vertex."""
        return self.histograms(mesh, self.field(mesh))


def _smoothed(mesh: Mesh, rounds: int) -> Mesh:
    ends = mesh.edges
    n = mesh.n_vertices
    links = sp.coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n, n)).tocsr()
    links = links + links.T
    degrees = np.bincount(ends.ravel(), minlength=n)[:, None]
    at = mesh.vertices
    for _ in range(rounds):
        means = np.divide(np.asarray(links @ at), degrees, out=at.copy(), where=degrees > 0)
        at = 0.5 * (at + means)
    return mesh.with_vertices(at)
