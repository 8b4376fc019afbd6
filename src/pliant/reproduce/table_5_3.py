"""Table 5.3: bins of the context, scales of the spectrum and words of the vocabulary."""

from __future__ import annotations

import numpy as np

from ..heart import BagOfFeatures, heart_study
from ..heart.features import feature_blocks
from ..heart.study import Scenario
from ._hearts import hearts
from .bench import Bench
from .findings import Experiment, Findings, Row, graded, row_of

# Bins f1, scales f2, words k: mean accuracy over the seventeen segments.
PRINTED = {
    (10, 10, 10): 0.51, (10, 10, 20): 0.57, (10, 20, 10): 0.51, (10, 20, 20): 0.49,
    (20, 10, 10): 0.49, (20, 10, 20): 0.53, (20, 20, 10): 0.48, (20, 20, 20): 0.54,
}  # fmt: skip
BEST = (10, 10, 20)
# One segment of each ring and territory in the quick run.
_FEW = (
    "segment 1",
    "segment 4",
    "segment 5",
    "segment 7",
    "segment 9",
    "segment 11",
    "segment 13",
    "segment 15",
    "segment 16",
)


def _run(bench: Bench) -> Findings:
    scores: dict[tuple[int, int, int], list[float]] = {}
    said = ""
    scenario: Scenario = "territory" if bench.quick else "segment"
    for bins in (10, 20):
        for waves in (10, 20):
            features, stenosis, said = hearts(bench, bins=bins, waves=waves)
            methods = {
                f"{words} words": BagOfFeatures(words, blocks=feature_blocks(bins, waves), rng=bench.seed)
                for words in (10, 20)
            }
            study = heart_study(
                features, stenosis, scenario=scenario, methods=methods, classifiers=("logistic",),
                regressors=("ridge",), permutations=0, repeats=1, folds=4, resamples=2, rng=bench.seed,
            )  # fmt: skip
            for words in (10, 20):
                scores[bins, waves, words] = [
                    study.row(unit, f"{words} words", "logistic").score.value for unit in study.problems
                ]
    rows: list[Row] = [
        row_of(f"f1 = {f1}, f2 = {f2}, k = {k}: mean accuracy", PRINTED[f1, f2, k], scores[f1, f2, k])
        for f1, f2, k in PRINTED
    ]
    means = {setting: float(np.mean(values)) for setting, values in scores.items()}
    ranked = sorted(means, key=means.__getitem__, reverse=True)
    spread = max(means.values()) - min(means.values())
    gained = float(np.mean([means[f1, f2, 20] - means[f1, f2, 10] for f1, f2, k in PRINTED if k == 10]))
    rows.append(Row("gain of 20 words over 10, mean", 0.035, gained))
    top = ranked[0] == BEST
    return Findings(
        graded(top and gained > 0, top or gained > 0),
        f"Best is (f1, f2, k) = {ranked[0]} with {means[ranked[0]]:.2f}; (10, 10, 20) is place "
        f"{ranked.index(BEST) + 1} of 8 "
        f"with {means[BEST]:.2f}. The eight lie within {spread:.2f}, printed within .09; twenty words gain "
        f"{gained:+.3f} over "
        "ten.",
        f"{said} Intervals here are over {scenario}s, which share subjects, so they are too narrow.",
        tuple(rows),
        {"folds": 4, "model": "logistic", "units": f"{len(next(iter(scores.values())))} {scenario}"},
    )


EXPERIMENT = Experiment(
    "table-5.3",
    "Bins, scales and words of the bag of features",
    "Of eight settings, 10 bins, 10 scales and 20 words classify segments best.",
    "That setting is the best of the eight and twenty words are better than ten on average; in part if one of these.",
    _run,
)
