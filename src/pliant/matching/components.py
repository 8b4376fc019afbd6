"""Key components: the connected regions where a shape is locally distinctive (section 3.6.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse import csgraph
from threadpoolctl import threadpool_limits

from .._arrays import BoolArray, FloatArray, IntArray, frozen
from ..descriptors import bde
from ..errors import InputError
from ..mesh import Mesh
from ..spectral import Spectrum, eigenbasis
from .functional_map import checked_descriptors

__all__ = ["KeyComponents", "key_components"]


@dataclass(frozen=True, eq=False, repr=False)
class KeyComponents:
    """Where a shape is locally distinctive, and the connected pieces of that.

    Parameters
    ----------
    distinctive : (n,) array of bool
        Whether the vertex is in the distinctive cluster.
    labels : (n,) array of int
        Component of each vertex, -1 outside all of them; numbered by falling area.
    areas : (c,) array of float
        Area of each component, in the mesh's unit squared.
    clusters : (n,) array of int
        Cluster of each vertex; 0 is the shape's bulk.
    """

    distinctive: BoolArray
    labels: IntArray
    areas: FloatArray
    clusters: IntArray

    def __post_init__(self) -> None:
        for name in ("distinctive", "labels", "areas", "clusters"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.areas)

    def __getitem__(self, i: int) -> IntArray:
        """Vertices of component i."""
        if not -len(self) <= i < len(self):
            message = f"there are {len(self)} components, no number {i}"
            raise IndexError(message)
        return np.flatnonzero(self.labels == i % len(self))

    def __repr__(self) -> str:
        return f"KeyComponents({len(self)} components, {int(self.distinctive.sum())} of {len(self.labels)} vertices)"


def key_components(
    mesh: Mesh,
    *,
    radius: float = 0.1,
    spectrum: Spectrum | None = None,
    descriptor: ArrayLike | None = None,
    clusters: int = 2,
    least_area: float = 0.005,
    rng: int | np.random.Generator = 0,
) -> KeyComponents:
    """Find the regions where a shape is locally distinctive: paws, ears, the tip of the tail.

    k-means (k = 2) on the logarithm of the mean kernel in small biharmonic balls (eq. 3.3); the
    cluster of larger kernel is the distinctive one, and its connected pieces are the components.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    radius : float
        Radius of the estimate in units of the shape's root mean square biharmonic distance.
    spectrum : Spectrum, optional
        The mesh's eigenbasis, where it is at hand. Otherwise 100 pairs are computed.
    descriptor : (n,) or (n, d) array_like of float, optional
        Cluster this instead of the estimate; the bulk is then the cluster of largest area.
    clusters : int
        More than 2 tell kinds of distinctive regions apart; all but the bulk count as distinctive then.
    least_area : float
        Drop components below this share of the surface.
    rng : int or numpy.random.Generator
        Seed of k-means (best of ten starts). Two clusters of one number are found exactly and need none.

    Returns
    -------
    KeyComponents

    Raises
    ------
    InputError
        If an option is out of range, sizes do not fit, or the descriptor is the same everywhere.

    Notes
    -----
    The same for every rigid motion and scale, and stable under bending. Where the clusters are not separate,
    as on a sphere, k-means divides noise: look at the descriptor.

    References
    ----------
    .. [1] A. Mukhopadhyay, Geometric analysis of shapes and its application to medical image analysis, PhD
       dissertation, University of Georgia, 2014, section 3.6.1.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant import shapes
    >>> sphere = shapes.icosphere(3)
    >>> caps = key_components(sphere, descriptor=np.abs(sphere.vertices[:, 2]) > 0.8)
    >>> caps
    KeyComponents(2 components, 122 of 642 vertices)
    """
    if isinstance(clusters, bool) or int(clusters) != clusters or not 2 <= clusters <= mesh.n_vertices:
        message = f"clusters must be a whole number 2..{mesh.n_vertices}, got {clusters}"
        raise InputError(message)
    if not 0 <= least_area < 1:
        message = f"least_area must be a share of the surface, 0 to 1, got {least_area}"
        raise InputError(message)
    values = _density(mesh, spectrum, radius) if descriptor is None else np.asarray(descriptor)
    values = checked_descriptors(
        values[:, None] if values.ndim == 1 else values, mesh.n_vertices, "descriptor"
    )
    if not np.ptp(values, axis=0).any():
        raise InputError("the descriptor is the same everywhere; there is nothing distinctive")
    found = _clusters(values, mesh.vertex_areas, int(clusters), rng, by_value=descriptor is None)
    labels, areas = _components(mesh, found, least_area * mesh.area)
    return KeyComponents(labels >= 0, labels, areas, found)


def _density(mesh: Mesh, spectrum: Spectrum | None, radius: float) -> FloatArray:
    if spectrum is None:
        spectrum = eigenbasis(mesh, min(100, mesh.n_vertices - 1))
    if spectrum.n_vertices != mesh.n_vertices:
        message = f"the spectrum has {spectrum.n_vertices} vertices, the mesh {mesh.n_vertices}"
        raise InputError(message)
    density: FloatArray = bde(spectrum, [radius], statistic="mean", form="log")
    return density


def _clusters(
    values: FloatArray, areas: FloatArray, count: int, rng: int | np.random.Generator, *, by_value: bool
) -> IntArray:
    """(n,) clusters, the bulk first; vertices weigh by area, so that dense meshing draws no centre."""
    spread = values.std(axis=0)
    scaled = (values - values.mean(axis=0)) / np.where(spread > 0, spread, 1)
    weights = areas / areas.mean()
    raw = (
        _cut(scaled[:, 0], weights)
        if count == 2 and scaled.shape[1] == 1
        else _means(scaled, weights, count, rng)
    )
    held = np.bincount(raw, weights=areas, minlength=count)
    # Tips are far from everything, which makes the kernel large: that tells them from the bulk in every pose,
    # even where both have half of the area.
    means = np.bincount(raw, weights=areas * scaled[:, 0], minlength=count) / np.maximum(held, 1e-300)
    order = np.argsort(means if by_value else -held, kind="stable")
    rank = np.empty(count, dtype=np.int64)
    rank[order] = np.arange(count)
    return np.asarray(rank[raw], dtype=np.int64)


def _cut(values: FloatArray, weights: FloatArray) -> IntArray:
    """Return the best two means of numbers: on a line the optimum is a cut, and every cut can be tried."""
    order = np.argsort(values, kind="stable")
    ordered, mass = values[order], weights[order]
    below, total = np.cumsum(mass)[:-1], mass.sum()
    moment = np.cumsum(mass * ordered)[:-1]
    mean = (mass * ordered).sum() / total
    # Between-cluster scatter of a cut after each number; equal numbers stay together.
    parts = np.maximum(below * (total - below), np.finfo(float).tiny)
    scatter = np.where(np.diff(ordered) > 0, (moment - mean * below) ** 2 / parts, -1.0)
    cut = ordered[int(scatter.argmax())]
    return np.asarray(values > cut, dtype=np.int64)


def _means(values: FloatArray, weights: FloatArray, count: int, rng: int | np.random.Generator) -> IntArray:
    from sklearn.cluster import KMeans

    seed = int(np.random.default_rng(rng).integers(2**31))
    # Threads would sum in an order that differs from run to run.
    with threadpool_limits(1):
        found = KMeans(count, n_init=10, random_state=seed).fit(values, sample_weight=weights).labels_
    return np.asarray(found, dtype=np.int64)


def _components(mesh: Mesh, clusters: IntArray, least: float) -> tuple[IntArray, FloatArray]:
    """Label the connected pieces of every cluster but the first, by falling area."""
    ends = mesh.edges[clusters[mesh.edges[:, 0]] == clusters[mesh.edges[:, 1]]]
    n = mesh.n_vertices
    links = sp.coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n, n))
    pieces = csgraph.connected_components(links, directed=False)[1]
    areas: FloatArray = np.bincount(pieces, weights=np.where(clusters > 0, mesh.vertex_areas, 0.0)).astype(
        np.float64
    )
    kept = np.flatnonzero(areas > least)
    # Rounded, so that mirror twins stay in the order of their first vertices.
    kept = kept[np.argsort(-np.round(areas[kept] / mesh.area, 9), kind="stable")]
    number = np.full(len(areas), -1, dtype=np.int64)
    number[kept] = np.arange(len(kept))
    return number[pieces], areas[kept]
