"""Figures of a left ventricle: the bull's-eye, the surface by segments, contours over the image."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from .._arrays import FloatArray, as_floats, as_indices
from ..errors import InputError
from ..heart.segments import TERRITORIES, VentricleFrame
from ..heart.volume import Volume
from ..mesh import Mesh
from .colours import ColourMap, colour_table, colours_of, robust_limits
from .render import paint, rasterise

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["bulls_eye_figure", "contour_figure", "segment_figure"]

_INK, _QUIET, _DPI = "#1b1f24", "#5b6470", 200
# A hue a territory; segments next to each other differ in lightness.
_HUES = {"LAD": (0.78, 0.28, 0.22), "LCX": (0.20, 0.55, 0.36), "RCA": (0.20, 0.42, 0.72)}
_LIGHTER = {
    1: 0.0,
    2: 0.3,
    7: 0.45,
    8: 0.15,
    13: 0.2,
    14: 0.5,
    17: 0.05,
    3: 0.0,
    4: 0.3,
    9: 0.45,
    10: 0.15,
    15: 0.3,
}
_LIGHTER |= {5: 0.0, 6: 0.3, 11: 0.45, 12: 0.15, 16: 0.3}
_CUT = (0.80, 0.80, 0.80)
# Rings of the bull's-eye: inner and outer radius, and each segment's first angle and width, anterior at the top.
_RINGS = ((0.75, 1.0, 1, 60.0, 60.0), (0.5, 0.75, 7, 60.0, 60.0), (0.25, 0.5, 13, 45.0, 90.0))
_HALF_FIELD = 62.0


def segment_colours() -> FloatArray:
    """(18, 3) red, green and blue of segments 0 to 17: one hue a territory, grey for the cut at the base."""
    colours = np.tile(np.array(_CUT), (18, 1))
    for name, segments in TERRITORIES.items():
        for s in segments:
            colours[s] = np.array(_HUES[name]) * (1 - _LIGHTER[s]) + _LIGHTER[s]
    return colours


def bulls_eye_figure(
    values: ArrayLike | None = None,
    *,
    title: str = "",
    label: str = "",
    limits: tuple[float, float] | None = None,
    colour_map: ColourMap = "viridis",
    width: float = 5.0,
) -> Figure:
    """Draw the seventeen segments as a bull's-eye: base outside, apex in the middle, anterior at the top.

    Parameters
    ----------
    values : (17,) array_like of float, optional
        One a segment, in the order 1 to 17; NaN is grey. Without values, the segments' numbers in the colours of
        their territories.
    title, label : str
        Heading, and what the colour bar shows, with its unit.
    limits : (float, float), optional
        Values of the first and the last colour; the range of the values by default.
    colour_map : str
        See :data:`pliant.report.colours.COLOUR_MAPS`.
    width : float
        In inches.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there are not seventeen values.

    Notes
    -----
    Thick lines part the territories of the LAD, the LCX and the RCA. The septum is to the left, as seen from the apex.

    References
    ----------
    Cerqueira et al., Circulation 105, 2002.

    Examples
    --------
    >>> bulls_eye_figure(np.arange(17.0), label="per cent").get_size_inches()[0].item()
    5.0
    """
    from matplotlib.figure import Figure

    numbers = None if values is None else as_floats(values, "values")
    if numbers is not None and numbers.shape != (17,):
        message = f"values must be one for each of 17 segments, got shape {numbers.shape}"
        raise InputError(message)
    figure = Figure(figsize=(width, width * (1.02 if numbers is None else 1.16)), dpi=_DPI, facecolor="white")
    height = figure.get_size_inches()[1]
    axes = figure.add_axes((0.06, 1 - 0.97 * width / height + 0.02, 0.88, 0.88 * width / height))
    colours = segment_colours()[1:]
    shown = (0.0, 1.0)
    if numbers is not None:
        shown = robust_limits(numbers, percentiles=(0, 100)) if limits is None else limits
        colours = colours_of(numbers, *shown, colour_table(colour_map)).astype(np.float64)
    _draw_rings(axes, colours, numbers)
    _draw_borders(axes)
    axes.set(xlim=(-1.16, 1.16), ylim=(-1.16, 1.16), aspect="equal")
    axes.set_axis_off()
    figure.text(0.5, 0.985, title, size=12, weight="bold", color=_INK, ha="center", va="top")
    if numbers is not None:
        _draw_scale(figure, shown, colour_map, label)
    return figure


def segment_figure(
    mesh: Mesh, labels: ArrayLike, frame: VentricleFrame, *, title: str = "", width: float = 10.0
) -> Figure:
    """Draw a ventricle's surface coloured by segment, from its four walls, base up.

    Parameters
    ----------
    mesh : Mesh
        The surface, in mm.
    labels : (n,) array_like of int
        Segment of each vertex, 0 to 17.
    frame : VentricleFrame
        Which way the walls look.
    title : str
        Heading.
    width : float
        In inches.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the labels do not fit the mesh.

    Examples
    --------
    >>> from pliant.heart import heart_phantom, ventricle_frame
    >>> phantom = heart_phantom(spacing=4.0, mesh_step=3.0, rng=1)
    >>> frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    >>> len(segment_figure(phantom.mesh, phantom.labels, frame).axes)
    4
    """
    from matplotlib.figure import Figure

    segments = as_indices(labels, "labels")
    if segments.shape != (mesh.n_vertices,) or segments.min() < 0 or segments.max() > 17:
        message = (
            f"labels must be one segment, 0 to 17, a vertex ({mesh.n_vertices}), got shape {segments.shape}"
        )
        raise InputError(message)
    septum, anterior, up = frame.axes.T
    views = {"anterior": anterior, "septal": septum, "inferior": -anterior, "lateral": -septum}
    # A pixel belongs to the triangle's first label; mixing colours would invent segments.
    table = segment_colours()[segments[mesh.faces[:, 0]]]
    pixel = 1.15 * frame.length / (0.3 * width * _DPI)
    body = 0.33 * width
    height = body + (0.045 * width if title else 0)
    figure = Figure(figsize=(width, height), dpi=_DPI, facecolor="white")
    for i, (name, towards) in enumerate(views.items()):
        raster = rasterise(mesh, np.array([np.cross(up, towards), up, towards]), pixel=pixel)
        colours = np.ones((*raster.face.shape, 3), dtype=np.float32)
        seen = raster.face >= 0
        colours[seen] = table[raster.face[seen]]
        axes = figure.add_axes((0.01 + 0.245 * i, 0.02, 0.235, 0.90 * body / height))
        axes.imshow(paint(raster, colours), interpolation="antialiased")
        axes.set_axis_off()
        figure.text(0.1275 + 0.245 * i, 0.945 * body / height, name, size=9.5, color=_QUIET, ha="center")
    figure.text(0.01, 0.985, title, size=12, weight="bold", color=_INK, va="top")
    return figure


def contour_figure(
    volume: Volume,
    mesh: Mesh,
    frame: VentricleFrame,
    *,
    window: tuple[float, float] | None = None,
    title: str = "",
    width: float = 10.0,
) -> Figure:
    """Draw the surface's outline over slices of the image, along the ventricle's own axes.

    Parameters
    ----------
    volume : Volume
        The image.
    mesh : Mesh
        The surface, in the image's RAS mm.
    frame : VentricleFrame
        Directions of the slices: three across the axis, two along it.
    window : (float, float), optional
        Values shown black and white; the image's 2nd and 99.5th percentile around the ventricle by default.
    title : str
        Heading.
    width : float
        In inches.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> from pliant.heart import heart_phantom, ventricle_frame
    >>> phantom = heart_phantom(spacing=4.0, mesh_step=3.0, rng=1)
    >>> frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    >>> len(contour_figure(phantom.volume, phantom.mesh, frame).axes)
    5
    """
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    septum, anterior, up = frame.axes.T
    middle = 0.5 * (frame.apex + frame.base)
    slices = {
        f"short axis, {name}": (frame.apex + at * frame.length * up, -septum, anterior)
        for name, at in (("basal", 5 / 6), ("mid", 1 / 2), ("apical", 1 / 5))
    }
    slices |= {"septal to lateral": (middle, -septum, up), "inferior to anterior": (middle, anterior, up)}
    images = [_slice(volume, *plane) for plane in slices.values()]
    low, high = np.nanpercentile(images, [2, 99.5]) if window is None else window
    shades = colormaps["gray"].with_extremes(bad="black")
    # Inches for the pictures and, where there is one, for the title; the rest is in shares of both.
    body = 0.215 * width
    height = body + (0.045 * width if title else 0)
    figure = Figure(figsize=(width, height), dpi=_DPI, facecolor="white")
    for i, (name, plane) in enumerate(slices.items()):
        axes = figure.add_axes((0.005 + 0.199 * i, 0.01, 0.194, 0.194 * width / height))
        extent = (-_HALF_FIELD, _HALF_FIELD, -_HALF_FIELD, _HALF_FIELD)
        axes.imshow(images[i], cmap=shades, vmin=low, vmax=high, origin="lower", extent=extent)
        axes.add_collection(LineCollection(list(_section(mesh, *plane)), colors="#ffb000", linewidths=1.0))
        axes.set(xlim=extent[:2], ylim=extent[2:])
        axes.set_axis_off()
        axes.plot([-_HALF_FIELD + 6, -_HALF_FIELD + 26], [-_HALF_FIELD + 6] * 2, color="white", lw=1.6)
        axes.text(-_HALF_FIELD + 6, -_HALF_FIELD + 9, "20 mm", color="white", size=6.5)
        figure.text(0.102 + 0.199 * i, 0.93 * body / height, name, size=9, color=_QUIET, ha="center")
    figure.text(0.01, 0.985, title, size=12, weight="bold", color=_INK, va="top")
    return figure


def _wedges() -> list[tuple[int, float, float, float, float]]:
    """(segment, inner, outer radius, first angle, width in degrees), counted from the right, anticlockwise."""
    rows = [
        (first + i, inner, outer, start + i * width, width)
        for inner, outer, first, start, width in _RINGS
        for i in range(round(360 / width))
    ]
    return [*rows, (17, 0.0, 0.25, 0.0, 360.0)]


def _draw_rings(axes: Any, colours: NDArray[np.floating], numbers: FloatArray | None) -> None:
    from matplotlib.patches import Wedge

    decimals = 0 if numbers is None else _decimals(numbers)
    for segment, inner, outer, start, width in _wedges():
        colour = colours[segment - 1]
        axes.add_patch(
            Wedge((0, 0), outer, start, start + width, width=outer - inner, fc=colour, ec="white", lw=0.8)
        )
        angle, radius = np.radians(start + width / 2), 0.5 * (inner + outer) * (segment < 17)
        at = radius * np.array([np.cos(angle), np.sin(angle)])
        ink = "white" if colour @ [0.299, 0.587, 0.114] < 0.55 else _INK
        if numbers is None:
            axes.text(*at, str(segment), size=11, color=ink, ha="center", va="center")
            continue
        value = numbers[segment - 1]
        text = f"{value:.{decimals}f}" if np.isfinite(value) else "–"
        if segment == 17:
            axes.text(*at, text, size=8.5, color=ink, ha="center", va="center")
            continue
        x, y = _between(at, inner, outer), at[1] - 0.005
        axes.text(x, y + 0.01, text, size=8.5, color=ink, ha="center", va="bottom")
        axes.text(x, y - 0.025, str(segment), size=6, color=ink, alpha=0.8, ha="center", va="top")


def _decimals(numbers: FloatArray) -> int:
    """Return how many decimals give the largest number three digits; none where all are whole."""
    known = np.abs(numbers[np.isfinite(numbers)])
    if not known.size or not known.max() > 0 or (known == np.round(known)).all():
        return 0
    return int(np.clip(2 - np.floor(np.log10(known.max())), 0, 6))


def _between(at: FloatArray, inner: float, outer: float) -> float:
    """Return where, beside a place in a ring, as much of the ring is to the left as to the right of a value."""
    if abs(at[0]) < 1e-9:
        return 0.0
    y = at[1] + 0.04
    ends = np.sqrt([outer**2 - y**2, max(inner**2 - y**2, 0.0)])
    return float(np.sign(at[0]) * ends.mean())


def _draw_borders(axes: Any) -> None:
    """Draw lines where the territory changes, and name the walls."""
    of = {s: name for name, segments in TERRITORIES.items() for s in segments}
    wedges = _wedges()
    for segment, inner, outer, start, width in wedges:
        for other, inner2, outer2, start2, width2 in wedges:
            if of[segment] == of[other]:
                continue
            if (inner, outer) == (inner2, outer2) and (start + width - start2) % 360 == 0:
                angle = np.radians(start + width)
                ends = np.array([inner, outer])
                axes.plot(ends * np.cos(angle), ends * np.sin(angle), color=_INK, lw=2)
            if inner == outer2:
                _draw_arc(axes, inner, (start, width), (start2, width2))
    for text, x, y, turn in (("anterior", 0, 1.07, 0), ("inferior", 0, -1.07, 0), ("septal", -1.07, 0, 90)):
        axes.text(x, y, text, size=9, color=_QUIET, ha="center", va="center", rotation=turn)
    axes.text(1.07, 0, "lateral", size=9, color=_QUIET, ha="center", va="center", rotation=270)
    for name, angle in (("LAD", 128), ("LCX", 32), ("RCA", 248)):
        x, y = 1.08 * np.cos(np.radians(angle)), 1.08 * np.sin(np.radians(angle))
        axes.text(x, y, name, size=9.5, weight="bold", color=_HUES[name], ha="center", va="center")


def _draw_arc(axes: Any, radius: float, one: tuple[float, float], two: tuple[float, float]) -> None:
    """Draw the part of a circle at which both sectors lie."""
    degrees = np.arange(0.0, 360.01, 0.5)
    shared = ((degrees - one[0]) % 360 <= one[1]) & ((degrees - two[0]) % 360 <= two[1])
    points = np.where(shared, radius, np.nan)
    axes.plot(points * np.cos(np.radians(degrees)), points * np.sin(np.radians(degrees)), color=_INK, lw=2)


def _draw_scale(figure: Any, shown: tuple[float, float], colour_map: str, label: str) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    axes = figure.add_axes((0.2, 0.085, 0.6, 0.022))
    bar = figure.colorbar(ScalarMappable(Normalize(*shown), colour_map), cax=axes, orientation="horizontal")
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=8, color=_QUIET, labelcolor=_INK, length=3)
    bar.set_label(label, fontsize=9, color=_INK, labelpad=2)


def _slice(volume: Volume, centre: FloatArray, right: FloatArray, up: FloatArray) -> FloatArray:
    steps = np.arange(-_HALF_FIELD, _HALF_FIELD + 0.25, 0.5)
    across, along = np.meshgrid(steps, steps)
    points = centre + across[..., None] * right + along[..., None] * up
    at = np.moveaxis(volume.indices(points), -1, 0)
    values: FloatArray = map_coordinates(
        np.asarray(volume.values, dtype=np.float64), at, order=1, cval=np.nan
    )
    return values


def _section(mesh: Mesh, centre: FloatArray, right: FloatArray, up: FloatArray) -> Sequence[FloatArray]:
    """(k, 2, 2) pieces of the line in which a plane cuts a mesh, in the plane's coordinates."""
    height = (mesh.vertices - centre) @ np.cross(right, up)
    height = np.where(height == 0, 1e-9, height)
    flat = (mesh.vertices - centre) @ np.column_stack([right, up])
    above = height[mesh.faces] > 0
    cut = mesh.faces[above.any(axis=1) & ~above.all(axis=1)]
    ends = []
    for i in range(3):
        a, b = cut[:, i], cut[:, (i + 1) % 3]
        share = height[a] / np.where(height[a] == height[b], 1.0, height[a] - height[b])
        crossing = flat[a] + share[:, None] * (flat[b] - flat[a])
        crossing[(height[a] > 0) == (height[b] > 0)] = np.nan
        ends.append(crossing)
    points = np.stack(ends, axis=1)
    known = points[np.isfinite(points[..., 0])].reshape(-1, 2, 2)
    return list(known)
