"""Joint geometric embedding: features of two images in one spectral space, and who is whose nearest there."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist, pdist

from .._arrays import FloatArray, IntArray, as_floats
from ..errors import InputError
from ..spectral import joint_embedding

__all__ = ["embed_pair", "mutual_matches"]


def embed_pair(
    features1: ArrayLike, features2: ArrayLike, dim: int = 30, *, spread: float = 3.0
) -> tuple[FloatArray, FloatArray]:
    """Place the features of two images in the eigenvectors of their joint graph.

    Euclidean distance between rows of the two results is the joint geometric embedding distance (JGED, eq. 6.5).

    Parameters
    ----------
    features1, features2 : (n1, d), (n2, d) array_like of float
        Descriptors, such as from :func:`geometric_blur`.
    dim : int
        Eigenvectors, the trivial one not counted. With fewer than about 30, distance in the embedding tells true
        from false matches worse than distance between the descriptors themselves. At most n1 + n2 - 2 are used.
    spread : float
        The affinity is exp(-d^2 / (spread x median d^2)). The bare exp(-d^2) of eq. 6.3 depends on the
        descriptors' unit.

    Returns
    -------
    embedding1, embedding2 : (n1, k), (n2, k) arrays of float
        Rows of length 1, k = min(dim, n1 + n2 - 2).

    Raises
    ------
    InputError
        If the features do not fit together, are fewer than three in all, or are all alike.

    Notes
    -----
    Source: eq. 6.2-6.5 of the dissertation (there dim = 20). Cost: (n1 + n2)^3; 0.1 s for 300 + 300 points.

    Examples
    --------
    >>> import numpy as np
    >>> features = np.random.default_rng(0).random((30, 8))
    >>> one, two = embed_pair(features, features[::-1], 10)
    >>> bool(np.allclose(one, two[::-1]))
    True
    """
    both = [as_floats(features1, "features1"), as_floats(features2, "features2")]
    if dim < 1 or not spread > 0:
        message = f"dim must be 1 or more and spread positive, got {dim} and {spread}"
        raise InputError(message)
    if any(f.ndim != 2 for f in both) or both[0].shape[1] != both[1].shape[1]:
        message = f"features must be (n, d) of one d, got {both[0].shape} and {both[1].shape}"
        raise InputError(message)
    count = len(both[0]) + len(both[1])
    if count < 3 or not len(both[0]) or not len(both[1]):
        message = f"an embedding needs three points in all and one in each image, got {len(both[0])} and {len(both[1])}"
        raise InputError(message)
    median = float(np.median(pdist(np.vstack(both), "sqeuclidean")))
    if not median > 0:
        raise InputError("more than half of the features are alike: there is nothing to embed them by")
    return joint_embedding(both[0], both[1], min(dim, count - 2), scale=spread * median, unit_rows=True)


def mutual_matches(features1: ArrayLike, features2: ArrayLike) -> tuple[IntArray, FloatArray]:
    """Pair the rows of two arrays that are each other's nearest.

    Parameters
    ----------
    features1, features2 : (n1, d), (n2, d) array_like of float
        Descriptors or embeddings.

    Returns
    -------
    pairs : (m, 2) array of int
        Rows of the first and of the second, nearest pair first.
    distances : (m,) array of float

    Examples
    --------
    >>> pairs, distances = mutual_matches([[0.0], [1.0], [5.0]], [[4.5], [0.1]])
    >>> pairs.tolist()
    [[0, 1], [2, 0]]
    """
    one, two = as_floats(features1, "features1"), as_floats(features2, "features2")
    if not len(one) or not len(two):
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0)
    distances = cdist(one, two)
    there, back = distances.argmin(axis=1), distances.argmin(axis=0)
    first = np.flatnonzero(back[there] == np.arange(len(one)))
    found = distances[first, there[first]]
    order = np.argsort(found, kind="stable")
    return np.column_stack([first, there[first]])[order], found[order]
