"""Twenty-three numbers a point of the endocardium: bend, orientation, geodesic context, wave kernel signature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from .._arrays import BoolArray, FloatArray, IntArray, as_floats, as_indices, frozen
from .._parallel import ordered_map
from ..descriptors import geodesic_context, wks
from ..errors import InputError, MeshError, NumericalError, first_indices
from ..mesh import Mesh, principal_curvatures, vertex_components
from ..spectral import eigenbasis
from ._denoising import enclosed_volume
from .segments import VentricleFrame

__all__ = ["FEATURE_BLOCKS", "FEATURE_NAMES", "SegmentFeatures", "endocardial_features"]

_BINS, _WAVES = 10, 10


def feature_blocks(bins: int = _BINS, waves: int = _WAVES) -> dict[str, slice]:
    """Return the columns of each kind of number."""
    return {
        "shape index": slice(0, 1),
        "curvedness": slice(1, 2),
        "orientation": slice(2, 3),
        "context": slice(3, 3 + bins),
        "spectrum": slice(3 + bins, 3 + bins + waves),
    }


#: Columns of each kind of number, of the 23.
FEATURE_BLOCKS: dict[str, slice] = feature_blocks()
#: Name of each of the 23 columns.
FEATURE_NAMES: tuple[str, ...] = (
    "shape index",
    "curvedness (1/mm)",
    "orientation (degrees)",
    *(f"context {i}" for i in range(1, 11)),
    *(f"spectrum {i}" for i in range(1, 11)),
)
_WAVELENGTHS = tuple(float(w) for w in np.geomspace(30.0, 6.0, _WAVES))
# A segment with fewer connected vertices carries no spectrum.
_FEWEST = 30


@dataclass(frozen=True, eq=False, repr=False)
class SegmentFeatures:
    """What is known of one ventricle's surface, segment by segment.

    Parameters
    ----------
    values : (m, 23) array of float
        A row a sampled point, columns :data:`FEATURE_NAMES` (more or fewer where other bins or wavelengths were asked
        for, see :attr:`blocks`); NaN where the surface is flat (shape index) or the
        curvature is missing.
    segments : (m,) array of int
        Segment of each point, 1 to 17, ascending.
    vertices : (m,) array of int
        Vertex of each point.
    roughness : (18,) array of float
        Mean curvedness of each segment by area, in 1/mm; place 0 is the mean over all segments.
    areas : (18,) array of float
        Area of each segment in mm²; place 0 is their sum.
    cavity_ml : float
        Volume of the cavity; NaN where the surface is open.
    settings : mapping
        What made it.
    axis_mm : float
        Length of the long axis, apex to base; NaN where nobody said.
    """

    values: FloatArray
    segments: IntArray
    vertices: IntArray
    roughness: FloatArray
    areas: FloatArray
    cavity_ml: float
    settings: Mapping[str, Any] = field(default_factory=dict)
    axis_mm: float = float("nan")

    def __post_init__(self) -> None:
        for name in ("values", "segments", "vertices", "roughness", "areas"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        if self.values.ndim != 2 or len(self.values) != len(self.segments):
            message = (
                f"values must have a row for each of {len(self.segments)} points, got {self.values.shape}"
            )
            raise InputError(message)

    def __repr__(self) -> str:
        return f"SegmentFeatures({len(self.values)} points in {len(np.unique(self.segments))} segments)"

    @property
    def blocks(self) -> dict[str, slice]:
        """Columns of each kind of number."""
        bins = int(self.settings.get("bins", _BINS))
        return feature_blocks(bins, self.values.shape[1] - 3 - bins)

    @property
    def n_missing(self) -> int:
        """Number of points with a number missing."""
        return int(np.isnan(self.values).any(axis=1).sum())

    @property
    def sphericity(self) -> float:
        """Volume of the cavity over that of the ball whose diameter is the long axis; NaN where either is unknown.

        It grows as a failing ventricle rounds.
        """
        return self.cavity_ml * 1000 / (np.pi / 6 * self.axis_mm**3)

    def of(self, segments: Sequence[int]) -> FloatArray:
        """Return the rows, (k, 23), of some segments, without points where a number is missing.

        Raises
        ------
        InputError
            If none is left.
        """
        rows = self.values[np.isin(self.segments, list(segments))]
        rows = rows[np.isfinite(rows).all(axis=1)]
        if not len(rows):
            message = f"no point of segments {', '.join(map(str, segments))} has all its numbers"
            raise InputError(message)
        return rows

    def mean_roughness(self, segments: Sequence[int]) -> float:
        """Return the mean curvedness over some segments by area, in 1/mm."""
        chosen = list(segments)
        return float(np.average(self.roughness[chosen], weights=self.areas[chosen]))


def endocardial_features(
    mesh: Mesh,
    labels: ArrayLike,
    frame: VentricleFrame,
    *,
    points: int = 500,
    radius: float = 3.0,
    bins: int = _BINS,
    wavelengths: Sequence[float] = _WAVELENGTHS,
    rng: np.random.Generator | int | None = None,
    n_jobs: int | None = None,
) -> SegmentFeatures:
    """Measure 23 numbers at random points of every segment.

    Parameters
    ----------
    mesh : Mesh
        Endocardial surface in mm, normals out of the blood.
    labels : (n,) array_like of int
        From :func:`aha_segments`.
    frame : VentricleFrame
        From :func:`ventricle_frame`; orientation is measured in it.
    points : int
        Points a segment, drawn by area: vertices without repetition while there are enough.
    radius : float
        Scale of the curvatures, in mm.
    bins : int
        Of the geodesic context: f1 of Table 5.3.
    wavelengths : sequence of float
        Scales of the wave kernel signature, in mm, longest first; their number is f2 of Table 5.3.
    rng : numpy.random.Generator or int, optional
        Seed of the points.
    n_jobs : int, optional
        Threads, over segments.

    Returns
    -------
    SegmentFeatures

    Raises
    ------
    InputError
        If the labels do not fit, or an option is out of range.
    MeshError
        If a segment has fewer than 30 connected vertices; the message names it.

    Notes
    -----
    Shape index, 0 (dome seen from outside the blood, that is a pit of the wall) to 1 (a strand's tip); curvedness; the
    angle between normal and the plane of septum and long axis, signed, positive to the front; ten shares of the
    geodesic distances to the segment's other points over the largest; the wave kernel signature at ten wavelengths,
    times the segment's area. Geodesics and eigenfunctions are the segment's own: its triangles, cut out. Wavelengths
    are in mm, the same for all hearts, with bands as wide as their spacing; the published setting (energies spread
    over each shape's own spectrum) compares only shapes of equal size.

    About 4 s for 25,000 vertices on one core. Not to be trusted where triangles are longer than half the radius
    (see :attr:`pliant.Curvatures.n_widened`): slices 8 mm apart carry no trabeculae.

    References
    ----------
    Dissertation, section 5.4.

    Examples
    --------
    >>> from pliant.heart import aha_segments, heart_phantom, ventricle_frame
    >>> phantom = heart_phantom(spacing=4.0, mesh_step=2.0, rng=1)
    >>> frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    >>> endocardial_features(phantom.mesh, phantom.labels, frame, points=40, rng=0)
    SegmentFeatures(680 points in 17 segments)
    """
    segment_of = _checked_labels(labels, mesh.n_vertices)
    waves = _checked_options(points, radius, bins, wavelengths)
    generator = np.random.default_rng(rng)
    seeds = generator.integers(2**63, size=17)
    bend = principal_curvatures(mesh, radius=radius, n_jobs=n_jobs)
    local = np.column_stack([bend.shape_index, bend.curvedness, _orientation(mesh, frame)])

    def measure(segment: int) -> tuple[IntArray, FloatArray]:
        rng_of_segment = np.random.default_rng(seeds[segment - 1])
        chosen, rest = _segment(mesh, segment_of == segment, segment, points, (bins, waves), rng_of_segment)
        return chosen, np.column_stack([local[chosen], rest])

    # Segments limit the linear algebra's threads, which is one setting for all: set around them it cannot change
    # between one segment's beginning and its end, and with it the last bits.
    with threadpool_limits(1):
        parts = list(ordered_map(measure, range(1, 18), n_jobs))
    roughness, areas = _roughness(mesh, segment_of, bend.curvedness)
    return SegmentFeatures(
        np.concatenate([values for _, values in parts]),
        np.repeat(np.arange(1, 18), [len(chosen) for chosen, _ in parts]),
        np.concatenate([chosen for chosen, _ in parts]),
        roughness,
        areas,
        cavity_volume(mesh),
        {
            "points": points,
            "radius": radius,
            "wavelengths": [round(float(w), 3) for w in waves],
            "bins": bins,
        },
        frame.length,
    )


def cavity_volume(mesh: Mesh) -> float:
    """Return what a closed surface in mm holds, in ml; NaN where it is open."""
    closed = len(mesh.edges) * 2 == mesh.n_faces * 3
    return enclosed_volume(mesh) / 1000 if closed else float("nan")


def _checked_labels(labels: ArrayLike, n: int) -> IntArray:
    found = as_indices(labels, "labels")
    if found.shape != (n,):
        message = f"labels must have one segment a vertex, shape ({n},), got {found.shape}"
        raise InputError(message)
    bad = np.flatnonzero((found < 0) | (found > 17))
    if bad.size:
        message = f"labels: {bad.size} are outside 0..17, first at vertices {first_indices(bad)}"
        raise InputError(message)
    return found


def _checked_options(points: int, radius: float, bins: int, wavelengths: Sequence[float]) -> FloatArray:
    waves = as_floats(wavelengths, "wavelengths")
    if waves.ndim != 1 or len(waves) < 2 or not ((np.diff(waves) < 0).all() and waves[-1] > 0):
        raise InputError("wavelengths must be two or more positive lengths in mm, longest first")
    if points < 10 or not radius > 0 or bins < 2:
        message = f"points must be at least 10, radius positive and bins 2 or more, got {points}, {radius} and {bins}"
        raise InputError(message)
    return waves


def _orientation(mesh: Mesh, frame: VentricleFrame) -> FloatArray:
    """(n,) degrees between normal and the plane of septum and long axis, positive to the anterior wall."""
    angles: FloatArray = np.degrees(np.arcsin(np.clip(mesh.vertex_normals @ frame.axes[:, 1], -1, 1)))
    return angles


def _roughness(mesh: Mesh, labels: IntArray, curvedness: FloatArray) -> tuple[FloatArray, FloatArray]:
    known = np.isfinite(curvedness) & (labels > 0)
    weights = mesh.vertex_areas * known
    areas = np.bincount(labels, weights, 18).astype(np.float64)
    total = np.bincount(labels, weights * np.nan_to_num(curvedness), 18).astype(np.float64)
    areas[0], total[0] = areas[1:].sum(), total[1:].sum()
    means: FloatArray = np.divide(total, areas, out=np.full(18, np.nan), where=areas > 0)
    return means, areas


def _segment(
    mesh: Mesh,
    inside: BoolArray,
    segment: int,
    points: int,
    scales: tuple[int, FloatArray],
    rng: np.random.Generator,
) -> tuple[IntArray, FloatArray]:
    """Draw vertices of one segment; return them with their context and spectrum, (k, bins + waves)."""
    patch, members = _patch(mesh, inside, segment)
    weights = patch.vertex_areas / patch.area
    enough = int((weights > 0).sum()) >= points
    chosen = np.sort(rng.choice(len(members), points, replace=not enough, p=weights))
    context = geodesic_context(patch, chosen, bins=scales[0], n_jobs=1)[chosen]
    return members[chosen], np.column_stack([context, _waves(patch, scales[1], segment)[chosen]])


def _patch(mesh: Mesh, inside: BoolArray, segment: int) -> tuple[Mesh, IntArray]:
    """Largest connected piece of a segment's own triangles, and the vertices it is made of."""
    faces = mesh.faces[inside[mesh.faces].all(axis=1)]
    used, numbered = np.unique(faces, return_inverse=True)
    if len(used) < _FEWEST:
        message = f"segment {segment} has {len(used)} vertices in triangles of its own, {_FEWEST} are needed"
        raise MeshError(message)
    cut = Mesh(mesh.vertices[used], numbered.reshape(-1, 3))
    count, piece = vertex_components(cut)
    if count > 1:
        largest = piece == np.argmax(np.bincount(piece))
        if largest.sum() < _FEWEST:
            message = f"segment {segment} falls into {count} pieces of fewer than {_FEWEST} vertices"
            raise MeshError(message)
        number = np.cumsum(largest) - 1
        cut = Mesh(cut.vertices[largest], number[cut.faces[largest[cut.faces[:, 0]]]])
        used = used[largest]
    return cut, used


def _waves(patch: Mesh, waves: FloatArray, segment: int) -> FloatArray:
    """(n, waves) wave kernel signature at wavelengths in mm, times area: 1 is the mean over the segment."""
    energies = 2 * np.log(2 * np.pi / waves)
    width = float(np.abs(np.diff(energies)).mean())
    # Weyl: so many eigenvalues lie below the last band's far side.
    last = np.exp(energies[-1] + 1.5 * width)
    wanted = int(np.ceil(last * patch.area / (4 * np.pi))) + 8
    try:
        spectrum = eigenbasis(patch, min(wanted, patch.n_vertices - 2), tol=1e-6, n_jobs=1)
        signature: FloatArray = wks(spectrum, energies=energies, width=width) * patch.area
    except (InputError, NumericalError) as error:
        message = f"segment {segment}: no spectrum: {error}"
        raise MeshError(message) from error
    return signature
