"""The truth of an index on disk: an SQLite file in which a code that was acknowledged stays."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import IntArray
from ..errors import InputError, first_indices
from .bits import Codes

#: Written into every catalogue; a greater one comes from a newer version of Pliant.
FORMAT = 1
_APPLICATION = 0x506C6E74  # "Plnt"
_TABLES = {
    "facts": "CREATE TABLE facts (key TEXT PRIMARY KEY, value) WITHOUT ROWID",
    "labels": "CREATE TABLE labels (number INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE)",
    "items": (
        "CREATE TABLE items (id INTEGER PRIMARY KEY AUTOINCREMENT, code BLOB NOT NULL, name TEXT NOT NULL, "
        "label INTEGER NOT NULL, source TEXT UNIQUE, digest TEXT)"
    ),
    "previews": "CREATE TABLE previews (id INTEGER PRIMARY KEY, jpeg BLOB NOT NULL)",
}
#: The label number of what has no label.
UNLABELLED = 0
# Fewer parameters than any SQLite allows in one statement.
_CHUNK = 500


class Catalogue:
    """Codes, names, labels and previews by id, in one SQLite file (or in memory).

    Parameters
    ----------
    path : Path or None
        The file; None keeps it in memory.
    wait : float
        Seconds to wait for another process that writes.
    facts : mapping, optional
        Given, a new catalogue is made that holds these; otherwise an existing one is opened.
    """

    def __init__(
        self, path: Path | None, *, wait: float = 10.0, facts: Mapping[str, Any] | None = None
    ) -> None:
        self.path, self.wait = path, wait
        if facts is None and (path is None or not path.is_file()):
            message = f"{path}: there is no catalogue; this is not an index, or a part of it was lost"
            raise InputError(message)
        with self._explained():
            self._db = sqlite3.connect(
                ":memory:" if path is None else path, wait, isolation_level=None, check_same_thread=False
            )
        try:
            with self._explained():
                # Nothing that a file made by others holds may run code, and no acknowledged write may be lost.
                self._db.execute("PRAGMA trusted_schema = OFF")
                if facts is None:
                    self._check_format()
                self._db.execute("PRAGMA journal_mode = WAL")
                self._db.execute("PRAGMA synchronous = FULL")
                if facts is not None:
                    self._create(facts)
        except BaseException:
            self._db.close()
            raise

    def close(self) -> None:
        """Let go of the file."""
        self._db.close()

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Hold the only right to write; all of the block is kept, or nothing of it."""
        with self._explained():
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._db.execute("COMMIT")
            except BaseException:
                if self._db.in_transaction:
                    self._db.execute("ROLLBACK")
                raise

    @contextmanager
    def reading(self) -> Iterator[None]:
        """See one state of the file throughout the block, whoever writes meanwhile."""
        with self._explained():
            self._db.execute("BEGIN")
            try:
                yield
            finally:
                self._db.execute("ROLLBACK")

    def facts(self) -> dict[str, Any]:
        """Return everything that is known of the index as a whole."""
        with self._explained():
            return dict(self._db.execute("SELECT key, value FROM facts"))

    def state(self) -> int:
        """Return a number that changes when another process or connection writes."""
        with self._explained():
            return int(self._db.execute("PRAGMA data_version").fetchone()[0])

    def note(self, **facts: Any) -> None:
        """Set facts, within :meth:`writing`."""
        self._db.executemany("INSERT OR REPLACE INTO facts VALUES (?, ?)", facts.items())

    def count(self, key: str) -> int:
        """Raise a counter among the facts by one and return it, within :meth:`writing`."""
        value = int(self._db.execute("SELECT value FROM facts WHERE key = ?", (key,)).fetchone()[0]) + 1
        self.note(**{key: value})
        return value

    def insert(self, rows: Sequence[tuple[bytes, str, int, str | None, str | None]]) -> IntArray:
        """Append (code, name, label number, source, digest) and return the ids, within :meth:`writing`."""
        statement = "INSERT INTO items (code, name, label, source, digest) VALUES (?, ?, ?, ?, ?)"
        ids = [self._db.execute(statement, row).lastrowid for row in rows]
        return np.array(ids, dtype=np.int64)

    def insert_previews(self, ids: IntArray, previews: Sequence[bytes]) -> None:
        """Keep one JPEG an item, within :meth:`writing`."""
        self._db.executemany("INSERT INTO previews VALUES (?, ?)", zip(ids.tolist(), previews, strict=True))

    def delete(self, ids: IntArray) -> None:
        """Remove items, within :meth:`writing`."""
        each = [(i,) for i in ids.tolist()]
        self._db.executemany("DELETE FROM items WHERE id = ?", each)
        self._db.executemany("DELETE FROM previews WHERE id = ?", each)

    def label_number(self, name: str) -> int:
        """Return the number of a label, a new one where it has none yet, within :meth:`writing`."""
        if not name:
            return UNLABELLED
        self._db.execute("INSERT OR IGNORE INTO labels (name) VALUES (?)", (name,))
        return int(self._db.execute("SELECT number FROM labels WHERE name = ?", (name,)).fetchone()[0])

    def label_names(self) -> dict[int, str]:
        """Return all labels by number."""
        with self._explained():
            return dict(self._db.execute("SELECT number, name FROM labels"))

    def rows_after(self, last: int, bits: int) -> tuple[IntArray, Codes, IntArray]:
        """Return ids, codes and label numbers of all items past an id, in the order of ids."""
        with self._explained():
            found = self._db.execute(
                "SELECT id, code, label FROM items WHERE id > ? ORDER BY id", (last,)
            ).fetchall()
        ids = np.array([row[0] for row in found], dtype=np.int64)
        labels = np.array([row[2] for row in found], dtype=np.int64)
        wrong = [row[0] for row in found if not isinstance(row[1], bytes) or len(row[1]) * 8 != bits]
        if wrong:
            message = (
                f"{self.path}: {len(wrong)} codes are not of {bits} bits, items {first_indices(wrong)}: damaged; "
                "build the index anew"
            )
            raise InputError(message)
        codes = np.frombuffer(b"".join(row[1] for row in found), dtype=np.uint8)
        return ids, codes.reshape(len(ids), bits // 8), labels

    def labels_upto(self, last: int) -> tuple[IntArray, IntArray]:
        """Return ids and label numbers of the items up to an id, in the order of ids."""
        with self._explained():
            found = self._db.execute(
                "SELECT id, label FROM items WHERE id <= ? ORDER BY id", (last,)
            ).fetchall()
        pairs = np.array(found, dtype=np.int64).reshape(len(found), 2)
        return np.ascontiguousarray(pairs[:, 0]), np.ascontiguousarray(pairs[:, 1])

    def names(self, ids: Sequence[int]) -> dict[int, tuple[str, int]]:
        """Return name and label number of the items among these that exist."""
        found: dict[int, tuple[str, int]] = {}
        with self._explained():
            for start in range(0, len(ids), _CHUNK):
                part = tuple(ids[start : start + _CHUNK])
                marks = ",".join("?" * len(part))
                statement = f"SELECT id, name, label FROM items WHERE id IN ({marks})"
                found |= {row[0]: (row[1], row[2]) for row in self._db.execute(statement, part)}
        return found

    def sources(self) -> dict[str, tuple[int, str | None]]:
        """Return id and digest of every item that came from a file, by the file's path."""
        with self._explained():
            rows = self._db.execute("SELECT source, id, digest FROM items WHERE source IS NOT NULL")
            return {source: (item, digest) for source, item, digest in rows}

    def items_of(self, sources: Sequence[str]) -> IntArray:
        """Return the ids of the items that came from these files, ascending."""
        statement = "SELECT id FROM items WHERE source = ?"
        with self._explained():
            found = [self._db.execute(statement, (source,)).fetchone() for source in sources]
        return np.array(sorted(row[0] for row in found if row is not None), dtype=np.int64)

    def preview(self, item: int) -> bytes | None:
        """Return the JPEG of an item, if there is one."""
        with self._explained():
            row = self._db.execute("SELECT jpeg FROM previews WHERE id = ?", (item,)).fetchone()
        return None if row is None else bytes(row[0])

    def copy_to(self, path: Path) -> None:
        """Write all of it to a new file, seen at one moment."""
        with self._explained():
            target = sqlite3.connect(path)
            try:
                self._db.backup(target)
            finally:
                target.close()

    def _create(self, facts: Mapping[str, Any]) -> None:
        with self.writing():
            for statement in _TABLES.values():
                self._db.execute(statement)
            self._db.execute(f"PRAGMA application_id = {_APPLICATION}")
            self._db.execute(f"PRAGMA user_version = {FORMAT}")
            self.note(**facts)

    def _check_format(self) -> None:
        application = self._db.execute("PRAGMA application_id").fetchone()[0]
        version = self._db.execute("PRAGMA user_version").fetchone()[0]
        if application != _APPLICATION:
            message = f"{self.path} is not the catalogue of an index that Pliant wrote"
            raise InputError(message)
        if version > FORMAT:
            message = (
                f"{self.path} was written by a newer version of Pliant (format {version}, this one reads up to "
                f"{FORMAT}); upgrade Pliant"
            )
            raise InputError(message)
        schema = self._db.execute(
            "SELECT name, sql FROM sqlite_master WHERE name NOT LIKE 'sqlite\\_%' ESCAPE '\\'"
        )
        if dict(schema) != _TABLES:
            message = f"{self.path}: its tables are not those of an index; it was changed by something else"
            raise InputError(message)

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise InputError(self._meaning(error)) from error

    def _meaning(self, error: sqlite3.Error) -> str:
        text = str(error)
        if "locked" in text or "busy" in text:
            return (
                f"{self.path}: another process is writing to this index and did not end within {self.wait:g} s; "
                "wait for it, then try again"
            )
        if "malformed" in text or "not a database" in text or "disk I/O" in text:
            return f"{self.path} is truncated or damaged ({text}); restore it from a copy, or build the index anew"
        return f"{self.path}: {text}"
