"""Symmetry protocols: whether regions come back on a changed shape, and what noise does to maps (section 4.5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, as_floats, frozen
from ..errors import InputError
from ..matching.symmetry import Symmetry
from ..mesh import Mesh
from ..mesh.perturb import with_noise
from ._checks import point_map_of

__all__ = ["SymmetryRepeatability", "region_overlap", "symmetry_noise", "symmetry_repeatability"]

Detect = Callable[[Mesh], Sequence[Symmetry]]


@dataclass(frozen=True, eq=False, repr=False)
class SymmetryRepeatability:
    """How well the symmetric regions of a changed shape cover those of the intact one.

    Attributes
    ----------
    overlaps : (m,) array of float
        For each symmetry of the changed shape, its largest overlap with one of the intact shape, of the same kind; 0
        where there is none.
    n_reference : int
        Symmetries of the intact shape.

    Examples
    --------
    >>> found = SymmetryRepeatability([0.9, 0.5], 2)
    >>> found.rate, found.at(0.75)
    (0.7, 0.5)
    """

    overlaps: FloatArray
    n_reference: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "overlaps", frozen(as_floats(self.overlaps, "overlaps")))

    def __repr__(self) -> str:
        return f"SymmetryRepeatability({len(self.overlaps)} regions, rate {self.rate:.3f}, at .75 {self.at(0.75):.3f})"

    @property
    def rate(self) -> float:
        """Mean overlap: eq. 4.7 over the number of regions, which as printed is a sum; NaN without any."""
        return float(self.overlaps.mean()) if len(self.overlaps) else float("nan")

    def at(self, overlap: float) -> float:
        """Share of the regions with at least this overlap; NaN without any."""
        return float((self.overlaps >= overlap).mean()) if len(self.overlaps) else float("nan")

    @property
    def found(self) -> float:
        """Regions of the changed shape over those of the intact one: a method that finds few repeats them easily."""
        return len(self.overlaps) / self.n_reference if self.n_reference else float("nan")


def region_overlap(one: ArrayLike, other: ArrayLike, areas: ArrayLike) -> float:
    """Area of the intersection of two regions over that of their union (eq. 4.8).

    Parameters
    ----------
    one, other : (n,) array_like of bool
    areas : (n,) array_like of float
        Area of each vertex.

    Returns
    -------
    float
        0 to 1; 0 for two empty regions.

    Raises
    ------
    InputError
        If sizes differ.

    Examples
    --------
    >>> region_overlap([True, True, False], [False, True, True], [1.0, 2.0, 1.0])
    0.5
    """
    first, second, weights = np.asarray(one, bool), np.asarray(other, bool), as_floats(areas, "areas")
    if not first.shape == second.shape == weights.shape:
        message = f"regions and areas must have one size, got {first.shape}, {second.shape}, {weights.shape}"
        raise InputError(message)
    union = float(weights[first | second].sum())
    return float(weights[first & second].sum()) / union if union > 0 else 0.0


def symmetry_repeatability(
    reference: Sequence[Symmetry], changed: Sequence[Symmetry], mesh: Mesh, source: ArrayLike
) -> SymmetryRepeatability:
    """Carry the regions of a changed shape to the intact one and measure how they overlap (eq. 4.7, 4.8).

    Parameters
    ----------
    reference, changed : sequence of Symmetry
        Of the intact shape and of the changed one; a region is source and target of one symmetry together.
    mesh : Mesh
        The intact shape, n vertices.
    source : (m,) array_like of int
        The vertex of the intact shape that each vertex of the changed one was; -1 for new ones.

    Returns
    -------
    SymmetryRepeatability

    Raises
    ------
    InputError
        If sizes do not fit.

    References
    ----------
    Dissertation, section 4.5.6 and Fig. 4.10.

    Examples
    --------
    >>> from pliant import detect_symmetries, shapes
    >>> figure = shapes.human(1000)
    >>> found = detect_symmetries(figure.mesh, parts=False).symmetries
    >>> symmetry_repeatability(found, found, figure.mesh, np.arange(1000)).rate
    1.0
    """
    for one in reference:
        if len(one.source) != mesh.n_vertices:
            message = f"a symmetry has {len(one.source)} vertices, the mesh {mesh.n_vertices}"
            raise InputError(message)
    rows = np.asarray(source)
    known = point_map_of(np.where(rows < 0, 0, rows), len(rows), mesh.n_vertices, "source")
    # Vertices that the change took away count for nobody.
    seen = np.zeros(mesh.n_vertices, dtype=bool)
    seen[known[rows >= 0]] = True
    areas = mesh.vertex_areas * seen
    overlaps = []
    for one in changed:
        if len(one.source) != len(rows):
            message = f"a symmetry has {len(one.source)} vertices, source {len(rows)}"
            raise InputError(message)
        carried = np.zeros(mesh.n_vertices, dtype=bool)
        carried[known[_region(one) & (rows >= 0)]] = True
        same = [
            region_overlap(_region(other), carried, areas) for other in reference if other.kind == one.kind
        ]
        overlaps.append(max(same, default=0.0))
    return SymmetryRepeatability(np.array(overlaps, dtype=np.float64), len(reference))


def symmetry_noise(
    mesh: Mesh,
    detect: Detect,
    *,
    sigmas: Sequence[float] = (0.1, 0.2, 0.4, 0.6, 0.8, 1.0),
    k: int = 20,
    rng: int | np.random.Generator = 0,
) -> FloatArray:
    """Measure how far functional maps move under normal displacement of growing size (Fig. 4.9).

    Parameters
    ----------
    mesh : Mesh
    detect : callable
        Takes a mesh and returns its symmetries; the first one is compared.
    sigmas : sequence of float
        Standard deviations in mean edge lengths: the dissertation names no unit.
    k : int
        Eigenfunctions compared.
    rng : int or numpy.random.Generator
        Seed of the noise.

    Returns
    -------
    (s,) array of float
        ``|C^2 - C'^2| / |C^2|`` of each, squares taken entry by entry since signs of eigenfunctions are arbitrary; NaN
        where the noisy shape has no symmetry.

    Raises
    ------
    InputError
        If the clean shape has no symmetry, or there is no sigma.

    Examples
    --------
    >>> from pliant import detect_symmetries, shapes
    >>> figure = shapes.human(1000)
    >>> moved = symmetry_noise(
    ...     figure.mesh, lambda mesh: detect_symmetries(mesh, parts=False).symmetries, sigmas=[0.05]
    ... )
    >>> bool(moved[0] < 0.3)
    True
    """
    if not len(sigmas):
        raise InputError("symmetry_noise needs at least one sigma")
    generator = np.random.default_rng(rng)
    clean = detect(mesh)
    if not clean:
        raise InputError("the clean shape has no symmetry to compare with")
    reference = clean[0].fmap[:k, :k] ** 2
    moved = np.full(len(sigmas), np.nan)
    for i, sigma in enumerate(sigmas):
        noisy = detect(with_noise(mesh, sigma, rng=generator))
        if noisy:
            change = noisy[0].fmap[:k, :k] ** 2 - reference
            moved[i] = np.linalg.norm(change) / np.linalg.norm(reference)
    return moved


def _region(symmetry: Symmetry) -> BoolArray:
    region: BoolArray = symmetry.source | symmetry.target
    return region
