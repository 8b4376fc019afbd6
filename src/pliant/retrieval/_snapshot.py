"""The faiss file of an index: made from its catalogue, trusted only when the catalogue knows its hash."""

from __future__ import annotations

import hashlib
import os
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ._catalogue import Catalogue
from ._hamming import HammingSearch

_FILE = "codes.faiss"


def write_snapshot(folder: Path, catalogue: Catalogue, search: HammingSearch, removals: int) -> None:
    """Write what faiss holds, and note in the catalogue its size, its hash and what it covers.

    Whoever is interrupted in between leaves a file that does not fit the note, and it is then made again.
    """
    data = search.to_bytes()
    last = int(search.ids[-1]) if len(search) else 0
    draft = folder / f".{_FILE}.{secrets.token_hex(4)}.part"
    try:
        with catalogue.writing():
            if int(catalogue.facts()["removals"]) != removals:
                return  # Another process removed items just now; its own snapshot will do.
            _write_through(draft, data)
            os.replace(draft, folder / _FILE)
            catalogue.note(
                snapshot_last=last,
                snapshot_removals=removals,
                snapshot_size=len(data),
                snapshot_hash=hashlib.sha256(data).hexdigest(),
            )
    except OSError as error:
        message = f"{folder / _FILE}: cannot be written: {error.strerror or error}"
        raise InputError(message) from error
    finally:
        draft.unlink(missing_ok=True)


def read_snapshot(
    folder: Path, catalogue: Catalogue, facts: Mapping[str, Any], search: HammingSearch
) -> bool:
    """Fill a search from the faiss file; False where it is missing, damaged, or covers items removed since."""
    if facts.get("snapshot_removals") != facts["removals"]:
        return False
    data = _bytes_of_size(folder / _FILE, facts["snapshot_size"])
    if data is None or hashlib.sha256(data).hexdigest() != facts["snapshot_hash"]:
        return False
    last = int(facts["snapshot_last"])
    ids, labels = catalogue.labels_upto(last)
    codes = None
    if search.kind == "ivf" or (search.kind == "auto" and len(ids) > search.flat_up_to):
        everything, all_codes, _ = catalogue.rows_after(0, search.bits)
        codes = np.ascontiguousarray(all_codes[everything <= last])
    return search.restore(data, ids, labels, codes)


def _bytes_of_size(path: Path, size: int) -> bytes | None:
    """Read a file if it has the size that it should have, so that a wrong one is not even read."""
    try:
        return path.read_bytes() if path.stat().st_size == size else None
    except OSError:
        return None


def _write_through(path: Path, data: bytes) -> None:
    with path.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
