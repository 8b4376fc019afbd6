"""Voting for symmetric pairs of points: who looks alike, and who is far from everybody else in the same way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..._arrays import BoolArray, FloatArray, IntArray, as_floats, frozen, vertex_indices
from ...errors import InputError
from ...mesh import Mesh
from ...spectral import Spectrum
from ._frame import Frame

__all__ = ["SymmetricPairs", "symmetric_pairs"]


@dataclass(frozen=True, eq=False, repr=False)
class SymmetricPairs:
    """Pairs of points that others vote to be symmetric, the most supported first.

    Parameters
    ----------
    sources, targets : (p,) array_like of int
        Vertices: a sample, and its partner anywhere on the surface.
    support : (p,) array_like of float
        Votes: samples with a partner of their own that agrees (eq. 4.5), each counted between 0 and 1.
    n_voters : int
        Samples with a partner of like signature (eq. 4.4): the most support there can be.
    scale : float
        Root mean square biharmonic distance of the surface, the unit of the thresholds.

    Examples
    --------
    >>> pairs = SymmetricPairs([3], [8], [12.5], 20, 1.0)
    >>> pairs
    SymmetricPairs(1 pairs of 20 voters, best support 12.5)
    """

    sources: IntArray
    targets: IntArray
    support: FloatArray
    n_voters: int
    scale: float

    def __post_init__(self) -> None:
        support = as_floats(self.support, "support")
        most = int(max(np.max(self.sources, initial=-1), np.max(self.targets, initial=-1))) + 1
        sources, targets = (vertex_indices(ends, most, "pairs") for ends in (self.sources, self.targets))
        if support.ndim != 1 or not len(sources) == len(targets) == len(support):
            sizes = f"{len(sources)}, {len(targets)}, {support.shape}"
            message = f"a pair needs a source, a target and a support; got {sizes}"
            raise InputError(message)
        object.__setattr__(self, "sources", frozen(sources))
        object.__setattr__(self, "targets", frozen(targets))
        object.__setattr__(self, "support", frozen(support))

    def __repr__(self) -> str:
        best = f"{self.support.max():.1f}" if len(self) else "none"
        return f"SymmetricPairs({len(self)} pairs of {self.n_voters} voters, best support {best})"

    def __len__(self) -> int:
        return len(self.sources)


def symmetric_pairs(
    mesh: Mesh,
    spectrum: Spectrum,
    *,
    samples: int = 100,
    partners: int = 6,
    signature_threshold: float = 0.1,
    least_distance: float = 0.15,
    width: float = 0.03,
    kept: float = 0.5,
    rng: int | np.random.Generator | None = None,
) -> SymmetricPairs:
    """Find pairs of points that are symmetric, by votes of samples.

    Parameters
    ----------
    mesh : Mesh
        In one piece.
    spectrum : Spectrum
        Of the mesh, 30 eigenpairs at least; 200 are good.
    samples : int
        Farthest points by biharmonic distance.
    partners : int
        Partners a sample may propose: the local minima of the distance of signatures, nearest first.
    signature_threshold : float
        Largest squared distance of signatures (T_WKS of eq. 4.4), in units where two random points have 1.
    least_distance : float
        Least biharmonic distance to a partner, times the scale: a point is always like its
        neighbours.
    width : float
        How far the distances of eq. 4.5 may differ, as a standard deviation, times the scale.
    kept : float
        Least support of a pair that is kept, as a share of the largest.
    rng : int or numpy.random.Generator, optional
        Draws the first sample; by default it is the point farthest out.

    Returns
    -------
    SymmetricPairs
        At most one pair a sample, its best supported. Empty where no sample has a partner.

    Raises
    ------
    InputError
        If the mesh is in pieces, the spectrum is not of this mesh or too short, or an option is out of range.

    Notes
    -----
    Pairing samples with samples fails: the mirror image of a sample is rarely a sample. So each is paired with
    vertices of the whole mesh. Cost: samples times vertices times 100 channels, and (samples partners)^2.

    Pairs of several symmetries come mixed; a pair speaks for the one that most voters share. A surface of
    revolution or a sphere gives pairs too, of no one symmetry.

    References
    ----------
    Dissertation, section 4.3, eq. 4.4 and 4.5; M. Aubry, U. Schlickewei, D. Cremers, The wave kernel signature, 2011.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> figure = shapes.quadruped(1000)
    >>> pairs = symmetric_pairs(figure.mesh, eigenbasis(figure.mesh, 60), samples=30)
    >>> bool((figure.symmetry[pairs.sources] == pairs.targets).mean() > 0.5)
    True
    """
    _check_options(samples, partners, signature_threshold, least_distance, width, kept)
    frame = Frame(mesh, spectrum)
    sources, targets = candidate_pairs(
        frame,
        frame.samples(samples, rng),
        partners=partners,
        signature_threshold=signature_threshold,
        least_distance=least_distance,
    )
    support = np.zeros(len(sources))
    if len(sources):
        starts = np.flatnonzero(np.diff(sources, prepend=-1))
        support = np.maximum.reduceat(agreements(frame, sources, targets, width), starts, axis=1).sum(axis=1)
    best = best_per_source(sources, support, kept)
    return SymmetricPairs(sources[best], targets[best], support[best], len(np.unique(sources)), frame.scale)


def candidate_pairs(
    frame: Frame,
    samples: IntArray,
    *,
    partners: int = 6,
    signature_threshold: float = 0.1,
    least_distance: float = 0.15,
) -> tuple[IntArray, IntArray]:
    """Pair samples with the local minima, over the mesh, of the distance of signatures: good voters."""
    signature = frame.signature
    squares = np.einsum("ij,ij->i", signature, signature)
    gaps = squares + squares[samples][:, None] - 2 * signature[samples] @ signature.T
    gaps /= 2 * signature.shape[1]
    edges = frame.neighbours
    sources, targets = [], []
    distances = frame.distances(samples, np.arange(frame.mesh.n_vertices))
    for sample, row, away in zip(samples, gaps, distances, strict=True):
        near = np.flatnonzero((row < signature_threshold) & (away > least_distance))
        lowest = near[_is_lowest(row, near, edges)]
        lowest = lowest[np.argsort(row[lowest], kind="stable")[:partners]]
        sources.append(np.full(len(lowest), sample))
        targets.append(lowest)
    return np.concatenate(sources).astype(np.int64), np.concatenate(targets).astype(np.int64)


def agreements(frame: Frame, sources: IntArray, targets: IntArray, width: float) -> FloatArray:
    """(p, p) how well pairs agree, in [0, 1] (eq. 4.5, soft)."""
    straight = frame.distances(sources, sources) - frame.distances(targets, targets)
    crossed = frame.distances(sources, targets)
    crossed = crossed - crossed.T
    agreement: FloatArray = np.exp(-(straight**2 + crossed**2) / (2 * width**2))
    return agreement


def _is_lowest(values: FloatArray, vertices: IntArray, edges: sp.csr_array) -> BoolArray:
    """Say which of some vertices have no neighbour with a smaller value."""
    sizes = np.diff(edges.indptr)[vertices]
    vertices = vertices[sizes > 0] if len(vertices) else vertices
    lowest = np.ones(len(sizes), dtype=bool)
    if len(vertices):
        rows = edges[vertices]
        least = np.minimum.reduceat(values[rows.indices], rows.indptr[:-1])
        lowest[sizes > 0] = values[vertices] <= least
    return lowest


def best_per_source(sources: IntArray, support: FloatArray, kept: float) -> IntArray:
    """Return the best supported pair of each source, where it has a share of the largest support."""
    order = np.lexsort((np.arange(len(sources)), -support))
    _, first = np.unique(sources[order], return_index=True)
    best = order[np.sort(first)]
    return best[support[best] >= kept * support.max(initial=0.0)] if len(best) else best


def _check_options(
    samples: int, partners: int, signature_threshold: float, least_distance: float, width: float, kept: float
) -> None:
    for name, count in (("samples", samples), ("partners", partners)):
        if isinstance(count, bool) or int(count) != count or count < 1:
            message = f"{name} must be a whole number of 1 or more, got {count}"
            raise InputError(message)
    for name, value in (
        ("signature_threshold", signature_threshold),
        ("least_distance", least_distance),
        ("width", width),
    ):
        if not (np.isfinite(value) and value > 0):
            message = f"{name} must be a positive number, got {value}"
            raise InputError(message)
    if not 0 <= kept <= 1:
        message = f"kept must be a share from 0 to 1, got {kept}"
        raise InputError(message)
