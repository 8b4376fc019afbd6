"""Searching an index: against plain counting of bits, with ties, labels, removals, and through its folder."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pliant.errors import InputError
from pliant.retrieval.index import Neighbours, ShapeIndex

pytest.importorskip("faiss")


def random_codes(rng, count: int, bits: int, distinct: int | None = None):
    codes = rng.integers(0, 256, (distinct or count, bits // 8), dtype=np.uint8)
    return codes if distinct is None else codes[rng.integers(0, distinct, count)]


def expected(queries, codes, ids, count: int) -> Neighbours:
    """By distance, then by id, with nothing but NumPy."""
    apart = np.unpackbits(queries[:, None] ^ codes[None], axis=2).sum(axis=2).astype(np.int64)
    order = np.stack([np.lexsort((ids, row)) for row in apart])[:, :count]
    return Neighbours(np.take_along_axis(apart, order, axis=1), np.asarray(ids)[order])


def same(found: Neighbours, wanted: Neighbours) -> bool:
    return np.array_equal(found.ids, wanted.ids) and np.array_equal(found.distances, wanted.distances)


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 300),
    distinct=st.integers(1, 12),
    bits=st.sampled_from([8, 24, 32, 64, 128, 136, 512]),
    wanted=st.integers(1, 60),
)
def test_search_is_exact_and_ties_go_to_the_lower_id(seed, count, distinct, bits, wanted):
    rng = np.random.default_rng(seed)
    codes = random_codes(rng, count, bits, distinct)
    index = ShapeIndex(bits)
    ids = index.add(codes)
    queries = np.concatenate([codes[:3], random_codes(rng, 3, bits)])
    assert same(index.search(queries, wanted), expected(queries, codes, ids, wanted))


@given(seed=st.integers(0, 2**32 - 1), steps=st.lists(st.integers(0, 3), min_size=1, max_size=12))
def test_adding_and_removing_in_any_order_leaves_what_it_should(seed, steps):
    rng = np.random.default_rng(seed)
    index, kept = ShapeIndex(32), {}
    for step in steps:
        if step or not kept:
            codes = random_codes(rng, step + 1, 32, 2)
            kept |= dict(zip(index.add(codes).tolist(), codes, strict=True))
        else:
            gone = rng.permutation(list(kept))[: len(kept) // 2 + 1]
            index.remove(gone)
            for item in gone.tolist():
                del kept[item]
    assert len(index) == len(kept)
    if kept:
        queries = random_codes(rng, 4, 32)
        codes, ids = np.stack(list(kept.values())), np.array(list(kept))
        assert same(index.search(queries, 50), expected(queries, codes, ids, 50))


def test_an_id_is_never_given_twice(tmp_path):
    rng = np.random.default_rng(0)
    index = ShapeIndex(16)
    index.remove(index.add(random_codes(rng, 5, 16)))
    index.save(tmp_path / "index")
    with ShapeIndex.load(tmp_path / "index") as again:
        assert again.add(random_codes(rng, 2, 16)).tolist() == [6, 7]


def test_search_within_a_label_is_the_search_of_its_items(tmp_path):
    rng = np.random.default_rng(1)
    codes = random_codes(rng, 200, 64, 40)
    labels = [("dog", "cat", "")[i % 3] for i in range(200)]
    index = ShapeIndex(64)
    ids = index.add(codes, labels=labels)
    cats = np.array(labels) == "cat"
    queries = random_codes(rng, 5, 64)
    assert same(index.search(queries, 9, label="cat"), expected(queries, codes[cats], ids[cats], 9))
    assert index.labels() == {"": 66, "cat": 67, "dog": 67}
    index.save(tmp_path / "index")
    with ShapeIndex.load(tmp_path / "index") as again:
        assert same(again.search(queries, 9, label="cat"), expected(queries, codes[cats], ids[cats], 9))
        again.remove(ids[cats])
        assert again.search(queries, 3, label="cat").ids.shape == (5, 0)
        with pytest.raises(InputError, match="no item has the label 'emu'; there are 2: cat, dog"):
            again.search(queries, 3, label="emu")


def test_a_folder_gives_back_everything(tmp_path):
    rng = np.random.default_rng(2)
    codes = random_codes(rng, 50, 128)
    index = ShapeIndex(128)
    names = [f"picture {i}" for i in range(50)]
    ids = index.add(codes, names=names, labels=["a"] * 50, previews=[bytes([i]) for i in range(50)])
    assert index.save(tmp_path / "deep" / "index") == tmp_path / "deep" / "index"
    assert sorted(p.name for p in (tmp_path / "deep").iterdir()) == ["index"]
    with ShapeIndex.load(tmp_path / "deep" / "index") as again:
        assert [item.name for item in again.items(ids)] == names
        assert {item.label for item in again.items(ids)} == {"a"}
        assert again.preview(int(ids[7])) == b"\x07"
        assert again.preview(999) is None
        assert same(again.search(codes, 5), index.search(codes, 5))
        more = again.add(codes[:2] ^ 1, names=["x", "y"])
        assert again.preview(int(more[0])) is None
    with ShapeIndex.load(tmp_path / "deep" / "index") as third:
        assert len(third) == 52
        assert third.search(codes[:1] ^ 1, 1).ids.tolist() == [[51]]


def test_what_one_process_adds_or_removes_another_finds(tmp_path):
    rng = np.random.default_rng(3)
    codes = random_codes(rng, 6, 64)
    ShapeIndex(64).save(tmp_path / "index")
    with ShapeIndex.load(tmp_path / "index") as writer, ShapeIndex.load(tmp_path / "index") as reader:
        ids = writer.add(codes, labels=["new"] * 6)
        assert same(reader.search(codes, 6), expected(codes, codes, ids, 6))
        assert reader.items(ids)[0].label == "new"
        reader.remove(ids[:2])
        assert same(writer.search(codes, 6), expected(codes, codes[2:], ids[2:], 6))
        added = writer.add(codes[:1])
        assert added.tolist() == [7]
        assert len(reader) == 4  # Until it looks.
        reader.refresh()
        assert len(reader) == 5


def test_inverted_lists_find_nearly_all_of_clustered_codes_and_survive_the_folder(tmp_path):
    """Two hundred clusters; flipping 5 of 128 bits stays far nearer than another cluster is."""
    rng = np.random.default_rng(4)
    centres = random_codes(rng, 200, 128)
    codes = np.repeat(centres, 30, axis=0)
    flips = np.zeros((len(codes), 128), dtype=np.uint8)
    np.put_along_axis(flips, rng.integers(0, 128, (len(codes), 5)), 1, axis=1)
    codes ^= np.packbits(flips, axis=1)
    index = ShapeIndex(128, flat_up_to=1000)
    ids = index.add(codes[:900])
    assert index.exact
    ids = np.concatenate([ids, index.add(codes[900:])])
    assert not index.exact
    exact = expected(centres, codes, ids, 10)

    def recall(found: Neighbours) -> float:
        return float(np.mean([np.isin(a, b).mean() for a, b in zip(exact.ids, found.ids, strict=True)]))

    assert recall(index.search(centres, 10)) > 0.95
    assert (np.diff(index.search(centres, 10).distances, axis=1) >= 0).all()
    index.remove(exact.ids[0])
    assert not np.isin(index.search(centres[:1], 20).ids, exact.ids[0]).any()
    index.save(tmp_path / "index")
    with ShapeIndex.load(tmp_path / "index") as again:
        assert not again.exact
        assert same(again.search(centres, 10), index.search(centres, 10))
        new = again.add(centres[:1])
        assert again.search(centres[:1], 1).ids.tolist() == [new.tolist()]
    assert recall(index.search(centres, 10, label="")) > 0.99  # Within a label every code is compared.


def test_lists_that_hold_too_few_say_so():
    index = ShapeIndex(32, kind="ivf")
    index.add(random_codes(np.random.default_rng(5), 400, 32))
    found = index.search(np.zeros((1, 4), np.uint8), 400)
    short = found.ids[0] == -1
    assert short.any()
    assert (found.distances[0][short] == 33).all()
    assert not short[:10].any()


@pytest.mark.parametrize(
    ("codes", "message"),
    [
        (np.zeros((2, 8), np.int64), "uint8"),
        (np.zeros((2, 3), np.uint8), "24 bits and the index has 64"),
        (np.zeros(8, np.uint8), "an \\(m, bits / 8\\) array"),
        (np.zeros((2, 0), np.uint8), "packed"),
    ],
)
def test_codes_of_another_kind_are_refused(codes, message):
    index = ShapeIndex(64)
    with pytest.raises(InputError, match=message):
        index.add(codes)
    with pytest.raises(InputError, match=message):
        index.search(codes)


def test_arguments_that_do_not_fit_are_refused_and_change_nothing():
    index, codes = ShapeIndex(8), np.zeros((2, 1), np.uint8)
    for wrong, message in [
        ({"names": ["one"]}, "names must be one text a code, 2 in all: got 1"),
        ({"labels": ["a", 5]}, "1 are not printable text, \\[1\\]"),
        ({"names": ["a", "b\x00"]}, "not printable"),
        ({"previews": [b""]}, "got 1 for 2"),
    ]:
        with pytest.raises(InputError, match=message):
            index.add(codes, **wrong)
    assert len(index) == 0
    with pytest.raises(InputError, match="the index is empty"):
        index.search(codes)
    ids = index.add(codes)
    with pytest.raises(InputError, match="2 of 3 ids are not in the index: \\[3, 9\\]"):
        index.remove([9, 3, 1])
    assert len(index) == 2
    with pytest.raises(InputError, match="not in the index"):
        index.items([*ids, 4])
    with pytest.raises(InputError, match="count must be 1 or more"):
        index.search(codes, 0)


@pytest.mark.parametrize("wrong", [{"bits": 0}, {"bits": 12}, {"bits": None}, {"bits": 8, "kind": "tree"}])
def test_an_index_of_no_sense_is_refused(wrong):
    with pytest.raises(InputError, match=r"bits|kind"):
        ShapeIndex(**wrong)


def test_an_index_without_a_model_says_so(tmp_path):
    ShapeIndex(8).save(tmp_path / "index")
    with ShapeIndex.load(tmp_path / "index") as index, pytest.raises(InputError, match="no model"):
        _ = index.model
    with pytest.raises(InputError, match="exists already"):
        ShapeIndex(8).save(tmp_path / "index")
    with pytest.raises(InputError, match="name a folder"):
        ShapeIndex(8).save()


def test_threads_that_add_search_and_remove_at_once_see_a_whole_index(tmp_path):
    """Every answer holds only items that were added, each with its own distance."""
    ShapeIndex(64).save(tmp_path / "index")
    rng = np.random.default_rng(6)
    codes = random_codes(rng, 400, 64)
    wrong: list[str] = []
    with ShapeIndex.load(tmp_path / "index") as index:
        index.add(codes[:40])
        done = threading.Event()

        def look() -> None:
            while not done.is_set():
                found = index.search(codes[:3], 30)
                apart = np.bitwise_xor(codes[:3, None], codes[found.ids - 1])
                if not np.array_equal(np.unpackbits(apart, axis=2).sum(axis=2), found.distances):
                    wrong.append("a distance is not that of its id")

        watchers = [threading.Thread(target=look) for _ in range(3)]
        for watcher in watchers:
            watcher.start()
        for first in range(40, 400, 20):
            index.add(codes[first : first + 20])
        index.remove(np.arange(1, 21))
        done.set()
        for watcher in watchers:
            watcher.join()
        assert len(index) == 380
    assert wrong == []
