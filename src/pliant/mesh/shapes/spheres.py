"""Closed surfaces around the origin: sphere, ellipsoid, sphere with random bumps, regular solids."""

from __future__ import annotations

from itertools import product
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from ..._arrays import FloatArray, IntArray
from ...errors import InputError
from ..surface import Mesh
from ._checks import checked_count, checked_length, checked_number, checked_triple

__all__ = ["bumpy_sphere", "ellipsoid", "icosphere", "platonic"]

Solid = Literal["tetrahedron", "cube", "octahedron", "dodecahedron", "icosahedron"]

_GOLDEN = (1 + 5**0.5) / 2
_N_WAVES = 256


def icosphere(subdivisions: int = 3, *, radius: float = 1.0) -> Mesh:
    """Sphere from an icosahedron whose triangles are split in four, again and again.

    Parameters
    ----------
    subdivisions : int
        0 to 9; the sphere has ``10 * 4**subdivisions + 2`` vertices: 12, 42, 162, 642, 2562, 10242, 40962,
        163842, ... The vertices of a coarser sphere are the first ones of a finer sphere.
    radius : float
        Distance of every vertex from the origin, in the unit of the mesh.

    Returns
    -------
    Mesh
        Closed, wound outwards.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    Linear in the number of vertices. The vertices are a little denser around the twelve of the icosahedron,
    and the icosahedron's 120 symmetries hold up to rounding, so lengths tie: not a generic mesh (for one, see
    :func:`bumpy_sphere`).

    Examples
    --------
    >>> icosphere(2).n_vertices
    162
    >>> bool(abs(icosphere(4).area / (4 * np.pi) - 1) < 3e-3)
    True
    """
    subdivisions = checked_count(subdivisions, "subdivisions", 0, 9)
    radius = checked_length(radius, "radius")
    solid = platonic("icosahedron")
    vertices, faces = solid.vertices, solid.faces
    for _ in range(subdivisions):
        vertices, faces = _split_in_four(vertices, faces)
    return Mesh(radius * vertices, faces)


def ellipsoid(axes: ArrayLike, subdivisions: int = 3) -> Mesh:
    """Ellipsoid with given semi-axes, an :func:`icosphere` stretched along x, y and z.

    Parameters
    ----------
    axes : (3,) array_like of float
        Semi-axes along x, y and z, all positive, in the unit of the mesh.
    subdivisions : int
        As for :func:`icosphere`.

    Returns
    -------
    Mesh
        Closed, wound outwards.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    Triangles stretch with the axes; past a ratio of about 5 they are too thin for the cotangent Laplacian.

    Examples
    --------
    >>> ellipsoid([1, 2, 3], 2).vertices.max(axis=0).round(2).tolist()
    [1.0, 2.0, 3.0]
    """
    semi_axes = checked_triple(axes, "axes")
    for length in semi_axes:
        checked_length(float(length), "every one of axes")
    sphere = icosphere(subdivisions)
    return Mesh(sphere.vertices * semi_axes, sphere.faces)


def bumpy_sphere(
    subdivisions: int = 4,
    *,
    rng: int | np.random.Generator,
    amplitude: float = 0.15,
    smoothness: float = 0.4,
) -> Mesh:
    """Sphere with smooth random bumps: a generic closed surface, without symmetries or tied lengths.

    The radius is ``exp(amplitude * f)``, where f is a random field of mean 0 and variance 1 made of plane
    waves whose wavelengths are all at least ``2 pi smoothness``: it is band-limited, so finer meshes of the
    same seed converge to one smooth surface.

    Parameters
    ----------
    subdivisions : int
        As for :func:`icosphere`.
    rng : int or numpy.random.Generator
        Seed of the bumps; the same seed gives the same bytes.
    amplitude : float
        Standard deviation of the logarithm of the radius; 0 is the sphere.
    smoothness : float
        Shortest wavelength over 2 pi, where the sphere has radius 1. Smaller is rougher.

    Returns
    -------
    Mesh
        Closed, wound outwards, star-shaped about the origin (so it never meets itself).

    Raises
    ------
    InputError
        If an argument is out of range.

    Examples
    --------
    >>> bumpy_sphere(3, rng=7)
    Mesh(642 vertices, 1280 faces)
    """
    amplitude = checked_number(amplitude, "amplitude")
    if abs(amplitude) > 1:
        message = f"amplitude must lie between -1 and 1, got {amplitude:g}: radii would range over decades"
        raise InputError(message)
    smoothness = checked_length(smoothness, "smoothness")
    sphere = icosphere(subdivisions)
    radii = np.exp(amplitude * _random_field(sphere.vertices, smoothness, np.random.default_rng(rng)))
    return Mesh(sphere.vertices * radii[:, None], sphere.faces)


def platonic(solid: Solid, *, radius: float = 1.0) -> Mesh:
    """One of the five regular solids, its square or pentagonal sides cut into triangles.

    Parameters
    ----------
    solid : {"tetrahedron", "cube", "octahedron", "dodecahedron", "icosahedron"}
        Which one.
    radius : float
        Distance of every vertex from the origin.

    Returns
    -------
    Mesh
        Closed, wound outwards.

    Raises
    ------
    InputError
        If the name or the radius cannot be used.

    Examples
    --------
    >>> platonic("cube")
    Mesh(8 vertices, 12 faces)
    """
    if solid not in get_args(Solid):
        message = f"solid must be one of {', '.join(get_args(Solid))}; got {solid!r}"
        raise InputError(message)
    radius = checked_length(radius, "radius")
    corners = _corners(solid)
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    faces = ConvexHull(corners).simplices.astype(np.int64)
    inward = np.linalg.det(corners[faces]) < 0
    faces[inward] = faces[inward, ::-1]
    return Mesh(radius * corners, faces)


def _corners(solid: Solid) -> FloatArray:
    signs: FloatArray = np.array(list(product([-1.0, 1.0], repeat=3)))
    if solid == "tetrahedron":
        return signs[[0, 3, 5, 6]]
    if solid == "cube":
        return signs
    if solid == "octahedron":
        return np.vstack([np.eye(3), -np.eye(3)])
    long, short = (_GOLDEN, 1.0) if solid == "icosahedron" else (_GOLDEN, 1 / _GOLDEN)
    rectangle = np.unique(signs * [0, short, long], axis=0)
    golden = [np.roll(rectangle, shift, axis=1) for shift in range(3)]
    return np.vstack(golden if solid == "icosahedron" else [signs, *golden])


def _split_in_four(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    keys, middle = np.unique(ends[:, 0] * len(vertices) + ends[:, 1], return_inverse=True)
    start, stop = np.divmod(keys, len(vertices))
    added = vertices[start] + vertices[stop]
    added /= np.linalg.norm(added, axis=1, keepdims=True)
    a, b, c = faces.T
    ab, bc, ca = (len(vertices) + middle.reshape(-1, 3)).T
    corners = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    split = np.stack([np.column_stack(corner) for corner in corners], axis=1).reshape(-1, 3)
    return np.vstack([vertices, added]), split


def _random_field(points: FloatArray, smoothness: float, rng: np.random.Generator) -> FloatArray:
    directions = rng.standard_normal((_N_WAVES, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # Wave vectors uniform in the ball of radius 1 / smoothness: nothing finer than that.
    waves = directions * (np.cbrt(rng.random((_N_WAVES, 1))) / smoothness)
    phases = rng.uniform(0, 2 * np.pi, _N_WAVES)
    field = np.zeros(len(points))
    for wave, phase in zip(waves, phases, strict=True):
        field += np.cos(points @ wave + phase)
    field *= np.sqrt(2 / _N_WAVES)
    return field
