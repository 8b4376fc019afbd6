"""Sparse correspondence: a few points of two surfaces matched by their signatures (section 3.6.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist

from .._arrays import FloatArray, IntArray, as_floats, as_indices, frozen
from ..descriptors import bde
from ..errors import InputError
from ..mesh import Mesh
from ..spectral import Spectrum, eigenbasis, joint_embedding
from ._signatures import standardised
from .refine import biharmonic_samples

__all__ = ["Correspondence", "correspond"]

_PAIRS = 100


@dataclass(frozen=True, eq=False, repr=False)
class Correspondence:
    """Matched points of two surfaces, the surest first.

    Parameters
    ----------
    points_a, points_b : (m,) array of int
        Vertex ``points_a[i]`` of a matches vertex ``points_b[i]`` of b.
    confidence : (m,) array of float
        1 - (distance of the match) / (distance of the best other candidate), the worse of both directions: 1 is beyond
        doubt, 0 a coin's toss.
    distances : (m,) array of float
        Distances in the joint embedding.
    """

    points_a: IntArray
    points_b: IntArray
    confidence: FloatArray
    distances: FloatArray

    def __post_init__(self) -> None:
        for name in ("points_a", "points_b"):
            object.__setattr__(self, name, frozen(as_indices(getattr(self, name), name)))
        for name in ("confidence", "distances"):
            object.__setattr__(self, name, frozen(as_floats(getattr(self, name), name)))

    def __len__(self) -> int:
        return len(self.points_a)

    def __repr__(self) -> str:
        return f"Correspondence({len(self)} pairs)"

    def surest(self, count: int) -> Correspondence:
        """Return the first ``count`` pairs, or all where there are fewer."""
        if count < 0:
            message = f"count must be 0 or more, got {count}"
            raise InputError(message)
        return Correspondence(
            self.points_a[:count], self.points_b[:count], self.confidence[:count], self.distances[:count]
        )


def correspond(
    a: Mesh | Spectrum,
    b: Mesh | Spectrum,
    *,
    samples: int = 200,
    dim: int = 20,
    descriptors: tuple[ArrayLike, ArrayLike] | None = None,
    least_confidence: float = 0.0,
) -> Correspondence:
    """Match a few points of two surfaces by their signatures, in a joint spectral embedding.

    The biharmonic density estimate at many radii, standardised, is the signature of farthest points of both
    surfaces. Their joint affinity (eq. 3.5-3.7) is embedded by its leading eigenvectors, and
    points that are each other's nearest there are matched.

    Parameters
    ----------
    a, b : Mesh or Spectrum
        The surfaces; of meshes 100 eigenpairs are computed.
    samples : int
        Points of each surface to match, farthest points by biharmonic distance, so that tips come first.
    dim : int
        Coordinates of the joint embedding; fewer where the samples give fewer.
    descriptors : ((n_a, d), (n_b, d)) arrays of float, optional
        Match by these instead of the estimate.
    least_confidence : float
        Drop pairs below this confidence.

    Returns
    -------
    Correspondence
        At most ``samples`` pairs, the surest first; one point of a for each of b.

    Raises
    ------
    InputError
        If an option is out of range or descriptors do not fit.

    Notes
    -----
    Nothing here knows left from right: a point may be matched with the mirror image of its counterpart, one
    independently of the next. :func:`pliant.dense_map` decides that, for surfaces that are near isometric.
    Cost: (2 samples)^3.

    References
    ----------
    .. [1] A. Mukhopadhyay, Geometric analysis of shapes and its application to medical image analysis, PhD
       dissertation, University of Georgia, 2014, section 3.6.2.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant import eigenbasis, shapes
    >>> shape = shapes.ellipsoid([1, 0.8, 0.5], 2)
    >>> spectrum = eigenbasis(shape, 30)
    >>> same = correspond(spectrum, spectrum, samples=40, descriptors=(shape.vertices, shape.vertices))
    >>> len(same), bool((same.points_a == same.points_b).all())
    (40, True)
    """
    if isinstance(samples, bool) or int(samples) != samples or samples < 3:
        message = f"samples must be a whole number of 3 or more, got {samples}"
        raise InputError(message)
    if isinstance(dim, bool) or int(dim) != dim or dim < 1:
        message = f"dim must be a whole number of 1 or more, got {dim}"
        raise InputError(message)
    if not 0 <= least_confidence <= 1:
        message = f"least_confidence must lie between 0 and 1, got {least_confidence}"
        raise InputError(message)
    spectrum_a, spectrum_b = _spectrum(a), _spectrum(b)
    f_a, f_b = standardised(spectrum_a, spectrum_b, descriptors, bde)
    at_a, at_b = biharmonic_samples(spectrum_a, samples), biharmonic_samples(spectrum_b, samples)
    embedded = joint_embedding(f_a[at_a], f_b[at_b], min(dim, len(at_a) + len(at_b) - 2))
    between = cdist(*embedded)
    forth, back = between.argmin(axis=1), between.argmin(axis=0)
    i = np.flatnonzero(back[forth] == np.arange(len(at_a)))
    j = forth[i]
    confidence = np.minimum(_margins(between, i, j), _margins(between.T, j, i))
    order = np.lexsort((between[i, j], -confidence))
    order = order[confidence[order] >= least_confidence]
    return Correspondence(at_a[i][order], at_b[j][order], confidence[order], between[i, j][order])


def _margins(between: FloatArray, rows: IntArray, matches: IntArray) -> FloatArray:
    """1 - nearest / second nearest of each row."""
    nearest = between[rows, matches]
    others = between[rows].copy()
    others[np.arange(len(rows)), matches] = np.inf
    second = others.min(axis=1, initial=np.inf)
    # Copies are told apart by rounding only, which is no reason to be sure.
    rounding = 1e-9 * between.max()
    margins: FloatArray = (second - nearest) / np.maximum(second + rounding, np.finfo(float).tiny)
    return margins


def _spectrum(surface: Mesh | Spectrum) -> Spectrum:
    if isinstance(surface, Spectrum):
        return surface
    return eigenbasis(surface, min(_PAIRS, surface.n_vertices - 1))
