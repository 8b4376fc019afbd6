"""Relevance, false area, repeatability, transform error, ROC area and intervals against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pliant.errors import InputError
from pliant.evaluate.relevance import (
    area_under_roc,
    box_overlaps,
    mean_interval,
    relevance_scores,
    transform_error,
)

corner = st.integers(0, 20)


@st.composite
def boxes(draw, least=0):
    x, y = draw(corner), draw(corner)
    return [x, y, x + draw(st.integers(least, 15)), y + draw(st.integers(least, 15))]


def painted(box):
    grid = np.zeros((40, 40), dtype=bool)
    grid[box[1] : box[3], box[0] : box[2]] = True
    return grid


@given(boxes(), boxes(), boxes(1), boxes(1))
def test_scores_are_those_of_painted_pixels(found1, found2, true1, true2):
    scores = relevance_scores([found1], [found2], [true1], [true2])
    found = np.stack([painted(found1), painted(found2)])
    true = np.stack([painted(true1), painted(true2)])
    hit, union = (found & true).sum(), (found | true).sum()
    assert scores.relevance[0] == pytest.approx(hit / union)
    assert scores.false_share[0] == pytest.approx((found & ~true).sum() / union)
    assert scores.repeatability[0] == pytest.approx(hit / found.sum() if found.any() else 0)
    one = (found[0] & true[0]).sum() / (found[0] | true[0]).sum()
    assert scores.overlap1[0] == pytest.approx(one)


@given(boxes(1), boxes(1))
def test_overlap_between_runs_is_symmetric_and_1_for_equal_boxes(one, two):
    overlaps = box_overlaps([one, two, one])
    assert overlaps[1] == 1.0
    assert overlaps[0] == overlaps[2]


def test_empty_found_box_scores_nothing():
    scores = relevance_scores([[0, 0, 0, 0]], [[0, 0, 0, 0]], [[0, 0, 5, 5]], [[0, 0, 5, 5]])
    assert scores.relevance[0] == scores.false_share[0] == scores.repeatability[0] == 0


def test_means_by_group():
    true = [[0, 0, 10, 10]] * 3
    found = [[0, 0, 10, 10], [0, 0, 5, 10], [0, 0, 10, 5]]
    means = relevance_scores(found, found, true, true).means(["b", "a", "a"])
    assert list(means) == ["a", "b"]
    assert means["a"] == {"mrs": 0.5, "fpr": 0.0, "pairs": 2}


@pytest.mark.parametrize(
    ("found", "true", "words"),
    [
        ([[5, 0, 0, 5]], [[0, 0, 1, 1]], "1 of 1 boxes"),
        ([[0, 0, 1, 1]], [[0, 0, 0, 1]], "empty"),
        ([[0, 0, 1, np.nan]], [[0, 0, 1, 1]], "1 of 1 boxes"),
        ([[0, 0, 1, 1]] * 2, [[0, 0, 1, 1]], "one box a pair"),
        ([0, 0, 1, 1], [[0, 0, 1, 1]], "shape"),
    ],
)
def test_bad_boxes_are_named(found, true, words):
    with pytest.raises(InputError, match=words):
        relevance_scores(found, true, true, true)


def test_transform_error_of_a_scaling_is_the_mean_distance():
    error = transform_error(np.diag([1.1, 1.0, 1.0]), np.eye(3), [0, 0, 80, 60], [80, 60])
    inside = np.linspace(0, 80, 9)[:-1]  # the last column is on the far edge, outside
    assert error == pytest.approx(0.1 * inside.mean() / 100)
    assert transform_error(None, np.eye(3), [0, 0, 1, 1], [5, 5]) == np.inf
    away = np.array([[1.0, 0, 500], [0, 1, 0], [0, 0, 1]])
    assert np.isnan(transform_error(away, away, [0, 0, 1, 1], [5, 5]))


def test_area_under_roc_is_half_for_equal_scores_and_1_for_separated():
    assert area_under_roc([1, 2, 3], [1, 2, 3]) == 0.5
    assert area_under_roc([4, 5], [1, 2]) == 1.0
    with pytest.raises(InputError, match="both kinds"):
        area_under_roc([], [1])


def test_interval_draws_groups_and_not_pairs():
    rng = np.random.default_rng(0)
    values = np.repeat(rng.normal(size=10), 20)
    low, high = mean_interval(values, [str(i // 20) for i in range(200)])
    narrow_low, narrow_high = mean_interval(values, [str(i) for i in range(200)])
    assert (high - low) > 3 * (narrow_high - narrow_low)
    assert low < values.mean() < high
    with pytest.raises(InputError, match="two groups"):
        mean_interval([1.0, 2.0], ["a", "a"])


def test_interval_covers_the_true_mean_about_as_often_as_it_says():
    rng = np.random.default_rng(1)
    hits = 0
    for trial in range(200):
        values = rng.normal(size=30)
        low, high = mean_interval(values, [str(i) for i in range(30)], draws=500, rng=trial)
        hits += low <= 0 <= high
    assert 0.88 <= hits / 200 <= 0.99
