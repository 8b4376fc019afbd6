"""Pictures into an index and out again: folders, changes, bad files, what a query says."""

from __future__ import annotations

import io

import numpy as np
import pytest
from tiny_encoder import Image, TinyEncoder, encoded, scene, write_classes

from pliant.errors import InputError
from pliant.images import as_picture
from pliant.retrieval import ShapeIndex, add_folder, query_index
from pliant.retrieval.querying import preview_jpeg

pytest.importorskip("faiss")


@pytest.fixture
def folder(tmp_path):
    return write_classes(tmp_path / "pictures", {"hills": 3, "lakes": 4})


def test_a_folder_is_added_with_its_classes_and_each_picture_finds_itself(folder):
    (folder / "alone.png").write_bytes(encoded(scene(50)))
    (folder / "lakes" / "deep").mkdir()
    (folder / "lakes" / "deep" / "UPPER.JPG").write_bytes(encoded(scene(51), "JPEG"))
    (folder / "notes.txt").write_text("not a picture by its name")
    index = ShapeIndex(model=TinyEncoder())
    report = add_folder(index, folder, n_jobs=2)
    assert report.unchanged == 0
    assert report.failures == {}
    names = [item.name for item in index.items(report.ids)]
    assert names == ["alone.png", *(f"hills/{i}.jpg" for i in range(3)), *(f"lakes/{i}.jpg" for i in range(3, 7)),
                     "lakes/deep/UPPER.JPG"]  # fmt: skip
    assert index.labels() == {"": 1, "hills": 3, "lakes": 5}
    for seed in range(7):
        best = query_index(index, scene(seed), count=1).matches[0]
        assert best.name.endswith(f"/{seed}.jpg")
        assert best.distance <= 4
    assert query_index(index, scene(1), count=5, label="lakes").label == "lakes"
    assert all(match.label == "hills" for match in query_index(index, scene(4), label="hills").matches)


def test_adding_again_adds_what_is_new_and_replaces_what_changed(folder):
    index = ShapeIndex(model=TinyEncoder())
    first = add_folder(index, folder)
    again = add_folder(index, folder)
    assert again.ids.size == 0
    assert again.unchanged == 7
    (folder / "hills" / "1.jpg").write_bytes(encoded(scene(90), "JPEG"))
    (folder / "hills" / "new.png").write_bytes(encoded(scene(91)))
    third = add_folder(index, folder)
    assert third.unchanged == 6
    assert [item.name for item in index.items(third.ids)] == ["hills/1.jpg", "hills/new.png"]
    assert len(index) == 8
    assert first.ids[1] not in {match.id for match in query_index(index, scene(1), count=8).matches}
    assert query_index(index, scene(90), count=1).matches[0].name == "hills/1.jpg"


def test_bad_files_end_in_the_report_and_the_others_are_added(folder):
    good = encoded(scene(1), "JPEG")
    bad = {
        "text.jpg": b"no picture",
        "empty.png": b"",
        "cut.jpg": good[: len(good) // 2],
        "plain.png": encoded(np.full((30, 30), 7, np.uint8)),
    }
    for name, data in bad.items():
        (folder / "hills" / name).write_bytes(data)
    index = ShapeIndex(model=TinyEncoder())
    report = add_folder(index, folder)
    assert len(index) == 7
    reasons = {path.rpartition("/")[2]: why for path, why in report.failures.items()}
    assert set(reasons) == set(bad)
    assert "truncated or damaged" in reasons["cut.jpg"]
    assert "one colour" in reasons["plain.png"]
    assert "not a picture of a known format" in reasons["text.jpg"]


def test_an_encoder_that_breaks_on_one_picture_does_not_end_the_run(folder):
    class Breaks(TinyEncoder):
        def _one(self, picture):
            if abs(picture.grey.mean() - scene(2).mean() / 255) < 1e-3:
                raise ZeroDivisionError("by zero")
            return super()._one(picture)

    index = ShapeIndex(model=Breaks())
    report = add_folder(index, folder)
    assert list(report.failures.values()) == ["ZeroDivisionError: by zero"]
    assert len(index) == 6


def test_folders_that_cannot_be_added_are_refused(tmp_path):
    index = ShapeIndex(model=TinyEncoder())
    with pytest.raises(InputError, match="no such folder"):
        add_folder(index, tmp_path / "none")
    with pytest.raises(InputError, match="no pictures below it"):
        add_folder(index, tmp_path)
    with pytest.raises(InputError, match="empty"):
        query_index(index, scene(0))


def test_the_label_of_a_query_is_the_mode_and_of_equals_the_first_met(folder):
    index = ShapeIndex(model=TinyEncoder())
    code = index.model.encode([scene(0)])
    index.add(np.repeat(code, 5, axis=0), labels=["b", "a", "a", "b", ""])
    assert query_index(index, scene(0), count=5).label == "b"
    assert query_index(index, scene(0), count=3).label == "a"
    bare = ShapeIndex(model=TinyEncoder())
    bare.add(code)
    assert query_index(bare, scene(0)).label == ""


def test_previews_are_small_jpegs_with_fill_in_white():
    pixels = np.zeros((400, 1000, 4), np.uint8)
    pixels[..., 3] = 255
    pixels[:, :500, 3] = 0
    shown = np.asarray(Image.open(io.BytesIO(preview_jpeg(as_picture(pixels)))))
    assert shown.shape == (128, 320, 3)
    assert shown[64, 40].min() > 240
    assert shown[64, 280].max() < 15


def test_the_model_travels_with_the_index(folder, tmp_path):
    index = ShapeIndex(model=TinyEncoder())
    add_folder(index, folder)
    index.save(tmp_path / "index")
    assert (tmp_path / "index" / "model" / "tiny").is_file()
    with ShapeIndex.load(tmp_path / "index", model=TinyEncoder()) as again:
        assert query_index(again, scene(3), count=1).matches[0].name == "lakes/3.jpg"
    with pytest.raises(InputError, match="the model gives codes of 64 bits, the index holds 32"):
        ShapeIndex(32, model=TinyEncoder())


def test_a_sample_is_spread_over_the_index(folder):
    index = ShapeIndex(model=TinyEncoder())
    assert index.sample(5) == []
    ids = add_folder(index, folder).ids
    assert [item.id for item in index.sample(3)] == ids[[0, 3, 6]].tolist()
    assert len(index.sample(50)) == 7


def test_matches_that_tie_are_said_to(folder):
    class Alike(TinyEncoder):
        def encode(self, pictures):
            return np.zeros((len(pictures), 8), dtype=np.uint8)

    index = ShapeIndex(model=Alike())
    add_folder(index, folder)
    assert any("7 of 7 matches are all 0 bits away" in note for note in query_index(index, scene(1)).notes)
    plain = ShapeIndex(model=TinyEncoder())
    add_folder(plain, folder)
    assert not any("bits away" in note for note in query_index(plain, scene(1)).notes)
