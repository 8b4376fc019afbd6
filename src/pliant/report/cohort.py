"""Figures of a cohort: the ranking of its sites, where they lie, and what the extreme ones look like."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from .._arrays import FloatArray, IntArray, vertex_indices
from ..errors import InputError
from ..mesh import Mesh
from .render import Direction, camera, interpolate, paint, rasterise

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..cortex import CohortResult, Variability

__all__ = ["extremes_figure", "ranking_figure", "sites_figure"]

_INK, _QUIET = "#1b1f24", "#5b6470"
# Regular and variable sites as the dissertation colours them, and all others.
_GREEN, _PINK, _OTHER = "#2e8b57", "#d6336c", "#4a5560"
_SURFACE = (0.86, 0.85, 0.83)
# Width of a picture of one view, in pixels, and dots' radius over half the usual distance between sites, at most.
_PIXELS, _DOT = 620, 0.6
_LARGEST = 0.02


def ranking_figure(found: CohortResult, ranking: Variability, *, label: str = "cumulative MAD") -> Figure:
    """Draw the sites' deviations in ascending order with their bootstrap intervals.

    Parameters
    ----------
    found : CohortResult
        For the sites' names.
    ranking : Variability
        Of :func:`pliant.cortex.variability`.
    label : str
        Of the deviation, with its unit.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> from pliant.cortex import CohortResult, variability
    >>> values = np.random.default_rng(0).random((6, 8, 3))
    >>> names = tuple("abcdefgh")
    >>> found = CohortResult((), (), names, values, np.arange(4.0), np.zeros((6, 8)), np.zeros((6, 8)))
    >>> ranking_figure(found, variability(values, rng=0, resamples=20)).axes[0].get_xlabel()
    'rank of the site'
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.8), dpi=150, layout="constrained", facecolor="white")
    axes = figure.add_subplot()
    order = np.argsort(ranking.mad)[: int(np.isfinite(ranking.mad).sum())]
    place = np.arange(1, len(order) + 1)
    axes.fill_between(place, ranking.low[order], ranking.high[order], color="#d5dde6", lw=0)
    axes.plot(place, ranking.mad[order], color="#2a6f97", lw=1.4)
    for sites, colour, kind in ((ranking.regular, _GREEN, "regular"), (ranking.variable, _PINK, "variable")):
        inside = np.isin(order, sites)
        names = ", ".join(found.sites[i] for i in sites[:4]) + (", …" if len(sites) > 4 else "")
        axes.scatter(place[inside], ranking.mad[order][inside], s=20, color=colour, zorder=3)
        if inside.any():
            _note(axes, place[inside], ranking.mad[order][inside], f"{kind}: {names}", colour)
    axes.set_xlim(0, len(order) + 1)
    axes.set_ylim(0, 1.12 * float(np.nanmax(ranking.high, initial=1e-12)))
    _style(axes, "rank of the site", label)
    axes.set_title("Deviation over subjects; the band is the interval over subjects", loc="left", fontsize=10)
    return figure


def extremes_figure(
    found: CohortResult, ranking: Variability, *, count: int = 3, label: str = "geodesic field"
) -> Figure:
    """Draw the histograms of the most regular and the most variable sites, one line a subject.

    Parameters
    ----------
    found : CohortResult
        With the histograms.
    ranking : Variability
        Says which sites.
    count : int
        Sites of each kind, at most.
    label : str
        Of the values that were counted.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If ``count`` is below 1.

    Examples
    --------
    >>> from pliant.cortex import CohortResult, variability
    >>> values = np.random.default_rng(0).random((6, 8, 3))
    >>> names = tuple("abcdefgh")
    >>> found = CohortResult((), (), names, values, np.arange(4.0), np.zeros((6, 8)), np.zeros((6, 8)))
    >>> len(extremes_figure(found, variability(values, rng=0, resamples=20)).axes)
    2
    """
    from matplotlib.figure import Figure

    if count < 1:
        message = f"count must be at least 1, got {count}"
        raise InputError(message)
    chosen = [(ranking.regular[:count], _GREEN, "regular"), (ranking.variable[:count], _PINK, "variable")]
    columns = max(len(sites) for sites, _, _ in chosen)
    figure = Figure(figsize=(2.6 * columns + 0.4, 4.6), dpi=150, layout="constrained", facecolor="white")
    panels = figure.subplots(2, columns, squeeze=False, sharex=True, sharey=True)
    for row, (sites, colour, kind) in zip(panels, chosen, strict=True):
        for axes, site in zip(row, sites, strict=False):
            for histogram in found.histograms[:, site]:
                axes.stairs(histogram, found.edges, color=colour, alpha=0.3, lw=0.8)
            mean = np.nanmean(found.histograms[:, site], axis=0)
            axes.stairs(mean, found.edges, color=_INK, lw=1.6)
            axes.set_title(
                f"{kind}: {found.sites[site]}", fontsize=9, color=colour, loc="left", weight="bold"
            )
            _style(axes, label if kind == "variable" else "", "share" if axes is row[0] else "")
        for axes in row[len(sites) :]:
            axes.set_axis_off()
    panels[0][0].set_ylim(0, None)
    return figure


def sites_figure(
    mesh: Mesh,
    vertices: ArrayLike,
    ranking: Variability,
    *,
    views: tuple[Direction, ...] = ("left", "right", "top", "bottom"),
    title: str = "",
) -> Figure:
    """Draw where the sites lie on one subject's surface: regular ones green, variable ones pink.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    vertices : (sites,) array_like of int
        Vertex of each site; -1 where this surface lacks it.
    ranking : Variability
        Says which sites are extreme.
    views : tuple of directions
        Sides to draw.
    title : str
        Text above.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If a vertex is out of range or no site is on the surface.

    Examples
    --------
    >>> from pliant import shapes
    >>> from pliant.cortex import variability
    >>> ranking = variability(np.random.default_rng(0).random((6, 8, 3)), rng=0, resamples=20)
    >>> figure = sites_figure(shapes.icosphere(2), np.arange(8), ranking, views=("left",))
    >>> len(figure.axes)
    1
    """
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    vertices = np.asarray(vertices)
    known = np.flatnonzero(vertices >= 0)
    if not known.size:
        raise InputError("none of the sites is on this surface")
    places = mesh.vertices[vertex_indices(vertices[known], mesh.n_vertices, "vertices")]
    kinds = np.isin(known, ranking.regular) + 2 * np.isin(known, ranking.variable)
    size = float(np.ptp(mesh.vertices, axis=0).max())
    radius = min(0.5 * _DOT * np.sqrt(mesh.area / len(places)), _LARGEST * size)
    images = [_view(mesh, camera(view), size / _PIXELS, (places, kinds, radius)) for view in views]
    columns = min(2, len(images))
    rows = -(-len(images) // columns)
    figure = Figure(figsize=(7.2, 0.6 + 2.7 * rows), dpi=150, layout="constrained", facecolor="white")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, image, view in zip(panels, images, views, strict=False):
        axes.imshow(image, interpolation="antialiased")
        axes.set_title(view, fontsize=9, color=_QUIET)
    for axes in panels:
        axes.set_axis_off()
    names = [("regular", _GREEN), ("variable", _PINK), ("other sites", _OTHER)]
    handles = [Line2D([], [], marker="o", ls="", ms=6, color=colour, label=name) for name, colour in names]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    if title:
        figure.suptitle(title, fontsize=11, weight="bold", color=_INK)
    return figure


def _view(mesh: Mesh, rotation: FloatArray, pixel: float, dots: tuple[FloatArray, IntArray, float]) -> Any:
    from matplotlib.colors import to_rgb

    places, kinds, radius = dots
    raster = rasterise(mesh, rotation, pixel=pixel)
    colours = np.broadcast_to(np.array(_SURFACE, dtype=np.float32), (*raster.face.shape, 3)).copy()
    seen = raster.face >= 0
    points = np.stack([interpolate(raster, mesh, axis)[seen] for axis in mesh.vertices.T], axis=1)
    # A dot is a ball around its site: round, and the same size whatever the triangles.
    away, nearest = cKDTree(places).query(points, distance_upper_bound=radius)
    inside = np.isfinite(away)
    kind = kinds[np.asarray(nearest)[inside]]
    shown = colours[seen]
    shown[inside] = np.array([to_rgb(c) for c in (_OTHER, _GREEN, _PINK)])[kind]
    colours[seen] = shown
    return paint(raster, colours)


def _note(axes: Any, x: IntArray, y: FloatArray, text: str, colour: str) -> None:
    low = x.mean() < np.mean(axes.get_xlim()) if axes.get_xlim()[1] > 1 else True
    axes.annotate(
        text,
        (x.min() if low else x.max(), y.max()),
        xytext=(2, 14) if low else (-2, 14),
        textcoords="offset points",
        ha="left" if low else "right",
        color=colour,
        fontsize=8.5,
    )


def _style(axes: Any, x_label: str, y_label: str) -> None:
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(_QUIET)
    axes.tick_params(labelsize=8, color=_QUIET, labelcolor=_INK)
    axes.set_xlabel(x_label, fontsize=9, color=_INK)
    axes.set_ylabel(y_label, fontsize=9, color=_INK)
