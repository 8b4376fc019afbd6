"""The transform between two images: proposed by matched points, judged by all their edges."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .._arrays import BoolArray, FloatArray, IntArray
from .agreement import EvenEdges, agreement
from .alignment import aligned
from .blur import geometric_blur
from .correlation import shifts
from .embedding import embed_pair, mutual_matches
from .registration import agreeing, registrations
from .views import WORKING_SIZE, View

__all__ = ["Found", "found_transform", "joint_matches"]

#: Sizes at which the second image is described, so that the two may differ in size.
_SCALES = (1 / 1.4, 1.0, 1.4)
# Matches agree with a transform within 4 % of the working diagonal.
TOLERANCE = 0.04 * np.sqrt(2) * WORKING_SIZE
_HYPOTHESES = 10
# Linear parts, of the transforms with most votes, that are tried at all shifts; shifts kept of each.
_LINEAR = 8
_SHIFTS = 3
_UNLIKE = 0.08
_SHORTLIST = 7
# Consensus that edges alone are worth: where points mislead, as in a row of like houses, edges still decide.
_EDGES_WORTH = 20.0
_WINDOW = 6.0


@dataclass(frozen=True, eq=False)
class Found:
    """A transform, and what speaks for it.

    Attributes
    ----------
    transform : (3, 3) array of float
        Affine; takes working pixels of the first image to the second.
    merit : float
        Agreement of edges x root of (shared edges x (20 + consensus of the matches)).
    agreement : float
        Of the edges where the images overlap, at most 1.
    pairs : (m, 2) array of int
        Matched points at the size where most agree, nearest first.
    distances : (m,) array of float
    inliers : (m,) array of bool
        Which of them agree with the transform.
    """

    transform: FloatArray
    merit: float
    agreement: float
    pairs: IntArray
    distances: FloatArray
    inliers: BoolArray


@dataclass(frozen=True, eq=False)
class _Matches:
    """Matched points at one size."""

    pairs: IntArray
    distances: FloatArray
    points1: FloatArray
    points2: FloatArray


def joint_matches(one: View, two: View, dim: int, *, scale: float = 1.0) -> tuple[IntArray, FloatArray]:
    """Return the mutually nearest points in the joint embedding, nearest first, and their distances.

    Parameters
    ----------
    one, two : View
    dim : int
        Eigenvectors.
    scale : float
        At which the second image is described, the first being described at 1.

    Returns
    -------
    pairs : (m, 2) array of int
        Rows of the points of each view.
    distances : (m,) array of float
    """
    return _joint(geometric_blur(one.edges, one.points), two, dim, scale)


def _joint(first: FloatArray, two: View, dim: int, scale: float) -> tuple[IntArray, FloatArray]:
    second = geometric_blur(two.edges, two.points, scale=scale)
    return mutual_matches(*embed_pair(first, second, dim))


def found_transform(one: View, two: View, even1: EvenEdges, even2: EvenEdges, dim: int) -> Found | None:
    """Find the transform under which edges and matched points of two images agree best.

    Matches vote for similarities. The linear parts of the best are also tried at all shifts, by correlation of
    the edges: among like houses the points may agree on the wrong one, while all edges together know better.

    Parameters
    ----------
    one, two : View
    even1, even2 : EvenEdges
        Of these views.
    dim : int
        Eigenvectors of the joint embedding.

    Returns
    -------
    Found or None
        None where no three matches agree on anything.
    """
    described = geometric_blur(one.edges, one.points)
    matches = [_matched(one, described, two, dim, scale) for scale in _SCALES]
    voted = [r for m in matches for r in registrations(m.points1, m.points2, TOLERANCE, count=_HYPOTHESES)]
    if not voted:
        return None
    voted.sort(key=lambda r: -r.consensus)
    transforms = [r.transform for r in voted]
    quarter1, quarter2 = even1.reduced(4), even2.reduced(4)
    for linear in _unlike([t[:2, :2] for t in transforms])[:_LINEAR]:
        transforms += [_scaled(t, 4.0) for t in shifts(quarter1, quarter2, linear, count=_SHIFTS)]
    rough = [_judged(t, quarter1, quarter2, 4, matches) for t in transforms]
    half1, half2 = even1.reduced(2), even2.reduced(2)
    fine = []
    for candidate in sorted(rough, key=lambda f: -f.merit)[:_SHORTLIST]:
        transform = _scaled(aligned(half1, half2, _scaled(candidate.transform, 0.5)), 2.0)
        fine.append(_judged(transform, half1, half2, 2, matches))
    return max(fine, key=lambda f: f.merit)


def _matched(one: View, described: FloatArray, two: View, dim: int, scale: float) -> _Matches:
    pairs, distances = _joint(described, two, dim, scale)
    points1, points2 = one.points[pairs[:, 0]], two.points[pairs[:, 1]]
    return _Matches(pairs, distances, points1.astype(np.float64), points2.astype(np.float64))


def _unlike(parts: list[FloatArray]) -> list[FloatArray]:
    """Leave out the linear parts that are close to an earlier one."""
    kept: list[FloatArray] = []
    for part in parts:
        if all(np.abs(part - other).max() > _UNLIKE for other in kept):
            kept.append(part)
    return kept


def _scaled(transform: FloatArray, factor: float) -> FloatArray:
    """Return a transform for images of another size, pixel centres at whole numbers."""
    move = (factor - 1) / 2
    there = np.array([[factor, 0, move], [0, factor, move], [0, 0, 1.0]])
    back = np.array([[1 / factor, 0, -move / factor], [0, 1 / factor, -move / factor], [0, 0, 1.0]])
    result: FloatArray = there @ transform @ back
    return result


def _judged(
    transform: FloatArray, one: EvenEdges, two: EvenEdges, reduction: int, matches: list[_Matches]
) -> Found:
    options = []
    for m in matches:
        consensus, inliers = agreeing(m.points1, m.points2, transform, TOLERANCE)
        options.append((consensus, Found(transform, 0.0, 0.0, m.pairs, m.distances, inliers)))
    consensus, found = max(options, key=lambda option: option[0])
    shown = agreement(one, two, _scaled(transform, 1 / reduction), window=_WINDOW / reduction)
    energy = float(shown.shared.sum()) * reduction**2
    merit = shown.total * float(np.sqrt(energy * (_EDGES_WORTH + consensus)))
    return replace(found, merit=merit, agreement=shown.total)
