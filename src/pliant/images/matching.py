"""Partial matching of two images: which part of each shows the same thing (section 6.3)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._arrays import BoolArray, FloatArray, frozen
from ..errors import InputError
from ._opencv import carried_back
from .agreement import even_edges
from .extent import grown, shared_part
from .picture import Picture, as_picture
from .registration import inverse
from .search import found_transform
from .views import View, view

__all__ = ["PairMatch", "match_pair", "nothing", "unusable"]

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
        The evidence that the two show the same thing at all: the number of matches that agree with the transform,
        times the correlation of the edges under it (at most 1).
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
    share: float = 0.83,
    intensity_weight: float = 0.0,
    rng: int | np.random.Generator = 0,
) -> PairMatch:
    """Find the part of each of two images that shows the same thing, however different they look.

    Points are drawn from the edges of both images and described by geometric blur; the descriptors of both
    are placed in the eigenvectors of their joint graph (eq. 6.2-6.5). Points that are mutually nearest there
    vote for a transform (a similarity, refined to an affine one: geometric consistency, which eq. 6.1 leaves open).
    The transforms with most votes, and their linear parts at the shifts where all edges correlate best, are aligned
    to the edges; the one is kept under which edges and points agree best.

    Then eq. 6.1 is solved over boxes. Taken as printed its best is the smallest region, so a pixel earns a
    benefit: the edge strength shared by both images (geometric mean) times the local correlation of their oriented
    edges. Area has a price, and the price is the highest at which the best box, found exactly in each image,
    still holds ``share`` of all that can be earned. From there the box grows along lines where shared edges go on,
    upwards also where they are thin: annotators box a church with its spire, however little a spire can earn.

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
        Part of the shared evidence that each box holds at least; a lower one gives smaller boxes.
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
    Cost: about 0.8 s on one core, whatever the size of the images.

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
    best = found_transform(one, two, even1, even2, dim)
    if best is None:
        reason = "no transform brings three matches together"
        return nothing(one.picture, two.picture, reason, settings)
    transform = best.transform
    charges = _charges(one, two, transform, intensity_weight)
    part1 = shared_part(even1, even2, transform, charges[0])
    part2 = shared_part(even2, even1, inverse(transform), charges[1])
    box1, region1 = grown(part1, share)
    box2, region2 = grown(part2, share)
    kept = best.pairs[best.inliers]
    return PairMatch(
        box1=one.box_in_source(box1),
        box2=two.box_in_source(box2),
        region1=one.region_in_picture(region1),
        region2=two.region_in_picture(region2),
        points1=one.points_in_source(one.points[kept[:, 0]].astype(np.float64)),
        points2=two.points_in_source(two.points[kept[:, 1]].astype(np.float64)),
        distances=best.distances[best.inliers],
        transform=inverse(two.to_working) @ transform @ one.to_working,
        score=len(kept) * max(0.0, best.agreement),
        reason="" if part1.evidence.any() else "the registered images share no edges",
        settings=settings,
    )


def _charges(
    one: View, two: View, transform: FloatArray, intensity_weight: float
) -> tuple[FloatArray | None, FloatArray | None]:
    """Return what difference of intensity costs each pixel of both images; None where it costs nothing."""
    if not intensity_weight > 0:
        return None, None
    levels = _standardised(one), _standardised(two)
    there = carried_back(levels[1], transform, levels[0].shape)
    here = carried_back(levels[0], inverse(transform), levels[1].shape)
    return intensity_weight * np.abs(levels[0] - there), intensity_weight * np.abs(levels[1] - here)


def _standardised(seen: View) -> FloatArray:
    inside = seen.grey[seen.edges.mask]
    spread = float(inside.std())
    result: FloatArray = (seen.grey - float(inside.mean())) / (spread if spread > 0 else 1.0)
    return result
