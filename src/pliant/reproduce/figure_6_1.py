"""Figure 6.1: partial matches with boxes and correspondences."""

from __future__ import annotations

import numpy as np

from ..evaluate.relevance import mean_interval
from ..images import ImagePair, PairMatch, match_pair
from ..report.matches import match_figure
from ._pairs import NEEDS, image_pairs
from .bench import Bench
from .findings import Experiment, Findings, Row, graded

_BEST, _WITHIN, _SHOWN = 50, 0.05, 4


def _run(bench: Bench) -> Findings:
    pairs, said = image_pairs(bench)
    matches = [match_pair(pair.picture1, pair.picture2, rng=bench.seed) for pair in pairs]
    right = np.array([_right(pair, match) for pair, match in zip(pairs, matches, strict=True)])
    monuments = [pair.monument or pair.name for pair in pairs]
    order = np.argsort(right)
    for place in np.linspace(len(order) - 1, 0, min(_SHOWN, len(order))).astype(int):
        i = int(order[place])
        drawn = match_figure(
            pairs[i].picture1,
            pairs[i].picture2,
            matches[i],
            truth=(pairs[i].box1, pairs[i].box2),
            title=pairs[i].name,
        )
        bench.figure(drawn, f"{pairs[i].name}: {100 * right[i]:.0f} % of the nearest matches are right")
    mean, most = float(right.mean()), float((right >= 0.5).mean())
    return Findings(
        graded(mean >= 0.8, mean >= 0.5),
        f"Of the {_BEST} nearest matches {100 * mean:.0f} % lie where the pair's homography takes them, to "
        f"5 % of the "
        f"diagonal; in {100 * most:.0f} % of the pairs that is half of them or more. The pictures are the "
        f"best, the worst "
        "and two between. The dissertation shows pictures only.",
        f"{said} Intervals by bootstrap over monuments.",
        (
            Row(
                "share of the nearest matches that are right",
                None,
                mean,
                *mean_interval(right, monuments, rng=bench.seed),
            ),
            Row("share of pairs with half or more right", None, most),
        ),
        {"pairs": len(pairs), "points": 300, "eigenvectors": 30},
    )


def _right(pair: ImagePair, match: PairMatch) -> float:
    one, two = match.points1[:_BEST], match.points2[:_BEST]
    if not len(one):
        return 0.0
    carried = np.column_stack([one, np.ones(len(one))]) @ pair.homography.T
    miss = np.linalg.norm(carried[:, :2] / carried[:, 2:] - two, axis=1)
    return float((miss <= _WITHIN * np.hypot(*pair.picture2.size)).mean())


EXPERIMENT = Experiment(
    "figure-6.1",
    "Partial matches with their correspondences",
    "The part that two pictures share is found, and points in it correspond.",
    "Four fifths of the 50 nearest matches are right to 5 % of the diagonal; in part from half.",
    _run,
    uses=(NEEDS,),
)
