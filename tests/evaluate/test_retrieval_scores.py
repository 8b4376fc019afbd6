"""The protocol of retrieval: votes, ties, intervals."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pliant.errors import InputError
from pliant.evaluate.retrieval import crossed_interval, retrieval_scores


def counted(distances: np.ndarray, own: str, labels: list[str], k: int) -> float:
    """Without ties: sort, count, compare."""
    order = np.argsort(distances)[:k]
    votes = {c: sum(labels[i] == c for i in order) for c in labels}
    sums = {c: sum(distances[i] for i in order if labels[i] == c) for c in votes}
    most = max(votes.values())
    tied = [c for c in votes if votes[c] == most]
    return float(own == min(tied, key=lambda c: sums[c]))


@given(st.integers(0, 10_000))
def test_without_ties_the_label_is_the_mode_of_the_nearest(seed: int) -> None:
    rng = np.random.default_rng(seed)
    labels = [str(c) for c in rng.integers(0, 4, 15)]
    queries = [str(c) for c in rng.integers(0, 4, 5)]
    distances = rng.random((5, 15))
    scores = retrieval_scores(distances, queries, labels, neighbours=(1, 4, 9, 40))
    for i, own in enumerate(queries):
        assert scores.label[i].tolist() == [counted(distances[i], own, labels, k) for k in (1, 4, 9, 15)]
        order = np.argsort(distances[i])
        right = np.array([labels[j] == own for j in order])
        assert scores.share[i, 1] == pytest.approx(right[:4].mean())
        ranks = np.flatnonzero(right)
        precision = [(n + 1) / (rank + 1) for n, rank in enumerate(ranks)]
        assert scores.average[i] == pytest.approx(np.mean(precision) if len(ranks) else 0)


@given(st.integers(0, 10_000))
def test_with_ties_the_order_of_the_database_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, 3, 12)
    distances = rng.integers(0, 4, (6, 12))
    queries = rng.integers(0, 3, 6)
    one = retrieval_scores(distances, queries, labels, neighbours=(1, 2, 5, 12))
    order = rng.permutation(12)
    two = retrieval_scores(distances[:, order], queries, labels[order], neighbours=(1, 2, 5, 12))
    assert np.allclose(one.label, two.label)
    assert np.allclose(one.share, two.share)
    assert np.allclose(one.average, two.average)


def test_equally_far_items_share_the_places_that_are_left() -> None:
    # One place, three at the same distance: two thirds of it for a.
    scores = retrieval_scores([[5, 5, 5]], ["a"], ["a", "a", "b"], neighbours=[1, 2])
    assert scores.share.tolist() == [[pytest.approx(2 / 3), pytest.approx(2 / 3)]]
    assert scores.label.tolist() == [[1.0, 1.0]]
    expected = np.mean(
        [[order[0] < 2, (np.array(order[:2]) < 2).mean()] for order in permutations(range(3))], axis=0
    )
    assert np.allclose(scores.share, expected)


def test_classes_that_tie_in_votes_and_distance_share_the_label() -> None:
    labels = ["a", "b", "c"]
    assert retrieval_scores([[1, 1, 1]], ["b"], labels, neighbours=[3]).label[0, 0] == pytest.approx(1 / 3)
    # Equal votes, but b is nearer.
    assert retrieval_scores([[2, 1, 9]], ["b"], labels, neighbours=[2]).label[0, 0] == 1
    assert retrieval_scores([[2, 1, 9]], ["a"], labels, neighbours=[2]).label[0, 0] == 0


def test_precision_weighs_classes_alike_and_an_unknown_class_is_wrong() -> None:
    scores = retrieval_scores(
        [[0, 1], [0, 1], [0, 1], [1, 0]], ["a", "a", "z", "b"], ["a", "b"], neighbours=[1]
    )
    assert scores.by_class() == {"a": 1.0, "b": 1.0, "z": 0.0}
    assert scores.precision == pytest.approx(2 / 3)


def test_codes_that_say_nothing_score_by_chance() -> None:
    labels = np.repeat(np.arange(5), 20)
    scores = retrieval_scores(np.zeros((5, 100)), np.arange(5), labels)
    assert np.allclose(scores.label, 0.2)
    assert np.allclose(scores.average, 0.2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[1, 2]], ["a"], ["a"]), "a label for each"),
        ((np.zeros((0, 2)), [], ["a", "b"]), "one query or more"),
        (([[np.inf]], ["a"], ["a"]), "must be finite"),
    ],
)
def test_bad_tables_are_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(InputError, match=message):
        retrieval_scores(*arguments)
    with pytest.raises(InputError, match="1 or more"):
        retrieval_scores([[1]], ["a"], ["a"], neighbours=[0])


def test_crossed_intervals_cover_the_truth_about_as_often_as_they_say() -> None:
    rng = np.random.default_rng(0)
    covered = []
    for i in range(120):
        table = (
            0.5
            + 0.05 * rng.normal(size=(5, 1))
            + 0.1 * rng.normal(size=(1, 20))
            + 0.05 * rng.normal(size=(5, 20))
        )
        low, high = crossed_interval(table, draws=1000, rng=i)
        covered.append(low <= 0.5 <= high)
    assert 0.85 <= np.mean(covered) <= 1.0


def test_a_constant_has_no_width_and_bad_tables_no_interval() -> None:
    assert crossed_interval(np.full((3, 4), 0.3)) == (pytest.approx(0.3), pytest.approx(0.3))
    for bad in (np.ones(3), np.ones((3, 1)), np.array([[1.0, np.nan]])):
        with pytest.raises(InputError, match="two classes or more"):
            crossed_interval(bad)
