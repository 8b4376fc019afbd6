"""Partial matching of two images: which part of each shows the same thing (section 6.3)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .._arrays import BoolArray, FloatArray, IntArray, frozen
from ..errors import InputError
from ._opencv import carried_back
from .agreement import Agreement, EvenEdges, agreement, even_edges
from .alignment import aligned
from .blur import geometric_blur
from .embedding import embed_pair, mutual_matches
from .picture import Picture, as_picture
from .region import smallest_rectangle
from .registration import Registration, inverse, registrations
from .views import WORKING_SIZE, View, view

__all__ = ["PairMatch", "joint_matches", "match_pair", "nothing", "unusable"]

#: Sizes at which the second image is described, so that the two may differ in size.
_SCALES = (1 / 1.4, 1.0, 1.4)
# Matches agree with a transform within 4 % of the working diagonal.
TOLERANCE = 0.04 * np.sqrt(2) * WORKING_SIZE
_HYPOTHESES = 10
_SHORTLIST = 6
_LEAST_SIDE = 16
_LEAST_POINTS = 8


@dataclass(frozen=True, eq=False)
class PairMatch:
    """The parts of two images that show the same thing.

    Attributes
    ----------
    box1, box2 : (4,) array of float
        x0, y0, x1, y1 in pixels of each source image, x1 and y1 exclusive; all 0 where nothing was found.
    region1, region2 : (h, w) array of bool
        The part of each box where shared edges are worth their area. At the size of :attr:`Picture.grey`.
    points1, points2 : (m, 2) array of float
        Matched points, nearest first, pixel centres at whole numbers.
    distances : (m,) array of float
        Distance of the matched features (JGED, eq. 6.5).
    transform : (3, 3) array of float or None
        Affine; takes points of the first image to the second. None where none was found.
    score : float
        Number of matches that agree with the transform: the evidence that the two show the same thing at all.
    reason : str
        Why nothing, or less than usual, was found; empty otherwise.
    settings : dict
        What made the result.
    """

    box1: FloatArray
    box2: FloatArray
    region1: BoolArray
    region2: BoolArray
    points1: FloatArray
    points2: FloatArray
    distances: FloatArray
    transform: FloatArray | None
    score: float
    reason: str = ""
    settings: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("box1", "box2", "region1", "region2", "points1", "points2", "distances"):
            object.__setattr__(self, name, frozen(np.asarray(getattr(self, name))))
        if self.transform is not None:
            object.__setattr__(self, "transform", frozen(np.asarray(self.transform, dtype=np.float64)))

    def __repr__(self) -> str:
        """Say the boxes, the matches and the score."""
        boxes = " and ".join(str(np.rint(box).astype(int).tolist()) for box in (self.box1, self.box2))
        why = f": {self.reason}" if self.reason else ""
        return f"PairMatch({boxes}, {len(self.points1)} matches, score {self.score:g}{why})"


def match_pair(
    image1: Any,
    image2: Any,
    *,
    mask1: Any = None,
    mask2: Any = None,
    features: int = 300,
    dim: int = 30,
    share: float = 0.9,
    intensity_weight: float = 0.0,
    rng: int | np.random.Generator = 0,
) -> PairMatch:
    """Find the part of each of two images that shows the same thing, however different they look.

    Points are drawn from the edges of both images and described by geometric blur; the descriptors of both
    are placed in the eigenvectors of their joint graph (eq. 6.2-6.5). Points that are mutually nearest there
    vote for a transform (a similarity, refined to an affine one: geometric consistency, which eq. 6.1 leaves open).
    Of the transforms with most votes the one is kept under which the edges agree best, and it is aligned to them.

    Then eq. 6.1 is solved over boxes. Taken as printed its best is the smallest region, so a pixel earns a
    benefit: the edge strength shared by both images (geometric mean) times the local correlation of their oriented
    edges. Area has a price, and the price is the highest at which the best box, found exactly in each image,
    still holds ``share`` of all that can be earned.

    Parameters
    ----------
    image1, image2 : Picture, str, Path, or array_like
        See :func:`as_picture`.
    mask1, mask2 : file or (h, w) array_like, optional
        What is picture and what is fill. Default: transparency, or constant fill that touches the border.
    features : int
        Points in each image (n_GB of the dissertation, there 300).
    dim : int
        Eigenvectors (m of the dissertation, there 20).
    share : float
        Part of the shared evidence that each box holds; a lower one gives smaller boxes.
    intensity_weight : float
        Weight of the regulariser r(X', Y') of eq. 6.1, the difference of intensity of the two parts, each image
        brought to mean 0 and variance 1 first. It is charged pixel by pixel, which bounds the difference of the
        means from above. 0 leaves it out.
    rng : int or Generator
        Seed of the points. The same seed gives the same bytes.

    Returns
    -------
    PairMatch
        Where nothing can be found (an image of one colour, of a few pixels) an empty one with score 0 and the reason.

    Raises
    ------
    InputError
        If an image cannot be used (see :func:`as_picture`) or an option is out of range.

    Notes
    -----
    ``score`` tells whether the two have anything in common; the documentation gives its distribution over unrelated
    pictures. Do not trust the boxes of a low score, nor those of two images that the same thing fills from edge
    to edge: what the object is, the pictures alone do not say. Rows of like houses can match one house off.
    Images turned by more than about 20 degrees, or whose object differs in size by more than 2, are beyond it.
    Cost: about 0.4 s on one core, whatever the size of the images.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.ndimage import gaussian_filter
    >>> scene = gaussian_filter(np.random.default_rng(0).random((240, 320)), 4)
    >>> scene = (scene - scene.min()) / np.ptp(scene)
    >>> match = match_pair(scene, 1 - scene[20:220, 40:300])   # a crop of the negative
    >>> bool(np.abs(match.transform[:2, 2] + [40, 20]).max() < 2)
    True
    """
    _check_options(features, dim, share, intensity_weight)
    pictures = as_picture(image1, mask=mask1), as_picture(image2, mask=mask2)
    settings = {
        "method": "proposed",
        "features": features,
        "dim": dim,
        "share": share,
        "intensity_weight": intensity_weight,
    }
    generator = np.random.default_rng(rng)
    reason = unusable(*pictures)
    if reason:
        return nothing(*pictures, reason, settings)
    one, two = view(pictures[0], features, generator), view(pictures[1], features, generator)
    reason = _too_plain(one, two)
    if reason:
        return nothing(*pictures, reason, settings)
    return _matched(one, two, dim, share, intensity_weight, settings)


def nothing(one: Picture, two: Picture, reason: str, settings: dict[str, Any]) -> PairMatch:
    """Return the match of a pair in which nothing can be found."""
    return PairMatch(
        box1=np.zeros(4),
        box2=np.zeros(4),
        region1=np.zeros(one.grey.shape, dtype=bool),
        region2=np.zeros(two.grey.shape, dtype=bool),
        points1=np.zeros((0, 2)),
        points2=np.zeros((0, 2)),
        distances=np.zeros(0),
        transform=None,
        score=0.0,
        reason=reason,
        settings=settings,
    )


def _check_options(features: int, dim: int, share: float, intensity_weight: float) -> None:
    if features < _LEAST_POINTS or dim < 1 or not 0 < share < 1 or not intensity_weight >= 0:
        message = (
            f"features must be {_LEAST_POINTS} or more, dim 1 or more, share between 0 and 1 and intensity_weight not "
            f"negative, got features={features}, dim={dim}, share={share}, intensity_weight={intensity_weight}"
        )
        raise InputError(message)


def unusable(*pictures: Picture) -> str:
    """Say why pictures are too small for matching; empty where they are not."""
    for number, picture in enumerate(pictures, 1):
        if min(picture.size) < _LEAST_SIDE:
            width, height = picture.size
            return f"image {number} is {width} x {height} pixels; {_LEAST_SIDE} a side are needed"
        if np.count_nonzero(picture.mask) < _LEAST_SIDE**2:
            return f"image {number} has only {np.count_nonzero(picture.mask)} pixels inside its mask"
    return ""


def _too_plain(*views: View) -> str:
    for number, seen in enumerate(views, 1):
        if len(seen.points) < _LEAST_POINTS:
            return (
                f"image {number} has edges for only {len(seen.points)} points; it is (nearly) of one colour"
            )
    return ""


def _matched(
    one: View, two: View, dim: int, share: float, intensity_weight: float, settings: dict[str, Any]
) -> PairMatch:
    even1, even2 = even_edges(one.edges), even_edges(two.edges)
    best = _registered(one, two, even1, even2, dim)
    if best is None:
        reason = "no transform brings three matches together"
        return nothing(one.picture, two.picture, reason, settings)
    transform = _full(best.transform)
    shown = agreement(even1, even2, transform)
    evidence = _evidence(one, two, shown, transform, intensity_weight)
    box1, region1 = _solved(evidence, share)
    back = carried_back(evidence, inverse(transform), two.grey.shape[:2])
    box2, region2 = _solved(np.maximum(back.astype(np.float64), 0), share)
    inliers = best.registration.inliers
    kept = best.pairs[inliers]
    return PairMatch(
        box1=one.box_in_source(box1),
        box2=two.box_in_source(box2),
        region1=one.region_in_picture(region1),
        region2=two.region_in_picture(region2),
        points1=one.points_in_source(one.points[kept[:, 0]].astype(np.float64)),
        points2=two.points_in_source(two.points[kept[:, 1]].astype(np.float64)),
        distances=best.distances[inliers],
        transform=inverse(two.to_working) @ transform @ one.to_working,
        score=float(np.count_nonzero(inliers)),
        reason="" if evidence.any() else "the registered images share no edges",
        settings=settings,
    )


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A registration with the matches it came from, its transform at half size, and what speaks for that."""

    registration: Registration
    pairs: IntArray
    distances: FloatArray
    transform: FloatArray
    merit: float

    def moved(self, one: EvenEdges, two: EvenEdges, transform: FloatArray) -> _Candidate:
        """Return the same with another transform: consensus times agreement of edges speaks for it."""
        alike = agreement(one, two, transform, window=3.0).total
        merit = self.registration.consensus * max(alike, 0.0)
        return replace(self, transform=transform, merit=merit)


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
    first = geometric_blur(one.edges, one.points)
    second = geometric_blur(two.edges, two.points, scale=scale)
    return mutual_matches(*embed_pair(first, second, dim))


def _registered(one: View, two: View, even1: EvenEdges, even2: EvenEdges, dim: int) -> _Candidate | None:
    """Return the best of the registrations at all sizes, judged and finely aligned at half size."""
    small1, small2 = even1.reduced(2), even2.reduced(2)
    found = []
    for scale in _SCALES:
        pairs, distances = joint_matches(one, two, dim, scale=scale)
        for candidate in registrations(
            one.points[pairs[:, 0]], two.points[pairs[:, 1]], TOLERANCE, count=_HYPOTHESES
        ):
            rough = _half(candidate.transform)
            entry = _Candidate(candidate, pairs, distances, rough, 0.0)
            found.append(entry.moved(small1, small2, rough))
    shortlist = sorted(found, key=lambda c: -c.merit)[:_SHORTLIST]
    fine = [c.moved(small1, small2, aligned(small1, small2, c.transform)) for c in shortlist]
    return max(fine, key=lambda c: c.merit, default=None)


_TO_HALF = np.array([[0.5, 0, -0.25], [0, 0.5, -0.25], [0, 0, 1.0]])
_FROM_HALF = np.array([[2, 0, 0.5], [0, 2, 0.5], [0, 0, 1.0]])


def _half(transform: FloatArray) -> FloatArray:
    """Return a transform for images of half the size."""
    result: FloatArray = _TO_HALF @ transform @ _FROM_HALF
    return result


def _full(transform: FloatArray) -> FloatArray:
    result: FloatArray = _FROM_HALF @ transform @ _TO_HALF
    return result


def _evidence(
    one: View, two: View, shown: Agreement, transform: FloatArray, intensity_weight: float
) -> FloatArray:
    """Return what each pixel of the first image earns, none of it negative."""
    gain = shown.shared * np.maximum(shown.correlation, 0)
    if intensity_weight > 0 and shown.overlap.any():
        other = carried_back(_standardised(two), transform, one.grey.shape[:2])
        apart = np.abs(_standardised(one) - other)
        gain = np.maximum(gain - intensity_weight * gain[shown.overlap].mean() * apart, 0)
    return np.where(shown.overlap, gain, 0.0)


def _standardised(seen: View) -> FloatArray:
    inside = seen.grey[seen.edges.mask]
    spread = float(inside.std())
    return (seen.grey - float(inside.mean())) / (spread if spread > 0 else 1.0)


def _solved(evidence: FloatArray, share: float) -> tuple[tuple[int, int, int, int], BoolArray]:
    """Return the box and the pixels in it that are worth their price."""
    box, price = smallest_rectangle(evidence, share)
    region = np.zeros(evidence.shape, dtype=bool)
    part = (slice(box[1], box[3]), slice(box[0], box[2]))
    region[part] = evidence[part] > price
    return box, region
