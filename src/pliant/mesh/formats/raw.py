"""Bytes in and out: whole files, bounded decompression, writes that never leave half a file."""

from __future__ import annotations

import gzip
import os
import secrets
import stat
import zlib
from pathlib import Path

from ...errors import FileFormatError, InputError

# Honest mesh data shrinks 20-fold at most; a stream that grows beyond this is a bomb or broken.
_FREE_BYTES = 64 << 20
_EXPANSION = 40


class Inflater:
    """Decompress the streams of one file against one budget, set by the size of that file."""

    def __init__(self, file_size: int) -> None:
        self._limit = self._left = _FREE_BYTES + _EXPANSION * file_size

    def inflate(self, data: bytes, *, expected: int | None = None) -> bytes:
        """Decompress a zlib or gzip stream to its end, to ``expected`` bytes where that is known."""
        limit = self._left if expected is None else min(self._left, expected)
        decoder = zlib.decompressobj(zlib.MAX_WBITS | 32)
        result = decoder.decompress(data, limit + 1)
        if len(result) > self._left:
            message = (
                f"compressed data grows beyond {self._limit} bytes, far more than a mesh of this file size; "
                "if the file is sound, decompress it first"
            )
            raise FileFormatError(message)
        if expected is not None and len(result) != expected:
            message = (
                f"compressed data has {_size(result, expected)} bytes where the header claims {expected}"
            )
            raise FileFormatError(message)
        if not decoder.eof and (expected is None or decoder.unconsumed_tail == b""):
            raise FileFormatError("compressed data ends early: the file is truncated")
        self._left -= len(result)
        return result


def _size(result: bytes, expected: int) -> str:
    return f"more than {expected}" if len(result) > expected else str(len(result))


def file_bytes(path: Path) -> bytes:
    """Read a regular file whole; gzip is unpacked whatever the name says."""
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            message = f"{path}: this is a folder; name a file in it"
            raise FileFormatError(message)
        if not stat.S_ISREG(status.st_mode):
            message = f"{path}: not a regular file"
            raise FileFormatError(message)
        data = path.read_bytes()
    except FileNotFoundError as error:
        message = f"{path}: there is no such file"
        raise FileFormatError(message) from error
    except (OSError, ValueError) as error:  # ValueError: a null byte in the name
        if isinstance(error, FileFormatError):
            raise
        message = f"{path}: cannot be read: {error}"
        raise FileFormatError(message) from error
    if not data:
        message = f"{path}: the file is empty (0 bytes)"
        raise FileFormatError(message)
    if data[:2] != b"\x1f\x8b":
        return data
    try:
        unpacked = Inflater(len(data)).inflate(data)
    except (zlib.error, FileFormatError) as error:
        message = f"{path}: gzip: {error}"
        raise FileFormatError(message) from error
    if not unpacked:
        message = f"{path}: the file is empty (0 bytes) once unpacked"
        raise FileFormatError(message)
    return unpacked


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file beside its place and rename it into place, so that nobody sees half of it.

    A name that ends in ``.gz`` is compressed, with no time stamp: the same data give the same bytes.
    """
    if path.name.lower().endswith(".gz"):
        data = gzip.compress(data, mtime=0)
    draft = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        try:
            draft.write_bytes(data)
            os.replace(draft, path)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        message = f"{path}: cannot be written: {error}"
        raise InputError(message) from error
