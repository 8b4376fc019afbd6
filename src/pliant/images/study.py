"""The protocol of section 6.5: methods over a list of pairs, with intervals over monuments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from .._parallel import ordered_map
from ..errors import InputError, MissingExtraError
from ..evaluate.relevance import (
    RelevanceScores,
    area_under_roc,
    box_overlaps,
    mean_interval,
    relevance_scores,
    transform_error,
)
from .baselines import match_blur, match_centre, match_keypoints, match_saliency, match_whole
from .matching import PairMatch, match_pair
from .pairs import ImagePair, moved
from .records import PairRecord

__all__ = ["BASELINES", "METHODS", "PairStudy", "evaluate_pairs", "repeated_matches", "unrelated_scores"]

Method: TypeAlias = Callable[..., PairMatch]
Motion: TypeAlias = Literal["as given", "moved"]

#: What the proposed method has to beat.
BASELINES = ("sift", "orb", "akaze", "fast", "gb", "whole", "centre")
_WITHIN = 0.05


def _proposed(one: Any, two: Any, *, rng: int) -> PairMatch:
    return match_pair(one, two, rng=rng)


def _gb(one: Any, two: Any, *, rng: int) -> PairMatch:
    return match_blur(one, two, rng=rng)


def _plain(method: Method, **options: Any) -> Method:
    def run(one: Any, two: Any, *, rng: int) -> PairMatch:
        return method(one, two, **options)

    return run


METHODS: Mapping[str, Method] = {
    "proposed": _proposed,
    "sift": _plain(match_keypoints, detector="sift"),
    "orb": _plain(match_keypoints, detector="orb"),
    "akaze": _plain(match_keypoints, detector="akaze"),
    "fast": _plain(match_keypoints, detector="fast"),
    "gb": _gb,
    "whole": _plain(match_whole),
    "centre": _plain(match_centre),
    "saliency": _plain(match_saliency),
    "sift_ransac": _plain(match_keypoints, detector="sift", box="ransac"),
    "orb_ransac": _plain(match_keypoints, detector="orb", box="ransac"),
    "akaze_ransac": _plain(match_keypoints, detector="akaze", box="ransac"),
    "fast_ransac": _plain(match_keypoints, detector="fast", box="ransac"),
}


@dataclass(frozen=True, eq=False)
class PairStudy:
    """Scores of several methods on the same pairs.

    Attributes
    ----------
    names, kinds, monuments : tuple of str
        Of each pair.
    registered : tuple of bool
        Whether its pictures lay on each other before anything was done.
    scores : dict of str to RelevanceScores
        By method; a method that could not run is left out and named in ``failures``.
    transform_errors : (n,) array of float
        Of the proposed method, see :func:`pliant.evaluate.relevance.transform_error`.
    inliers : (n,) array of float
        Its scores.
    failures : dict of str to str
        Why a method could not run.
    """

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    monuments: tuple[str, ...]
    registered: tuple[bool, ...]
    scores: dict[str, RelevanceScores]
    transform_errors: Any
    inliers: Any
    failures: dict[str, str]

    def mrs(self) -> dict[str, float | None]:
        """Return the mean relevance score of every method; None where it could not run."""
        return self._means("relevance")

    def fpr(self) -> dict[str, float | None]:
        """Return the mean false share of every method."""
        return self._means("false_share")

    def above_best(self, *, rng: int = 0) -> dict[str, Any]:
        """Compare the proposed method with the best baseline, by a bootstrap over monuments.

        Parameters
        ----------
        rng : int
            Seed of the bootstrap.

        Returns
        -------
        dict
            ``baseline``, ``difference`` of mean relevance, and its 95 % ``interval`` (None with one monument). The
            best is chosen on the same pairs, so the difference is not flattered by the choice.
        """
        ran = [name for name in BASELINES if name in self.scores]
        best = max(ran, key=lambda name: float(self.scores[name].relevance.mean()))
        apart = self.scores["proposed"].relevance - self.scores[best].relevance
        several = len(set(self.monuments)) > 1
        interval = list(mean_interval(apart, self.monuments, rng=rng)) if several else None
        return {"baseline": best, "difference": float(apart.mean()), "interval": interval}

    def transform_share(self) -> float | None:
        """Return the share of pairs whose transform is right to 5 % of the diagonal; None where none can be judged."""
        known = self.transform_errors[~np.isnan(self.transform_errors)]
        return float((known <= _WITHIN).mean()) if known.size else None

    def summary(self) -> dict[str, Any]:
        """Return everything as plain values for JSON."""
        proposed = self.scores["proposed"]
        where = ["registered" if r else "not registered" for r in self.registered]
        several = len(set(self.monuments)) > 1
        return {
            "above_best": self.above_best(),
            "mrs_interval": list(mean_interval(proposed.relevance, self.monuments)) if several else None,
            "transform_within_5_percent": self.transform_share(),
            "by_kind": proposed.means(self.kinds),
            "by_registration": proposed.means(where),
            "by_monument": proposed.means(self.monuments),
            "repeatability": float(proposed.repeatability.mean()),
            "overlap": [float(proposed.overlap1.mean()), float(proposed.overlap2.mean())],
        }

    def _means(self, measure: str) -> dict[str, float | None]:
        means: dict[str, float | None] = {
            name: float(getattr(scores, measure).mean()) for name, scores in self.scores.items()
        }
        return means | dict.fromkeys(self.failures)


def evaluate_pairs(
    records: Sequence[PairRecord | ImagePair],
    *,
    methods: Sequence[str] = tuple(METHODS),
    motion: Motion = "as given",
    rng: int = 0,
    n_jobs: int | None = 1,
    progress: bool = False,
) -> PairStudy:
    """Run methods over pairs with true boxes and score them.

    Parameters
    ----------
    records : sequence of PairRecord or ImagePair
        From :func:`read_pairs` or :func:`synthetic_pairs`.
    methods : sequence of str
        Names in :data:`METHODS`; "proposed" must be among them.
    motion : {"as given", "moved"}
        "moved" turns and resizes the second picture of each pair first (:func:`moved`), which takes away the
        register that most public pairs come in.
    rng : int
        Seed of the points and the motions.
    n_jobs : int, optional
        Threads.
    progress : bool
        Whether to show a bar on a terminal.

    Returns
    -------
    PairStudy

    Raises
    ------
    InputError
        If there are no pairs, a method is unknown, or a picture cannot be read.
    """
    unknown = [name for name in methods if name not in METHODS]
    if unknown or "proposed" not in methods or not any(name in BASELINES for name in methods):
        message = (
            f"methods must be 'proposed', a baseline of {', '.join(BASELINES)}, and others of {', '.join(METHODS)}; "
            f"got {list(methods)}"
        )
        raise InputError(message)
    if not records:
        raise InputError("there are no pairs to evaluate")

    def work(item: tuple[int, PairRecord | ImagePair]) -> tuple[ImagePair, dict[str, PairMatch | str]]:
        index, record = item
        pair = record.load() if isinstance(record, PairRecord) else record
        if motion == "moved":
            pair = moved(pair, rng=np.random.default_rng([rng, index]))
        return pair, {name: _tried(name, pair, rng) for name in methods}

    done = list(
        ordered_map(work, list(enumerate(records)), n_jobs, description="Matching pairs", progress=progress)
    )
    return _studied(records, done, methods)


def _tried(name: str, pair: ImagePair, rng: int) -> PairMatch | str:
    try:
        return METHODS[name](pair.picture1, pair.picture2, rng=rng)
    except MissingExtraError as error:
        return str(error)


def _studied(
    records: Sequence[PairRecord | ImagePair],
    done: list[tuple[ImagePair, dict[str, PairMatch | str]]],
    methods: Sequence[str],
) -> PairStudy:
    pairs = [pair for pair, _ in done]
    truth = [np.array([p.box1 for p in pairs]), np.array([p.box2 for p in pairs])]
    scores, failures = {}, {}
    for name in methods:
        found = [results[name] for _, results in done]
        matches = [m for m in found if isinstance(m, PairMatch)]
        if len(matches) < len(found):
            failures[name] = next(str(m) for m in found if isinstance(m, str))
            continue
        scores[name] = relevance_scores([m.box1 for m in matches], [m.box2 for m in matches], *truth)
    proposed = [results["proposed"] for _, results in done]
    errors = [
        transform_error(match.transform, pair.homography, pair.box1, pair.picture2.size)
        for pair, match in zip(pairs, proposed, strict=True)
        if isinstance(match, PairMatch)
    ]
    return PairStudy(
        names=tuple(p.name for p in pairs),
        kinds=tuple(p.kind for p in pairs),
        monuments=tuple(p.monument or p.name for p in pairs),
        registered=tuple(_was_registered(r) for r in records),
        scores=scores,
        transform_errors=np.array(errors),
        inliers=np.array([m.score for m in proposed if isinstance(m, PairMatch)]),
        failures=failures,
    )


def _was_registered(record: PairRecord | ImagePair) -> bool:
    return bool(np.allclose(record.homography, np.eye(3), atol=1e-6))


def repeated_matches(pair: ImagePair, *, runs: int = 50, n_jobs: int | None = 1) -> dict[str, float]:
    """Match one pair with many seeds, to see how much of the result is chance.

    Parameters
    ----------
    pair : ImagePair
    runs : int
        Seeds 0, 1, ...
    n_jobs : int, optional
        Threads.

    Returns
    -------
    dict
        ``r1``: mean repeatability R1 (eq. 6.10), the share of the found boxes that is true; ``overlap``: mean
        intersection over union of the boxes of every two runs, both images.
    """
    matches = list(
        ordered_map(lambda seed: match_pair(pair.picture1, pair.picture2, rng=seed), range(runs), n_jobs)
    )
    found = [[m.box1 for m in matches], [m.box2 for m in matches]]
    truth = [np.tile(pair.box1, (runs, 1)), np.tile(pair.box2, (runs, 1))]
    overlap = np.mean([box_overlaps(boxes).mean() for boxes in found])
    return {"r1": float(relevance_scores(*found, *truth).repeatability.mean()), "overlap": float(overlap)}


def unrelated_scores(
    pairs: Sequence[ImagePair], *, count: int = 100, rng: int = 0, n_jobs: int | None = 1
) -> tuple[Any, float, Any]:
    """Score pairs of pictures that have nothing in common, and true ones.

    Parameters
    ----------
    pairs : sequence of ImagePair
        First pictures are matched with second pictures of other monuments.
    count : int
        Unrelated pairs, drawn at random without repetition.
    rng : int
        Seed.
    n_jobs : int, optional
        Threads.

    Returns
    -------
    unrelated : (count,) array of float
    area : float
        Area under the ROC curve of the true pairs against them.
    true : (n,) array of float

    Raises
    ------
    InputError
        If all pairs show one monument.
    """
    apart = [(a, b) for a in pairs for b in pairs if (a.monument or a.name) != (b.monument or b.name)]
    if not apart:
        raise InputError("unrelated pairs need two monuments or more")
    chosen = np.random.default_rng(rng).permutation(len(apart))[:count]
    lists = [[apart[i] for i in chosen], [(p, p) for p in pairs]]
    unrelated, true = (
        np.array(
            list(
                ordered_map(lambda ab: match_pair(ab[0].picture1, ab[1].picture2, rng=rng).score, one, n_jobs)
            )
        )
        for one in lists
    )
    return unrelated, area_under_roc(true, unrelated), true
