"""From a folder of pictures to a model in a folder, and the study of kinds of codes."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageDraw
from typer.testing import CliRunner

import pliant.retrieval._features as features
from pliant.cli.app import app
from pliant.errors import FileFormatError, InputError, PliantWarning
from pliant.mesh import load_arrays, save_arrays
from pliant.retrieval import (
    LocalitySensitiveHashing,
    RetrievalModel,
    Vocabulary,
    evaluate_retrieval,
    hamming_distances,
    train_retrieval,
)
from pliant.retrieval._features import FeatureStore, read_collection
from pliant.retrieval.protocol import _Bench
from pliant.retrieval.training import Workers, chosen_pairs

KINDS = ("disc", "ladder", "star", "waves")


def drawn(kind: str, seed: int) -> Image.Image:
    """A shape at a random place and size, on clutter of random lines."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    image = Image.new("L", (96, 80), 140)
    pen = ImageDraw.Draw(image)
    for _ in range(6):
        pen.line(rng.uniform(0, 96, 4).tolist(), fill=int(rng.integers(90, 190)), width=1)
    x, y, r = rng.uniform(38, 58), rng.uniform(34, 46), rng.uniform(22, 28)
    dark = int(rng.integers(0, 60))
    if kind == "disc":
        for share in (1, 0.7, 0.4):
            pen.ellipse((x - share * r, y - share * r, x + share * r, y + share * r), outline=dark, width=3)
    elif kind == "ladder":
        for step in np.linspace(-1, 1, 6):
            pen.rectangle((x - r, y + step * r, x + r, y + step * r + 4), fill=dark)
    elif kind == "star":
        for angle in np.arange(0, np.pi, np.pi / 5):
            dx, dy = r * np.cos(angle), r * np.sin(angle)
            pen.line((x - dx, y - dy, x + dx, y + dy), fill=dark, width=3)
    else:
        for shift in (-0.6, 0, 0.6):
            t = np.linspace(-1, 1, 40)
            curve = np.column_stack([x + r * t, y + r * (shift + 0.2 * np.sin(7 * t))])
            pen.line([tuple(p) for p in curve], fill=dark, width=3)
    return image


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("pictures")
    for kind in KINDS:
        (root / kind).mkdir()
        for i in range(8):
            drawn(kind, i).save(root / kind / f"{i}.png")
    (root / "notes.txt").write_text("not a class")
    return root


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What one test has computed, the others need not."""
    return tmp_path_factory.mktemp("cache")


SMALL = {"n_words": 40, "points": 100, "pairs_per_class": 2, "n_jobs": 1}


@pytest.fixture(scope="module")
def model(pictures: Path, cache: Path) -> RetrievalModel:
    return train_retrieval(pictures, bits=32, train_per_class=6, cache=cache, **SMALL)


def test_a_model_tells_new_pictures_of_its_classes_apart(model: RetrievalModel, pictures: Path) -> None:
    archive = [path for kind in KINDS for path in sorted((pictures / kind).iterdir())]
    labels = np.repeat(np.arange(4), 8)
    new = [np.asarray(drawn(kind, 100 + i)) for kind in KINDS for i in range(4)]
    distances = hamming_distances(model.encode(new), model.encode(archive))
    found = labels[distances.argmin(axis=1)]
    assert (found == np.repeat(np.arange(4), 4)).mean() >= 0.75
    assert model.settings["classes"] == list(KINDS)
    assert model.settings["pictures"] == 24
    assert model.settings["left_out"] == {}
    assert model.encode([]).shape == (0, 4)


def test_selection_weighs_words_and_leaving_it_out_does_not(
    pictures: Path, cache: Path, model: RetrievalModel
) -> None:
    assert np.ptp(model.vocabulary.weights_) > 0
    plain = train_retrieval(pictures, bits=32, cache=cache, **(SMALL | {"pairs_per_class": 0}))
    assert np.ptp(plain.vocabulary.weights_) == 0


def test_training_goes_on_from_what_is_in_the_cache(
    pictures: Path, cache: Path, model: RetrievalModel, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def never(*args: object, **options: object) -> None:
        raise AssertionError

    monkeypatch.setattr(features, "match_pair", never)
    monkeypatch.setattr(features, "describe_picture", never)
    again = train_retrieval(pictures, bits=32, train_per_class=6, cache=cache, **SMALL)
    assert np.array_equal(again.vocabulary.words_, model.vocabulary.words_)
    assert np.array_equal(again.codes.weights_, model.codes.weights_)
    # Without the cache nothing can be had, and every picture says so.
    with pytest.raises(InputError, match="two classes with a usable picture are needed, got 0"):
        train_retrieval(pictures, cache=tmp_path, **SMALL)


def test_a_damaged_file_of_the_cache_is_made_anew(pictures: Path, tmp_path: Path) -> None:
    store = FeatureStore(tmp_path, 50, 0)
    collection = read_collection(pictures)
    item = (collection.paths[0], collection.digests[0])
    assert store.describe(item) == ""
    (kept,) = tmp_path.rglob("*.npz")
    whole = kept.read_bytes()
    kept.write_bytes(whole[: len(whole) // 2])
    assert store.describe(item) == ""
    assert kept.read_bytes() == whole


def test_the_number_of_processes_does_not_matter(pictures: Path, tmp_path: Path, cache: Path) -> None:
    few = [(path, kind) for kind in KINDS[:2] for path in sorted((pictures / kind).iterdir())[:2]]
    one, two = (
        train_retrieval(few, bits=16, cache=place, **(SMALL | {"n_jobs": jobs, "pairs_per_class": 1}))
        for place, jobs in ((cache, 1), (tmp_path, 2))
    )
    assert np.array_equal(one.vocabulary.words_, two.vocabulary.words_)
    assert np.array_equal(one.codes.weights_, two.codes.weights_)


def test_bad_pictures_end_in_the_report(pictures: Path, tmp_path: Path, cache: Path) -> None:
    chosen = [
        (path, path.parent.name) for kind in KINDS[:2] for path in sorted((pictures / kind).iterdir())[:3]
    ]
    broken, plain, absent = tmp_path / "broken.png", tmp_path / "plain.png", tmp_path / "absent.png"
    broken.write_bytes(chosen[0][0].read_bytes()[:200])
    Image.new("L", (50, 50), 99).save(plain)
    model = train_retrieval(
        [*chosen, (broken, "disc"), (plain, "ladder"), (absent, "disc")], bits=16, cache=cache, **SMALL
    )
    left_out = model.settings["left_out"]
    assert sorted(left_out) == sorted(map(str, (broken, plain, absent)))
    assert "one colour" in left_out[str(plain)]
    assert model.settings["pictures"] == 6


def test_classes_of_one_picture_have_no_pairs_and_all_features_count(pictures: Path, cache: Path) -> None:
    lonely = [(pictures / kind / "0.png", kind) for kind in KINDS[:2]]
    with pytest.warns(PliantWarning, match="all points count alike"):
        model = train_retrieval(lonely, bits=8, cache=cache, **SMALL)
    assert np.ptp(model.vocabulary.weights_) == 0


@pytest.mark.parametrize(
    ("source", "options", "message"),
    [
        ("nowhere", {}, "no such folder"),
        ([], {}, "no pictures"),
        (None, {"train_per_class": 0}, "1 or more"),
        (None, {"pairs_per_class": -1}, "not be negative"),
    ],
)
def test_what_cannot_be_trained_on(
    source: object, options: dict, message: str, pictures: Path, cache: Path
) -> None:
    with pytest.raises(InputError, match=message):
        train_retrieval(pictures if source is None else source, cache=cache, **(SMALL | options))


def test_one_class_is_not_enough(pictures: Path, cache: Path) -> None:
    with pytest.raises(InputError, match="two classes"):
        train_retrieval([(pictures / "disc" / "0.png", "disc")], cache=cache, **SMALL)


@given(st.lists(st.integers(0, 3), min_size=1, max_size=30), st.integers(0, 12), st.integers(0, 5))
def test_pairs_are_of_one_class_different_and_even(labels: list[int], count: int, seed: int) -> None:
    pairs = chosen_pairs(np.array(labels), count, seed)
    assert len({tuple(pair) for pair in pairs.tolist()}) == len(pairs)
    for label in set(labels):
        members = np.flatnonzero(np.array(labels) == label)
        own = [pair for pair in pairs.tolist() if labels[pair[0]] == label]
        assert len(own) == min(count, len(members) * (len(members) - 1) // 2)
        assert all(i < j and {i, j} <= set(members.tolist()) for i, j in own)
        if len(own) <= len(members) // 2:
            assert max(Counter(np.ravel(own).tolist()).values(), default=0) <= 1


def test_a_class_has_the_same_pairs_whatever_others_there_are() -> None:
    together = chosen_pairs(np.repeat(["a", "b"], 6), 3, 1)
    alone = chosen_pairs(np.repeat(["b"], 6), 3, 1)
    assert np.array_equal(together[3:] - 6, alone)


def test_points_of_the_shared_part_are_told_in_the_pixels_of_the_source(pictures: Path, cache: Path) -> None:
    store = FeatureStore(cache, 100, 0)
    collection = read_collection(pictures)
    items = [(collection.paths[i], collection.digests[i]) for i in (0, 1)]
    assert [store.describe(item) for item in items] == ["", ""]
    assert store.compare((items[0], items[1])) == ""
    match = features.match_pair(*(path for path, _ in items), rng=0)
    flags = store.shared(items[0][1], items[1][1])
    for flag, region, (_, digest) in zip(flags, (match.region1, match.region2), items, strict=True):
        at = np.clip(np.rint(store.positions(digest)).astype(int), 0, [95, 79])
        assert np.array_equal(flag, region[at[:, 1], at[:, 0]])


def test_a_model_comes_back_from_its_folder(model: RetrievalModel, pictures: Path, tmp_path: Path) -> None:
    model.save(tmp_path / "kept")
    back = RetrievalModel.load(tmp_path / "kept")
    some = sorted((pictures / "star").iterdir())
    assert np.array_equal(back.encode(some), model.encode(some))
    assert back.settings == model.settings
    assert back.bits == 32
    assert (
        json.loads((tmp_path / "kept" / "model.json").read_text(encoding="utf-8"))["codes"]["kind"]
        == "proposed"
    )
    assert sorted(p.name for p in (tmp_path / "kept").iterdir()) == ["model.json", "model.npz"]


def test_models_that_cannot_be_trusted_are_refused(model: RetrievalModel, tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"model\.npz"):
        RetrievalModel.load(tmp_path)
    model.save(tmp_path)
    path = tmp_path / "model.npz"
    arrays = load_arrays(path)
    facts = json.loads(arrays["facts"].tobytes())

    def written(**changes: object) -> None:
        text = json.dumps(facts | changes).encode()
        save_arrays(path, arrays | {"facts": np.frombuffer(text, dtype=np.uint8)})

    written(format=99, version="7.0")
    with pytest.raises(FileFormatError, match=r"version 7\.0 \(format 99\)"):
        RetrievalModel.load(tmp_path)
    for change in ({"codes": {"kind": "magic", "parameters": {}}}, {"vocabulary": {}}, {"format": "x"}):
        written(**change)
        with pytest.raises(FileFormatError, match="damaged"):
            RetrievalModel.load(tmp_path)
    save_arrays(path, {k: v for k, v in arrays.items() if k != "codes.weights_"})
    with pytest.raises(FileFormatError, match="weights_"):
        RetrievalModel.load(tmp_path)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(FileFormatError):
        RetrievalModel.load(tmp_path)


def test_codes_of_a_generator_are_kept_and_codes_of_no_known_kind_are_not(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    tables = [rng.random((30, 4)) for _ in range(6)]
    words = Vocabulary(n_words=5).fit(tables)
    coder = LocalitySensitiveHashing(16, rng=np.random.default_rng(1)).fit(words.transform(tables))
    RetrievalModel(words, coder).save(tmp_path)
    back = RetrievalModel.load(tmp_path)
    assert np.array_equal(back.encode_descriptors(tables), coder.transform(words.transform(tables)))
    with pytest.raises(InputError, match="dict cannot be kept"):
        RetrievalModel(words, {}).save(tmp_path)


def test_a_study_scores_every_kind_on_the_same_splits(pictures: Path, cache: Path) -> None:
    (study,) = evaluate_retrieval(pictures, bits=32, train=6, splits=2, cache=cache, **SMALL)
    assert study.classes == KINDS
    for bag in ("consistent", "all"):
        assert all(
            table.shape == (2, 4) and not np.isnan(table).any() for table in study.precision[bag].values()
        )
    assert study.mean() > 0.6
    assert study.mean("classifier") > 0.6
    held = study.precision["held_out"]["itq"]
    assert (np.isnan(held).sum(axis=1) == 2).all()
    summary = study.summary()
    assert list(summary["precision"]) == ["proposed", "lsh", "itq", "cca_itq", "spectral", "classifier"]
    assert summary["effect_of_selection"]["difference"] == pytest.approx(study.mean() - study.mean(bag="all"))
    low, high = study.interval("lsh")
    assert low <= study.mean("lsh") <= high
    assert len(summary["curve"]["itq"]) == len(summary["neighbours"]) == 20
    (again,) = evaluate_retrieval(
        pictures, bits=32, train=6, splits=2, methods=["itq"], bags=["consistent"], cache=cache, **SMALL
    )
    assert np.array_equal(again.precision["consistent"]["itq"], study.precision["consistent"]["itq"])


def test_queries_of_another_folder_never_train(pictures: Path, cache: Path, tmp_path: Path) -> None:
    for kind in KINDS[1:]:
        (tmp_path / kind).mkdir()
        for i in range(2):
            Image.eval(drawn(kind, 50 + i), lambda v: 255 - v).save(tmp_path / kind / f"{i}.png")
    (study,) = evaluate_retrieval(
        pictures, queries=tmp_path, bits=32, train=20, splits=1, bags=["consistent"], cache=cache, **SMALL
    )
    assert study.classes == KINDS[1:]
    store = FeatureStore(cache, 100, 0)
    bench = _Bench.made(read_collection(pictures), read_collection(tmp_path), store, Workers(1), 20)
    trained, asking = bench.split(20, np.random.default_rng(0))
    assert len(trained) == 24
    assert {bench.collection.paths[i].parent.parent for i in asking} == {tmp_path}


def test_classes_held_out_are_learned_from_by_nobody(pictures: Path, cache: Path) -> None:
    store = FeatureStore(cache, 100, 0)
    bench = _Bench.made(read_collection(pictures), None, store, Workers(1), 6)
    rng = np.random.default_rng(0)
    trained, asking = bench.split(6, rng)
    assert not set(trained) & set(asking)
    learned, database, queries = bench.bag("held_out", trained, asking, rng)
    labels = bench.collection.labels
    assert not set(labels[learned]) & set(labels[database])
    assert set(labels[queries]) == set(labels[database])
    assert len(learned) == len(database) == 12


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"train": 8},
            "more than 8 usable pictures are needed, got 0; the second largest of .* learn from fewer",
        ),
        ({"bits": 20}, "multiples of 8"),
        ({"methods": ["magic"]}, "methods are proposed"),
        ({"splits": 0}, "1 or more"),
    ],
)
def test_studies_that_cannot_be_made(options: dict, message: str, pictures: Path, cache: Path) -> None:
    with pytest.raises(InputError, match=message):
        evaluate_retrieval(pictures, **({"train": 6, "cache": cache} | SMALL | options))


def test_evaluate_prints_json_and_nothing_else(pictures: Path, cache: Path) -> None:
    words = f"retrieval evaluate {pictures} --bits 16 --train 6 --splits 1 --pairs 2 --words 40 --points 100 --jobs 1"
    done = CliRunner().invoke(app, [*words.split(), "--cache", str(cache), "--json"])
    assert done.exit_code == 0, done.output
    values = json.loads(done.stdout)
    assert set(values["precision"]) == {"proposed", "lsh", "itq", "cca_itq", "spectral", "classifier"}
    assert values["bits"] == 16
    shown = CliRunner().invoke(app, [*words.split(), "--cache", str(cache)])
    assert "held-out classes" in shown.stdout


def test_train_writes_a_model(pictures: Path, cache: Path, tmp_path: Path) -> None:
    words = f"retrieval train {pictures} --bits 16 --train 6 --pairs 2 --words 40 --points 100 --jobs 1 -o {tmp_path}"
    done = CliRunner().invoke(app, [*words.split(), "--cache", str(cache), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["pictures"] == 24
    assert RetrievalModel.load(tmp_path).bits == 16


def test_pictures_outside_of_classes_are_counted(tmp_path: Path) -> None:
    for name in ("a.jpg", "b.png", "c.txt"):
        (tmp_path / name).write_bytes(b"")
    with pytest.raises(
        InputError, match="2 pictures lie in the folder itself, none in folders; lay them out"
    ):
        read_collection(tmp_path)
