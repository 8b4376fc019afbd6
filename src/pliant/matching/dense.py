"""Dense maps between surfaces that bend into one another, without landmarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, frozen
from .._progress import progress_bar
from ..descriptors import bde, wks
from ..errors import InputError, MeshError
from ..mesh import Mesh
from ..spectral import Spectrum, eigenbasis
from ._search import Candidates, at_samples, branch, grow, measures, ranked, scores, sign_starts
from ._side import Side, is_oriented, side_of, winding
from ._signatures import standardised
from .functional_map import FunctionalMap, point_map
from .refine import zoomout

__all__ = ["PointMap", "dense_map"]

Orientation = Literal["preserve", "reverse", "any"]
_ORIENTATIONS = {"preserve": 1, "reverse": -1, "any": 0}

# (eigenfunctions whose signs are enumerated, size reached by branching, maps kept on the way).
_BRANCHINGS = ((4, 20, 32), (5, 20, 32), (7, 20, 32))
_COARSE_SAMPLES, _SAMPLES, _FINE_SAMPLES = 200, 300, 1000
_MIDDLE = 40
_FINALISTS, _REFINED = 12, 2


@dataclass(frozen=True, eq=False, repr=False)
class PointMap:
    """A map of points from b to a, with what it was chosen by.

    Parameters
    ----------
    p_ba : (n_b,) array of int
        For each vertex of b, a vertex of a.
    fmap : FunctionalMap
        The functional map from a to b that it was read from.
    measures : mapping of str to float
        What was judged, smaller is better: ``orthogonality`` and ``commutativity`` of the functional map,
        distortion of biharmonic ``distances``, difference of ``descriptors`` and, between oriented meshes,
        ``folding``.
    reversed_area : float
        Share of b's area whose triangles a receives the other way round, of those that keep three corners;
        about 0 for a map that keeps the orientation, about 1 for a mirrored one, between for a
        mixture. NaN without oriented meshes.
    candidate_scores : (h,) array of float
        Sums of the measures of the different maps compared before the last refinement, ascending: where
        the first two are close there was little to choose between.
    """

    p_ba: IntArray
    fmap: FunctionalMap
    measures: Mapping[str, float] = field(repr=False)
    reversed_area: float
    candidate_scores: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "p_ba", frozen(self.p_ba))
        object.__setattr__(self, "candidate_scores", frozen(self.candidate_scores))
        object.__setattr__(self, "measures", MappingProxyType(dict(self.measures)))

    def __repr__(self) -> str:
        judged = ", ".join(f"{name} {value:.3f}" for name, value in self.measures.items())
        return f"PointMap({len(self.p_ba)} vertices of b -> a; {judged})"


def dense_map(
    a: Mesh | Spectrum,
    b: Mesh | Spectrum,
    *,
    spectra: tuple[Spectrum, Spectrum] | None = None,
    descriptors: tuple[ArrayLike, ArrayLike] | None = None,
    k: int = 120,
    orientation: Orientation = "preserve",
    progress: bool = False,
) -> PointMap:
    """Find the map of points from b to a of two surfaces that are nearly isometric, from nothing but them.

    Parameters
    ----------
    a, b : Mesh or Spectrum
        The surfaces, each in one piece. Without meshes, orientation is left to chance.
    spectra : (Spectrum, Spectrum), optional
        Eigenbases of the two meshes, where they are at hand. Otherwise computed with ``k`` pairs.
    descriptors : ((n_a, d), (n_b, d)) arrays of float, optional
        Signatures to judge candidates by; by default the biharmonic density estimate and the wave kernel
        signature, each column standardised.
    k : int
        Eigenfunctions of the final map, or fewer where there are fewer; at least 30.
    orientation : {"preserve", "reverse", "any"}
        Which maps to look for between oriented meshes: those that keep the orientation, as bending does;
        those that turn it over, as from a left hand to a right one; or whatever fits better. A closed mesh
        wound inwards counts as wound outwards.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    PointMap
        ``.p_ba`` (n_b,): for each vertex of b a vertex of a. ``.fmap`` takes functions on a to functions on b.

    Raises
    ------
    MeshError
        If a surface is in several pieces.
    InputError
        If there are fewer than 30 eigenpairs, or descriptors or spectra do not fit.

    Notes
    -----
    Least squares on descriptors mixes a map with its mirror image where a shape has an intrinsic symmetry.
    Here the signs of the first eigenfunctions are enumerated instead, maps are grown on a few hundred
    farthest points with both signs of each further eigenfunction tried, and the best of each size
    kept. The judges are orthogonality and commutativity of the functional map, distortion of biharmonic
    distances, difference of descriptors, and folding (whether Jacobians of the carried eigenfunctions
    agree in sign), summed. The best are refined by ZoomOut, and the best of them is returned.

    Deterministic. Cost: a few seconds for 5,000 vertices, eigenbases included; for larger meshes the last two
    nearest-neighbour searches take over, 4 n_a n_b k flops.

    Do not trust it where the surfaces are not near isometric, have one glued where the other has a gap, or
    where ``folding`` is large or ``reversed_area`` is far from 0.

    References
    ----------
    .. [1] S. Melzi et al., ZoomOut: spectral upsampling for efficient shape correspondence, ACM TOG 38(6), 2019.
    .. [2] J. Ren, S. Melzi, M. Ovsjanikov, P. Wonka, MapTree: recovering multiple solutions in the space of
       maps, ACM TOG 39(6), 2020.

    Examples
    --------
    >>> from pliant import shapes
    >>> figure = shapes.human(1000)
    >>> found = dense_map(figure.mesh, figure.posed("walk").mesh, k=40)
    >>> found.p_ba.shape
    (1000,)
    """
    if orientation not in _ORIENTATIONS:
        message = f"orientation must be one of {', '.join(map(repr, _ORIENTATIONS))}, got {orientation!r}"
        raise InputError(message)
    wanted = _ORIENTATIONS[orientation]
    with progress_bar("dense map", 3 + _REFINED, show=progress) as advance:
        spectrum_a, spectrum_b = _spectra(a, b, spectra, k)
        f_a, f_b = standardised(spectrum_a, spectrum_b, descriptors, _signatures)
        size = min(k, spectrum_a.k, spectrum_b.k)
        side_a = side_of(a if isinstance(a, Mesh) else None, spectrum_a, f_a, _SAMPLES, min(size, 60))
        side_b = side_of(b if isinstance(b, Mesh) else None, spectrum_b, f_b, _SAMPLES, min(size, 60))
        advance()
        finalists = _finalists(side_a, side_b, wanted)
        advance()
        fmaps = []
        for matrix in finalists.matrices[:_REFINED]:
            fmaps.append(_refined(matrix, spectrum_a, spectrum_b, size))
            advance()
        return _chosen(a, b, fmaps, finalists, (side_a, side_b), wanted)


def _spectra(
    a: Mesh | Spectrum, b: Mesh | Spectrum, spectra: tuple[Spectrum, Spectrum] | None, k: int
) -> tuple[Spectrum, Spectrum]:
    found = []
    for i, (name, surface) in enumerate((("a", a), ("b", b))):
        if isinstance(surface, Spectrum):
            spectrum = surface
        elif spectra is None:
            spectrum = eigenbasis(surface, min(k, surface.n_vertices - 1))
        else:
            spectrum = spectra[i]
            if spectrum.n_vertices != surface.n_vertices:
                message = f"spectra: that of {name} has {spectrum.n_vertices} vertices, the mesh {surface.n_vertices}"
                raise InputError(message)
        if spectrum.n_zero > 1:
            message = f"{name} is in {spectrum.n_zero} pieces at least; map one at a time, see pliant.largest_component"
            raise MeshError(message)
        if min(k, spectrum.k) < 30:
            message = f"{name} has {spectrum.k} eigenpairs and k is {k}; a dense map needs 30 at least"
            raise InputError(message)
        found.append(spectrum)
    return found[0], found[1]


def _signatures(spectrum: Spectrum) -> FloatArray:
    return np.column_stack([bde(spectrum), wks(spectrum)])


def _finalists(a: Side, b: Side, wanted: int) -> Candidates:
    """Return maps of middle size, the best first, no two alike."""
    size = min(_MIDDLE, len(a.values), len(b.values))
    coarse_a, coarse_b = a.first(_COARSE_SAMPLES), b.first(_COARSE_SAMPLES)
    grown = []
    for start, stop, width in _BRANCHINGS:
        starts = sign_starts(a, b, start)
        found = branch(starts, coarse_a, coarse_b, min(stop, size), width, wanted)
        grown.append(grow(_distinct(found).matrices[:_FINALISTS], a, b, size))
    both = Candidates(*(np.concatenate([getattr(g, name) for g in grown]) for name in ("matrices", "points")))
    return _distinct(both.chosen(ranked(both, a, b, wanted)))


def _distinct(candidates: Candidates) -> Candidates:
    """Keep the first of maps that send nine samples in ten to the same place."""
    kept: list[int] = []
    for i, points in enumerate(candidates.points):
        if all((points == candidates.points[j]).mean() < 0.9 for j in kept):
            kept.append(i)
    return candidates.chosen(np.array(kept))


def _refined(matrix: FloatArray, spectrum_a: Spectrum, spectrum_b: Spectrum, size: int) -> FunctionalMap:
    """ZoomOut from a small corner of the map: what its growth on few samples got wrong is found anew."""
    corner = matrix[:20, :20] * (spectrum_b.area / spectrum_a.area) ** 0.5
    samples = min(_FINE_SAMPLES, spectrum_a.n_vertices, spectrum_b.n_vertices)
    return zoomout(FunctionalMap(corner, spectrum_a, spectrum_b), k=size, step=2, samples=samples)


def _chosen(
    a: Mesh | Spectrum,
    b: Mesh | Spectrum,
    fmaps: list[FunctionalMap],
    found: Candidates,
    sides: tuple[Side, Side],
    wanted: int,
) -> PointMap:
    """Judge the refined maps as their coarse forms were judged, and read the points off the best."""
    side_a, side_b = sides
    size = min(side_a.basis.shape[1], side_b.basis.shape[1], fmaps[0].matrix.shape[0])
    factor = (side_a.spectrum.area / side_b.spectrum.area) ** 0.5
    refined = at_samples(np.stack([fmap.matrix[:size, :size] * factor for fmap in fmaps]), side_a, side_b)
    best = int(ranked(refined, side_a, side_b, wanted)[0])
    judged = measures(refined, side_a, side_b, wanted)
    p_ba = point_map(fmaps[best])
    meshes = isinstance(a, Mesh) and isinstance(b, Mesh)
    return PointMap(
        p_ba,
        fmaps[best],
        {name: float(values[best]) for name, values in judged.items()},
        reversed_area(p_ba, a, b) if meshes else np.nan,  # type: ignore[arg-type]
        np.sort(scores(measures(found, side_a, side_b, wanted))),
    )


def reversed_area(p_ba: IntArray, mesh_a: Mesh, mesh_b: Mesh) -> float:
    """Return the share of b's area whose triangles arrive on a turned over; NaN where a mesh has no two sides.

    A triangle's image counts as turned over where its normal points away from the surface's at its corners.
    Triangles two corners of which arrive at one vertex are left out.
    """
    if not (is_oriented(mesh_a) and is_oriented(mesh_b)):
        return float("nan")
    images = p_ba[mesh_b.faces]
    corners = mesh_a.vertices[images]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    agreement = np.einsum("ij,ij->i", normals, mesh_a.vertex_normals[images].sum(axis=1))
    whole = (images[:, 0] != images[:, 1]) & (images[:, 1] != images[:, 2]) & (images[:, 2] != images[:, 0])
    area = mesh_b.face_areas[whole]
    if not area.sum() > 0:
        return float("nan")
    turned = area[agreement[whole] < 0].sum() / area.sum()
    return float(turned if winding(mesh_a) == winding(mesh_b) else 1 - turned)
