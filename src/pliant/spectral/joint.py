"""Two sets of features in one spectral embedding: what is alike lands together."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from .._arrays import FloatArray, as_floats
from ..errors import InputError, NumericalError, first_indices
from ._signs import fix_signs
from ._sparse import CsrArray, as_csr, diagonal_matrix, product, row_sums

__all__ = ["joint_embedding"]

Normalisation: TypeAlias = Literal["symmetric", "random-walk"]

# Up to this many points in all the whole affinity matrix is the simplest exact thing.
_DENSE = 3000
_DEFAULT_NEIGHBOURS = 30
_MEDIAN_SAMPLE = 2000


def joint_embedding(
    features_a: ArrayLike,
    features_b: ArrayLike,
    dim: int = 20,
    *,
    scale: float | Literal["median"] = "median",
    neighbours: int | None = None,
    normalisation: Normalisation = "symmetric",
    unit_rows: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """Embed two sets of feature vectors by the leading eigenvectors of their joint affinity.

    The affinity is ``[[W_a, C], [C^T, W_b]]`` with ``exp(-|f - g|^2 / s)`` in every block (the dissertation's
    eq. 3.5-3.7 for two surfaces, 6.2-6.4 for two images); it is normalised by its row sums and the
    first eigenvector, which is trivial, is dropped. Euclidean distance between rows of the results is the
    joint graph's spectral distance (eq. 6.5).

    Parameters
    ----------
    features_a : (na, d) array_like of float
    features_b : (nb, d) array_like of float
    dim : int
        Coordinates wanted, from 1 to na + nb - 2.
    scale : float or "median"
        s, in the features' unit squared. ``"median"``: the median squared distance between distinct points,
        so that nothing depends on the features' unit. ``scale=1`` is the bare formula of the text.
    neighbours : int, optional
        Keep each point's affinity to that many nearest points only, in its own set and in the other one each.
        Default: all up to 3,000 points in all, 30 past that.
    normalisation : {"symmetric", "random-walk"}
        Eigenvectors of D^-1/2 W D^-1/2, or of D^-1 W (constant on what is alike whatever its number).
    unit_rows : bool
        Whether rows are scaled to length 1.

    Returns
    -------
    embedding_a : (na, dim) array of float
    embedding_b : (nb, dim) array of float

    Raises
    ------
    InputError
        If the features are of different width, not finite or without spread, or an option is out of range.
    NumericalError
        If the affinities underflow: the scale is far below the features' squared distances.

    Notes
    -----
    A graph in several pieces is embedded as it is, and the leading coordinates tell the pieces apart.
    Deterministic: fixed start, first of each eigenvector's largest entries positive. Repeated eigenvalues
    fix only a subspace. Cost: (na + nb)^3 dense; (na + nb) neighbours dim sparse, plus the neighbour search.
    Do not compare coordinates of one call with those of another.

    Examples
    --------
    >>> import numpy as np
    >>> a = np.array([[0.0], [1.0], [5.0]])
    >>> left, right = joint_embedding(a, a[::-1], 2)
    >>> bool(np.allclose(left, right[::-1]))
    True
    """
    a, b = _checked(features_a, "features_a"), _checked(features_b, "features_b")
    _check_options(a, b, dim, neighbours, normalisation)
    both = np.vstack([a, b])
    squared_scale = _median_squared(both) if scale == "median" else _positive_scale(scale)
    n = len(both)
    if neighbours is None and n <= _DENSE:
        affinity = np.exp(-cdist(both, both, "sqeuclidean") / squared_scale)
        vectors, degrees = _dense_vectors(affinity, dim)
    else:
        graph = _neighbour_affinity(a, b, neighbours or _DEFAULT_NEIGHBOURS, squared_scale)
        vectors, degrees = _sparse_vectors(graph, dim)
    if normalisation == "random-walk":
        vectors = vectors / np.sqrt(degrees)[:, None]
        vectors /= np.linalg.norm(vectors, axis=0)
    vectors = np.array(vectors, order="C")
    fix_signs(vectors)
    if unit_rows:
        lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
        vectors = np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0)
    return np.ascontiguousarray(vectors[: len(a)]), np.ascontiguousarray(vectors[len(a) :])


def _checked(values: ArrayLike, name: str) -> FloatArray:
    features = as_floats(values, name)
    if features.ndim != 2 or not features.size:
        message = f"{name} must have shape (points, width) and not be empty, got {features.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(features).all(axis=1))
    if bad.size:
        message = f"{name}: {bad.size} of {len(features)} rows are not finite, first {first_indices(bad)}"
        raise InputError(message)
    return features


def _check_options(
    a: FloatArray, b: FloatArray, dim: int, neighbours: int | None, normalisation: str
) -> None:
    if a.shape[1] != b.shape[1]:
        message = (
            f"features must be of one width, got {a.shape[1]} and {b.shape[1]} columns; compute both with the "
            "same settings"
        )
        raise InputError(message)
    most = len(a) + len(b) - 2
    if not 1 <= dim <= most:
        message = f"dim must be 1..{most} for {len(a)} and {len(b)} points, got {dim}"
        raise InputError(message)
    if neighbours is not None and neighbours < 1:
        message = f"neighbours must be 1 or more, got {neighbours}"
        raise InputError(message)
    if normalisation not in get_args(Normalisation):
        message = f"normalisation must be 'symmetric' or 'random-walk', got {normalisation!r}"
        raise InputError(message)


def _positive_scale(scale: float | str) -> float:
    if isinstance(scale, str) or not np.isfinite(scale) or scale <= 0:
        message = f"scale must be 'median' or a positive number, got {scale!r}"
        raise InputError(message)
    return float(scale)


def _median_squared(features: FloatArray) -> float:
    """Return the median squared distance between distinct points, on an even sample where there are many."""
    step = max(1, len(features) // _MEDIAN_SAMPLE)
    sample = features[::step]
    squared = cdist(sample, sample, "sqeuclidean")
    positive = squared[squared > 0]
    if not positive.size:
        raise InputError("all feature vectors are alike: there is nothing to embed them by")
    return float(np.median(positive))


def _dense_vectors(affinity: FloatArray, dim: int) -> tuple[FloatArray, FloatArray]:
    degrees = affinity.sum(axis=1)
    root = np.sqrt(degrees)
    n = len(affinity)
    normalised = affinity / root / root[:, None]
    trivial = root / np.linalg.norm(root)
    # Taken out exactly (its eigenvalue 1 becomes -1): with several pieces it is one of many of its value.
    normalised -= 2 * trivial[:, None] * trivial
    _, vectors = scipy.linalg.eigh(
        0.5 * (normalised + normalised.T), subset_by_index=(n - dim, n - 1), check_finite=False
    )
    return vectors[:, ::-1], degrees


def _neighbour_affinity(a: FloatArray, b: FloatArray, neighbours: int, scale: float) -> CsrArray:
    """Return the joint affinity with each point's nearest in either set, made symmetric."""
    blocks = [[_block(a, a, neighbours, scale), _block(a, b, neighbours, scale)]]
    blocks.append([_block(b, a, neighbours, scale), _block(b, b, neighbours, scale)])
    graph = as_csr(sp.block_array(blocks, format="csr"))
    return as_csr(graph.maximum(graph.T))


def _block(queries: FloatArray, points: FloatArray, neighbours: int, scale: float) -> CsrArray:
    count = min(neighbours, len(points))
    distances, indices = cKDTree(points).query(queries, k=np.arange(1, count + 1))
    rows = np.repeat(np.arange(len(queries)), count)
    entries: Any = (np.exp(-(np.ravel(distances) ** 2) / scale), (rows, np.ravel(indices)))
    return as_csr(sp.coo_array(entries, shape=(len(queries), len(points))))


def _sparse_vectors(graph: CsrArray, dim: int) -> tuple[FloatArray, FloatArray]:
    degrees = row_sums(graph)
    n = len(degrees)
    lost = np.flatnonzero(degrees <= 0)
    if lost.size:
        message = f"{lost.size} of {n} points have no affinity to any other, first {first_indices(lost)}; raise scale"
        raise NumericalError(message)
    if n <= _DENSE or 4 * dim > n:
        return _dense_vectors(graph.toarray(), dim)
    root = np.sqrt(degrees)
    scaling = diagonal_matrix(1 / root)
    normalised = scaling @ graph @ scaling
    trivial = root / np.linalg.norm(root)

    def apply(vector: FloatArray) -> FloatArray:
        applied: FloatArray = product(normalised, vector) - 2 * trivial * (trivial @ vector)
        return applied

    start = np.random.default_rng(0).standard_normal(n)
    # Repeated leading eigenvalues, one a piece, are slow for a single start vector: give it room.
    pieces = int(connected_components(graph, directed=False)[0])
    krylov = min(n - 1, max(3 * dim, dim + 2 * pieces) + 40)
    try:
        operator = LinearOperator((n, n), matvec=apply, dtype=np.float64)
        values, vectors = eigsh(operator, dim, which="LA", v0=start, ncv=krylov, tol=1e-10)
    except (ArpackError, RuntimeError) as error:
        message = f"the joint embedding of {n} points did not converge: {error}"
        raise NumericalError(message) from error
    order = np.argsort(-values, kind="stable")
    return vectors[:, order], degrees
