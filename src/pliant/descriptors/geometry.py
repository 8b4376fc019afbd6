"""Signatures from curvature and from geodesic distances."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats, vertex_indices
from ..errors import InputError
from ..geodesic import geodesic_distances
from ..mesh import Mesh, principal_curvatures

__all__ = ["curvature_signature", "geodesic_context"]

_DEFAULT_SCALES = (3.0, 6.0)


def curvature_signature(
    mesh: Mesh, *, scales: ArrayLike = _DEFAULT_SCALES, n_jobs: int | None = None
) -> FloatArray:
    """Return curvedness and shape index of every vertex at several scales, ready to compare by L2.

    For each scale two columns: ``arcsinh`` of curvedness times the root of the surface's area (so size
    does not matter, and sharp creases do not drown the rest), and the shape index mapped to -1 (pit) to 1 (peak).

    Parameters
    ----------
    mesh : Mesh
        Consistently wound, normals outwards where it is closed.
    scales : (s,) array_like of float
        Radii of the neighbourhoods, in mean edge lengths.
    n_jobs : int, optional
        Threads.

    Returns
    -------
    (n, 2 s) array of float
        Columns (curvedness, shape) scale by scale. Flat places have 0 in both; so have vertices without
        curvature (fewer than six vertices in reach).

    Raises
    ------
    InputError
        If the scales are not positive and finite.
    MeshError
        If no edge of the mesh has a length.

    Notes
    -----
    Unlike the other signatures this one sees bending: it changes with pose. Two shapes compare only where
    their mean edge lengths are alike. Cost: that of :func:`pliant.principal_curvatures` a scale.

    Examples
    --------
    >>> from pliant import shapes
    >>> curvature_signature(shapes.icosphere(3)).shape
    (642, 4)
    """
    lengths = np.atleast_1d(as_floats(scales, "scales"))
    if lengths.ndim != 1 or not lengths.size or not (np.isfinite(lengths) & (lengths > 0)).all():
        raise InputError("scales must be one or more positive numbers, in mean edge lengths")
    mean = float(mesh.edge_lengths.mean()) if len(mesh.edge_lengths) else 0.0
    columns = []
    for scale in lengths:
        found = principal_curvatures(mesh, radius=scale * mean or None, n_jobs=n_jobs)
        bend = np.arcsinh(found.curvedness * np.sqrt(mesh.area))
        columns += [np.nan_to_num(bend), np.nan_to_num(1 - 2 * found.shape_index)]
    return np.column_stack(columns)


def geodesic_context(
    mesh: Mesh,
    samples: ArrayLike,
    *,
    bins: int = 10,
    n_jobs: int | None = None,
    progress: bool = False,
) -> FloatArray:
    """Histogram each vertex's geodesic distances to sampled points (section 5.4's geodesic context descriptor).

    Parameters
    ----------
    mesh : Mesh
    samples : (s,) array_like of int
        Sampled vertices: drawn at random, or farthest points.
    bins : int
        Bins of equal width from 0 to the vertex's largest finite distance to a sample: distances are normalised a
        vertex at a time.
    n_jobs, progress
        As for :func:`pliant.geodesic_distances`.

    Returns
    -------
    (n, bins) array of float
        Shares of the samples that can be reached; rows sum to 1, or to 0 where none can.

    Raises
    ------
    InputError
        If there is no sample, one is not a vertex, or ``bins`` is below 1.

    Notes
    -----
    Distances run along edges and overestimate by up to about 15 per cent. Cost: one shortest-path tree a
    sample; memory s n numbers.

    Examples
    --------
    >>> from pliant import shapes
    >>> context = geodesic_context(shapes.icosphere(2), [0, 5, 40, 100], bins=4)
    >>> context.shape, float(context.sum(axis=1).max())
    ((162, 4), 1.0)
    """
    chosen = vertex_indices(samples, mesh.n_vertices, "samples")
    if bins < 1 or not chosen.size:
        message = (
            f"geodesic_context needs one sample or more and bins of 1 or more, got {chosen.size} and {bins}"
        )
        raise InputError(message)
    distances = geodesic_distances(mesh, chosen, n_jobs=n_jobs, progress=progress).T
    reached = np.isfinite(distances)
    largest = np.where(reached, distances, 0.0).max(axis=1, keepdims=True)
    ratio = np.where(reached, distances, 0.0) / np.where(largest > 0, largest, 1.0)
    slot = np.minimum((ratio * bins).astype(np.int64), bins - 1)
    rows = np.broadcast_to(np.arange(len(distances))[:, None], slot.shape)
    counts = np.bincount((rows * bins + slot)[reached], minlength=len(distances) * bins).reshape(-1, bins)
    context: FloatArray = counts / np.maximum(reached.sum(axis=1, keepdims=True), 1)
    return context
