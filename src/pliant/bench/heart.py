"""The study of stenosis on phantoms of known truth: territories, nulls, ablation, the vocabulary's settings.

pliant bench heart --subjects 32 --tables 5.9,ablation
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from ..errors import InputError
from ..heart import (
    BagOfFeatures,
    ColumnHistograms,
    HeartPhantom,
    PhantomCohort,
    aha_segments,
    describe_heart,
    endocardial_features,
    heart_study,
    phantom_cohort,
    ventricle_frame,
)
from ..heart.features import SegmentFeatures

__all__ = ["TABLES", "measured_cohort", "run"]

#: What can be measured: Tables 5.3, 5.8 and 5.9, the ablation, other kinds of change, and from CT.
TABLES = ("5.3", "5.8", "5.9", "ablation", "direction", "none", "ct")
Row = dict[str, Any]


def run(
    tables: Sequence[str] = ("5.9", "ablation"),
    *,
    subjects: int = 32,
    seed: int = 1000,
    permutations: int = 0,
    perceptron: bool = True,
    repeats: int = 1,
) -> list[Row]:
    """Measure some tables on fresh phantoms.

    Parameters
    ----------
    tables : sequence of str
        Of :data:`TABLES`. "5.3": accuracy for bins of context f1, wavelengths f2, words k. "5.8", "5.9": by segment
        and by territory. "ablation": shape index; with curvedness and orientation; histograms of all 23 columns; the
        bag. "direction": a cohort in which stenosis turns trabeculae and their height stays. "none": nothing
        follows stenosis. "ct": from automatic segmentation of the CT, septal landmarks given.
    subjects : int
        A cohort's size.
    seed : int
        Of the cohorts; every table but the last three shares one.
    permutations : int
        Shuffles for the null; "none" takes 100 at least.
    perceptron : bool
        Whether to train perceptrons too.
    repeats : int
        Draws of the ten folds.

    Returns
    -------
    list of dict
        One a score, with the table it belongs to and the CPU seconds its cohort took to measure.
    """
    unknown = sorted(set(tables) - set(TABLES))
    if unknown:
        message = f"tables are {', '.join(TABLES)}; got {', '.join(unknown)}"
        raise InputError(message)
    options: dict[str, Any] = {
        "permutations": permutations, "repeats": repeats, "n_jobs": 1,
        "classifiers": ("perceptron", "logistic") if perceptron else ("logistic",),
    }  # fmt: skip
    rows: list[Row] = []
    kept: dict[str, tuple[list[SegmentFeatures], np.ndarray, float]] = {}
    for table in tables:
        if table == "5.3":
            rows += _vocabulary_rows(subjects, seed)
            continue
        kind = table if table in ("direction", "none", "ct") else "mixed"
        if kind not in kept:
            kept[kind] = _cohort(kind, subjects, seed + ("mixed", "direction", "none", "ct").index(kind))
        features, stenosis, seconds = kept[kind]
        chosen = dict(options, permutations=max(permutations, 100)) if table == "none" else options
        for row in _study_rows(table, features, stenosis, chosen):
            rows.append({"table": table, **row, "cpu_s": round(seconds, 1)})
    return rows


def measured_cohort(
    cohort: PhantomCohort,
    *,
    from_ct: bool = False,
    bins: int = 10,
    wavelengths: Sequence[float] | None = None,
) -> list[SegmentFeatures]:
    """Measure every subject of a cohort, from its true surface or from its CT."""
    scales: Mapping[str, Any] = {} if wavelengths is None else {"wavelengths": wavelengths}
    return [_features(phantom, i, from_ct, {"bins": bins, **scales}) for i, phantom in enumerate(cohort)]


def _features(phantom: HeartPhantom, i: int, from_ct: bool, options: Mapping[str, Any]) -> SegmentFeatures:
    if from_ct:
        septum = {"septum": phantom.landmarks["septum"]}
        return describe_heart(phantom.volume, landmarks=septum, rng=i, n_jobs=1).features
    frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    return endocardial_features(
        phantom.mesh, aha_segments(phantom.mesh, frame), frame, rng=i, n_jobs=1, **options
    )


def _cohort(kind: str, subjects: int, seed: int) -> tuple[list[SegmentFeatures], np.ndarray, float]:
    ct = kind == "ct"
    change: Any = "mixed" if ct else kind
    cohort = phantom_cohort(subjects, change=change, rng=seed, spacing=1.0 if ct else 8.0)
    start = time.process_time()
    features = measured_cohort(cohort, from_ct=ct)
    return features, np.asarray(cohort.stenosis), time.process_time() - start


def _study_rows(
    table: str, features: list[SegmentFeatures], stenosis: np.ndarray, options: Mapping[str, Any]
) -> list[Row]:
    methods: dict[str, Any] = {"bag of features": BagOfFeatures()}
    if table == "ablation":
        methods = {
            "shape index": ColumnHistograms(20, columns=(0,)),
            "shape index, curvedness, orientation": ColumnHistograms(20, columns=(0, 1, 2)),
            "23 columns": ColumnHistograms(10),
            "shape index and curvedness, bag": BagOfFeatures(columns=(0, 1)),
            "plain bag": BagOfFeatures(weighting="plain"),
            **methods,
        }
    scenario: Any = "segment" if table == "5.8" else "territory"
    found = heart_study(features, stenosis, scenario=scenario, methods=methods, **options)
    rows = found.table()
    if table == "direction":
        for model, baseline in (("ridge", "linear"), ("logistic", "logistic")):
            value, low, high = found.above(
                "bag of features", "roughness", model=model, baseline_model=baseline
            )
            rows.append({"unit": "mean", "method": "bag above roughness", "model": model, "difference": round(value, 3),
                         "low": round(low, 3), "high": round(high, 3)})  # fmt: skip
    return rows


def _vocabulary_rows(subjects: int, seed: int) -> list[Row]:
    """Mean balanced accuracy over territories for each (f1, f2, k) of Table 5.3, by logistic regression."""
    cohort = phantom_cohort(subjects, rng=seed, spacing=8.0)
    rows = []
    for f1, f2 in product((10, 20), (10, 20)):
        start = time.process_time()
        features = measured_cohort(cohort, bins=f1, wavelengths=np.geomspace(30.0, 6.0, f2).tolist())
        seconds = time.process_time() - start
        methods = {f"k = {k}": BagOfFeatures(k, blocks=features[0].blocks) for k in (10, 20)}
        found = heart_study(
            features, cohort.stenosis, methods=methods, classifiers=("logistic",), regressors=("ridge",),
            repeats=1, permutations=0, n_jobs=1,
        )  # fmt: skip
        for k in (10, 20):
            name = f"k = {k}"
            accuracies = [found.row(unit, name, "logistic").accuracy for unit in found.problems]
            balanced, r = found.mean_score(name, "logistic"), found.mean_score(name, "ridge")
            row = {
                "table": "5.3",
                "f1": f1,
                "f2": f2,
                "k": k,
                "accuracy": round(float(np.mean(accuracies)), 3),
            }
            rows.append(
                row | {"balanced accuracy": round(balanced, 3), "r": round(r, 3), "cpu_s": round(seconds, 1)}
            )
    return rows
