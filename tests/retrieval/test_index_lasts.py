"""An index through damage, versions, two writers, and processes that are killed while they add."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

from pliant.errors import InputError
from pliant.retrieval.index import ShapeIndex

pytest.importorskip("faiss")


@pytest.fixture
def saved(tmp_path):
    index = ShapeIndex(64)
    index.add(codes_of(range(1, 101)), names=[str(i) for i in range(1, 101)])
    return index.save(tmp_path / "index")


def codes_of(items) -> np.ndarray:
    """Each id has a code of its own that a test can tell without asking the index."""
    rows = [np.random.default_rng(int(item)).integers(0, 256, 8, dtype=np.uint8) for item in items]
    return np.array(rows, dtype=np.uint8).reshape(len(rows), 8)


def is_whole(index: ShapeIndex, count: int) -> bool:
    ids = np.arange(1, count + 1)
    found = index.search(codes_of(ids), 1)
    return len(index) == count and bool((found.ids[:, 0] == ids).all() and not found.distances.any())


def lose(path):
    path.unlink()


def cut(path):
    path.write_bytes(path.read_bytes()[:-5])


def flip(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4
    path.write_bytes(data)


def swell(path):
    path.write_bytes(path.read_bytes() * 3)


def empty(path):
    path.write_bytes(b"")


@pytest.mark.parametrize("spoil", [lose, cut, flip, swell, empty])
def test_a_spoilt_faiss_file_is_made_again_from_the_catalogue(saved, spoil):
    file = saved / "codes.faiss"
    before = file.read_bytes()
    spoil(file)
    with ShapeIndex.load(saved) as index:
        assert is_whole(index, 100)
        index.save()
    assert file.read_bytes() == before
    assert list(saved.glob("*.part")) == []


def test_faiss_never_reads_a_file_that_the_catalogue_does_not_know(saved, monkeypatch):
    import faiss

    def refuse(_):
        raise AssertionError("faiss was given unknown bytes")

    monkeypatch.setattr(faiss, "deserialize_index_binary", refuse)
    with pytest.raises(AssertionError):
        ShapeIndex.load(saved)
    flip(saved / "codes.faiss")
    with ShapeIndex.load(saved) as index:
        assert is_whole(index, 100)


def test_a_faiss_file_that_is_behind_is_completed(saved):
    behind = (saved / "codes.faiss").read_bytes()
    with ShapeIndex.load(saved) as index:
        index.add(codes_of(range(101, 131)))
    (saved / "codes.faiss").write_bytes(behind)
    with ShapeIndex.load(saved) as index:
        assert is_whole(index, 130)
        index.remove(np.arange(121, 131))
    (saved / "codes.faiss").write_bytes(behind)
    with ShapeIndex.load(saved) as index:
        assert is_whole(index, 120)


@pytest.mark.parametrize("spoil", [cut, flip, empty, lose])
def test_a_spoilt_catalogue_is_a_clear_error_or_no_error_at_all(saved, spoil):
    """A flipped bit can fall on free space; then everything must still be there."""
    file = saved / "catalogue.sqlite"
    if spoil is cut:
        file.write_bytes(file.read_bytes()[:9000])
    else:
        spoil(file)
    whole, said = used(saved)
    if said is None:
        assert spoil is flip
        assert whole
    else:
        assert any(word in said for word in ("damaged", "no catalogue", "not the catalogue", "not those of"))


def used(folder) -> tuple[bool, str | None]:
    """Open and search; return whether all is there, and what was said if it could not be done."""
    try:
        with ShapeIndex.load(folder) as index:
            found = index.search(codes_of([1]), 100)
            index.items(found.ids[0])
            return is_whole(index, 100), None
    except InputError as error:
        return False, str(error)


@pytest.mark.parametrize("offset", range(100, 16000, 1590))
def test_no_flipped_byte_of_the_catalogue_crashes(saved, offset):
    file = saved / "catalogue.sqlite"
    data = bytearray(file.read_bytes())
    data[offset % len(data)] ^= 0xFF
    file.write_bytes(data)
    _, said = used(saved)
    assert said is None or str(saved) in said or "not in the index" in said


def execute(path, *statements: str) -> None:
    database = sqlite3.connect(path)
    with database:
        for statement in statements:
            database.execute(statement)
    database.close()


def test_an_index_of_a_newer_version_is_refused(saved):
    execute(saved / "catalogue.sqlite", "PRAGMA user_version = 7")
    with pytest.raises(
        InputError, match=r"newer version of Pliant \(format 7, this one reads up to 1\); upgrade"
    ):
        ShapeIndex.load(saved)


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("CREATE TRIGGER t AFTER INSERT ON items BEGIN DELETE FROM items; END", "changed by something else"),
        ("PRAGMA application_id = 3", "not the catalogue"),
        (
            "UPDATE items SET code = x'00' WHERE id > 97",
            "3 codes are not of 64 bits, items \\[98, 99, 100\\]",
        ),
        ("UPDATE facts SET value = 'many' WHERE key = 'bits'", "damaged"),
        ("UPDATE facts SET value = 12 WHERE key = 'bits'", "damaged"),
        ("DELETE FROM facts", "damaged"),
    ],
)
def test_a_catalogue_that_others_changed_is_refused(saved, statement, message):
    execute(saved / "catalogue.sqlite", statement)
    (saved / "codes.faiss").unlink()
    with pytest.raises(InputError, match=message):
        ShapeIndex.load(saved)


def test_places_that_hold_no_index_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such index"):
        ShapeIndex.load(tmp_path / "none")
    with pytest.raises(InputError, match="no catalogue"):
        ShapeIndex.load(tmp_path)
    (tmp_path / "catalogue.sqlite").write_text("not a database, " * 100)
    with pytest.raises(InputError, match="damaged"):
        ShapeIndex.load(tmp_path)


def test_a_second_writer_waits_and_is_then_refused(saved):
    other = sqlite3.connect(saved / "catalogue.sqlite", isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with ShapeIndex.load(saved, wait=0.05) as index:
        with pytest.raises(InputError, match=r"another process is writing .* did not end within 0.05 s"):
            index.add(codes_of([101]))
        assert is_whole(index, 100)  # Reading goes on.
        other.execute("ROLLBACK")
        index.add(codes_of([101]))
        assert is_whole(index, 101)
    other.close()


WRITER = textwrap.dedent(
    """
    import sys
    import numpy as np
    from pliant.retrieval.index import ShapeIndex

    index = ShapeIndex.load(sys.argv[1])
    for step in range(10**6):
        first = index._store._last + 1
        rows = [np.random.default_rng(i).integers(0, 256, 8, dtype=np.uint8) for i in range(first, first + 3)]
        ids = index.add(np.array(rows), names=[str(i) for i in range(first, first + 3)])
        sys.stdout.write(f"{ids[-1]}\\n")
        sys.stdout.flush()
        if step % 5 == 4:
            index.save()
    """
)


def test_nothing_acknowledged_is_lost_when_the_writer_is_killed(saved, tmp_path):
    """Killed at random moments, again and again on the same folder; a batch of three is there whole or not at all."""
    script = tmp_path / "writer.py"
    script.write_text(WRITER)
    rng, count = np.random.default_rng(0), 100
    for _ in range(5):
        writer = subprocess.Popen([sys.executable, script, saved], stdout=subprocess.PIPE, text=True)
        said = [writer.stdout.readline()]
        time.sleep(rng.uniform(0, 0.25))
        os.kill(writer.pid, signal.SIGKILL)
        said += writer.stdout.read().splitlines()
        writer.wait()
        writer.stdout.close()
        acknowledged = int([line for line in said if line.strip()][-1])
        assert acknowledged > count
        with ShapeIndex.load(saved) as index:
            count = len(index)
            assert count - acknowledged in (0, 3)
            assert is_whole(index, count)
            assert [item.name for item in index.items(np.arange(1, count + 1))] == [
                str(i) for i in range(1, count + 1)
            ]


def test_two_processes_that_add_at_once_both_succeed(saved, tmp_path):
    script = tmp_path / "adder.py"
    script.write_text(
        "import json, sys, numpy as np\nfrom pliant.retrieval.index import ShapeIndex\n"
        "with ShapeIndex.load(sys.argv[1]) as index:\n"
        "    code = np.full((1, 8), int(sys.argv[2]), dtype=np.uint8)\n"
        "    print(json.dumps([int(index.add(code)[0]) for _ in range(25)]))\n"
    )
    adders = [
        subprocess.Popen([sys.executable, script, saved, str(k)], stdout=subprocess.PIPE, text=True)
        for k in range(2)
    ]
    ids = [json.loads(adder.communicate()[0]) for adder in adders]
    assert sorted(ids[0] + ids[1]) == list(range(101, 151))
    with ShapeIndex.load(saved) as index:
        assert len(index) == 150
        for k in range(2):
            found = index.search(np.full((1, 8), k, dtype=np.uint8), 25)
            assert sorted(found.ids[0].tolist()) == sorted(ids[k])
