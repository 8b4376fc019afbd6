"""The space of symmetries: how far functional maps are from the diagonal, and which of them are alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from ..._arrays import FloatArray, IntArray, as_floats
from ...errors import InputError
from ...spectral import Spectrum
from ...spectral.kernels import biharmonic_embedding
from .result import Symmetry

__all__ = ["ComplexityForm", "complexity", "group_symmetries", "symmetry_space"]

# Least mean silhouette of a division that is believed.
_STRUCTURE = 0.5

ComplexityForm = Literal["literal", "absolute", "squared"]


def complexity(matrix: ArrayLike, *, form: ComplexityForm = "squared", k: int | None = 20) -> float:
    """Return how far a functional map is from a diagonal one: the coordinate in the symmetry space (eq. 4.6).

    ``sum_ij w_ij g(c_ij) / k`` with ``w_ij = 1 - exp(-d_ij^2)`` and d_ij the distance of the entry (i, j) from the
    diagonal, ``|i - j| / sqrt(2)``. An exact symmetry of a surface without repeated eigenvalues has 0.

    Parameters
    ----------
    matrix : (m, m) array_like of float
        A functional map.
    form : {"squared", "absolute", "literal"}
        g(c): c squared, which for an orthogonal map gives the share of it off the diagonal, from 0 to 1;
        the absolute value; or c itself, as eq. 4.6 is printed, where entries of opposite sign cancel and which orders
        nothing.
    k : int, optional
        Eigenfunctions used, at most; all for None. Higher ones measure the mesh rather than the shape.

    Returns
    -------
    float
        Eq. 4.6 over the number of eigenfunctions used.

    Raises
    ------
    InputError
        If the matrix is not square and finite, the form is unknown or k is not positive.

    Notes
    -----
    Within a repeated eigenvalue the basis is arbitrary, and so is this number.

    References
    ----------
    Dissertation, section 4.3, eq. 4.6.

    Examples
    --------
    >>> complexity([[1, 0], [0, -1]])
    0.0
    >>> round(complexity([[0, 1], [1, 0]]), 4)
    0.3935
    >>> complexity([[0, 1], [-1, 0]], form="literal")
    0.0
    """
    array = as_floats(matrix, "matrix")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not array.size:
        message = f"matrix must be square, (m, m), got shape {array.shape}"
        raise InputError(message)
    if not np.isfinite(array).all():
        raise InputError("matrix must be finite")
    if k is not None and (isinstance(k, bool) or int(k) != k or k < 1):
        message = f"k must be a whole number of 1 or more, or None; got {k}"
        raise InputError(message)
    size = len(array) if k is None else min(int(k), len(array))
    entries = array[:size, :size]
    if form == "squared":
        entries = entries**2
    elif form == "absolute":
        entries = np.abs(entries)
    elif form != "literal":
        message = f"form must be 'squared', 'absolute' or 'literal', got {form!r}"
        raise InputError(message)
    rows, columns = np.indices(entries.shape)
    weights = -np.expm1(-((rows - columns) ** 2) / 2)
    return float((weights * entries).sum() / size)


def symmetry_space(
    symmetries: Sequence[Symmetry], *, form: ComplexityForm = "squared", k: int | None = 20
) -> FloatArray:
    """Place symmetries in the one-dimensional symmetry space: exact isometries at 0, the rest farther out.

    Parameters
    ----------
    symmetries : sequence of Symmetry
    form : {"squared", "absolute", "literal"}
        See :func:`complexity`.
    k : int, optional
        Eigenfunctions used, at most.

    Returns
    -------
    (s,) array of float
        Coordinates. How far two symmetries are apart is the absolute difference.

    Notes
    -----
    Global maps are measured in the surface's eigenbasis and partial ones in their regions': compare within a
    kind. Where eigenvalues are nearly repeated, as on round limbs, an exact isometry may lie off 0.

    References
    ----------
    Dissertation, section 4.4 and Fig. 4.5.

    Examples
    --------
    >>> symmetry_space([])
    array([], dtype=float64)
    """
    return np.array([complexity(one.fmap, form=form, k=k) for one in symmetries], dtype=np.float64)


def group_symmetries(
    symmetries: Sequence[Symmetry],
    spectrum: Spectrum,
    *,
    count: int | None = None,
    k: int = 12,
    rng: int | np.random.Generator = 0,
) -> IntArray:
    """Sort symmetries into groups of like maps: k-means, after deciding for each which region is the source.

    Parameters
    ----------
    symmetries : sequence of Symmetry
        Of one surface.
    spectrum : Spectrum
        Of that surface.
    count : int, optional
        Groups of partial symmetries. By default the number, from 2 up to one less than there are maps, with the largest
        mean silhouette, if that is 0.5 or more (Kaufman and Rousseeuw's bound of reasonable structure); else one.
    k : int
        Eigenfunctions of the maps that are compared.
    rng : int or numpy.random.Generator
        Seed of k-means (best of ten starts).

    Returns
    -------
    (s,) array of int
        Group of each, numbered from 0 within each kind, in the order in which they first appear.

    Raises
    ------
    InputError
        If ``count`` or ``k`` is out of range.

    Notes
    -----
    Every pair could as well be taken from target to source. As in the dissertation the direction is that of the
    smaller total biharmonic distance, source to source and target to target, from the first one. Regions have their own
    eigenbases, whose signs are arbitrary, so entries are compared squared; those of global maps, all in one basis, as
    they are. Different kinds are never in one group.

    References
    ----------
    Dissertation, section 4.5.8 and Fig. 4.11; L. Kaufman, P. J. Rousseeuw, Finding groups in data, 1990.

    Examples
    --------
    >>> from pliant import shapes, eigenbasis
    >>> group_symmetries([], eigenbasis(shapes.icosphere(2), 10))
    array([], dtype=int64)
    """
    for name, value in (("count", count), ("k", k)):
        if value is not None and (isinstance(value, bool) or int(value) != value or value < 1):
            message = f"{name} must be a whole number of 1 or more, got {value}"
            raise InputError(message)
    labels = np.zeros(len(symmetries), dtype=np.int64)
    for kind in ("global", "partial"):
        which = [i for i, one in enumerate(symmetries) if one.kind == kind]
        chosen = [symmetries[i] for i in which]
        if kind == "partial":
            maps = [matrix[:k, :k] ** 2 for matrix in _one_way(chosen, spectrum)]
        else:
            maps = [one.fmap[:k, :k] for one in chosen]
        if len(maps) > 1:
            labels[which] = _grouped(_rows(maps, k), count if kind == "partial" else None, rng)
    return labels


def _one_way(symmetries: Sequence[Symmetry], spectrum: Spectrum) -> list[FloatArray]:
    """Return maps, transposed where the way back suits the first one's direction better."""
    embedding = biharmonic_embedding(spectrum)
    masses: FloatArray = np.asarray(spectrum.mass.sum(axis=1)).ravel()
    centres = [
        [np.average(embedding[mask], axis=0, weights=masses[mask]) for mask in (one.source, one.target)]
        for one in symmetries
    ]
    found = []
    for one, (source, target) in zip(symmetries, centres, strict=True):
        first, second = centres[0]
        straight = np.linalg.norm(source - first) + np.linalg.norm(target - second)
        crossed = np.linalg.norm(target - first) + np.linalg.norm(source - second)
        found.append(one.fmap if straight <= crossed else one.fmap.T)
    return found


def _rows(maps: Sequence[FloatArray], k: int) -> FloatArray:
    rows = np.zeros((len(maps), k, k))
    for row, matrix in zip(rows, maps, strict=True):
        row[: len(matrix), : len(matrix)] = matrix
    return rows.reshape(len(maps), -1)


def _grouped(rows: FloatArray, count: int | None, rng: int | np.random.Generator) -> IntArray:
    from sklearn.cluster import KMeans
    from sklearn.metrics import silhouette_score

    seed = int(np.random.default_rng(rng).integers(2**31))
    distinct = len(np.unique(np.round(rows, 6), axis=0))
    best, labels = _STRUCTURE, np.zeros(len(rows), dtype=np.int64)
    counts = range(2, min(len(rows) - 1, distinct) + 1) if count is None else (min(count, distinct),)
    # Threads would sum in an order that differs from run to run.
    with threadpool_limits(1):
        for tried in counts:
            found = KMeans(tried, n_init=10, random_state=seed).fit(rows).labels_
            if count is not None:
                labels = found
                break
            score = float(silhouette_score(rows, found))
            if score >= best:
                best, labels = score, found
    first = np.unique(labels, return_index=True)[1]
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.asarray(rank[labels], dtype=np.int64)
