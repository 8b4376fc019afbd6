"""One self-contained page for several surfaces and any per-vertex result: two panes, linked cameras, mirror images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from string import Template
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats, as_indices
from ..errors import InputError
from ..mesh import Mesh
from ._frame import VIEWER, asset, embedded, framed, scripts
from ._payload import packed, surface_payload
from .colours import COLOUR_MAPS
from .labels import LABEL_COLOURS, LabelNames, is_aha, label_values
from .page import checked_histograms, checked_layers
from .render import Axis

__all__ = ["ShownSurface", "comparison_page"]

SEGMENTS = 17


@dataclass(frozen=True, eq=False)
class ShownSurface:
    """A surface on a page, with what is known of its vertices.

    Parameters
    ----------
    name : str
        What it is called on the page.
    mesh : Mesh
        The surface; it must have faces.
    layers : mapping of name to (n,) array_like
        What colours can show. NaN is grey.
    histograms : mapping of name to (n, bins) array_like
        One histogram a vertex, drawn when the vertex is picked.
    maps : mapping of name to (n,) array_like of int
        Where each vertex goes under a map of the surface to itself, -1 where nowhere: symmetries to step through.
    segments : (n,) array_like of int, optional
        AHA segment of each vertex, 0 to 17: a bull's-eye is drawn beside the surface.
    label_names : mapping of layer name to mapping of int to str
        What the labels of a layer are called. Layers of whole numbers of few kinds are shown as labels.
    notes : sequence of str
        What to know before looking, written under the surface.
    cameras : mapping of name of a map to (3, 3) array_like
        From where a map is seen best, as :func:`pliant.report.render.camera` gives: the surface turns there when the
        map is stepped to. Stepping also shows the layer that has the name of the map, if there is one.
    """

    name: str
    mesh: Mesh
    layers: Mapping[str, ArrayLike]
    histograms: Mapping[str, ArrayLike] = field(default_factory=dict)
    maps: Mapping[str, ArrayLike] = field(default_factory=dict)
    segments: ArrayLike | None = None
    label_names: Mapping[str, LabelNames] = field(default_factory=dict)
    notes: Sequence[str] = ()
    cameras: Mapping[str, ArrayLike] = field(default_factory=dict)


def comparison_page(
    surfaces: Sequence[ShownSurface], *, title: str, up: Axis = "z", length_unit: str = ""
) -> str:
    """Write an interactive page of one or more surfaces, as HTML.

    Parameters
    ----------
    surfaces : sequence of ShownSurface
        The first two are shown side by side; others can be chosen.
    title : str
        Heading and window title.
    up : {"z", "y"}
        Which axis points up.
    length_unit : str
        The meshes' unit.

    Returns
    -------
    str
        A whole HTML document that loads nothing from anywhere.

    Raises
    ------
    InputError
        If there is no surface, two have one name, or an array does not fit its mesh.

    Notes
    -----
    Size and time as for :func:`pliant.report.surface_page`, once a surface. Surfaces are unpacked when they are chosen.
    Where two surfaces have equally many vertices, picking one marks the vertex of the same number in the other.

    Examples
    --------
    >>> from pliant import shapes
    >>> ball = shapes.icosphere(2)
    >>> shown = ShownSurface("ball", ball, {"height": ball.vertices[:, 2]})
    >>> "<title>A ball</title>" in comparison_page([shown], title="A ball")
    True
    """
    if not surfaces:
        raise InputError("there is nothing to show: give at least one surface")
    names = [surface.name for surface in surfaces]
    if len(set(names)) < len(names):
        message = f"surfaces must have different names, got {', '.join(names)}"
        raise InputError(message)
    shared = _shared_labels(surfaces)
    data = [
        _surface_data(surface, labels, up, length_unit)
        for surface, labels in zip(surfaces, shared, strict=True)
    ]
    maps = "\n".join(f'<option value="{name}">{name}</option>' for name in COLOUR_MAPS)
    parts = {
        "title": escape(title),
        "map_options": maps,
        "panes": "\n".join(_pane(i, names, min(i, len(names) - 1)) for i in range(min(2, len(names)))),
        "data": embedded(data),
        "scripts": scripts(*VIEWER, "common.js", "key.js", "bullseye.js", "comparison.js"),
    }
    return framed("comparison.html", parts, style="comparison.css")


def _shared_labels(surfaces: Sequence[ShownSurface]) -> list[dict[str, tuple[int, ...]]]:
    """Labels of each surface's layers, with those of surfaces that mean the same by a name: one label has one colour.

    Segments of the heart share with segments only: another surface's 1 is not "basal anterior".
    """
    own = [
        {name: found for name, values in surface.layers.items() if (found := label_values(values))}
        for surface in surfaces
    ]
    together: dict[tuple[str, bool], set[int]] = {}
    for layers in own:
        for name, found in layers.items():
            together.setdefault((name, is_aha(found)), set()).update(found)

    def shared(name: str, found: tuple[int, ...]) -> tuple[int, ...]:
        union = together[name, is_aha(found)]
        return tuple(sorted(union)) if len(union) <= len(LABEL_COLOURS) else found

    return [{name: shared(name, found) for name, found in layers.items()} for layers in own]


def _surface_data(
    surface: ShownSurface, labels: Mapping[str, tuple[int, ...]], up: Axis, unit: str
) -> dict[str, Any]:
    mesh = surface.mesh
    layers = checked_layers(mesh, surface.layers)
    # Histograms of several kinds may have different numbers of bins, each with edges of its own.
    charts: dict[str, FloatArray] = {}
    for name, values in surface.histograms.items():
        charts.update(checked_histograms(mesh, {name: values}, None)[0])
    payload = surface_payload(
        mesh, layers, charts, np.array([0.0]), up, unit, labels=labels, names=surface.label_names
    )
    maps = {
        name: _checked_vertices(values, mesh, f"map {name!r}", mesh.n_vertices - 1)
        for name, values in surface.maps.items()
    }
    segments = (
        None
        if surface.segments is None
        else _checked_vertices(surface.segments, mesh, "segments", SEGMENTS, least=0)
    )
    return {
        **payload,
        "title": surface.name,
        "notes": list(surface.notes),
        "count": mesh.n_vertices,
        "bins": [chart.shape[1] for chart in charts.values()],
        "maps": [
            {
                "name": name,
                "values": packed((values + 1).astype(np.uint32)),
                "camera": _checked_camera(surface, name),
            }
            for name, values in maps.items()
        ],
        "segments": None if segments is None else packed(segments.astype(np.uint8)),
    }


def _checked_vertices(values: ArrayLike, mesh: Mesh, name: str, most: int, *, least: int = -1) -> Any:
    numbers = as_indices(values, name)
    if numbers.shape != (mesh.n_vertices,):
        message = f"{name} must have one number a vertex, shape ({mesh.n_vertices},), got {numbers.shape}"
        raise InputError(message)
    outside = int(((numbers < least) | (numbers > most)).sum())
    if outside:
        message = f"{name} must lie in {least} to {most}; {outside} numbers do not"
        raise InputError(message)
    return numbers


def _checked_camera(surface: ShownSurface, name: str) -> list[list[float]] | None:
    if name not in surface.cameras:
        return None
    rows = as_floats(surface.cameras[name], f"camera of {name!r}")
    if rows.shape != (3, 3) or not np.allclose(rows @ rows.T, np.eye(3), atol=1e-6):
        message = f"the camera of map {name!r} must be three unit rows at right angles, shape (3, 3), got {rows.shape}"
        raise InputError(message)
    seen: list[list[float]] = rows.tolist()
    return seen


def _pane(index: int, names: Sequence[str], chosen: int) -> str:
    options = "".join(
        f'<option value="{i}"{" selected" if i == chosen else ""}>{escape(name)}</option>'
        for i, name in enumerate(names)
    )
    return Template(asset("comparison-pane.html")).substitute(
        index=index, number=("First", "Second")[index], options=options
    )
