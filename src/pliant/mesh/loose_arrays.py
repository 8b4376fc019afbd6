"""Per-vertex numbers that come without a mesh: NPY, and tables of text."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileFormatError
from .formats import file_bytes
from .formats.text import floats, integers

TABLES = (".csv", ".tsv", ".txt")


def stored_array(stream: Any, available: int, name: str) -> NDArray[Any]:
    """Read one NPY array, its header's claim compared with the bytes that there are before anything is allocated."""
    version = np.lib.format.read_magic(stream)
    read_header = (
        np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    )
    shape, column_order, dtype = read_header(stream)
    if dtype.hasobject:
        message = f"{name} holds pickled objects, which are not read"
        raise FileFormatError(message)
    size = int(np.prod([*shape], dtype=object)) * dtype.itemsize if shape else dtype.itemsize
    raw = stream.read(size) if size <= available else b""
    if len(raw) != size:
        message = f"{name} claims {size} bytes and has {available if size > available else len(raw)}"
        raise FileFormatError(message)
    return np.frombuffer(raw, dtype=dtype).reshape(shape, order="F" if column_order else "C").copy()


def read_npy(path: Path) -> dict[str, NDArray[Any]]:
    """Read the array of an NPY file, named like the file."""
    data = file_bytes(path)
    try:
        return {path.stem: stored_array(io.BytesIO(data), len(data), path.name)}
    except FileFormatError as error:
        message = f"{path}: {error}"
        raise FileFormatError(message) from error
    except Exception as error:
        message = f"{path}: not a readable NPY file: {type(error).__name__}: {error}"
        raise FileFormatError(message) from error


def read_table(path: Path) -> tuple[dict[str, NDArray[Any]], tuple[str, ...]]:
    """Read the columns of numbers of a text table, one row a vertex, and say which columns hold something else.

    Cells are parted by commas, semicolons or tabs, or else by blanks; a first row without a number names the columns;
    an empty cell is NaN; lines that begin with ``#`` are left out.
    """
    try:
        text = file_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        message = f"{path}: not a text table: {error}"
        raise FileFormatError(message) from error
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if not lines:
        message = f"{path}: the table is empty"
        raise FileFormatError(message)
    mark = next((mark for mark in ",;\t" if mark in lines[0]), None)
    rows = [[cell.strip() for cell in line.split(mark)] for line in lines]
    wide = len(rows[0])
    bad = [number for number, row in enumerate(rows, start=1) if len(row) != wide]
    if bad:
        message = (
            f"{path}: {len(bad)} rows do not have the {wide} cells of the first, first row {bad[0]} with "
            f"{len(rows[bad[0] - 1])}"
        )
        raise FileFormatError(message)
    titles = [f"column {i + 1}" for i in range(wide)] if wide > 1 else [path.stem]
    if _numbers(rows[0]) is None:
        titles, rows = [cell or title for cell, title in zip(rows[0], titles, strict=True)], rows[1:]
    if len(set(titles)) < wide:
        message = (
            f"{path}: {wide - len(set(titles))} columns have the name of another, first row {titles[:6]}"
        )
        raise FileFormatError(message)
    columns = {title: _numbers(cells) for title, cells in zip(titles, zip(*rows, strict=True), strict=False)}
    left = [title for title, values in columns.items() if values is None]
    found = {title: values for title, values in columns.items() if values is not None}
    if not found:
        message = f"{path}: no column holds numbers, one row a vertex"
        raise FileFormatError(message)
    notes = (f"left out, as they do not hold numbers: {', '.join(left)}",) if left else ()
    return found, notes


def _numbers(cells: Sequence[str]) -> NDArray[Any] | None:
    """Parse cells as whole numbers, or else as floats, an empty one as NaN; None where one is neither."""
    tokens = [cell.encode() or b"nan" for cell in cells]
    for parse in (integers, floats):
        try:
            return parse(tokens)
        except FileFormatError:
            continue
    return None
