"""The geodesic context histogram: how a field is distributed around each vertex (dissertation section 2.3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats, vertex_indices
from ..errors import InputError, first_indices
from .nearest import Neighbourhoods


def gch(
    field: ArrayLike,
    neighbours: Neighbourhoods | ArrayLike,
    *,
    bins: int = 10,
    edges: ArrayLike | None = None,
) -> FloatArray:
    """Histogram a field over each vertex's neighbourhood.

    Parameters
    ----------
    field : (n,) array_like of float
        A value a vertex, such as :func:`pliant.gfe`.
    neighbours : Neighbourhoods, or (s, k) array_like of int
        What :func:`pliant.nearest` returns, or a row of vertex numbers for each histogram.
    bins : int
        Number of bins, placed by :func:`pliant.gch_edges`; the dissertation uses 10 with 50 neighbours.
    edges : (bins + 1,) array_like of float, optional
        Bin edges instead. **Shapes are only comparable over common edges**: take :func:`pliant.gch_edges`
        of all their fields together.

    Returns
    -------
    (s, bins) array of float
        Each row sums to 1 (an empty neighbourhood gives zeros). Values beyond the edges count in the
        first or last bin.

    Raises
    ------
    InputError
        If the field is not finite, the edges do not ascend, or a neighbour is not a vertex.

    Notes
    -----
    Cost: one pass over the neighbourhoods.

    Examples
    --------
    >>> gch([0.0, 1.0, 2.0, 3.0], [[0, 1], [2, 3]], bins=2)
    array([[1., 0.],
           [0., 1.]])
    """
    values = _finite(field)
    limits = gch_edges(values, bins=bins) if edges is None else _ascending(edges)
    if isinstance(neighbours, Neighbourhoods):
        members, offsets = neighbours.vertices, neighbours.offsets
    else:
        table = np.asarray(neighbours)
        if table.ndim != 2:
            message = f"neighbours must be Neighbourhoods or an (s, k) array, got shape {table.shape}"
            raise InputError(message)
        members, offsets = table.ravel(), np.arange(len(table) + 1) * table.shape[1]
    members = vertex_indices(members, len(values), "neighbours")
    n_bins = len(limits) - 1
    bin_of = np.clip(np.searchsorted(limits, values, side="right") - 1, 0, n_bins - 1)
    sizes = np.diff(offsets)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    counts = np.bincount(owner * n_bins + bin_of[members], minlength=len(sizes) * n_bins)
    histograms: FloatArray = counts.reshape(len(sizes), n_bins) / np.maximum(sizes, 1)[:, None]
    return histograms


def gch_edges(*fields: ArrayLike, bins: int = 10, percentile: float = 98.0) -> FloatArray:
    """Bin edges of equal width that suit one or several fields, so that their histograms compare.

    Parameters
    ----------
    *fields : (n,) array_like of float
        One field, or those of all the shapes to be compared.
    bins : int
        Number of bins.
    percentile : float
        The last edge is this percentile of all values, which :func:`pliant.gch` then counts in the last bin. A
        geodesic field has a long tail: with 100, nearly every vertex would land in the first bin.

    Returns
    -------
    (bins + 1,) array of float

    Raises
    ------
    InputError
        If there is no field, one is not finite, ``bins`` is below 1 or ``percentile`` not in (0, 100].

    Examples
    --------
    >>> gch_edges([0.0, 2.0], [1.0, 5.0], bins=5, percentile=100)
    array([0., 1., 2., 3., 4., 5.])
    """
    if bins < 1:
        message = f"bins must be at least 1, got {bins}"
        raise InputError(message)
    if not 0 < percentile <= 100:
        message = f"percentile must lie in (0, 100], got {percentile}"
        raise InputError(message)
    if not fields:
        raise InputError("gch_edges needs at least one field")
    values = np.concatenate([_finite(field) for field in fields])
    low, high = float(values.min()), float(np.percentile(values, percentile))
    # A constant field still needs bins of some width.
    return np.linspace(low, high if high > low else low + 1.0, bins + 1)


def _finite(field: ArrayLike) -> FloatArray:
    values = as_floats(field, "field")
    if values.ndim != 1 or not values.size:
        message = f"field must have one value a vertex, got shape {values.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        message = f"field: {bad.size} values are not finite, first at vertices {first_indices(bad)}"
        raise InputError(message)
    return values


def _ascending(edges: ArrayLike) -> FloatArray:
    limits = as_floats(edges, "edges")
    if limits.ndim != 1 or len(limits) < 2 or not (np.diff(limits) > 0).all():
        raise InputError("edges must be at least two ascending numbers")
    return limits
