"""Two surfaces side by side, with lines between the points that correspond."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats, vertex_indices
from ..errors import InputError
from ..mesh import Mesh
from .render import Axis, Direction, camera, paint, rasterise

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["correspondence_figure"]

_HEIGHT_PIXELS = 700
_GREY = 0.83


def correspondence_figure(
    mesh_a: Mesh,
    mesh_b: Mesh,
    points_a: ArrayLike,
    points_b: ArrayLike,
    *,
    view: Direction | ArrayLike = "left",
    up: Axis = "z",
    title: str = "",
    most: int = 60,
) -> Figure:
    """Draw two surfaces and lines between corresponding points, in colours that follow the first surface.

    Parameters
    ----------
    mesh_a, mesh_b : Mesh
        The surfaces; each is scaled to the same height.
    points_a, points_b : (p,) array_like of int
        Vertices of a and of b that correspond, pair by pair.
    view : {"left", "right", "front", "back", "top", "bottom"}
        The side that faces the viewer; or a camera of one's own, (3, 3), with the image's right, its up and the
        direction towards the viewer as rows.
    up : {"z", "y"}
        Which axis points up; see :func:`pliant.report.render.camera`.
    title : str
        Text above.
    most : int
        Draw the first so many pairs; the title says how many there are.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the two lists differ in length or name vertices that are not there.

    Examples
    --------
    >>> from pliant import shapes
    >>> figure = correspondence_figure(shapes.icosphere(2), shapes.icosphere(2), [0, 5], [0, 5])
    >>> len(figure.axes)
    1
    """
    from matplotlib.figure import Figure

    ends_a = vertex_indices(points_a, mesh_a.n_vertices, "points_a")
    ends_b = vertex_indices(points_b, mesh_b.n_vertices, "points_b")
    if len(ends_a) != len(ends_b):
        message = f"points_a has {len(ends_a)} vertices and points_b {len(ends_b)}; they must pair up"
        raise InputError(message)
    rotation = camera(cast("Direction", view), up=up) if isinstance(view, str) else as_floats(view, "view")
    if rotation.shape != (3, 3) or not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6):
        message = f"view must be a side's name or a rotation, (3, 3), got shape {rotation.shape}"
        raise InputError(message)
    figure = Figure(figsize=(10, 5), dpi=200)
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.86))
    axes.set_axis_off()
    edge = 0.0
    spots: list[FloatArray] = []
    for mesh, ends in ((mesh_a, ends_a), (mesh_b, ends_b)):
        spot, edge = _draw_surface(axes, mesh, rotation, edge)
        spots.append(spot[ends[:most]])
    _draw_lines(axes, spots[0], spots[1])
    axes.set_xlim(0, edge)
    axes.set_ylim(0, 1)
    axes.set_aspect("equal")
    shown = f"{min(most, len(ends_a))} of {len(ends_a)} pairs"
    figure.text(0.03, 0.93, title, size=13, weight="bold", color="#1a1c23")
    figure.text(0.97, 0.93, shown, size=9, color="#5b6270", ha="right")
    return figure


def _draw_surface(axes: Axes, mesh: Mesh, rotation: FloatArray, left: float) -> tuple[FloatArray, float]:
    """Draw a surface one unit high from ``left`` on; return each vertex's place and where the surface ends."""
    flat = mesh.vertices @ rotation[:2].T
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    height = float(max(size[1], size[0] / 2))
    pixel = height / _HEIGHT_PIXELS
    raster = rasterise(mesh, rotation, pixel=pixel, margin=0)
    picture = paint(raster, np.full((*raster.face.shape, 3), _GREY))
    rows, columns = picture.shape[:2]
    base = (1 - size[1] / height) / 2
    span = (left, left + columns / _HEIGHT_PIXELS, base, base + rows / _HEIGHT_PIXELS)
    axes.imshow(picture, extent=span, origin="upper", interpolation="bilinear", zorder=1)
    return (flat - low) / height + [left, base], span[1] + 0.15


def _draw_lines(axes: Axes, a: FloatArray, b: FloatArray) -> None:
    from matplotlib import colormaps

    if not len(a):
        return
    rank = np.argsort(np.argsort(a[:, 0] + a[:, 1]))
    colours = colormaps["plasma"](0.05 + 0.85 * rank / max(len(a) - 1, 1))
    for start, stop, colour in zip(a, b, colours, strict=True):
        axes.plot(*np.transpose([start, stop]), color=colour, linewidth=0.7, alpha=0.8, zorder=2)
    for ends in (a, b):
        axes.scatter(ends[:, 0], ends[:, 1], s=12, c=colours, edgecolors="white", linewidths=0.4, zorder=3)
