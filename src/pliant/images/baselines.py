"""What partial matching has to beat: key points, geometric blur alone, and boxes that look at nothing."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from .._arrays import FloatArray
from ..errors import InputError, MissingExtraError, require
from ._opencv import opencv
from .blur import geometric_blur
from .embedding import mutual_matches
from .matching import PairMatch, nothing, unusable
from .picture import Picture, as_picture
from .region import smallest_rectangle
from .views import view

__all__ = ["match_blur", "match_centre", "match_keypoints", "match_saliency", "match_whole"]

Detector: TypeAlias = Literal["sift", "orb", "fast", "akaze"]
BoxRule: TypeAlias = Literal["matched", "ransac"]

_KEYPOINTS = 2000
_RATIO = 0.8


def match_whole(image1: Any, image2: Any, *, mask1: Any = None, mask2: Any = None) -> PairMatch:
    """Call the whole of both pictures the match.

    Parameters
    ----------
    image1, image2, mask1, mask2
        As :func:`pliant.images.match_pair`.

    Returns
    -------
    PairMatch
        Its boxes are those of the masks.
    """
    return match_centre(image1, image2, mask1=mask1, mask2=mask2, share=1.0)


def match_centre(
    image1: Any, image2: Any, *, mask1: Any = None, mask2: Any = None, share: float = 0.85
) -> PairMatch:
    """Call a centred box the match: photographers aim, so this looks at nothing and is hard to beat.

    Parameters
    ----------
    image1, image2, mask1, mask2
        As :func:`pliant.images.match_pair`.
    share : float
        Of each side.

    Returns
    -------
    PairMatch

    Raises
    ------
    InputError
        If the share is not in (0, 1].

    Examples
    --------
    >>> import numpy as np
    >>> match_centre(np.ones((100, 200)) / 2, np.ones((100, 100)) / 2, share=0.5).box1
    array([ 50.,  25., 150.,  75.])
    """
    if not 0 < share <= 1:
        message = f"share must be in (0, 1], got {share}"
        raise InputError(message)
    pictures = as_picture(image1, mask=mask1), as_picture(image2, mask=mask2)
    boxes = [_centred(picture, share) for picture in pictures]
    settings = {"method": "centre" if share < 1 else "whole", "share": share}
    return boxed(pictures, boxes, settings)


def match_saliency(
    image1: Any, image2: Any, *, mask1: Any = None, mask2: Any = None, share: float = 0.9
) -> PairMatch:
    """Box the edges of each picture alone, without matching.

    Parameters
    ----------
    image1, image2, mask1, mask2
        As :func:`pliant.images.match_pair`.
    share : float
        Of the edge strength that the box holds.

    Returns
    -------
    PairMatch
    """
    pictures = as_picture(image1, mask=mask1), as_picture(image2, mask=mask2)
    settings = {"method": "saliency", "share": share}
    reason = unusable(*pictures)
    if reason:
        return nothing(*pictures, reason, settings)
    views = [view(picture, 8, np.random.default_rng(0)) for picture in pictures]
    boxes = [v.box_in_source(smallest_rectangle(v.edges.strength, share)[0]) for v in views]
    return boxed(pictures, boxes, settings)


def match_blur(
    image1: Any,
    image2: Any,
    *,
    mask1: Any = None,
    mask2: Any = None,
    features: int = 300,
    rng: int | np.random.Generator = 0,
) -> PairMatch:
    """Box the points whose geometric blur descriptors are mutually nearest: no embedding, no geometry.

    Parameters
    ----------
    image1, image2, mask1, mask2, features, rng
        As :func:`pliant.images.match_pair`.

    Returns
    -------
    PairMatch
        ``transform`` is None; ``score`` is the number of matches.
    """
    pictures = as_picture(image1, mask=mask1), as_picture(image2, mask=mask2)
    settings = {"method": "gb", "features": features}
    reason = unusable(*pictures)
    if reason:
        return nothing(*pictures, reason, settings)
    generator = np.random.default_rng(rng)
    views = [view(picture, features, generator) for picture in pictures]
    described = [geometric_blur(v.edges, v.points) for v in views]
    pairs, distances = mutual_matches(*described)
    points = [v.points_in_source(v.points[pairs[:, k]].astype(np.float64)) for k, v in enumerate(views)]
    return _around(pictures, points, distances, None, settings)


def match_keypoints(
    image1: Any,
    image2: Any,
    *,
    detector: Detector = "sift",
    box: BoxRule = "matched",
    mask1: Any = None,
    mask2: Any = None,
) -> PairMatch:
    """Match key points by their descriptors with the ratio test and box them.

    Parameters
    ----------
    image1, image2, mask1, mask2
        As :func:`pliant.images.match_pair`.
    detector : {"sift", "orb", "fast", "akaze"}
        OpenCV's; "fast" is FAST corners with scikit-image's BRIEF. At most 2,000 points; nearest neighbours pass where
        the second nearest is farther by 1 / 0.8.
    box : {"matched", "ransac"}
        Box all matches, or those that agree with a homography found by RANSAC within 1 % of the diagonal.

    Returns
    -------
    PairMatch
        ``score`` is the number of matches, or of inliers. Empty, with the reason, below 2 matches (4 for RANSAC).

    Raises
    ------
    InputError
        If an option is unknown or an image cannot be used.
    MissingExtraError
        If this OpenCV has no such detector (AKAZE left it with version 5).
    """
    if detector not in get_args(Detector) or box not in get_args(BoxRule):
        message = (
            f"detector must be one of {get_args(Detector)} and box of {get_args(BoxRule)}, "
            f"got {detector!r} and {box!r}"
        )
        raise InputError(message)
    pictures = as_picture(image1, mask=mask1), as_picture(image2, mask=mask2)
    settings = {"method": detector, "box": box, "keypoints": _KEYPOINTS, "ratio": _RATIO}
    reason = unusable(*pictures)
    if reason:
        return nothing(*pictures, reason, settings)
    described = [_described(picture, detector) for picture in pictures]
    pairs, distances = _ratio_matches(described[0][1], described[1][1], binary=detector != "sift")
    points = [described[k][0][pairs[:, k]] / picture.reduction for k, picture in enumerate(pictures)]
    transform = None
    if box == "ransac":
        transform, inside = _homography(points, pictures[1].size)
        points, distances = [p[inside] for p in points], distances[inside]
    return _around(pictures, points, distances, transform, settings)


def boxed(pictures: tuple[Picture, Picture], boxes: list[FloatArray], settings: dict[str, Any]) -> PairMatch:
    """Return a match that is only boxes."""
    empty = nothing(*pictures, "", settings)
    regions = [_filled(picture, box) for picture, box in zip(pictures, boxes, strict=True)]
    return PairMatch(
        boxes[0],
        boxes[1],
        regions[0],
        regions[1],
        empty.points1,
        empty.points2,
        empty.distances,
        None,
        0.0,
        settings=settings,
    )


def _centred(picture: Picture, share: float) -> FloatArray:
    rows, columns = np.flatnonzero(picture.mask.any(axis=1)), np.flatnonzero(picture.mask.any(axis=0))
    if not rows.size:
        return np.zeros(4)
    low = np.array([columns[0], rows[0]]) / picture.reduction
    high = np.array([columns[-1] + 1, rows[-1] + 1]) / picture.reduction
    middle, half = (low + high) / 2, share * (high - low) / 2
    return np.concatenate([middle - half, middle + half])


def _filled(picture: Picture, box: FloatArray) -> Any:
    region = np.zeros(picture.grey.shape, dtype=bool)
    x0, y0, x1, y1 = np.rint(box * np.tile(picture.reduction, 2)).astype(int)
    region[y0:y1, x0:x1] = True
    return region


def _around(
    pictures: tuple[Picture, Picture],
    points: list[FloatArray],
    distances: FloatArray,
    transform: FloatArray | None,
    settings: dict[str, Any],
) -> PairMatch:
    """Return the match whose boxes are the hulls of matched points."""
    if len(distances) < 2:
        return nothing(*pictures, f"only {len(distances)} matches", settings)
    order = np.argsort(distances, kind="stable")
    # A point covers its pixel.
    boxes = [np.concatenate([p.min(axis=0), p.max(axis=0) + 1]) for p in points]
    boxes = [np.clip(box, 0, np.tile(picture.size, 2)) for box, picture in zip(boxes, pictures, strict=True)]
    only = boxed(pictures, boxes, settings)
    return PairMatch(
        only.box1,
        only.box2,
        only.region1,
        only.region2,
        points[0][order],
        points[1][order],
        distances[order],
        transform,
        float(len(order)),
        settings=settings,
    )


def _described(picture: Picture, detector: Detector) -> tuple[FloatArray, Any]:
    """Return key points, in pixels of the picture, and their descriptors."""
    cv2 = opencv()
    image = np.rint(picture.grey * 255).astype(np.uint8)
    mask = picture.mask.astype(np.uint8)
    if detector == "fast":
        corners = cv2.FastFeatureDetector_create().detect(image, mask)
        strongest = sorted(corners, key=lambda k: -k.response)[:_KEYPOINTS]
        brief = require("skimage.feature", "images").BRIEF()
        at = np.array([k.pt for k in strongest]).reshape(-1, 2)
        brief.extract(image, at[:, ::-1])
        return at[brief.mask], np.packbits(brief.descriptors, axis=1)
    makers = {"sift": "SIFT_create", "orb": "ORB_create", "akaze": "AKAZE_create"}
    if not hasattr(cv2, makers[detector]):
        name = detector.upper()
        message = f"OpenCV {cv2.__version__} has no {name}; versions below 5 do: pip install 'pliant[images]'"
        raise MissingExtraError(message)
    maker = (
        getattr(cv2, makers[detector])()
        if detector == "akaze"
        else getattr(cv2, makers[detector])(_KEYPOINTS)
    )
    found, descriptors = maker.detectAndCompute(image, mask)
    if descriptors is None:
        return np.zeros((0, 2)), np.zeros((0, 1), dtype=np.uint8)
    return np.array([k.pt for k in found]), descriptors


def _ratio_matches(one: Any, two: Any, *, binary: bool) -> tuple[Any, FloatArray]:
    if len(one) < 1 or len(two) < 2:
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0)
    cv2 = opencv()
    matcher = cv2.BFMatcher(cv2.NORM_HAMMING if binary else cv2.NORM_L2)
    best = [(m, n) for m, n in matcher.knnMatch(one, two, k=2) if m.distance < _RATIO * n.distance]
    pairs = np.array([(m.queryIdx, m.trainIdx) for m, _ in best], dtype=np.int64).reshape(-1, 2)
    return pairs, np.array([m.distance for m, _ in best], dtype=np.float64)


def _homography(points: list[FloatArray], size: tuple[int, int]) -> tuple[FloatArray | None, Any]:
    cv2 = opencv()
    if len(points[0]) < 4:
        return None, np.zeros(len(points[0]), dtype=bool)
    cv2.setRNGSeed(0)
    matrix, inside = cv2.findHomography(points[0], points[1], cv2.RANSAC, 0.01 * float(np.hypot(*size)))
    if matrix is None:
        return None, np.zeros(len(points[0]), dtype=bool)
    return np.asarray(matrix, dtype=np.float64), inside.ravel() > 0
