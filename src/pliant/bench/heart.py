"""The study of stenosis on phantoms of known truth: territories, nulls, ablation, the vocabulary's settings.

pliant bench heart --subjects 32 --tables 5.9,ablation
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, PliantError
from ..heart import (
    BagOfFeatures,
    ColumnHistograms,
    HeartPhantom,
    HeartStudy,
    PhantomCohort,
    aha_segments,
    describe_heart,
    endocardial_features,
    heart_study,
    phantom_cohort,
    ventricle_frame,
)
from ..heart.features import SegmentFeatures
from .heart_real import sunnybrook_rows

__all__ = ["TABLES", "measured_cohort", "run"]

#: What can be measured: Tables 5.3 and 5.7 to 5.9, the ablation, other kinds of change, from CT, and real hearts.
TABLES = ("5.3", "5.7", "5.8", "5.9", "ablation", "direction", "none", "ct", "sunnybrook")
Row = dict[str, Any]


def run(
    tables: Sequence[str] = ("5.9", "ablation"),
    *,
    subjects: int = 32,
    seed: int = 1000,
    permutations: int = 0,
    perceptron: bool = True,
    repeats: int = 1,
    spacing: float = 1.0,
    data: str | Path | None = None,
) -> list[Row]:
    """Measure some tables, on fresh phantoms but for the last.

    Parameters
    ----------
    tables : sequence of str
        Of :data:`TABLES`. "5.3": accuracy for bins of context f1, wavelengths f2, words k. "5.7", "5.8", "5.9": of
        the whole heart, by segment and by territory. "ablation": shape index; with curvedness and orientation;
        histograms of all 23 columns; the bag. "direction": a cohort in which stenosis turns trabeculae and their
        height stays. "none": nothing follows stenosis. "ct": from automatic segmentation of the CT, septal
        landmarks given. "sunnybrook": real hearts, normal against heart failure.
    subjects : int
        A cohort's size.
    seed : int
        Of the cohorts; tables share one but for "direction", "none" and "ct".
    permutations : int
        Shuffles for the null; "none" takes 100 at least.
    perceptron : bool
        Whether to train perceptrons too.
    repeats : int
        Draws of the ten folds.
    spacing : float
        Of the CT volumes, in mm.
    data : path-like, optional
        Folder of the real hearts; see :func:`pliant.bench.heart_real.sunnybrook_rows`.

    Returns
    -------
    list of dict
        One a score, with the table it belongs to, how many subjects could not be measured, and the CPU seconds its
        cohort took to measure.
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
    kept: dict[str, tuple[list[SegmentFeatures], np.ndarray, Row]] = {}
    for table in tables:
        if table == "5.3":
            rows += _vocabulary_rows(subjects, seed)
            continue
        if table == "sunnybrook":
            rows += [{"table": table, **row} for row in _real_rows(data)]
            continue
        kind = table if table in ("direction", "none", "ct") else "mixed"
        if kind not in kept:
            own = seed + ("mixed", "direction", "none", "ct").index(kind)
            kept[kind] = _cohort(kind, subjects, own, spacing)
        features, stenosis, about = kept[kind]
        chosen = dict(options, permutations=max(permutations, 100)) if table == "none" else options
        for row in _study_rows(table, features, stenosis, chosen):
            rows.append({"table": table, **row, **about})
    return rows


def measured_cohort(
    cohort: PhantomCohort, *, bins: int = 10, wavelengths: Sequence[float] | None = None
) -> list[SegmentFeatures]:
    """Measure every subject of a cohort from its true surface."""
    scales: Mapping[str, Any] = {} if wavelengths is None else {"wavelengths": wavelengths}
    return [_features(phantom, i, {"bins": bins, **scales}) for i, phantom in enumerate(cohort)]


def _features(phantom: HeartPhantom, i: int, options: Mapping[str, Any]) -> SegmentFeatures:
    frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    return endocardial_features(
        phantom.mesh, aha_segments(phantom.mesh, frame), frame, rng=i, n_jobs=1, **options
    )


def _features_from_ct(phantom: HeartPhantom, i: int) -> SegmentFeatures | None:
    septum = {"septum": phantom.landmarks["septum"]}
    try:
        return describe_heart(phantom.volume, landmarks=septum, rng=i, n_jobs=1).features
    except PliantError:
        return None


def _real_rows(data: str | Path | None) -> list[Row]:
    if data is None:
        raise InputError("the table sunnybrook needs the folder of the hearts (data)")
    return sunnybrook_rows(data)


def _cohort(
    kind: str, subjects: int, seed: int, spacing: float
) -> tuple[list[SegmentFeatures], np.ndarray, Row]:
    """Return what was measured of the subjects that could be, their stenoses, and how many could not."""
    if kind != "ct":
        cohort = phantom_cohort(subjects, change=kind, rng=seed, spacing=8.0)  # type: ignore[arg-type]
        start = time.process_time()
        features = measured_cohort(cohort)
        return features, np.asarray(cohort.stenosis), {"cpu_s": round(time.process_time() - start, 1)}
    cohort = phantom_cohort(subjects, rng=seed, spacing=spacing)
    start = time.process_time()
    found = [_features_from_ct(phantom, i) for i, phantom in enumerate(cohort)]
    known = [i for i, measured in enumerate(found) if measured is not None]
    about = {"failed": found.count(None), "cpu_s": round(time.process_time() - start, 1)}
    return [f for f in found if f is not None], np.asarray(cohort.stenosis)[known], about


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
    scenario: Any = {"5.7": "global", "5.8": "segment"}.get(table, "territory")
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
    """Mean accuracy over territories for each (f1, f2, k) of Table 5.3, by logistic regression."""
    cohort = phantom_cohort(subjects, rng=seed, spacing=8.0)
    rows = []
    for f2 in (10, 20):
        start = time.process_time()
        fine = measured_cohort(cohort, bins=20, wavelengths=np.geomspace(30.0, 6.0, f2).tolist())
        seconds = round(time.process_time() - start, 1)
        for f1, features in ((10, [_halved(f) for f in fine]), (20, fine)):
            methods = {f"k = {k}": BagOfFeatures(k, blocks=features[0].blocks) for k in (10, 20)}
            found = heart_study(
                features, cohort.stenosis, methods=methods, classifiers=("logistic",), regressors=("ridge",),
                repeats=3, permutations=0, n_jobs=1,
            )  # fmt: skip
            rows += [
                {"table": "5.3", "f1": f1, "f2": f2, "k": k, **_means(found, f"k = {k}"), "cpu_s": seconds}
                for k in (10, 20)
            ]
    return rows


def _halved(features: SegmentFeatures) -> SegmentFeatures:
    """Return the same with half as many bins of context: shares of neighbouring bins added up."""
    block = features.blocks["context"]
    context = features.values[:, block]
    values = np.column_stack(
        [
            features.values[:, : block.start],
            context[:, ::2] + context[:, 1::2],
            features.values[:, block.stop :],
        ]
    )
    return replace(features, values=values, settings={**features.settings, "bins": context.shape[1] // 2})


def _means(found: HeartStudy, name: str) -> Row:
    accuracies = [found.row(unit, name, "logistic").accuracy for unit in found.problems]
    return {
        "accuracy": round(float(np.mean(accuracies)), 3),
        "balanced accuracy": round(found.mean_score(name, "logistic"), 3),
        "r": round(found.mean_score(name, "ridge"), 3),
    }
