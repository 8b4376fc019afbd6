"""The six cylinders of Fig. 2.7: a bump of known place and growing size, made by spin transformation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay

from .._arrays import FloatArray, frozen
from ..errors import InputError
from ..mesh import Mesh, shapes, spin_transform

__all__ = ["ConformalCylinder", "conformal_cylinder"]

LEVELS = 6
# Largest change of mean curvature half-density, times the radius, and the width of the bump over the radius.
_STRENGTH, _WIDTH = 2.0, 0.4
_JITTER = 0.3


@dataclass(frozen=True, eq=False)
class ConformalCylinder:
    """One of the six cylinders of Fig. 2.7.

    Parameters
    ----------
    mesh : Mesh
        The surface; all levels of one seed have the same triangles.
    density : (n,) array of float
        The bump, 1 at its centre: how strongly each vertex is deformed, relative to the strongest.
    level : int
        1 (the undeformed cylinder) to 6.
    """

    mesh: Mesh
    density: FloatArray
    level: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "density", frozen(self.density))


def conformal_cylinder(
    level: int, *, sides: int = 32, height: float = 6.0, rng: np.random.Generator | int = 0
) -> ConformalCylinder:
    """Make a cylinder with a bump of one of six sizes on its side, by spin transformation (Fig. 2.7).

    Parameters
    ----------
    level : int
        1 (none) to 6.
    sides : int
        Vertices around, at least 8; with the height this sets the resolution.
    height : float
        In radii, at least 3.
    rng : numpy.random.Generator or int
        Seed of the triangulation: vertices are moved by up to 0.3 spacings along the surface, so that paths do
        not follow a grain. Pass a seed, not a generator, to get levels with the same triangles.

    Returns
    -------
    ConformalCylinder
        Radius about 1 away from the bump, open at both ends, with the area of the undeformed cylinder.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    The dissertation does not print the strength of its deformations. Here the prescribed change of mean curvature
    half-density grows linearly to 2 / radius over a Gaussian of width 0.4 radii; at level 6 the bump's centre is
    stretched about twofold in length. A third of a second at 32 sides.

    References
    ----------
    Dissertation, section 2.5.1 and Fig. 2.7; Crane, Pinkall & Schroder 2011.

    Examples
    --------
    >>> plain, bent = (conformal_cylinder(k, sides=16, height=3) for k in (1, 6))
    >>> bool((plain.mesh.faces == bent.mesh.faces).all())
    True
    """
    if not (1 <= level <= LEVELS and sides >= 8 and height >= 3):
        message = (
            f"level must be 1 to {LEVELS}, sides 8 or more, height 3 or more: got {level}, {sides}, {height}"
        )
        raise InputError(message)
    mesh, around, along = _irregular_tube(sides, height, np.random.default_rng(rng))
    squares = (around - np.pi) ** 2 + (along - height / 2) ** 2
    density = np.exp(-squares / (2 * _WIDTH**2))
    if level > 1:
        mesh = spin_transform(mesh, _STRENGTH * (level - 1) / (LEVELS - 1) * density)
    return ConformalCylinder(mesh, density, level)


def _irregular_tube(
    sides: int, height: float, rng: np.random.Generator
) -> tuple[Mesh, FloatArray, FloatArray]:
    """Open tube of radius 1 over jittered vertices, triangulated by Delaunay's rule; with their angles and heights."""
    plain = shapes.cylinder(1.0, height, sides=sides, caps=False)
    row, column = np.divmod(np.arange(plain.n_vertices), sides)
    inner = (row > 0) & (row < row[-1])
    step = 2 * np.pi / sides
    shift = _JITTER * step * inner * rng.uniform(-1, 1, (2, len(row)))
    around = np.mod((column + 0.5 * (row % 2)) * step + shift[0], 2 * np.pi)
    along = plain.vertices[:, 2] + shift[1]
    # Three copies side by side, so that the middle one is triangulated as if it closed around.
    copies = np.concatenate([np.column_stack([around + k * 2 * np.pi, along]) for k in (-1, 0, 1)])
    triangles = Delaunay(copies).simplices.astype(np.int64)
    corners = copies[triangles]
    centre = corners[..., 0].mean(axis=1)
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    turn = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    triangles = np.where(turn[:, None] < 0, triangles[:, ::-1], triangles)
    faces = triangles[(centre >= 0) & (centre < 2 * np.pi)] % len(around)
    return Mesh(np.column_stack([np.cos(around), np.sin(around), along]), faces), around, along
