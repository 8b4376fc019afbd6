"""Partial matching measured: settings, correspondences, repeatability, evidence, time (sections 6.5.2 and 6.5.3)."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import FloatArray, IntArray
from ..evaluate.relevance import relevance_scores
from ..images import ImagePair, match_pair, mutual_matches, read_pairs, repeated_matches, unrelated_scores
from ..images.blur import geometric_blur
from ..images.registration import carried
from ..images.search import joint_matches
from ..images.views import View, view

__all__ = ["load", "run", "settings_table"]

#: Table 6.1 of the dissertation: (points, eigenvectors) -> MRS, FPR, on other pairs with other boxes.
PRINTED = {
    (100, 5): (0.71, 0.27),
    (100, 10): (0.72, 0.26),
    (100, 20): (0.76, 0.22),
    (100, 30): (0.76, 0.22),
    (200, 5): (0.75, 0.23),
    (200, 10): (0.77, 0.21),
    (200, 20): (0.79, 0.19),
    (200, 30): (0.80, 0.18),
    (300, 5): (0.74, 0.24),
    (300, 10): (0.78, 0.20),
    (300, 20): (0.82, 0.17),
    (300, 30): (0.81, 0.18),
}
_BEST = 50
_WITHIN = 0.05


def load(path: str | Path) -> list[ImagePair]:
    """Read all pairs of a list.

    Parameters
    ----------
    path : str or Path
        See :func:`pliant.images.read_pairs`.

    Returns
    -------
    list of ImagePair
    """
    return [record.load() for record in read_pairs(path)]


def settings_table(pairs: Sequence[ImagePair]) -> Iterator[dict[str, Any]]:
    """Recompute Table 6.1, the mean relevance by number of points and eigenvectors, beside the printed values.

    Parameters
    ----------
    pairs : sequence of ImagePair

    Yields
    ------
    dict
        One row a setting; the last one the dissertation did not try.
    """
    for features, dim in (*PRINTED, (300, 40)):
        mrs, fpr = _scored(pairs, features, dim)
        printed = PRINTED.get((features, dim))
        yield {
            "points": features,
            "eigenvectors": dim,
            "mrs": mrs,
            "printed_mrs": printed[0] if printed else None,
            "fpr": fpr,
            "printed_fpr": printed[1] if printed else None,
        }


def run(pairs: Sequence[ImagePair], *, runs: int = 50, unrelated: int = 200) -> dict[str, Any]:
    """Measure correspondences, repeatability, the evidence of the score, and time.

    Parameters
    ----------
    pairs : sequence of ImagePair
    runs : int
        Seeds for the repeatability.
    unrelated : int
        Pairs of pictures of different monuments.

    Returns
    -------
    dict
    """
    shares = np.array([_correspondences(pair) for pair in pairs])
    again = [repeated_matches(pair, runs=runs) for pair in pairs]
    low, area, true = unrelated_scores(pairs, count=unrelated)
    return {
        "correspondences": {"gb": float(shares[:, 0].mean()), "jged": float(shares[:, 1].mean())},
        "repeatability": float(np.mean([a["r1"] for a in again])),
        "overlap_between_runs": float(np.mean([a["overlap"] for a in again])),
        "area_under_roc": area,
        "score_of_unrelated": {"median": float(np.median(low)), "greatest": float(low.max())},
        "score_of_true": {"median": float(np.median(true)), "least": float(true.min())},
        "seconds_a_pair": _seconds(pairs),
    }


def _scored(pairs: Sequence[ImagePair], features: int, dim: int) -> tuple[float, float]:
    found = [match_pair(p.picture1, p.picture2, features=features, dim=dim) for p in pairs]
    scores = relevance_scores(
        [m.box1 for m in found], [m.box2 for m in found], [p.box1 for p in pairs], [p.box2 for p in pairs]
    )
    return float(scores.relevance.mean()), float(scores.false_share.mean())


def _correspondences(pair: ImagePair) -> tuple[float, float]:
    """Return the share of right ones among the 50 nearest mutual matches, by geometric blur and by JGED."""
    rng = np.random.default_rng(0)
    one, two = view(pair.picture1, 300, rng), view(pair.picture2, 300, rng)
    blur, _ = mutual_matches(geometric_blur(one.edges, one.points), geometric_blur(two.edges, two.points))
    joint, _ = joint_matches(one, two, 30)
    return _right(pair, one, two, blur), _right(pair, one, two, joint)


def _right(pair: ImagePair, one: View, two: View, matches: IntArray) -> float:
    best = matches[:_BEST]
    if not len(best):
        return 0.0
    points: list[FloatArray] = [
        seen.points_in_source(seen.points[best[:, k]].astype(np.float64)) for k, seen in enumerate((one, two))
    ]
    miss = np.linalg.norm(carried(pair.homography, points[0]) - points[1], axis=1)
    return float((miss <= _WITHIN * np.hypot(*pair.picture2.size)).mean())


def _seconds(pairs: Sequence[ImagePair]) -> float:
    """Return the median time of a match, pictures in memory, one thread."""
    from threadpoolctl import threadpool_limits

    from ..images._opencv import opencv

    cv2 = opencv()
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    taken = []
    try:
        with threadpool_limits(1):
            for pair in pairs:
                start = time.process_time()
                match_pair(pair.picture1, pair.picture2)
                taken.append(time.process_time() - start)
    finally:
        cv2.setNumThreads(threads)
    return float(np.median(taken))
