"""The values that an index takes and gives, and the checks of what it is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from .._arrays import IntArray, frozen
from ..errors import InputError, first_indices
from .bits import Codes


class Encoder(Protocol):
    """What turns pictures into codes: a :class:`RetrievalModel`, or anything else with these three."""

    @property
    def bits(self) -> int:
        """Length of a code, a multiple of 8."""

    def encode(self, pictures: Sequence[Any]) -> Codes:
        """Return the (m, bits / 8) packed codes of pictures; bit j of a code is bit j % 8 of byte j // 8."""

    def save(self, folder: str | Path) -> Any:
        """Write the model to a folder."""


@dataclass(frozen=True)
class Item:
    """One entry of an index.

    Attributes
    ----------
    id : int
        Never given to another item, not even after this one is removed.
    name : str
    label : str
        Its class; empty where it has none.
    """

    id: int
    name: str
    label: str


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The nearest items of each query.

    Attributes
    ----------
    distances : (q, k) array of int
        Hamming distances, ascending along each row.
    ids : (q, k) array of int
        Among equal distances the lower id comes first. -1, with distance ``bits + 1``, where inverted lists found
        fewer than k.
    """

    distances: IntArray
    ids: IntArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "distances", frozen(self.distances))
        object.__setattr__(self, "ids", frozen(self.ids))


def checked_bits(bits: int | None, model: Encoder | None) -> int:
    """Return the number of bits of an index, given as such or by its model."""
    if bits is None and model is None:
        raise InputError("give the number of bits, or a model")
    value = model.bits if bits is None and model is not None else bits
    if not isinstance(value, int | np.integer) or value < 8 or value % 8:
        message = f"bits must be a positive multiple of 8, got {value}"
        raise InputError(message)
    if model is not None and model.bits != value:
        message = f"the model gives codes of {model.bits} bits, the index holds {value}"
        raise InputError(message)
    return int(value)


def checked_texts(texts: Sequence[str] | None, count: int, what: str) -> Sequence[str]:
    """Return one printable text a code."""
    if texts is None:
        return [""] * count
    wrong = [i for i, text in enumerate(texts) if not isinstance(text, str) or not text.isprintable()]
    if len(texts) != count or wrong:
        why = f"{len(wrong)} are not printable text, {first_indices(wrong)}" if wrong else f"got {len(texts)}"
        message = f"{what} must be one text a code, {count} in all: {why}"
        raise InputError(message)
    return texts
