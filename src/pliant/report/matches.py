"""Two pictures side by side with the parts that match: a figure, and a page that holds all it needs."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from html import escape
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arrays import FloatArray
from ..errors import require
from ..images import PairMatch, Picture
from ._frame import asset, embedded, setting_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["match_figure", "match_page"]

_FOUND, _TRUE, _INK, _QUIET = "#e4572e", "#2a9d5c", "#1b1f24", "#5b6470"
_HEIGHT, _GAP = 3.6, 0.25
_PAGE_SIDE = 900


def match_figure(
    picture1: Picture,
    picture2: Picture,
    match: PairMatch,
    *,
    truth: tuple[FloatArray, FloatArray] | None = None,
    most: int = 50,
    title: str = "",
) -> Figure:
    """Draw two pictures with the boxes found and the nearest correspondences.

    Parameters
    ----------
    picture1, picture2 : Picture
    match : PairMatch
    truth : pair of (4,) arrays, optional
        True boxes, drawn dashed.
    most : int
        Correspondences drawn, nearest first.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import ConnectionPatch

    pictures = (picture1, picture2)
    widths = [_HEIGHT * p.size[0] / p.size[1] for p in pictures]
    total, head = sum(widths) + 3 * _GAP, 0.5
    figure = Figure(figsize=(total, _HEIGHT + head + 0.55), dpi=150, facecolor="white")
    height = _HEIGHT + head + 0.55
    axes = []
    left = _GAP
    for k, (picture, width) in enumerate(zip(pictures, widths, strict=True)):
        axis = figure.add_axes((left / total, 0.45 / height, width / total, _HEIGHT / height))
        axis.imshow(picture.colour, extent=(-0.5, picture.size[0] - 0.5, picture.size[1] - 0.5, -0.5))
        axis.set_xticks([])
        axis.set_yticks([])
        for spine in axis.spines.values():
            spine.set_visible(False)
        _draw_box(axis, (match.box1, match.box2)[k], _FOUND, "-")
        if truth is not None:
            _draw_box(axis, truth[k], _TRUE, "--")
        axes.append(axis)
        left += width + _GAP
    for a, b in zip(match.points1[:most], match.points2[:most], strict=True):
        line = ConnectionPatch(
            a, b, "data", "data", axesA=axes[0], axesB=axes[1], color="#ffb703", lw=0.6, alpha=0.75
        )
        figure.add_artist(line)
    for axis, points in zip(axes, (match.points1[:most], match.points2[:most]), strict=True):
        axis.plot(points[:, 0], points[:, 1], "o", ms=2.2, mfc="#ffb703", mec=_INK, mew=0.3)
    figure.text(_GAP / total, 1 - 0.32 / height, title, size=11, color=_INK)
    figure.text(_GAP / total, 0.15 / height, _caption(match, most, truth is not None), size=8, color=_QUIET)
    return figure


def match_page(
    picture1: Picture,
    picture2: Picture,
    match: PairMatch,
    *,
    title: str,
    truth: tuple[FloatArray, FloatArray] | None = None,
    settings: Mapping[str, object] | None = None,
) -> str:
    """Write an interactive page of two pictures and their match, as HTML.

    Choose how many correspondences are drawn, point at one to see it alone, or carry the first picture over the
    second to see how they register.

    Parameters
    ----------
    picture1, picture2 : Picture
    match : PairMatch
    title : str
    truth : pair of (4,) arrays, optional
        True boxes, drawn dashed.
    settings : mapping, optional
        What made the match, written as a table under its own.

    Returns
    -------
    str
        A whole HTML document that loads nothing from anywhere. All text is escaped.

    Raises
    ------
    MissingExtraError
        Without Pillow: ``pip install 'pliant[images]'``.
    """
    pictures = (picture1, picture2)
    data = {
        "images": [_encoded(p) for p in pictures],
        "sizes": [list(p.size) for p in pictures],
        "boxes": [match.box1.tolist(), match.box2.tolist()],
        "truth": None if truth is None else [np.asarray(t).tolist() for t in truth],
        "points": np.hstack([match.points1, match.points2]).round(2).tolist(),
        "distances": match.distances.round(4).tolist(),
        "transform": None if match.transform is None else match.transform.tolist(),
    }
    rows = {
        "score (agreeing matches × correlation of edges)": f"{match.score:.3g}",
        "box in image 1": _box_text(match.box1),
        "box in image 2": _box_text(match.box2),
        **({"reason": match.reason} if match.reason else {}),
        **match.settings,
        **(settings or {}),
    }
    parts = {
        "title": escape(title),
        "css": asset("page.css"),
        "rows": setting_rows(rows),
        "count": str(len(match.points1)),
        "shown": str(min(50, len(match.points1))),
        "legend": "the part found" if truth is None else "the part found; dashed: the true box",
        "data": embedded(data),
        "script": asset("matches.js"),
    }
    return Template(asset("matches.html")).substitute(parts)


def _draw_box(axis: Any, box: FloatArray, colour: str, style: str) -> None:
    from matplotlib.patches import Rectangle

    x0, y0, x1, y1 = (float(v) - 0.5 for v in box)
    if x1 > x0 and y1 > y0:
        for width, line in ((3.0, "white"), (1.8, colour)):
            axis.add_patch(
                Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, ec=line, lw=width, ls=style, clip_on=False)
            )


def _caption(match: PairMatch, most: int, with_truth: bool) -> str:
    if match.reason:
        return f"score {match.score:g}: {match.reason}"
    count = min(most, len(match.points1))
    lines = f"{count} of {len(match.points1)} matches drawn, score {match.score:.3g}; box found: solid"
    return lines + (", true: dashed" if with_truth else "")


def _box_text(box: FloatArray) -> str:
    return ", ".join(f"{value:.1f}" for value in box) if np.any(box) else "none"


def _encoded(picture: Picture) -> str:
    pillow = require("PIL.Image", "images")
    image = pillow.fromarray(picture.colour)
    image.thumbnail((_PAGE_SIDE, _PAGE_SIDE))
    buffer = io.BytesIO()
    image.save(buffer, "JPEG", quality=88)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
