"""Figure 6.5 and section 6.5.2: how much of a match is chance."""

from __future__ import annotations

import numpy as np

from ..evaluate.relevance import mean_interval
from ..images import repeated_matches
from ._pairs import NEEDS, image_pairs
from .bench import Bench
from .findings import Experiment, Findings, Row

PRINTED = 0.8255


def _run(bench: Bench) -> Findings:
    pairs, said = image_pairs(bench)
    runs = 4 if bench.quick else 50
    found = [repeated_matches(pair, runs=runs, n_jobs=None) for pair in pairs]
    right = np.array([result["r1"] for result in found])
    overlap = np.array([result["overlap"] for result in found])
    monuments = [pair.monument for pair in pairs]
    rows = (
        Row(
            "repeatability R1", PRINTED, float(right.mean()), *mean_interval(right, monuments, rng=bench.seed)
        ),
        Row(
            "overlap of boxes between runs",
            None,
            float(overlap.mean()),
            *mean_interval(overlap, monuments, rng=bench.seed),
        ),
    )
    return Findings(
        "holds"
        if rows[0].high is not None and rows[0].high >= PRINTED
        else "holds partly"
        if right.mean() > 0.7
        else "does not hold",
        f"Of what is found, {right.mean():.2f} is right on average over {runs} draws of the points "
        f"(printed: {PRINTED:.2f}, two outliers left out); boxes of two draws overlap by "
        f"{overlap.mean():.2f}, so chance is the smaller part of the error.",
        f"{said} {runs} seeds a pair. Intervals by bootstrap over monuments.",
        rows,
        {"seeds": runs},
    )


EXPERIMENT = Experiment(
    "figure-6.5",
    "Repeatability of matches over draws of the points",
    "Over 50 draws of the points the repeatability is .83 without two outliers.",
    "The interval of R1, outliers included, reaches .8255; in part above .7.",
    _run,
    uses=(NEEDS,),
)
