"""Principal curvatures of a mesh by one named estimator: a cubic jet fitted to a ball grown over edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import BoolArray, FloatArray, frozen
from .._parallel import ordered_map
from ..errors import InputError, MeshError
from ._jets import fit_jets
from .adjacency import edge_matrix
from .surface import Mesh

__all__ = ["Curvatures", "principal_curvatures"]

DEFAULT_RADIUS = 3.0

# Below this turn of the normal across the neighbourhood a surface is flat to within rounding.
_FLAT_TURN = 1e-6
# Above this one it folds inside the neighbourhood, and the polynomial exaggerates how sharply.
_FOLD_TURN = 3.0
_CHUNK = 4096


@dataclass(frozen=True, eq=False, repr=False)
class Curvatures:
    """Principal curvatures of every vertex, and what follows from them.

    Convex is positive where normals point outwards. NaN where the neighbourhood was too small to tell.

    Parameters
    ----------
    maximum, minimum : (n,) array of float
        kappa1 >= kappa2, in 1 / unit of the mesh.
    maximum_directions, minimum_directions : (n, 3) array of float
        Unit tangents along which the surface bends so; their sign is free and fixed by making the largest
        component positive. Where the two curvatures agree they mean nothing.
    radius : float
        Radius asked for, in the unit of the mesh.
    radii : (n,) array of float
        Radius used at each vertex: larger where the neighbourhood had to be widened.

    Examples
    --------
    >>> from pliant import shapes
    >>> ball = principal_curvatures(shapes.icosphere(3, radius=5.0))
    >>> ball
    Curvatures(642 vertices, radius 2.26)
    >>> float(ball.mean.mean().round(3)), float(ball.shape_index.max().round(2))
    (0.208, 0.0)
    """

    maximum: FloatArray
    minimum: FloatArray
    maximum_directions: FloatArray
    minimum_directions: FloatArray
    radius: float
    radii: FloatArray

    def __post_init__(self) -> None:
        for name in ("maximum", "minimum", "maximum_directions", "minimum_directions", "radii"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __repr__(self) -> str:
        return f"Curvatures({len(self.maximum)} vertices, radius {self.radius:.3g})"

    @property
    def mean(self) -> FloatArray:
        """(n,) mean curvature, (kappa1 + kappa2) / 2."""
        values: FloatArray = 0.5 * (self.maximum + self.minimum)
        return values

    @property
    def gaussian(self) -> FloatArray:
        """(n,) Gaussian curvature, kappa1 kappa2."""
        values: FloatArray = self.maximum * self.minimum
        return values

    @property
    def curvedness(self) -> FloatArray:
        """(n,) how strongly the surface bends, sqrt((kappa1^2 + kappa2^2) / 2)."""
        values: FloatArray = np.hypot(self.maximum, self.minimum) / np.sqrt(2.0)
        return values

    @property
    def shape_index(self) -> FloatArray:
        """(n,) 1/2 - arctan((kappa1 + kappa2) / (kappa1 - kappa2)) / pi, in [0, 1] (section 5.4).

        0 a convex umbilic (the outside of a ball), 1/4 a ridge, 1/2 a symmetric saddle, 3/4 a rut, 1 a
        concave umbilic. NaN where the surface is flat (see :attr:`planar`) or its curvature is missing.
        """
        total, spread = self.maximum + self.minimum, self.maximum - self.minimum
        values: FloatArray = 0.5 - np.arctan2(total, spread) / np.pi
        values[self.planar] = np.nan
        return values

    @property
    def planar(self) -> BoolArray:
        """(n,) where the normal turns by less than 1e-6 over the neighbourhood: no shape to speak of."""
        flat: BoolArray = self.curvedness * self.radii < _FLAT_TURN
        return flat

    @property
    def unresolved(self) -> BoolArray:
        """(n,) where the radius of curvature is under a third of the radius used.

        That is sharper than the scale shows: sign and direction still mean something, the size does not.
        """
        folded: BoolArray = self.curvedness * self.radii > _FOLD_TURN
        return folded

    @property
    def n_unresolved(self) -> int:
        """Number of vertices whose bend is too sharp for the radius."""
        return int(self.unresolved.sum())

    @property
    def n_planar(self) -> int:
        """Number of flat vertices: curvatures of 0, no shape index."""
        return int(self.planar.sum())

    @property
    def n_missing(self) -> int:
        """Number of vertices without curvatures: fewer than six vertices, or no normal, within reach."""
        return int(np.isnan(self.maximum).sum())

    @property
    def n_widened(self) -> int:
        """Number of vertices where the radius held too few neighbours and was widened."""
        return int((self.radii > self.radius).sum())


def principal_curvatures(mesh: Mesh, *, radius: float | None = None, n_jobs: int | None = None) -> Curvatures:
    """Estimate principal curvatures by fitting a cubic jet to each vertex's neighbourhood.

    The neighbourhood of a vertex is what paths along edges reach within the radius, so a sheet that is near
    in space and far along the surface stays out of it. A height polynomial of degree three over the mean
    tangent plane is fitted to it by least squares, weights ``exp(-2 (path / radius)^2)`` times the cosine
    between normals; its fundamental forms at the vertex give the curvatures. Boundary vertices are fitted
    from their one side.

    Parameters
    ----------
    mesh : Mesh
        Consistently wound, normals outwards where it is closed; otherwise signs are wrong where they are not.
    radius : float, optional
        Scale at which to look, in the unit of the mesh. By default 3 mean edge lengths, about 30 neighbours.
        Larger is smoother: noise of standard deviation s disturbs curvatures in proportion to
        ``s / radius^3``, and features smaller than the radius blur.
    n_jobs : int, optional
        Threads; all cores by default.

    Returns
    -------
    Curvatures

    Raises
    ------
    InputError
        If the radius or n_jobs is out of range.
    MeshError
        If the mesh has no edge of positive length.

    Notes
    -----
    The error is of second order in the radius on smooth surfaces, with irregular triangles too. Where fewer
    than 15 vertices are in reach, the radius grows until they are (:attr:`Curvatures.n_widened`); with 10 or
    fewer in the whole component, or points that do not fix a cubic, a quadric is fitted, and with fewer than
    6 the answer is NaN (:attr:`Curvatures.n_missing`). Not to be trusted where the surface bends within the
    radius, as at sharp creases and thin rims (:attr:`Curvatures.n_unresolved`). About 10 microseconds a
    vertex at the default radius, growing with its square.

    References
    ----------
    F. Cazals, M. Pouget, "Estimating differential quantities using polynomial fitting of osculating jets",
    Computer Aided Geometric Design 22, 2005.

    Examples
    --------
    >>> from pliant import shapes
    >>> tube = principal_curvatures(shapes.cylinder(2.0, 10.0, sides=120, caps=False))
    >>> float(np.median(tube.maximum).round(2)), float(abs(np.median(tube.minimum)).round(2))
    (0.5, 0.0)
    """
    radius = _checked_radius(mesh, radius)
    graph = edge_matrix(mesh)
    starts, neighbours = graph.indptr.astype(np.int64), graph.indices.astype(np.int64)
    n = mesh.n_vertices
    curvatures, axes, radii = np.empty((n, 2)), np.empty((n, 2, 3)), np.empty(n)

    def fit(first: int) -> None:
        last = min(first + _CHUNK, n)
        fit_jets(
            first, last, radius, mesh.vertices, mesh.vertex_normals, mesh.vertex_areas,
            starts, neighbours, graph.data, curvatures, axes, radii,
        )  # fmt: skip

    for _ in ordered_map(fit, range(0, n, _CHUNK), n_jobs):
        pass
    return Curvatures(curvatures[:, 0], curvatures[:, 1], axes[:, 0], axes[:, 1], radius, radii)


def _checked_radius(mesh: Mesh, radius: float | None) -> float:
    longest = float(mesh.edge_lengths.max(initial=0.0))
    if not longest > 0.0:
        raise MeshError("no edge of the mesh has a length: there is no surface to measure curvature on")
    if radius is None:
        return DEFAULT_RADIUS * float(mesh.edge_lengths.mean())
    if not (isinstance(radius, (int, float, np.number)) and np.isfinite(radius) and radius > 0):
        message = f"radius must be a positive length in the unit of the mesh, got {radius!r}"
        raise InputError(message)
    return float(radius)
