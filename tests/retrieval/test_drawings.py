"""Outline drawings, and features that a pair of pictures shares."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw

from pliant.images import as_picture
from pliant.retrieval import (
    DiscriminativeBinaryCodes,
    IterativeQuantization,
    Vocabulary,
    hamming_distances,
    outline_drawing,
    train_retrieval,
)
from pliant.retrieval._features import _apart, _found_again, shared_tables
from pliant.retrieval.training import Examples

Y, X = np.mgrid[0:150, 0:200]


def ink(picture: np.ndarray) -> np.ndarray:
    """Where a drawing has ink, at the size of the picture."""
    grey = outline_drawing(picture).grey
    return np.asarray(Image.fromarray((255 * grey).astype(np.uint8)).resize((200, 150))) < 128


def test_the_contour_of_a_disc_is_drawn_and_nothing_else() -> None:
    away = np.abs(np.hypot(X - 100, Y - 75) - 50)
    disc = np.where(np.hypot(X - 100, Y - 75) < 50, 0.3, 0.6)
    lines = ink(disc)
    assert (away[lines] < 4).all()
    near = lines[away < 1]
    assert near.mean() > 0.85
    # Which side is lighter, and by how much, does not matter to a contour.
    assert np.mean(ink(1 - 0.5 * disc) ^ lines) < 0.002


def test_fine_texture_is_not_drawn() -> None:
    disc = np.where(np.hypot(X - 100, Y - 75) < 50, 0.3, 0.6)
    rough = disc + np.random.default_rng(0).normal(0, 0.08, disc.shape)
    away = np.abs(np.hypot(X - 100, Y - 75) - 50)
    lines = ink(np.clip(rough, 0, 1))
    assert lines[away < 1].mean() > 0.8
    assert lines[away > 6].mean() < 0.02


def test_nothing_is_drawn_of_one_colour_nor_along_the_border_of_fill() -> None:
    assert outline_drawing(np.full((60, 80), 0.4)).grey.min() == 1
    mask = np.zeros((150, 200), dtype=bool)
    mask[20:130, 30:170] = True
    framed = as_picture(np.where(mask, 0.5, 0.0), mask=mask)
    drawing = outline_drawing(framed)
    assert drawing.grey.min() == 1
    assert drawing.mask.mean() == pytest.approx(mask.mean(), abs=0.03)


def test_a_drawing_keeps_proportions_and_is_the_same_each_time() -> None:
    scene = np.where(X > 90, 0.2, 0.8)
    drawing = outline_drawing(scene)
    assert drawing.size[0] / drawing.size[1] == pytest.approx(200 / 150, abs=0.01)
    assert drawing.size[0] * drawing.size[1] == pytest.approx(224**2, rel=0.02)
    assert np.array_equal(outline_drawing(scene).grey, drawing.grey)


def test_a_point_is_found_again_where_it_looks_alike_near_where_it_is_taken() -> None:
    one = np.array([[10.0, 10], [50, 10], [90, 90], [120, 20]])
    two = np.array([[12.0, 10], [11, 13], [50, 12], [10, 90], [121, 21]])
    looks1 = np.array([[0.0, 1], [1, 0], [1, 1], [0.5, 0]], dtype=np.float32)
    looks2 = np.array([[0.5, 1], [0, 1], [1, 0.5], [1, 1], [0.5, 0]], dtype=np.float32)
    second = as_picture(np.zeros((170, 170)) + (np.arange(170) % 2), mask=np.ones((170, 170), dtype=bool))
    apart = _apart(np.eye(3), (one, two), second)
    assert apart[0, 0] == pytest.approx(2)
    allowed = np.ones((4, 5), dtype=bool)
    allowed[3] = False  # outside what the two share
    places, distances = _found_again(apart, allowed, (looks1, looks2))
    # The nearest place of the first is not the likest; the third looks like one that is far away.
    assert places.tolist() == [[0, 1], [1, 2]]
    assert distances == pytest.approx([0, 0.25])
    shifted = np.array([[1.0, 0, -80], [0, 1, 0], [0, 0, 1]])
    moved, _ = _found_again(
        _apart(shifted, (one, two), second), np.ones((4, 5), dtype=bool), (looks1, looks2)
    )
    assert moved.tolist() == [[2, 3]]
    none, _ = _found_again(_apart(None, (one, two), second), allowed, (looks1, looks2))
    assert none.shape == (0, 2)


def test_the_reach_of_a_place_grows_with_the_picture() -> None:
    points = np.array([[100.0, 100]]), np.array([[110.0, 100]])
    small, large = (
        as_picture(np.tile(np.arange(n) % 2, (n, 1)) * 1.0, mask=np.ones((n, n))) for n in (170, 340)
    )
    assert _apart(np.eye(3), points, small)[0, 0] == pytest.approx(10)
    assert _apart(np.eye(3), points, large)[0, 0] == pytest.approx(5)


TABLES = {"a": [[0.0], [1.0], [2.0]], "b": [[0.2], [1.4], [9.0]], "c": [[4.0]], "d": [[8.0]]}
FOUND = {
    ("a", "b"): ([[0, 0], [1, 1], [2, 2]], [0.04, 0.16, 49.0]),
    ("c", "d"): ([[0, 0]], [16.0]),
}


class Kept:
    """Two pairs of pictures, one number a descriptor."""

    def descriptors(self, digest: str) -> np.ndarray:
        return np.array(TABLES[digest], dtype=np.float32)

    def found_again(self, one: str, two: str) -> tuple[np.ndarray, np.ndarray]:
        places, distances = FOUND[one, two]
        return np.array(places), np.array(distances)


def test_words_are_learned_from_the_means_of_the_likest_of_all_pairs() -> None:
    first, second = shared_tables(Kept(), [("a", "b"), ("c", "d")], 0.6)
    assert first.ravel() == pytest.approx([0.1, 1.2])
    assert second.shape == (0, 1)
    assert [len(t) for t in shared_tables(Kept(), [("a", "b"), ("c", "d")], 1.0)] == [3, 1]
    assert list(shared_tables(Kept(), [], 0.6)) == []


def test_shared_descriptors_give_the_words_and_flags_the_weights() -> None:
    tables = [np.repeat([[0.0, 0], [1, 1]], 50, axis=0)] * 4
    flags = [np.arange(100) < 50] * 4
    words = Vocabulary(2, rng=0).fit(
        tables, consistent=flags, shared=iter([[[0.1, 0.0]] * 400, [[0.8, 1.0]] * 400])
    )
    assert words.words_[words.words_[:, 1].argsort()].ravel() == pytest.approx([0.1, 0, 0.8, 1], abs=0.02)
    consistent, not_so = words.nearest_words([[0, 0], [1, 1]])
    assert words.weights_[consistent] > 3 * words.weights_[not_so]


def test_only_codes_that_learn_from_labels_learn_from_drawings() -> None:
    rng = np.random.default_rng(0)
    labels = np.repeat(["a", "b"], 10)
    rows = rng.random((20, 6)) + (labels == "b")[:, None]
    examples = Examples(rows, labels, rows + 5, labels)
    alone = Examples(rows, labels, rows[:0], labels[:0])

    def planes(kind: type, taught: Examples) -> np.ndarray:
        coder = kind(8)
        taught.teach(coder)
        return coder.offsets_

    assert np.array_equal(planes(IterativeQuantization, examples), planes(IterativeQuantization, alone))
    assert not np.array_equal(
        planes(DiscriminativeBinaryCodes, examples), planes(DiscriminativeBinaryCodes, alone)
    )


def shape(kind: str, seed: int, *, line: bool = False) -> Image.Image:
    """A dark shape on ground with a lattice of its own class, which no drawing shows; or its outline."""
    rng = np.random.default_rng([seed, len(kind)])
    image = Image.new("L", (110, 90), 250 if line else 190)
    pen = ImageDraw.Draw(image)
    step = {"disc": 6, "box": 9, "wedges": 13}[kind]
    for x in range(0 if line else -90, 0 if line else 110, step):
        pen.line((x, 0, x + (90 if kind == "box" else 0), 90), fill=150, width=1)
    x, y, r = *rng.uniform([50, 40], [60, 50]), rng.uniform(22, 26)
    options = {"outline": 0, "width": 3} if line else {"fill": int(rng.integers(20, 80))}
    if kind == "disc":
        pen.ellipse((x - r, y - r, x + r, y + r), **options)
    else:
        turned = (-1, 1), (1, -1)
        corners = (
            [(-1, -1), turned[1], (1, 1), turned[0]] if kind == "box" else [(-1, -1), (1, 1), *turned[::-1]]
        )
        pen.polygon([(x + r * u, y + r * v) for u, v in corners], **options)
    return image


def test_drawings_find_pictures_by_what_was_learned_from_drawings(tmp_path: Path) -> None:
    kinds = ("disc", "box", "wedges")
    for kind in kinds:
        (tmp_path / "all" / kind).mkdir(parents=True)
        for i in range(6):
            shape(kind, i).save(tmp_path / "all" / kind / f"{i}.png")
    sought = [np.asarray(shape(kind, 90 + i, line=True)) for kind in kinds for i in range(6)]
    archive = [path for kind in kinds for path in sorted((tmp_path / "all" / kind).iterdir())]
    labels = np.repeat(kinds, 6)
    apart = {}
    for drawings in (False, True):
        model = train_retrieval(
            tmp_path / "all", bits=32, n_words=60, points=80, pairs_per_class=0, drawings=drawings,
            cache=tmp_path / "cache", n_jobs=1,
        )  # fmt: skip
        assert model.settings["drawings"] == (18 if drawings else 0)
        distances = hamming_distances(model.encode(sought), model.encode(archive))
        own = labels[:, None] == labels
        apart[drawings] = distances[own].mean() / distances[~own].mean()
        if drawings:
            assert (labels[distances.argmin(axis=1)] == labels).mean() >= 0.8
    assert apart[True] < 0.8 * apart[False]
