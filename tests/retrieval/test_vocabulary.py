"""Descriptors of a picture, words, and histograms of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.base import clone

from pliant.errors import InputError, PliantWarning
from pliant.images import load_picture
from pliant.retrieval import Vocabulary, describe_picture
from pliant.retrieval.vocabulary import _sampled


def tables(count: int = 6, rows: int = 50, width: int = 5) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [rng.random((rows + i, width)) for i in range(count)]


def test_a_smaller_draw_of_points_is_the_head_of_a_larger_one() -> None:
    picture = np.random.default_rng(0).random((90, 120))
    many, few = describe_picture(picture, points=60), describe_picture(picture, points=20)
    assert np.array_equal(many.descriptors[:20], few.descriptors)
    assert np.array_equal(many.positions[:20], few.positions)
    assert many.descriptors.dtype == np.float32
    assert (many.positions >= -0.5).all()
    assert (many.positions < [119.5, 89.5]).all()
    again = describe_picture(picture, points=20, rng=1)
    assert not np.array_equal(again.positions, few.positions)


@pytest.mark.parametrize(
    ("picture", "message"),
    [(np.zeros((10, 40)), "10 pixels|40 x 10"), (np.full((60, 60), 0.5), "one colour")],
)
def test_pictures_without_shape_are_refused_with_the_reason(picture: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        describe_picture(picture)


def test_points_must_be_some() -> None:
    with pytest.raises(InputError, match="8 or more"):
        describe_picture(np.random.default_rng(0).random((60, 60)), points=3)


@pytest.mark.data
def test_a_photograph_is_described_in_its_own_pixels(data: Path) -> None:
    path = next((data / "images" / "caltech101" / "lamp").glob("*.jpg"))
    picture = load_picture(path)
    found = describe_picture(path)
    assert found.descriptors.shape[1] == 204
    assert len(found.descriptors) > 200
    assert (found.positions.max(axis=0) < picture.size).all()
    assert np.allclose((found.descriptors**2).sum(axis=1), 1, atol=1e-5)


def test_histograms_do_not_depend_on_the_order_of_points() -> None:
    given = tables()
    words = Vocabulary(n_words=8).fit(given)
    rows = words.transform(given)
    assert rows.shape == (6, 8)
    assert np.allclose((rows**2).sum(axis=1), 1)
    assert np.array_equal(rows, words.transform([t[::-1] for t in given]))
    assert np.array_equal(rows, clone(words).fit(given).transform(iter(given)))
    counts = np.bincount(words.nearest_words(given[2]), minlength=8)
    assert np.allclose(rows[2] ** 2 * counts.sum(), counts)


def test_nearest_words_are_nearest() -> None:
    given = tables()
    words = Vocabulary(n_words=12).fit(given)
    apart = np.linalg.norm(given[1][:, None] - words.words_, axis=2)
    assert np.array_equal(words.nearest_words(given[1]), apart.argmin(axis=1))


def test_a_picture_without_descriptors_is_the_row_of_zeros() -> None:
    words = Vocabulary(n_words=4).fit(tables())
    assert not words.transform([np.zeros((0, 5))]).any()
    assert words.transform([]).shape == (0, 4)


def test_words_come_from_consistent_descriptors_and_weigh_what_they_are_found_again() -> None:
    rng = np.random.default_rng(0)
    centres = np.eye(4) * 10
    given, flags = [], []
    for _ in range(20):
        kind = rng.integers(0, 4, 100)
        given.append(centres[kind] + 0.01 * rng.random((100, 4)))
        # Kind 0 is never found again, the others more and more often.
        flags.append(rng.random(100) < np.array([0, 0.2, 0.4, 0.8])[kind])
    words = Vocabulary(n_words=3).fit(given, consistent=flags)
    kinds = words.words_.argmax(axis=1)
    assert sorted(kinds) == [1, 2, 3]
    met = np.bincount(np.concatenate([words.nearest_words(t) for t in given]), minlength=3)
    assert np.isclose((words.weights_ * met).sum(), met.sum())
    one, two, three = words.weights_[np.argsort(kinds)]
    assert three / two == pytest.approx(2, rel=0.1)
    assert two > one
    plain = Vocabulary(n_words=3, consistency=0).fit(given, consistent=flags)
    assert np.array_equal(plain.weights_, np.ones(3))
    squared = Vocabulary(n_words=3, consistency=2).fit(given, consistent=flags)
    ratio = squared.weights_ / squared.weights_[0]
    assert np.allclose(ratio, (words.weights_ / words.weights_[0]) ** 2)


def test_descriptors_of_a_sequence_are_read_one_picture_at_a_time() -> None:
    class Lazy(Sequence):
        def __init__(self) -> None:
            self.reads = 0

        def __len__(self) -> int:
            return 6

        def __getitem__(self, place: int) -> np.ndarray:
            if place >= 6:
                raise IndexError
            self.reads += 1
            return tables()[place]

    lazy = Lazy()
    words = Vocabulary(n_words=5).fit(lazy)
    assert lazy.reads == 6
    assert np.array_equal(words.words_, Vocabulary(n_words=5).fit(tables()).words_)


@given(st.integers(0, 1000), st.integers(1, 60))
def test_a_sample_is_part_of_what_was_given_and_no_larger_than_asked(seed: int, most: int) -> None:
    rng = np.random.default_rng(seed)
    parts = [
        np.arange(1000 * i, 1000 * i + n, dtype=np.float32)[:, None]
        for i, n in enumerate(rng.integers(0, 40, 7))
    ]
    flags = [rng.random(len(p)) < 0.7 for p in parts]
    kept = np.concatenate([p[f] for p, f in zip(parts, flags, strict=True)])[:, 0]
    drawn = _sampled(zip(parts, flags, strict=True), most, rng)[:, 0]
    assert len(drawn) == min(most, len(kept))
    assert len(set(drawn.tolist())) == len(drawn)
    assert set(drawn.tolist()) <= set(kept.tolist())


def test_every_descriptor_is_as_likely_to_be_sampled() -> None:
    parts = [np.zeros((300, 1), np.float32), np.ones((100, 1), np.float32)]
    drawn = [
        _sampled([(p, np.ones(len(p), bool)) for p in parts], 40, np.random.default_rng(i)).mean()
        for i in range(200)
    ]
    # Standard deviation of the mean: sqrt(.25 * .75 / 8000) = .005.
    assert abs(np.mean(drawn) - 0.25) < 0.02


def test_fewer_descriptors_than_words_make_fewer_words() -> None:
    with pytest.warns(PliantWarning, match="3 different descriptors make 3 words, not 10"):
        words = Vocabulary(n_words=10).fit([np.eye(3)])
    assert words.transform([np.eye(3)]).shape == (1, 3)


@pytest.mark.parametrize(
    ("given", "consistent", "message"),
    [
        ([], None, "no descriptor"),
        ([np.zeros((3, 2)), np.zeros((3, 4))], None, "picture 1 must have shape"),
        ([np.full((3, 2), np.nan)], None, "3 descriptors are not finite"),
        ([["a"]], None, "not numbers"),
        ([np.zeros((3, 2))], [], "one entry a picture"),
        ([np.zeros((3, 2))], [[True]], "one flag a descriptor"),
        ([np.zeros((3, 2))], [[False] * 3], "no descriptor"),
    ],
)
def test_what_words_cannot_be_learned_from(given: list, consistent: list | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Vocabulary(n_words=2).fit(given, consistent=consistent)


def test_words_are_learned_before_they_are_used() -> None:
    with pytest.raises(InputError, match="not fitted"):
        Vocabulary().transform(tables())
    with pytest.raises(InputError, match="must be 1 or more"):
        Vocabulary(n_words=0).fit(tables())
