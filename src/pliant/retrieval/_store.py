"""What an index holds, on disk and in memory, kept in step."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from .._arrays import IntArray
from ..errors import InputError
from ._catalogue import UNLABELLED, Catalogue
from ._hamming import HammingSearch, IndexKind
from ._snapshot import read_snapshot, write_snapshot
from .bits import Codes

CATALOGUE = "catalogue.sqlite"


class Store:
    """A catalogue and the search over its codes. Not for several threads at once.

    Parameters
    ----------
    folder : Path or None
        Where the catalogue is; None for one in memory.
    catalogue : Catalogue
    """

    def __init__(self, folder: Path | None, catalogue: Catalogue) -> None:
        self.folder, self.catalogue = folder, catalogue
        self._behind = False
        self._removals = self._last = 0
        try:
            facts = catalogue.facts()
            self.bits = int(facts["bits"])
            if self.bits < 8 or self.bits % 8:
                raise ValueError(self.bits)
            self._kind: IndexKind = facts["kind"]
            self._flat_up_to = int(facts["flat_up_to"])
            self._rebuild()
        except (KeyError, TypeError, ValueError) as error:
            catalogue.close()
            if isinstance(error, InputError):
                raise
            message = f"{catalogue.path}: what it says of itself cannot be used ({error}); it is damaged"
            raise InputError(message) from error

    def insert(
        self,
        codes: Codes,
        names: Sequence[str],
        labels: Sequence[str],
        previews: Sequence[bytes] | None,
        files: Sequence[tuple[str, str]] | None,
    ) -> IntArray:
        """Append items, in place of those of the same files, in one transaction; return their ids."""
        origins: Sequence[tuple[str | None, str | None]] = files or [(None, None)] * len(codes)
        catalogue, gone = self.catalogue, np.zeros(0, dtype=np.int64)
        removals = self._removals
        with catalogue.writing():
            if files:
                gone = catalogue.items_of([path for path, _ in files])
                removals = self._delete(gone)
            numbers = {label: catalogue.label_number(label) for label in dict.fromkeys(labels)}
            rows = [
                (code.tobytes(), name, numbers[label], *origin)
                for code, name, label, origin in zip(codes, names, labels, origins, strict=True)
            ]
            ids = catalogue.insert(rows)
            if previews is not None:
                catalogue.insert_previews(ids, previews)
        self._after(gone, removals)
        return ids

    def delete(self, ids: IntArray) -> list[int]:
        """Remove items in one transaction; return those that are not there, and then remove none."""
        with self.catalogue.writing():
            known = self.catalogue.names(ids.tolist())
            missing = [item for item in ids.tolist() if item not in known]
            if missing or not len(ids):
                return missing
            removals = self._delete(ids)
        self._after(ids, removals)
        return []

    def refresh(self) -> None:
        """Take in what other processes wrote."""
        if self.catalogue.state() != self._state:
            self._catch_up()

    def label_name(self, number: int) -> str:
        """Return the label of a number, whoever gave it one."""
        if number not in self.labels:
            self._read_labels()
        return self.labels.get(number, "")

    def snapshot(self) -> None:
        """Bring the faiss file up to date."""
        if self.folder is not None:
            write_snapshot(self.folder, self.catalogue, self.search, self._removals)
            self._behind = False

    def copy_to(self, folder: Path, save_model: Callable[[Path], None]) -> None:
        """Write everything to a new folder, which appears whole or not at all."""
        draft = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}.part")
        try:
            draft.mkdir(parents=True)
            self.catalogue.copy_to(draft / CATALOGUE)
            save_model(draft)
            copy = Catalogue(draft / CATALOGUE)
            try:
                write_snapshot(draft, copy, self.search, self._removals)
            finally:
                copy.close()
            os.rename(draft, folder)
        except OSError as error:
            message = f"{folder}: cannot be written: {error.strerror or error}"
            raise InputError(message) from error
        finally:
            shutil.rmtree(draft, ignore_errors=True)

    def close(self) -> None:
        """Bring the faiss file up to date if something was written, and let go of the catalogue."""
        try:
            if self._behind:
                self.refresh()
                self.snapshot()
        finally:
            self.catalogue.close()

    def _delete(self, ids: IntArray) -> int:
        """Remove items within a transaction and return the number of removals there have been."""
        if not len(ids):
            return self._removals
        self.catalogue.delete(ids)
        return self.catalogue.count("removals")

    def _after(self, gone: IntArray, removals: int) -> None:
        """Bring memory to what was just committed."""
        self._behind = self.folder is not None
        if len(gone) and removals == self._removals + 1:
            self.search.discard(gone)
            self._removals = removals
        self._catch_up()

    def _catch_up(self) -> None:
        state = self.catalogue.state()
        if int(self.catalogue.facts()["removals"]) != self._removals:
            self._rebuild()
            return
        self._take(*self.catalogue.rows_after(self._last, self.bits))
        self._state = state

    def _rebuild(self) -> None:
        """Read everything: from the faiss file as far as it is whole and up to date, the rest from the catalogue."""
        self.search, self._last = HammingSearch(self.bits, self._kind, self._flat_up_to), 0
        self._state = self.catalogue.state()
        with self.catalogue.reading():
            facts = self.catalogue.facts()
            self._removals = int(facts["removals"])
            if self.folder is not None and read_snapshot(self.folder, self.catalogue, facts, self.search):
                self._last = int(facts["snapshot_last"])
            self._take(*self.catalogue.rows_after(self._last, self.bits))
            self._read_labels()

    def _take(self, ids: IntArray, codes: Codes, labels: IntArray) -> None:
        self.search.extend(ids, codes, labels)
        if len(ids):
            self._last = int(ids[-1])
            self._read_labels()

    def _read_labels(self) -> None:
        self.labels = {UNLABELLED: "", **self.catalogue.label_names()}
