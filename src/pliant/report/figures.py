"""Figures of surfaces and of distributions, drawn without a display.

Figures are plain :class:`matplotlib.figure.Figure` objects; nothing touches pyplot or its global state.
Save one with ``figure.savefig("name.png")`` (or .pdf, .svg).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import FloatArray, as_floats
from ..errors import InputError
from ..mesh import Mesh
from .colours import ColourMap, colour_table, colours_of, robust_limits
from .render import Axis, Direction, camera, interpolate, paint, rasterise

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_INK, _QUIET = "#1b1f24", "#5b6470"
_DPI = 200
_SERIES_COLOURS = ("#2a6f97", "#c8553d", "#588157", "#7a5195")
# Inches: space around the page, between views, above a row of views, under the title, for the colour bar.
_MARGIN, _GAP, _LABEL, _TITLE, _BAR = 0.30, 0.22, 0.30, 0.52, 0.95


@dataclass(frozen=True)
class _Panel:
    """A view and its place on the figure, in inches from the lower left corner."""

    label: str
    image: NDArray[np.uint8]
    left: float
    bottom: float
    label_level: float

    @property
    def size(self) -> tuple[float, float]:
        return self.image.shape[1] / _DPI, self.image.shape[0] / _DPI


@dataclass(frozen=True)
class _Palette:
    """How values become colours."""

    low: float
    high: float
    table: NDArray[np.uint8]
    scale: str

    def colours(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        if self.scale == "linear":
            return colours_of(values, self.low, self.high, self.table)
        with np.errstate(invalid="ignore"):
            positive = np.maximum(values, np.float32(self.low))
        return colours_of(np.log(positive), np.log(self.low), np.log(self.high), self.table)


def hemisphere_views(hemisphere: str) -> dict[str, Direction]:
    """Return the four standard views of a cortical hemisphere in RAS coordinates, by name.

    Parameters
    ----------
    hemisphere : {"left", "right"}
        Which half of the brain.

    Returns
    -------
    dict
        Name of the view -> side of the mesh, as :func:`surface_figure` takes it.

    Raises
    ------
    InputError
        If it is neither half.

    Examples
    --------
    >>> hemisphere_views("right")["medial"]
    'left'
    """
    if hemisphere == "left":
        return {"lateral": "left", "medial": "right", "dorsal": "top", "ventral": "bottom"}
    if hemisphere == "right":
        return {"lateral": "right", "medial": "left", "dorsal": "top", "ventral": "bottom"}
    message = f"a hemisphere is 'left' or 'right', got {hemisphere!r}"
    raise InputError(message)


def surface_figure(
    mesh: Mesh,
    values: ArrayLike,
    *,
    views: Sequence[Direction] | Mapping[str, Direction] = ("left", "right", "top", "bottom"),
    up: Axis = "z",
    colour_map: ColourMap = "viridis",
    limits: tuple[float, float] | None = None,
    percentiles: tuple[float, float] = (2.0, 98.0),
    scale: Literal["linear", "log"] = "linear",
    title: str = "",
    colour_bar_label: str = "",
    length_unit: str = "",
    width: float = 10.0,
) -> Figure:
    """Draw a mesh coloured by one value a vertex, from several sides at one scale.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    values : (n,) array_like of float
        One value a vertex; NaN and infinities are drawn grey.
    views : sequence of directions, or mapping of label to direction
        Sides to draw: "left", "right", "front", "back", "top", "bottom"; four in a row. For a cortex, see
        :func:`hemisphere_views`.
    up : {"z", "y"}
        Which axis points up; see :func:`pliant.report.render.camera`.
    colour_map : str
        One of :data:`pliant.report.colours.COLOUR_MAPS`.
    limits : (float, float), optional
        Values of the first and last colour. Without them, percentiles of the values.
    percentiles : (float, float)
        Which, in percent. The colour bar states them.
    scale : {"linear", "log"}
        How values spread over the colours. "log" suits fields with a long tail; zeros get the first colour.
    title, colour_bar_label : str
        Text above, and under the colour bar (give the unit).
    length_unit : str
        The mesh's unit, written on the scale bar; "" where it is not known.
    width : float
        Of the figure, in inches.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the values do not fit the mesh, a name is not known, there is no view, limits do not ascend, or a
        logarithmic scale has nothing above 0.

    Notes
    -----
    150,000 vertices in four views take about a second. Shading only shows form: read values from the colours'
    hue against the bar, or from the array.

    Examples
    --------
    >>> tetrahedron = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ...                    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> figure = surface_figure(tetrahedron, [0, 1, 2, 3], views=["front"], width=3)
    >>> len(figure.axes)  # the view and the colour bar
    2
    """
    from matplotlib.figure import Figure

    field = as_floats(values, "values")
    named: dict[str, Direction] = {}
    named.update(views if isinstance(views, Mapping) else {view: view for view in views})
    if not named:
        raise InputError("views is empty: name at least one side to draw")
    shown = _limits(field, limits, percentiles, scale)
    top = _TITLE if title else 0.1
    paint_with = _Palette(*shown, colour_table(colour_map), scale)
    panels, panels_height = _panels(mesh, field, named, up, paint_with, width)
    figure = Figure(figsize=(width, top + panels_height + _BAR), dpi=_DPI, facecolor="white")
    for panel in panels:
        _draw_panel(figure, panel)
    if title:
        height = figure.get_figheight()
        figure.text(_MARGIN / width, 1 - 0.2 / height, title, size=13, weight="bold", color=_INK, va="top")
    note = "" if limits else f"colours span percentiles {percentiles[0]:g} to {percentiles[1]:g}"
    note += " of the values above 0" if note and scale == "log" else ""
    _draw_bar(figure, field, shown, colour_map, scale, colour_bar_label, note)
    _draw_scale(figure, panels[0], _pixel_of(mesh, named, up, width), length_unit)
    return figure


def histogram_figure(
    series: Mapping[str, ArrayLike],
    *,
    bins: int = 60,
    percentiles: tuple[float, float] = (0.0, 99.0),
    title: str = "",
    label: str = "",
    width: float = 6.5,
) -> Figure:
    """Draw the distribution of one or more per-vertex values over common bins.

    Parameters
    ----------
    series : mapping of name to array_like
        What to compare, at most four; NaN and infinities are left out.
    bins : int
        Number of equal bins over the range shown.
    percentiles : (float, float)
        Range shown, in percent of all values together; what lies outside is counted in the note.
    title, label : str
        Text above, and under the value axis (give the unit).
    width : float
        Of the figure, in inches.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there is no series, there are more than four, or `bins` is not positive.

    Examples
    --------
    >>> figure = histogram_figure({"a": [1, 2, 2, 3]}, bins=3, label="value (mm)")
    >>> figure.axes[0].get_ylabel()
    'share of vertices'
    """
    from matplotlib.figure import Figure

    if not 1 <= len(series) <= len(_SERIES_COLOURS) or bins < 1:
        message = f"need 1 to {len(_SERIES_COLOURS)} series and a bin or more, got {len(series)} and {bins}"
        raise InputError(message)
    fields = {name: as_floats(values, name).ravel() for name, values in series.items()}
    known = {name: field[np.isfinite(field)] for name, field in fields.items()}
    low, high = robust_limits(np.concatenate(list(known.values())), percentiles=percentiles)
    figure = Figure(figsize=(width, width * 0.6), dpi=_DPI, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    edges = np.linspace(low, high, bins + 1)
    outside = 0
    for colour, (name, field) in zip(_SERIES_COLOURS, known.items(), strict=False):
        inside = np.histogram(field, bins=edges)[0]
        outside += field.size - int(inside.sum())
        axes.stairs(inside / max(field.size, 1), edges, color=colour, linewidth=1.6, label=name)
        axes.stairs(inside / max(field.size, 1), edges, color=colour, alpha=0.15, fill=True)
    total = sum(field.size for field in known.values())
    note = f"{outside} of {total} values lie outside the range shown" if outside else ""
    _style_axes(axes, title, "\n".join(filter(None, (label, note))), "share of vertices")
    axes.set_xlim(low, high)
    axes.set_ylim(bottom=0)
    if len(known) > 1:
        axes.legend(frameon=False, fontsize=9, labelcolor=_INK)
    return figure


def _limits(
    field: FloatArray,
    limits: tuple[float, float] | None,
    percentiles: tuple[float, float],
    scale: str,
) -> tuple[float, float]:
    if scale not in ("linear", "log"):
        message = f"scale must be 'linear' or 'log', got {scale!r}"
        raise InputError(message)
    positive = field[np.isfinite(field) & (field > 0)]
    if scale == "log" and not positive.size:
        raise InputError("a logarithmic scale needs values above 0, and there are none")
    if limits is None:
        return robust_limits(field if scale == "linear" else positive, percentiles=percentiles)
    if not limits[0] < limits[1] or (scale == "log" and limits[0] <= 0):
        message = f"limits must ascend, from above 0 on a logarithmic scale; got {limits}"
        raise InputError(message)
    return limits


def _extents(mesh: Mesh, named: Mapping[str, Direction], up: Axis) -> list[FloatArray]:
    """Width and height of the mesh in each view, in its unit."""
    return [np.ptp(mesh.vertices @ camera(view, up=up)[:2].T, axis=0) for view in named.values()]


def _rows(extents: list[FloatArray]) -> list[list[FloatArray]]:
    return [extents[start : start + 4] for start in range(0, len(extents), 4)]


def _pixel_of(mesh: Mesh, named: Mapping[str, Direction], up: Axis, width: float) -> float:
    """Side of a pixel, in the mesh's unit, at which the widest row fills the figure and none is too tall."""
    pixels = []
    for row in _rows(_extents(mesh, named, up)):
        inches = width - 2 * _MARGIN - (len(row) - 1) * _GAP
        pixels.append(sum(extent[0] for extent in row) / (inches * _DPI - 10 * len(row)))
        pixels.append(max(extent[1] for extent in row) / (0.7 * width * _DPI))
    largest = float(max(pixels))
    return largest if largest > 0 else 1.0


def _panels(
    mesh: Mesh,
    field: FloatArray,
    named: Mapping[str, Direction],
    up: Axis,
    palette: _Palette,
    width: float,
) -> tuple[list[_Panel], float]:
    """Draw each view and place the views in centred rows; also the height they take, in inches."""
    pixel = _pixel_of(mesh, named, up, width)
    images = []
    for view in named.values():
        raster = rasterise(mesh, camera(view, up=up), pixel=pixel)
        images.append(paint(raster, palette.colours(interpolate(raster, mesh, field))))
    labels = list(named)
    rows = [list(range(start, min(start + 4, len(images)))) for start in range(0, len(images), 4)]
    heights = [max(images[i].shape[0] for i in row) / _DPI for row in rows]
    total = sum(heights) + _LABEL * len(rows)
    panels, bottom = [], _BAR + total
    for row, height in zip(rows, heights, strict=True):
        bottom -= height + _LABEL
        taken = sum(images[i].shape[1] / _DPI for i in row) + _GAP * (len(row) - 1)
        left = (width - taken) / 2
        for i in row:
            offset = (height - images[i].shape[0] / _DPI) / 2
            panels.append(_Panel(labels[i], images[i], left, bottom + offset, bottom + height + 0.06))
            left += images[i].shape[1] / _DPI + _GAP
    return panels, total


def _draw_panel(figure: Figure, panel: _Panel) -> None:
    width, height = figure.get_size_inches()
    across, tall = panel.size
    axes = figure.add_axes((panel.left / width, panel.bottom / height, across / width, tall / height))
    axes.imshow(panel.image, interpolation="antialiased", aspect="auto")
    axes.set_axis_off()
    middle = (panel.left + across / 2) / width
    figure.text(middle, panel.label_level / height, panel.label, size=9.5, color=_QUIET, ha="center")


def _draw_bar(
    figure: Figure,
    field: FloatArray,
    shown: tuple[float, float],
    colour_map: str,
    scale: str,
    label: str,
    note: str,
) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.ticker import MaxNLocator, ScalarFormatter

    width, height = figure.get_size_inches()
    across = min(3.6, width - 2 * _MARGIN)
    box = ((width - across) / 2 / width, 0.62 / height, across / width, 0.13 / height)
    known = field[np.isfinite(field)]
    below, above = bool((known < shown[0]).any()), bool((known > shown[1]).any())
    ends = ("both" if above else "min") if below else ("max" if above else "neither")
    mappable = ScalarMappable(LogNorm(*shown) if scale == "log" else Normalize(*shown), colour_map)
    axes = figure.add_axes(box)
    bar = figure.colorbar(mappable, cax=axes, orientation="horizontal", extend=ends)
    if scale == "linear":
        bar.locator, bar.formatter = MaxNLocator(5), ScalarFormatter(useMathText=True)
        bar.formatter.set_powerlimits((-2, 4))
        bar.update_ticks()
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=8.5, color=_QUIET, labelcolor=_INK, length=3)
    bar.ax.xaxis.get_offset_text().set_fontsize(8.5)
    bar.set_label(label, fontsize=9.5, color=_INK, labelpad=3)
    missing = field.size - known.size
    grey = f"grey: no value ({missing} vertices)" if missing else ""
    text = "; ".join(filter(None, (note, grey)))
    figure.text(0.5, 0.07 / height, text, size=8, color=_QUIET, ha="center")


def _draw_scale(figure: Figure, panel: _Panel, pixel: float, unit: str) -> None:
    """Draw a line of a round length, at the scale of all views."""
    width, height = figure.get_size_inches()
    length = _round_length(0.3 * panel.size[0] * _DPI * pixel)
    across = length / pixel / _DPI
    from matplotlib.lines import Line2D

    left, level = _MARGIN, 0.68
    ends = [left / width, (left + across) / width]
    figure.add_artist(Line2D(ends, [level / height] * 2, color=_INK, linewidth=1.6, solid_capstyle="butt"))
    figure.text(
        ends[0], (level - 0.07) / height, f"{length:g} {unit or 'units'}", size=8.5, color=_INK, va="top"
    )


def _round_length(length: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not longer."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(step for step in (1, 2, 5) if step * power <= length))


def _style_axes(axes: Any, title: str, x_label: str, y_label: str) -> None:
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(_QUIET)
    axes.tick_params(labelsize=9, color=_QUIET, labelcolor=_INK)
    axes.set_title(title, fontsize=12, weight="bold", color=_INK, loc="left")
    axes.set_xlabel(x_label, fontsize=10, color=_INK)
    axes.set_ylabel(y_label, fontsize=10, color=_INK)
    axes.ticklabel_format(axis="x", scilimits=(-3, 4), useMathText=True)
