"""Size and shape in one prediction: shape is let in on evidence only, and nothing is learned from test subjects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pliant import InputError
from pliant.bench.heart import _halved
from pliant.bench.heart_real import compared
from pliant.evaluate.relevance import area_under_roc
from pliant.heart import (
    BagOfFeatures,
    aha_segments,
    endocardial_features,
    heart_phantom,
    heart_study,
    ventricle_frame,
)
from pliant.heart._crossval import model, predictions, splits_of
from pliant.heart._scores import area, area_draws
from pliant.heart.features import SegmentFeatures

SEGMENTS = np.repeat(np.arange(1, 18), 12)
FAST = {
    "scenario": "global",
    "classifiers": ("logistic",),
    "folds": 4,
    "repeats": 2,
    "permutations": 0,
    "n_jobs": 1,
}


def columns(n: int, size: float, shape: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """One column of size and eight of shape, which know so much of the label."""
    rng = np.random.default_rng(seed)
    y = np.arange(n) % 2
    X = rng.normal(size=(n, 9))
    X[:, 0] += size * y
    X[:, 3] += shape * y
    return X, y.astype(float)


def subjects(n: int, size: float, shape: float) -> tuple[list[SegmentFeatures], np.ndarray]:
    """Hearts whose volume, and one column of whose rows, know so much of the label."""
    rng = np.random.default_rng(1)
    ill = np.arange(n) % 2
    hearts = []
    for label in ill:
        values = rng.normal(0, 1, (len(SEGMENTS), 23))
        values[:, 1] += shape * label + rng.normal(0, 0.1)
        volume = 120 * np.exp(0.25 * (size * label + rng.normal()))
        hearts.append(SegmentFeatures(values, SEGMENTS, SEGMENTS, np.ones(18), np.ones(18), volume))
    return hearts, ill


@pytest.mark.parametrize("name", ["logistic", "ridge"])
def test_shape_that_knows_nothing_is_left_out_and_size_stands_as_it_is(name: str) -> None:
    kept = 0
    for seed in range(6):
        X, y = columns(40, 1.5, 0.0, seed)
        both = model(name, 9, 40, 0, sizes=1).fit(X, y)  # type: ignore[arg-type]
        alone = model(name, 1, 40, 0).fit(X[:, :1], y)  # type: ignore[arg-type]
        if both.weight_ == 0:
            kept += 1
            expected = alone.decision_function(X[:, :1]) if name == "logistic" else alone.predict(X[:, :1])
            assert both.predict(X) == pytest.approx(expected)
    assert kept >= 5


@pytest.mark.parametrize("name", ["logistic", "ridge"])
def test_shape_that_knows_more_is_let_in(name: str) -> None:
    X, y = columns(60, 0.8, 2.5, 0)
    both = model(name, 9, 60, 0, sizes=1).fit(X, y)  # type: ignore[arg-type]
    assert both.weight_ > 0.5
    fresh, truth = columns(400, 0.8, 2.5, 1)
    alone = model(name, 1, 60, 0).fit(X[:, :1], y)  # type: ignore[arg-type]
    score = alone.decision_function if name == "logistic" else alone.predict
    gained = [area_under_roc(s[truth > 0], s[truth < 1]) for s in (both.predict(fresh), score(fresh[:, :1]))]
    assert gained[0] > gained[1] + 0.1


def test_one_subject_of_a_class_leaves_size_alone() -> None:
    X, y = columns(9, 1.0, 3.0, 0)
    y[:] = [1, *[0] * 8]
    found = model("logistic", 9, 9, 0, sizes=1).fit(X, y)
    assert found.weight_ == 0
    assert found.predict_proba(X).sum(axis=1) == pytest.approx(1)


def test_a_subject_s_own_label_does_not_move_its_prediction() -> None:
    X, y = columns(18, 1.0, 1.5, 3)
    splits = splits_of(y > 0, 3, 1, np.random.default_rng(0))
    inputs = [[X] * 3]
    before = predictions("logistic", inputs, y, splits, 0, sizes=1)
    turned = y.copy()
    turned[5] = 1 - turned[5]
    after = predictions("logistic", inputs, turned, splits, 0, sizes=1)
    assert after[0, 5] == before[0, 5]
    assert not np.allclose(after, before)


def test_the_global_study_has_a_line_with_size_and_the_others_have_not() -> None:
    hearts, ill = subjects(24, 2.5, 0.0)
    found = heart_study(hearts, diseased=ill, methods={"bag": BagOfFeatures(5)}, **FAST)
    volume, both = (found.row("all", name, "logistic") for name in ("cavity volume", "bag and size"))
    assert both.auc >= volume.auc - 0.03
    assert both.auc > found.row("all", "bag", "logistic").auc + 0.15
    difference, low, high = found.above(
        "bag and size", "bag", model="logistic", baseline_model="logistic", measure="auc"
    )
    assert difference == pytest.approx(both.auc - found.row("all", "bag", "logistic").auc)
    assert 0 < low < difference < high
    percent = np.where(ill[:, None] > 0, 90.0, 10.0) + np.zeros(3)
    by_territory = heart_study(
        hearts, percent, methods={"bag": BagOfFeatures(5)}, **{**FAST, "scenario": "territory"}
    )
    assert not [row for row in by_territory.rows if "size" in row.method]
    with pytest.raises(InputError, match="percentages"):
        by_territory.above("bag", "roughness", model="ridge", baseline_model="linear", measure="auc")
    with pytest.raises(InputError, match="baseline"):
        heart_study(
            hearts, diseased=ill, methods={"bag": BagOfFeatures(5), "bag and size": BagOfFeatures(5)}, **FAST
        )


def test_a_heart_that_rounds_at_the_same_volume_is_told_by_its_sphericity() -> None:
    hearts, ill = subjects(24, 0.0, 0.0)
    rng = np.random.default_rng(5)
    axes = 90 * np.exp(0.05 * rng.normal(size=24) - 0.2 * ill)
    rounded = [replace(heart, axis_mm=axis) for heart, axis in zip(hearts, axes, strict=True)]
    found = heart_study(rounded, diseased=ill, methods={"bag": BagOfFeatures(5)}, **FAST)
    size, volume = (found.row("all", name, "logistic") for name in ("volume and sphericity", "cavity volume"))
    assert size.auc > volume.auc + 0.2
    assert found.row("all", "bag and size", "logistic").auc == pytest.approx(size.auc, abs=0.1)
    # Without an axis of every heart there is volume only.
    partly = heart_study([hearts[0], *rounded[1:]], diseased=ill, methods={"bag": BagOfFeatures(5)}, **FAST)
    assert "volume and sphericity" not in {row.method for row in partly.rows}


def test_an_open_surface_has_no_size_to_add() -> None:
    hearts, ill = subjects(12, 1.0, 1.0)
    hearts[4] = SegmentFeatures(hearts[4].values, SEGMENTS, SEGMENTS, np.ones(18), np.ones(18), float("nan"))
    found = heart_study(hearts, diseased=ill, methods={"bag": BagOfFeatures(5)}, **FAST)
    assert {row.method for row in found.rows} == {"bag", "roughness"}


def test_areas_and_their_draws_are_those_of_the_definition() -> None:
    rng = np.random.default_rng(0)
    ill = rng.random(30) > 0.4
    predicted = rng.normal(size=(3, 30)).round(1) + 0.5 * ill
    each = [area_under_roc(p[ill], p[~ill]) for p in predicted]
    assert area(predicted, ill) == pytest.approx(np.mean(each))
    draws = area_draws(predicted, ill, 4000, 0)
    assert draws.mean() == pytest.approx(np.mean(each), abs=0.01)
    assert area_draws(np.tile(ill.astype(float), (2, 1)), ill, 10, 0) == pytest.approx(1)


def test_differences_from_the_volume_are_in_the_benchmark() -> None:
    hearts, ill = subjects(20, 1.5, 1.0)
    rows = {row["method"]: row for row in compared(hearts, ill > 0, 1)}
    assert set(rows) == {"bag", "bag and size", "roughness", "cavity volume"}
    assert rows["cavity volume"]["above volume"] == rows["cavity volume"]["high"] == 0
    assert rows["bag"]["above volume"] == pytest.approx(
        rows["bag"]["auc"] - rows["cavity volume"]["auc"], abs=2e-3
    )


def test_sphericity_of_a_phantom_and_half_the_bins() -> None:
    phantom = heart_phantom(spacing=8.0, mesh_step=3.0, rng=1)
    frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    labels = aha_segments(phantom.mesh, frame)
    options = {"points": 30, "wavelengths": (30.0, 20.0), "rng": 0, "n_jobs": 1}
    fine = endocardial_features(phantom.mesh, labels, frame, bins=20, **options)
    assert fine.axis_mm == pytest.approx(
        np.linalg.norm(phantom.landmarks["base"] - phantom.landmarks["apex"])
    )
    assert fine.sphericity == pytest.approx(fine.cavity_ml * 6000 / (np.pi * fine.axis_mm**3))
    assert 0.2 < fine.sphericity < 0.8
    coarse = endocardial_features(phantom.mesh, labels, frame, bins=10, **options)
    assert _halved(fine).values == pytest.approx(coarse.values, nan_ok=True)
    assert _halved(fine).blocks == coarse.blocks
