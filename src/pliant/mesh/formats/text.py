"""Numbers written as text, and claims checked against what is there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..._arrays import FloatArray, IntArray
from ...errors import FileFormatError


def floats(tokens: Sequence[bytes]) -> FloatArray:
    """Parse tokens as float64; anything but a plain number is refused."""
    _no_underscores(tokens)
    try:
        return np.fromiter(map(float, tokens), dtype=np.float64, count=len(tokens))
    except ValueError as error:
        message = f"not a number: {error}"
        raise FileFormatError(message) from error


def integers(tokens: Sequence[bytes]) -> IntArray:
    """Parse tokens as int64; anything but a plain whole number is refused."""
    _no_underscores(tokens)
    try:
        return np.fromiter(map(int, tokens), dtype=np.int64, count=len(tokens))
    except (ValueError, OverflowError) as error:
        message = f"not a whole number that fits 64 bits: {error}"
        raise FileFormatError(message) from error


def _no_underscores(tokens: Sequence[bytes]) -> None:
    # Python reads 1_0 as 10; no mesh format does.
    if b"_" in b"".join(tokens):
        raise FileFormatError("not a number: an underscore inside a number")


def claimed(what: str, count: int, least_bytes: int, available: int) -> None:
    """Refuse a header's claim that the rest of the file cannot hold, before anything is allocated."""
    if count < 0:
        message = f"the header claims {count} {what}"
        raise FileFormatError(message)
    if count * least_bytes > available:
        message = (
            f"the header claims {count} {what}, at least {count * least_bytes} bytes, but only {available} "
            "bytes are left: the file is truncated or its header is wrong"
        )
        raise FileFormatError(message)


def shown(data: bytes, limit: int = 40) -> str:
    """Write the start of some bytes for a message."""
    return repr(data[:limit].decode("latin-1")) + ("..." if len(data) > limit else "")
