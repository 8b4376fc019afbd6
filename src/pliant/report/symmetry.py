"""One self-contained page of a surface's symmetries: a button for each, its correspondences drawn, its numbers told."""

from __future__ import annotations

import json
from html import escape
from string import Template
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from .._arrays import FloatArray, IntArray
from ..errors import InputError
from ..matching import farthest_points
from ..matching.symmetry import Symmetry, SymmetryResult
from ..mesh import Mesh
from ._payload import SIDES, packed, surface_payload
from .page import asset, checked_layers, version
from .render import Axis, camera

__all__ = ["correspondence_sources", "symmetry_page"]

_COLUMNS = ("confidence", "support", "distortion", "residual", "reversed_area", "complexity")


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
    for i, found in enumerate(result.symmetries):
        if len(found.point_map) != mesh.n_vertices:
            message = f"symmetry {i} has {len(found.point_map)} vertices, the mesh {mesh.n_vertices}"
            raise InputError(message)
    names = symmetry_names(result)
    layers = {
        name: _matching_colours(mesh, found) for name, found in zip(names, result.symmetries, strict=True)
    }
    ends = [correspondence_sources(mesh, found, most) for found in result.symmetries]
    data = surface_payload(mesh, checked_layers(mesh, layers), {}, np.array([0.0]), up, length_unit)
    data["maps"] = [packed((found.point_map + 1).astype(np.uint32)) for found in result.symmetries]
    data["ends"] = [some.tolist() for some in ends]
    data["firsts"] = [
        _telling_side(mesh, some, found.point_map[some], up)
        for some, found in zip(ends, result.symmetries, strict=True)
    ]
    table = {"vertices": mesh.n_vertices, "triangles": mesh.n_faces, **result.settings}
    parts = {
        "title": escape(title),
        "alt": escape(f"Interactive picture of {title}: {mesh.n_vertices} vertices, one colour a pair"),
        "sides": "\n".join(f'<button type="button" data-side="{s}">{s.capitalize()}</button>' for s in SIDES),
        "buttons": "\n".join(
            _button(i, *row) for i, row in enumerate(zip(names, result.symmetries, strict=True))
        ),
        "most": str(max(len(some) for some in ends)),
        "last": str(mesh.n_vertices - 1),
        "rows": "\n".join(_row(name, found) for name, found in zip(names, result.symmetries, strict=True)),
        "reasons": "".join(f"<li>{escape(reason)}</li>" for reason in result.reasons),
        "unreasoned": "" if result.reasons else "hidden",
        "settings": "\n".join(
            f'<tr><th scope="row">{escape(str(name))}</th><td>{escape(_shown(value))}</td></tr>'
            for name, value in table.items()
        ),
        # "<" in text could end the script element that carries the data.
        "data": json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        "version": version(),
        "css": asset("page.css"),
        "scripts": asset("viewer.js") + asset("common.js") + asset("symmetry.js"),
    }
    return Template(asset("symmetry.html")).substitute(parts)


def symmetry_names(result: SymmetryResult) -> list[str]:
    """Name each symmetry by its kind and number."""
    counts = {"global": 0, "partial": 0}
    names = []
    for found in result.symmetries:
        counts[found.kind] += 1
        names.append(f"{'Reflection' if found.kind == 'global' else 'Limbs'} {counts[found.kind]}")
    return names


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


def _one_side(mesh: Mesh, symmetry: Symmetry) -> FloatArray:
    """Say which vertices lie on one side of the surface that a reflection fixes, roughly: by the main way they move."""
    moved = mesh.vertices[symmetry.point_map] - mesh.vertices
    main = np.linalg.eigh(moved.T @ (mesh.vertex_areas[:, None] * moved))[1][:, -1]
    side: FloatArray = moved @ main > 0
    return side


def _telling_side(mesh: Mesh, sources: IntArray, images: IntArray, up: Axis) -> str:
    """Return the side from which correspondences are seen longest, one from above or below only if much longer."""
    moved = mesh.vertices[images] - mesh.vertices[sources]
    seen = {side: float(np.linalg.norm(moved @ camera(side, up=up)[:2].T, axis=1).sum()) for side in SIDES}
    for side in ("top", "bottom"):
        seen[side] *= 0.8
    return max(seen, key=lambda side: seen[side])


def _matching_colours(mesh: Mesh, found: Symmetry) -> FloatArray:
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


def _shown(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{str(name).replace('_', ' ')} {number}" for name, number in value.items())
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)
