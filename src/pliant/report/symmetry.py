"""One self-contained page of a surface's symmetries: a button for each, its correspondences drawn, its numbers told."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from .._arrays import BoolArray, FloatArray, IntArray
from ..errors import InputError
from ..matching import farthest_points
from ..matching.symmetry import Symmetry, SymmetryResult
from ..mesh import Mesh
from ._frame import VIEWER, embedded, framed, scripts, setting_rows
from ._payload import SIDES, packed, surface_payload
from .page import checked_layers
from .render import Axis, Direction, camera

__all__ = ["correspondence_sources", "symmetry_camera", "symmetry_page"]

_COLUMNS = ("confidence", "support", "distortion", "residual", "reversed_area", "complexity")
# A mirror whose upright direction is shorter than this lies flat.
_FLAT = 0.3
_NOTES = (
    '<p class="notes">A point and its image have one colour, and lines join some of them. '
    "Grey parts are not carried anywhere.</p>"
)
_TOLD = (
    '<p class="hint" id="told" aria-live="polite">'
    "Click the surface, or give a number, to see where that point is carried.</p>"
)


def symmetry_page(
    mesh: Mesh,
    result: SymmetryResult,
    *,
    title: str,
    most: int = 40,
    up: Axis = "z",
    length_unit: str = "",
) -> str:
    """Write an interactive page of the symmetries of a surface, as HTML.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    result : SymmetryResult
        Its symmetries, one at least.
    title : str
        Heading and window title.
    most : int
        Correspondences drawn of each symmetry; on the page fewer can be chosen.
    up : {"z", "y"}
        Which axis points up.
    length_unit : str
        The mesh's unit.

    Returns
    -------
    str
        A whole HTML document that loads nothing from anywhere. All text is escaped.

    Raises
    ------
    InputError
        If there is no symmetry, or one is not of this mesh.

    Notes
    -----
    Each button shows one symmetry: points and images in one colour, lines between some of them. A vertex that is
    picked is marked together with its image. Size and time as for :func:`pliant.report.surface_page`, a layer and a
    map a symmetry.

    Examples
    --------
    >>> from pliant import detect_symmetries, shapes
    >>> figure = shapes.quadruped(1000)
    >>> html = symmetry_page(figure.mesh, detect_symmetries(figure.mesh), title="A quadruped", up="y")
    >>> html.count('class="symmetry')
    1
    """
    if not result.symmetries:
        raise InputError("there is no symmetry to show")
    result.check_mesh(mesh)
    names = symmetry_names(result)
    layers = {
        name: matching_colours(mesh, found) for name, found in zip(names, result.symmetries, strict=True)
    }
    ends = [correspondence_sources(mesh, found, most) for found in result.symmetries]
    data = surface_payload(mesh, checked_layers(mesh, layers), {}, np.array([0.0]), up, length_unit)
    data["maps"] = [packed((found.point_map + 1).astype(np.uint32)) for found in result.symmetries]
    data["ends"] = [some.tolist() for some in ends]
    data["cameras"] |= {
        name: symmetry_camera(mesh, found, up=up).tolist()
        for name, found in zip(names, result.symmetries, strict=True)
    }
    data["firsts"] = names
    table = {"vertices": mesh.n_vertices, "triangles": mesh.n_faces, **result.settings}
    parts = {
        "title": escape(title),
        "alt": escape(f"Interactive picture of {title}: {mesh.n_vertices} vertices, one colour a pair"),
        "notes": _NOTES,
        "overlay": '<svg id="links" aria-hidden="true"></svg>',
        "told": _TOLD,
        "buttons": "\n".join(
            _button(i, *row) for i, row in enumerate(zip(names, result.symmetries, strict=True))
        ),
        "most": str(max(len(some) for some in ends)),
        "last": str(mesh.n_vertices - 1),
        "rows": "\n".join(_row(name, found) for name, found in zip(names, result.symmetries, strict=True)),
        "reasons": "".join(f"<li>{escape(reason)}</li>" for reason in result.reasons),
        "unreasoned": "" if result.reasons else "hidden",
        "settings": setting_rows(table),
        "data": embedded(data),
        "scripts": scripts(*VIEWER, "common.js", "frame.js", "symmetry.js"),
    }
    return framed("symmetry.html", parts, style="symmetry.css")


def symmetry_names(result: SymmetryResult) -> list[str]:
    """Name each symmetry by its number, counted from 1 as everywhere, and its kind."""
    return [f"Symmetry {i} ({found.kind})" for i, found in enumerate(result.symmetries, start=1)]


def correspondence_sources(mesh: Mesh, symmetry: Symmetry, most: int = 40) -> IntArray:
    """Choose vertices of a symmetry's source to draw: far from one another, farthest moved first.

    Parameters
    ----------
    mesh : Mesh
    symmetry : Symmetry
    most : int
        How many at most. Where the whole surface is carried, a pair is drawn once.

    Returns
    -------
    (m,) array of int
        Vertices of the source.

    Examples
    --------
    >>> from pliant import detect_symmetries, shapes
    >>> figure = shapes.quadruped(1000)
    >>> found = detect_symmetries(figure.mesh).symmetries[0]
    >>> len(correspondence_sources(figure.mesh, found, 12))
    12
    """
    source = np.flatnonzero(symmetry.source)
    if symmetry.kind == "global":
        source = source[_one_side(mesh, symmetry)[source]]
    chosen = source[farthest_points(mesh.vertices[source], min(most, len(source)))]
    return np.asarray(chosen, dtype=np.int64)


def symmetry_camera(mesh: Mesh, symmetry: Symmetry, *, up: Axis = "z") -> FloatArray:
    """Choose from where points and their images are seen both.

    Of a global symmetry the viewer stands in the plane between the halves, as high as shows most of the surface, at
    most 60 degrees. Of a partial one it is the side from which the lines between points and images are longest.

    Parameters
    ----------
    mesh : Mesh
    symmetry : Symmetry
    up : {"z", "y"}
        Which axis points up.

    Returns
    -------
    (3, 3) array
        As :func:`pliant.report.render.camera` gives.

    Examples
    --------
    >>> from pliant import detect_symmetries, shapes
    >>> figure = shapes.quadruped(1000)
    >>> found = detect_symmetries(figure.mesh).symmetries[0]
    >>> right, _, towards = symmetry_camera(figure.mesh, found, up="y")  # its left side is at +x
    >>> bool(abs(right[0]) > 0.99 and abs(towards[0]) < 0.01)
    True
    """
    if symmetry.kind == "partial":
        ends = correspondence_sources(mesh, symmetry)
        return camera(_telling_side(mesh, ends, symmetry.point_map[ends], up), up=up)
    across = _main_direction(mesh, symmetry)
    front = camera("front", up=up)
    upright = front[1] - (front[1] @ across) * across
    if np.linalg.norm(upright) < _FLAT:  # one half lies on the other
        ahead = front[2] - (front[2] @ across) * across
        ahead /= np.linalg.norm(ahead)
        return _widest(mesh, [ahead, np.cross(across, ahead)], across)
    upright /= np.linalg.norm(upright)
    ahead = np.cross(across, upright)
    if ahead @ (front[2] + 0.5 * camera("left", up=up)[2]) < 0:
        ahead = -ahead
    angles = np.radians([0, 15, 30, 45, 60])
    return _widest(mesh, [np.cos(a) * ahead + np.sin(a) * upright for a in angles], upright)


def _widest(mesh: Mesh, directions: list[FloatArray], upright: FloatArray) -> FloatArray:
    """Return the camera, of those that look from these directions, to which the surface offers most area."""
    offered = [float(np.abs(mesh.face_normals @ to) @ mesh.face_areas) for to in directions]
    towards = directions[int(np.argmax(offered))]
    right = np.cross(upright, towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right), towards])


def _main_direction(mesh: Mesh, symmetry: Symmetry) -> FloatArray:
    """Return the unit vector along which a symmetry moves most."""
    moved = np.where(symmetry.source[:, None], mesh.vertices[symmetry.point_map] - mesh.vertices, 0.0)
    main: FloatArray = np.linalg.eigh(moved.T @ (mesh.vertex_areas[:, None] * moved))[1][:, -1]
    return main


def _one_side(mesh: Mesh, symmetry: Symmetry) -> BoolArray:
    """Say which vertices lie on one side of the surface that a reflection fixes, roughly: by the main way they move."""
    moved = mesh.vertices[symmetry.point_map] - mesh.vertices
    side: BoolArray = moved @ _main_direction(mesh, symmetry) > 0
    return side


def _telling_side(mesh: Mesh, sources: IntArray, images: IntArray, up: Axis) -> Direction:
    """Return the side from which correspondences are seen longest, one from above or below only if much longer."""
    moved = mesh.vertices[images] - mesh.vertices[sources]
    seen = {side: float(np.linalg.norm(moved @ camera(side, up=up)[:2].T, axis=1).sum()) for side in SIDES}
    for side in ("top", "bottom"):
        seen[side] *= 0.8
    return max(seen, key=lambda side: seen[side])


def matching_colours(mesh: Mesh, found: Symmetry) -> FloatArray:
    """Values that agree between points and their images: the longest direction of the source, carried over."""
    values = np.full(mesh.n_vertices, np.nan)
    source = np.flatnonzero(found.source)
    centred = mesh.vertices[source] - mesh.vertices[source].mean(axis=0)
    along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
    values[source] = along
    if found.kind == "global":
        both: FloatArray = (values + values[found.point_map]) / 2
        return both
    images = found.point_map[source]
    sums, counts = np.zeros(mesh.n_vertices), np.zeros(mesh.n_vertices)
    np.add.at(sums, images, along)
    np.add.at(counts, images, 1.0)
    hit = (counts > 0) & ~found.source
    values[hit] = sums[hit] / counts[hit]
    missed = np.flatnonzero(found.target & ~hit & ~found.source)
    if len(missed) and hit.any():
        known = np.flatnonzero(hit)
        nearest: Any = KDTree(mesh.vertices[known]).query(mesh.vertices[missed])[1]
        values[missed] = values[known[nearest]]
    return values


def _button(number: int, name: str, found: Symmetry) -> str:
    pressed = "true" if number == 0 else "false"
    return (
        f'<button type="button" class="symmetry" data-symmetry="{number}" aria-pressed="{pressed}">'
        f"<span>{escape(name)}</span><small>confidence {found.confidence:.2f}</small></button>"
    )


def _row(name: str, found: Symmetry) -> str:
    cells = "".join(f"<td>{getattr(found, column):.3f}</td>" for column in _COLUMNS)
    group, follows = (str(n + 1) if n >= 0 else "–" for n in (found.group, found.implied_by))
    return f'<tr><th scope="row">{escape(name)}</th><td>{group}</td><td>{follows}</td>{cells}</tr>'
