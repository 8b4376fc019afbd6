"""Surfaces on a lattice of parameters: torus, cylinder, planar grid, quadric patch."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from ..._arrays import FloatArray, IntArray
from ...errors import InputError
from ..surface import Mesh
from ._checks import checked_count, checked_length, checked_number

__all__ = ["cylinder", "grid", "paraboloid", "torus"]

Diagonal = Literal["same", "alternating"]


def torus(major: float = 1.0, minor: float = 0.4, *, rings: int = 64, sides: int = 32) -> Mesh:
    """Torus around the z axis.

    Parameters
    ----------
    major, minor : float
        Radius of the central circle, and of the tube around it (the smaller of the two).
    rings, sides : int
        Vertices along the central circle and around the tube, 3 or more each.

    Returns
    -------
    Mesh
        Closed, wound outwards; ``rings * sides`` vertices, number ``ring * sides + side``.

    Raises
    ------
    InputError
        If an argument is out of range, or the tube is as thick as the ring.

    Examples
    --------
    >>> torus(2, 0.5, rings=40, sides=12)
    Mesh(480 vertices, 960 faces)
    """
    major, minor = checked_length(major, "major"), checked_length(minor, "minor")
    if minor >= major:
        message = f"minor ({minor:g}) must be smaller than major ({major:g}), or the torus meets itself"
        raise InputError(message)
    rings, sides = checked_count(rings, "rings", 3), checked_count(sides, "sides", 3)
    around, across = np.meshgrid(_turn(rings), _turn(sides), indexing="ij")
    radii = major + minor * np.cos(across)
    vertices = np.stack([radii * np.cos(around), radii * np.sin(around), minor * np.sin(across)], axis=-1)
    numbers = np.arange(rings * sides).reshape(rings, sides)
    wrapped = np.pad(numbers, ((0, 1), (0, 1)), mode="wrap")
    return Mesh(vertices.reshape(-1, 3), _split_quads(wrapped, "same"))


def cylinder(
    radius: float = 1.0,
    height: float = 2.0,
    *,
    sides: int = 48,
    rows: int | None = None,
    caps: bool = True,
) -> Mesh:
    """Cylinder around the z axis, from z = 0 to z = height.

    Parameters
    ----------
    radius, height : float
        In the unit of the mesh.
    sides : int
        Vertices around, 3 or more.
    rows : int, optional
        Circles of vertices along the height, 2 or more; by default as many as make the triangles even.
    caps : bool
        Close both ends with discs of even triangles. Without, the tube has two boundary loops.

    Returns
    -------
    Mesh
        Wound outwards. The first ``rows * sides`` vertices are the side, number ``row * sides + side``.

    Raises
    ------
    InputError
        If an argument is out of range.

    Examples
    --------
    >>> cylinder(1, 2, sides=12, rows=5, caps=False)
    Mesh(60 vertices, 96 faces)
    """
    radius, height = checked_length(radius, "radius"), checked_length(height, "height")
    sides = checked_count(sides, "sides", 3)
    even = max(2, 1 + round(height / (2 * np.pi * radius / sides)))
    rows = checked_count(even if rows is None else rows, "rows", 2)
    heights, around = np.meshgrid(np.linspace(0, height, rows), _turn(sides), indexing="ij")
    side = np.stack([radius * np.cos(around), radius * np.sin(around), heights], axis=-1).reshape(-1, 3)
    numbers = np.arange(rows * sides).reshape(rows, sides)
    faces = _split_quads(np.pad(numbers, ((0, 0), (0, 1)), mode="wrap"), "same")[:, ::-1]
    if not caps:
        return Mesh(side, faces)
    disc, disc_faces = _disc(sides)
    inner = radius * disc[sides:]
    bottom = np.column_stack([inner, np.zeros(len(inner))])
    top = np.column_stack([inner, np.full(len(inner), height)])
    low = np.r_[numbers[0], len(side) + np.arange(len(inner))]
    high = np.r_[numbers[-1], len(side) + len(inner) + np.arange(len(inner))]
    ends = [low[disc_faces[:, ::-1]], high[disc_faces]]
    return Mesh(np.vstack([side, bottom, top]), np.vstack([faces, *ends]))


def grid(rows: int, columns: int, *, spacing: float = 1.0, diagonal: Diagonal = "same") -> Mesh:
    """Flat rectangle of ``rows`` times ``columns`` vertices in the plane z = 0, its normal along +z.

    Parameters
    ----------
    rows, columns : int
        Vertices along y and along x, 2 or more each.
    spacing : float
        Distance between neighbours in a row or a column.
    diagonal : {"same", "alternating"}
        Cut all squares along the same diagonal, or like a chequerboard (the "Union Jack" pattern).

    Returns
    -------
    Mesh
        Vertex ``row * columns + column`` lies at ``(column * spacing, row * spacing, 0)``.

    Raises
    ------
    InputError
        If an argument is out of range.

    Examples
    --------
    >>> grid(3, 4, spacing=0.5)
    Mesh(12 vertices, 12 faces)
    """
    rows, columns = checked_count(rows, "rows", 2), checked_count(columns, "columns", 2)
    spacing = checked_length(spacing, "spacing")
    if diagonal not in get_args(Diagonal):
        message = f'diagonal must be "same" or "alternating", got {diagonal!r}'
        raise InputError(message)
    y, x = np.divmod(np.arange(rows * columns), columns)
    vertices = np.column_stack([x * spacing, y * spacing, np.zeros(rows * columns)])
    return Mesh(vertices, _split_quads(np.arange(rows * columns).reshape(rows, columns).T, diagonal))


def paraboloid(
    kappa1: float = 1.0, kappa2: float = -1.0, *, rows: int = 41, columns: int = 41, size: float = 1.0
) -> Mesh:
    """Square patch of the graph ``z = -(kappa1 x**2 + kappa2 y**2) / 2``; a saddle by default.

    At the origin the principal curvatures are ``kappa1`` (along x) and ``kappa2`` (along y), positive where
    the patch bends away from its normal, as on a sphere with outward normals.

    Parameters
    ----------
    kappa1, kappa2 : float
        Curvatures at the origin, in one over the unit of the mesh. Opposite signs give a saddle.
    rows, columns : int
        Vertices along y and along x, 2 or more each; odd numbers put a vertex at the origin.
    size : float
        Side of the square in the plane z = 0 over which the patch lies.

    Returns
    -------
    Mesh
        Vertex ``row * columns + column``, as :func:`grid`.

    Raises
    ------
    InputError
        If an argument is out of range.

    Examples
    --------
    >>> patch = paraboloid(1, -1, rows=5, columns=5)
    >>> patch.vertices[12].tolist()
    [0.0, 0.0, 0.0]
    """
    kappa1, kappa2 = checked_number(kappa1, "kappa1"), checked_number(kappa2, "kappa2")
    size = checked_length(size, "size")
    flat = grid(rows, columns, diagonal="alternating")
    x, y = ((flat.vertices[:, axis] / flat.vertices[:, axis].max() - 0.5) * size for axis in (0, 1))
    return Mesh(np.column_stack([x, y, 0.0 - (kappa1 * x**2 + kappa2 * y**2) / 2]), flat.faces)


def _turn(count: int) -> FloatArray:
    return np.linspace(0, 2 * np.pi, count, endpoint=False)


def _split_quads(numbers: IntArray, diagonal: Diagonal) -> IntArray:
    """Cut the squares of a (p, q) lattice of numbers in two, wound from the first axis to the second."""
    a, b, c, d = numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]
    falling = np.stack([a, b, c, a, c, d], axis=-1)
    if diagonal == "alternating":
        rising = np.stack([a, b, d, b, c, d], axis=-1)
        odd = np.add.outer(np.arange(a.shape[0]), np.arange(a.shape[1])) % 2 == 1
        falling = np.where(odd[..., None], rising, falling)
    return falling.reshape(-1, 3)


def _disc(sides: int) -> tuple[FloatArray, IntArray]:
    """Mesh the unit disc counter-clockwise in rings of ever fewer vertices, ``sides`` on the first."""
    n_rings = max(1, round(sides / (2 * np.pi)))
    counts = [max(3, round(sides * (n_rings - ring) / n_rings)) for ring in range(n_rings)]
    radii = 1 - np.arange(n_rings) / n_rings
    # Turned by half a step from ring to ring, so that no vertex sits behind another.
    angles = [_turn(count) + (ring % 2) * np.pi / count for ring, count in enumerate(counts)]
    angles[0] = _turn(sides)
    starts = np.cumsum([0, *counts])
    points = [r * np.column_stack([np.cos(t), np.sin(t)]) for r, t in zip(radii, angles, strict=True)]
    faces = [_zip_rings(angles[i], angles[i + 1], starts[i], starts[i + 1]) for i in range(n_rings - 1)]
    last = np.arange(counts[-1])
    centre = np.full(counts[-1], starts[-1])
    faces.append(np.column_stack([starts[-2] + last, starts[-2] + (last + 1) % counts[-1], centre]))
    return np.vstack([*points, np.zeros((1, 2))]), np.vstack(faces)


def _zip_rings(outer: FloatArray, inner: FloatArray, outer_start: int, inner_start: int) -> IntArray:
    """Fill the strip between two rings with a triangle for each step along either."""
    step_out, step_in = outer + np.pi / len(outer), inner + np.pi / len(inner)
    of_outer = np.r_[np.ones(len(outer), bool), np.zeros(len(inner), bool)]
    of_outer = of_outer[np.argsort(np.r_[step_out, step_in], kind="stable")]
    i = np.cumsum(of_outer) - of_outer
    j = np.cumsum(~of_outer) - ~of_outer
    this_out, next_out = outer_start + i % len(outer), outer_start + (i + 1) % len(outer)
    this_in, next_in = inner_start + j % len(inner), inner_start + (j + 1) % len(inner)
    return np.column_stack([this_out, np.where(of_outer, next_out, next_in), this_in])
