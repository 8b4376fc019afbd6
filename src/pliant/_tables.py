"""Tables that users write: CSV with a header, in UTF-8, with or without a byte order mark."""

from __future__ import annotations

import csv
from pathlib import Path

from .errors import FileFormatError


def table_rows(path: Path, delimiter: str = ",") -> list[dict[str, str]]:
    """Return the rows by column name, cells stripped; cells beyond the header are left out, missing ones empty.

    Raises
    ------
    FileFormatError
        If the file cannot be read as text, or not as CSV.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as lines:
            rows = csv.DictReader(lines, delimiter=delimiter)
            return [{k: (v or "").strip() for k, v in row.items() if k} for row in rows]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        message = f"{path}: not a table that can be read, a text file in UTF-8 is needed ({error})"
        raise FileFormatError(message) from error
