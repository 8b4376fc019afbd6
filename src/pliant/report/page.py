"""One self-contained HTML file that shows a surface: turn it, pick a vertex, read its values.

The page holds its data and its own small WebGL viewer; it loads nothing from anywhere and opens from disk.
"""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats
from ..errors import InputError
from ..mesh import Mesh
from ..mesh.formats import write_atomically
from ._frame import VIEWER, embedded, framed, scripts, setting_rows
from ._frame import version as version
from ._payload import PERCENTILES, surface_payload
from .colours import COLOUR_MAPS, ColourMap, colour_table
from .labels import LabelNames, label_values
from .render import Axis

Histograms = Mapping[str, ArrayLike]
Scale = Literal["linear", "log"]
_SCALES = {"linear": "linear", "log": "logarithmic"}

_TOLD = """<p class="hint" id="nothing-picked">Click the surface, or give a number, to see the values there.</p>
<div id="picked" aria-live="polite" hidden>
<table><tbody id="readout"></tbody></table>
<div id="histograms"></div>
</div>"""


def surface_page(
    mesh: Mesh,
    layers: Mapping[str, ArrayLike],
    *,
    title: str,
    histograms: Histograms | None = None,
    edges: ArrayLike | None = None,
    notes: str = "",
    settings: Mapping[str, object] | None = None,
    colour_map: ColourMap = "viridis",
    up: Axis = "z",
    length_unit: str = "",
    label_names: Mapping[str, LabelNames] | None = None,
    scale: Scale = "linear",
) -> str:
    """Write an interactive page of a mesh and its per-vertex values, as HTML.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    layers : mapping of name to (n,) array_like
        What can be shown on it, the first at once. Names carry the unit, as in ``"GFE (per mm²)"``. NaN and
        infinities are grey. Whole numbers of few kinds are labels: a colour and a line of the legend each.
    title : str
        Heading and window title.
    histograms : mapping of name to (n, bins) array_like, optional
        One histogram a vertex under each name, drawn when the vertex is picked.
    edges : (bins + 1,) array_like, optional
        Edges of the bins, common to all histograms; the bins' numbers without them.
    notes : str
        A paragraph under the title.
    settings : mapping, optional
        What made the values: written as a table.
    colour_map : str
        The map to start with, one of :data:`pliant.report.colours.COLOUR_MAPS`.
    up : {"z", "y"}
        Which axis points up; see :func:`pliant.report.render.camera`.
    length_unit : str
        The mesh's unit.
    label_names : mapping of layer name to mapping of int to str, optional
        What labels are called; the 17 segments of the heart have their names without it.
    scale : {"linear", "log"}
        How values spread over the colours at first; linear for a layer that has no logarithms.

    Returns
    -------
    str
        A whole HTML document. All text is escaped; positions and values are kept in single precision.

    Raises
    ------
    InputError
        If there is no layer or no face, a layer, a histogram or the edges do not fit, or the scale is unknown.

    Notes
    -----
    About 4 MB and half a second for 150,000 vertices and one layer. Viewing needs WebGL 2 and a browser from
    2023 or later.

    Examples
    --------
    >>> triangle = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> html = surface_page(triangle, {"height (mm)": [0, 1, 2]}, title="A triangle")
    >>> html.startswith("<!doctype html>") and "<title>A triangle</title>" in html
    True
    """
    fields = checked_layers(mesh, layers)
    charts, bin_edges = checked_histograms(mesh, histograms or {}, edges)
    labels = {name: label_values(values) for name, values in layers.items()}
    data = surface_payload(mesh, fields, charts, bin_edges, up, length_unit, labels=labels, names=label_names)
    if colour_map not in COLOUR_MAPS:
        colour_table(colour_map)  # says which maps there are
    if scale not in _SCALES:
        message = f"scale must be one of {', '.join(_SCALES)}; got {scale!r}"
        raise InputError(message)
    table = {"vertices": mesh.n_vertices, "triangles": mesh.n_faces, **(settings or {})}
    parts = {
        "title": escape(title),
        "notes": f'<p class="notes">{escape(notes)}</p>' if notes else "",
        "alt": escape(f"Interactive picture of {title}: {mesh.n_vertices} vertices, coloured by a layer"),
        "layer_options": _lines(
            f'<option value="{i}">{escape(name)}</option>' for i, name in enumerate(fields)
        ),
        "map_options": _lines(_option(name, name, name == colour_map) for name in COLOUR_MAPS),
        "scale_options": "".join(_option(name, text, name == scale) for name, text in _SCALES.items()),
        "percentiles": f"{PERCENTILES[0]:g} and {PERCENTILES[1]:g}",
        "last": str(mesh.n_vertices - 1),
        "summaries": _lines(_summary_row(name, field) for name, field in fields.items()),
        "settings": setting_rows(table),
        "told": _TOLD,
        "data": embedded(data),
        "viewer": scripts(*VIEWER),
        "page": scripts("common.js", "key.js", "frame.js", "page.js"),
    }
    return framed("page.html", parts)


def write_page(path: str | Path, html: str) -> Path:
    """Write a page in UTF-8, all of it or nothing.

    Parameters
    ----------
    path : str or Path
        Where; the folder must exist.
    html : str
        From :func:`surface_page`.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    InputError
        If the file cannot be written.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> write_page(pathlib.Path(tempfile.mkdtemp()) / "page.html", "<!doctype html>").name
    'page.html'
    """
    target = Path(path)
    write_atomically(target, html.encode("utf-8"))
    return target


def checked_layers(mesh: Mesh, layers: Mapping[str, ArrayLike]) -> dict[str, FloatArray]:
    """Return the layers as arrays of one value a vertex, or say which does not fit."""
    if not layers:
        raise InputError("layers is empty: give at least one array of one value a vertex")
    if not mesh.n_faces:
        raise InputError("the mesh has no faces, so there is nothing to draw")
    fields = {}
    for name, values in layers.items():
        field = as_floats(values, f"layer {name!r}")
        if field.shape != (mesh.n_vertices,):
            message = (
                f"layer {name!r} must have one value a vertex, shape ({mesh.n_vertices},), got {field.shape}"
            )
            raise InputError(message)
        fields[name] = field
    return fields


def checked_histograms(
    mesh: Mesh, histograms: Histograms, edges: ArrayLike | None
) -> tuple[dict[str, FloatArray], FloatArray]:
    """Return the histograms as arrays of one shape with their edges, or say what does not fit."""
    charts = {name: as_floats(values, f"histogram {name!r}") for name, values in histograms.items()}
    shapes = {chart.shape for chart in charts.values()}
    if not charts:
        return {}, np.array([0.0])
    bins = next(iter(shapes))[-1] if all(len(shape) == 2 for shape in shapes) else 0
    if shapes != {(mesh.n_vertices, bins)} or not bins:
        message = f"histograms must all have shape ({mesh.n_vertices}, bins), got {sorted(shapes)}"
        raise InputError(message)
    bad = [name for name, chart in charts.items() if not np.isfinite(chart).all()]
    if bad:
        message = f"histograms must be finite; these are not: {', '.join(bad)}"
        raise InputError(message)
    bounds = np.arange(bins + 1.0) if edges is None else as_floats(edges, "edges")
    if bounds.shape != (bins + 1,) or not np.isfinite(bounds).all():
        message = f"edges must be {bins + 1} finite numbers for {bins} bins, got shape {bounds.shape}"
        raise InputError(message)
    return charts, bounds


def _summary_row(name: str, field: FloatArray) -> str:
    known = field[np.isfinite(field)]
    ranks = (0, PERCENTILES[0], 50, PERCENTILES[1], 100)
    values = (
        [_readable(float(value)) for value in np.percentile(known, ranks)]
        if known.size
        else ["–"] * len(ranks)
    )
    cells = "".join(f"<td>{text}</td>" for text in (*values, str(field.size - known.size)))
    return f'<tr><th scope="row">{escape(name)}</th>{cells}</tr>'


def _readable(value: float) -> str:
    """Write a number with four digits, and a raised power of ten where it is far from 1."""
    digits, _, power = f"{value:.4g}".replace("-", "−").partition("e")
    if not power:
        return digits
    raised = power.translate(str.maketrans("−0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+"))
    return (
        f"{digits} × 10{raised[:1]}{raised[1:].lstrip('⁰')}"
        if raised[0] == "⁻"
        else f"{digits} × 10{raised.lstrip('⁰')}"
    )


def _option(name: str, text: str, chosen: bool) -> str:
    return f'<option value="{name}"{" selected" if chosen else ""}>{text}</option>'


def _lines(parts: Any) -> str:
    return "\n".join(parts)
