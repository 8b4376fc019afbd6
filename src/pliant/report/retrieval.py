"""A query and what an index holds like it, as one figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..images import Picture
from ..retrieval import QueryResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["query_figure"]

_INK, _QUIET, _LINE, _ACCENT = "#1b1f24", "#5b6470", "#d9dee4", "#1f5f86"
_TILE, _WORDS, _GAP, _HEAD = 1.5, 0.46, 0.16, 0.5
_COLUMNS = 6


def query_figure(result: QueryResult, pictures: Sequence[Picture | None], *, title: str = "") -> Figure:
    """Draw a query and its matches, nearest first, with their classes and distances.

    Parameters
    ----------
    result : QueryResult
    pictures : sequence of Picture or None
        One a match; an empty frame stands for None.
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there is not one picture a match.
    """
    from matplotlib.figure import Figure

    if len(pictures) != len(result.matches):
        message = f"pictures must have one a match, got {len(pictures)} for {len(result.matches)}"
        raise InputError(message)
    rows = max(2, -(-len(pictures) // _COLUMNS))
    # The query takes the room of two by two matches.
    left = 2 * _TILE + 3 * _GAP
    columns = min(_COLUMNS, max(1, len(pictures)))
    width = left + columns * (_TILE + _GAP) + _GAP
    height = _HEAD + rows * (_TILE + _WORDS + _GAP)
    figure = Figure(figsize=(width, height), dpi=150, facecolor="white")

    def tile(x: float, y: float, side: float, picture: Picture | None, edge: str, anchor: str) -> None:
        axes = figure.add_axes((x / width, 1 - (y + side) / height, side / width, side / height))
        _show(axes, picture, edge, anchor)

    def words(x: float, y: float, text: str, colour: str, size: float) -> None:
        figure.text(x / width, 1 - y / height, text, color=colour, size=size, va="top", parse_math=False)

    words(_GAP, 0.14, title, _INK, 11)
    side = 2 * _TILE + _GAP
    tile(_GAP, _HEAD, side, result.picture, _ACCENT, "NW")
    told = f"most likely: {result.label}" if result.label else "the query"
    tall, wide = result.picture.grey.shape
    words(_GAP, _HEAD + side * min(1, tall / wide) + 0.1, told, _INK, 9)
    for k, (match, picture) in enumerate(zip(result.matches, pictures, strict=True)):
        x = left + (k % _COLUMNS) * (_TILE + _GAP)
        y = _HEAD + (k // _COLUMNS) * (_TILE + _WORDS + _GAP)
        tile(x, y, _TILE, picture, _LINE, "SW")
        words(x, y + _TILE + 0.06, _short(match.label or match.name or f"item {match.id}"), _INK, 8)
        words(x, y + _TILE + 0.23, f"{match.distance} of {result.bits} bits apart", _QUIET, 7)
    return figure


def _show(axes: Any, picture: Picture | None, edge: str, anchor: str) -> None:
    if picture is not None:
        axes.imshow(np.where(picture.mask[..., None], picture.colour, np.uint8(255)))
    axes.set_anchor(anchor)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_color(edge)


def _short(text: str, most: int = 24) -> str:
    return text if len(text) <= most else "…" + text[1 - most :]
