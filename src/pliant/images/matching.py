"""Partial matching of two images: which part of each shows the same thing (section 6.3)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._arrays import BoolArray, FloatArray, IntArray, frozen
from ..errors import InputError
from ._opencv import carried_back, carried_mask, resized
from .agreement import Agreement, EvenEdges, agreement, even_edges
from .blur import EdgeChannels, edge_channels, edge_points, geometric_blur
from .embedding import embed_pair, mutual_matches
from .picture import Picture, as_picture
from .region import best_rectangle
from .registration import Registration, carried, registrations

__all__ = ["PairMatch", "View", "match_pair", "view"]

#: Square root of the number of picture pixels that matching works on.
WORKING_SIZE = 170
#: Sizes at which the second image is described, so that the two may differ in size.
_SCALES = (1 / 1.4, 1.0, 1.4)
# Matches agree with a transform within 4 % of the working diagonal.
_TOLERANCE = 0.04 * np.sqrt(2) * WORKING_SIZE
_HYPOTHESES = 10
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
        The part of each box that gains: shared edges enough for its area. At the size of :attr:`Picture.grey`.
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
        boxes = " and ".join(str([int(round(v)) for v in box]) for box in (self.box1, self.box2))
        why = f": {self.reason}" if self.reason else ""
        return f"PairMatch({boxes}, {len(self.points1)} matches, score {self.score:g}{why})"


@dataclass(frozen=True, eq=False)
class View:
    """A picture at working size, with its edges and the points drawn from them.

    Attributes
    ----------
    picture : Picture
    grey : (h, w) array of float
    edges : EdgeChannels
    points : (n, 2) array of int
    to_working : (3, 3) array of float
        Takes pixels of the source to working pixels.
    """

    picture: Picture
    grey: FloatArray
    edges: EdgeChannels
    points: IntArray
    to_working: FloatArray

    def box_in_source(self, box: tuple[int, int, int, int]) -> FloatArray:
        """Return a box of working pixels in pixels of the source."""
        factors = np.array([self.to_working[0, 0], self.to_working[1, 1]])
        return np.array(box, dtype=np.float64) / np.tile(factors, 2)

    def points_in_source(self, points: FloatArray) -> FloatArray:
        """Return points of the working image in pixels of the source."""
        return carried(np.linalg.inv(self.to_working), points)

    def region_in_picture(self, region: BoolArray) -> BoolArray:
        """Return a region of working pixels at the picture's size."""
        height, width = self.picture.grey.shape
        return np.asarray(resized(region, width, height) > 0.5)


def view(picture: Picture, features: int, rng: np.random.Generator) -> View:
    """Bring a picture to working size, find its edges and draw points from them.

    Parameters
    ----------
    picture : Picture
    features : int
        Points wanted.
    rng : Generator

    Returns
    -------
    View
    """
    height, width = picture.grey.shape
    factor = WORKING_SIZE / np.sqrt(max(1, np.count_nonzero(picture.mask)))
    shape = (max(1, round(height * factor)), max(1, round(width * factor)))
    if shape[0] * shape[1] > 20 * WORKING_SIZE**2:
        raise InputError("under a twentieth of the image is inside its mask; crop the image to the mask")
    grey = resized(picture.grey, shape[1], shape[0]).astype(np.float64)
    mask = resized(picture.mask, shape[1], shape[0]) > 0.99
    edges = edge_channels(grey, mask=mask)
    points = edge_points(edges.strength, features, rng=rng)
    across, down = shape[1] / picture.size[0], shape[0] / picture.size[1]
    to_working = np.array([[across, 0, (across - 1) / 2], [0, down, (down - 1) / 2], [0, 0, 1.0]])
    return View(picture, grey, edges, points, to_working)


def match_pair(
    image1: Any,
    image2: Any,
    *,
    mask1: Any = None,
    mask2: Any = None,
    features: int = 300,
    dim: int = 40,
    area_price: float = 0.4,
    intensity_weight: float = 0.0,
    rng: int | np.random.Generator = 0,
) -> PairMatch:
    """Find the part of each of two images that shows the same thing, however different they look.

    Points are drawn from the edges of both images and described by geometric blur; the descriptors of both
    are placed in the eigenvectors of their joint graph (eq. 6.2-6.5). Points that are mutually nearest there
    vote for a transform (a similarity, refined to an affine one: geometric consistency, which eq. 6.1 leaves open).
    Of the transforms with most votes the one is kept under which the edges agree best.

    Then eq. 6.1 is solved over boxes. Taken as printed its best is the smallest region, so
    area earns a benefit where edges are shared: a pixel earns its shared edge strength (geometric mean of both
    images) times the local correlation of oriented edges, in units of its mean over the overlap, and costs
    ``area_price``; differences of intensity cost ``intensity_weight`` each. The box with the greatest sum is found exactly, in each image.

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
    area_price : float
        Price of a pixel; a higher one gives smaller boxes.
    intensity_weight : float
        Weight of the regulariser r(X', Y'), the difference of mean intensity of the two parts after each image is
        brought to mean 0 and variance 1. It is applied pixel by pixel, where it bounds the difference of means from above. 0 leaves it out.
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
    ``score`` tells whether the two have anything in common. Unrelated pictures reach 10 to 20 of 300 points. Do not
    trust the box of a low score, nor one where the same thing fills both
    images: what the object is, the pictures alone do not say. Rows of like houses can match one house off. Images turned by
    more than about 20 degrees, or whose object differs in size by more than 2, are beyond it.
    Cost: 0.4 s on one core, whatever the size of the images.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.ndimage import gaussian_filter
    >>> scene = gaussian_filter(np.random.default_rng(0).random((240, 320)), 4)
    >>> scene = (scene - scene.min()) / np.ptp(scene)
    >>> match = match_pair(scene, 1 - scene[20:220, 40:300])   # a crop of the negative
    >>> bool(np.abs(match.transform[:2, 2] + [40, 20]).max() < 3)
    True
    """
    if features < _LEAST_POINTS or dim < 1 or area_price < 0 or intensity_weight < 0:
        message = (
            f"features must be {_LEAST_POINTS} or more, dim 1 or more, prices and weights not negative, got "
            f"features={features}, dim={dim}, area_price={area_price}, intensity_weight={intensity_weight}"
        )
        raise InputError(message)
    pictures = as_picture(image1, mask=mask1), as_picture(image2, mask=mask2)
    settings = {
        "method": "proposed",
        "features": features,
        "dim": dim,
        "area_price": area_price,
        "intensity_weight": intensity_weight,
    }
    generator = np.random.default_rng(rng)
    reason = _too_small(*pictures)
    if reason:
        return nothing(*pictures, reason, settings)
    one, two = (view(picture, features, generator) for picture in pictures)
    reason = _too_plain(one, two)
    if reason:
        return nothing(*pictures, reason, settings)
    return _matched(one, two, dim, area_price, intensity_weight, settings)


def nothing(one: Picture, two: Picture, reason: str, settings: dict[str, Any]) -> PairMatch:
    """Return the match of a pair in which nothing can be found."""
    empty = np.zeros((0, 2))
    regions = (np.zeros(picture.grey.shape, dtype=bool) for picture in (one, two))
    return PairMatch(
        np.zeros(4), np.zeros(4), *regions, empty, empty, np.zeros(0), None, 0.0, reason, settings
    )


def _too_small(*pictures: Picture) -> str:
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
    one: View, two: View, dim: int, area_price: float, intensity_weight: float, settings: dict[str, Any]
) -> PairMatch:
    pairs, distances = _joint_matches(one, two, dim)
    even1, even2 = even_edges(one.edges), even_edges(two.edges)
    best = _registered(one, two, pairs, even1, even2)
    if best is None:
        reason = "no transform brings three matches together"
        return nothing(one.picture, two.picture, reason, settings)
    shown = agreement(even1, even2, best.transform)
    benefit = _benefit(one, two, shown, best.transform, area_price, intensity_weight)
    box1, region1 = _solved(benefit, shown.overlap, area_price)
    inverse = np.linalg.inv(best.transform)
    shape2 = two.grey.shape
    box2, region2 = _solved(
        carried_back(benefit, inverse, shape2).astype(np.float64),
        carried_mask(shown.overlap, inverse, shape2),
        area_price,
    )
    kept = pairs[best.inliers]
    return PairMatch(
        one.box_in_source(box1),
        two.box_in_source(box2),
        one.region_in_picture(region1),
        two.region_in_picture(region2),
        one.points_in_source(one.points[kept[:, 0]].astype(np.float64)),
        two.points_in_source(two.points[kept[:, 1]].astype(np.float64)),
        distances[best.inliers],
        np.linalg.inv(two.to_working) @ best.transform @ one.to_working,
        float(np.count_nonzero(best.inliers)),
        settings=settings,
    )


def _joint_matches(one: View, two: View, dim: int) -> tuple[IntArray, FloatArray]:
    """Return the mutually nearest points in the joint embedding, the second image at the size that fits best."""
    first = geometric_blur(one.edges, one.points)
    best, most = None, -1.0
    for scale in _SCALES:
        second = geometric_blur(two.edges, two.points, scale=scale)
        pairs, _ = mutual_matches(first, second)
        found = registrations(one.points[pairs[:, 0]], two.points[pairs[:, 1]], _TOLERANCE, count=1)
        consensus = found[0].consensus if found else 0.0
        if consensus > most:
            best, most = second, consensus
    embedded = embed_pair(first, best if best is not None else first, dim)
    return mutual_matches(*embedded)


def _registered(
    one: View, two: View, pairs: IntArray, even1: EvenEdges, even2: EvenEdges
) -> Registration | None:
    """Return the registration with the best consensus times agreement of edges, judged at half size."""
    found = registrations(one.points[pairs[:, 0]], two.points[pairs[:, 1]], _TOLERANCE, count=_HYPOTHESES)
    half = np.array([[0.5, 0, -0.25], [0, 0.5, -0.25], [0, 0, 1.0]])
    small1, small2 = even1.reduced(2), even2.reduced(2)

    def merit(candidate: Registration) -> float:
        transform = half @ candidate.transform @ np.linalg.inv(half)
        return candidate.consensus * max(agreement(small1, small2, transform, window=3.0).total, 0.0)

    return max(found, key=merit, default=None)


def _benefit(
    one: View,
    two: View,
    shown: Agreement,
    transform: FloatArray,
    area_price: float,
    intensity_weight: float,
) -> FloatArray:
    gain = shown.shared * np.maximum(shown.correlation, 0)
    usual = gain[shown.overlap].mean() if shown.overlap.any() else 0.0
    benefit = gain / usual if usual > 0 else gain
    if intensity_weight > 0:
        other = carried_back(_standardised(two), transform, one.grey.shape)
        benefit = benefit - intensity_weight * np.abs(_standardised(one) - other)
    return np.where(shown.overlap, benefit, 0.0) - area_price


def _standardised(seen: View) -> FloatArray:
    inside = seen.grey[seen.edges.mask]
    spread = float(inside.std())
    return (seen.grey - inside.mean()) / (spread if spread > 0 else 1.0)


def _solved(
    benefit: FloatArray, overlap: BoolArray, area_price: float
) -> tuple[tuple[int, int, int, int], BoolArray]:
    """Return the best box and the pixels in it that gain."""
    gains = np.where(overlap, benefit, -max(area_price, 1e-9))
    box, _ = best_rectangle(gains)
    region = np.zeros(overlap.shape, dtype=bool)
    part = (slice(box[1], box[3]), slice(box[0], box[2]))
    region[part] = gains[part] > 0
    return box, region
