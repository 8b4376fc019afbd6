"""The seventeen segments of the American Heart Association on a triangle mesh, and the frame they are measured in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, as_floats, frozen
from ..errors import InputError, MeshError
from ..mesh import Mesh
from ._axis import long_axis
from ._landmarks import (
    checked_point,
    refuse_far,
    rotation_of_landmarks,
    rotation_of_prior,
    rotation_of_ventricle,
)
from ._ventricle import CUTS, TERRITORY
from .volume import Volume

__all__ = ["TERRITORIES", "VentricleFrame", "aha_segments", "ventricle_frame"]

Origin: TypeAlias = Literal["landmarks", "right ventricle", "automatic"]

#: Segments supplied by each coronary artery (Cerqueira et al. 2002).
TERRITORIES: dict[str, tuple[int, ...]] = {
    name: tuple(int(s) for s in np.flatnonzero(np.equal(TERRITORY, i)) + 1)
    for i, name in enumerate(("LAD", "LCX", "RCA"))
}
# Sectors in the sense of growing turn, from the middle of the septum towards the anterior wall.
_SIX, _FOUR = np.array([2, 1, 6, 5, 4, 3]), np.array([14, 13, 16, 15])


@dataclass(frozen=True, eq=False, repr=False)
class VentricleFrame:
    """Where the long axis of a left ventricle runs and which way its septum looks.

    Parameters
    ----------
    apex, base : (3,) array of float
        Ends of the long axis in mm: the apex, and the middle of the basal plane, which is normal to the axis.
    axes : (3, 3) array of float
        Columns are unit vectors towards the septum, the anterior wall and the base: right-handed in millimetres
        (RAS or LPS), so that a mirrored division cannot arise.
    origin : {"landmarks", "right ventricle", "automatic"}
        What fixed the rotation about the axis.
    confidence : float
        0 to 1: 1 where every landmark was given; below 0.5 look at the segments before using them.

    Examples
    --------
    >>> frame = VentricleFrame(np.zeros(3), np.array([0.0, 0.0, 80.0]), np.eye(3), "landmarks", 1.0)
    >>> frame
    VentricleFrame(axis of 80 mm, rotation from landmarks, confidence 1.00)
    >>> along, turn, radius = frame.cylindrical([[10.0, 10.0, 40.0]])
    >>> float(along[0]), float(turn[0].round(6))
    (0.5, 45.0)
    """

    apex: FloatArray
    base: FloatArray
    axes: FloatArray
    origin: Origin
    confidence: float

    def __post_init__(self) -> None:
        for name in ("apex", "base", "axes"):
            object.__setattr__(self, name, frozen(as_floats(getattr(self, name), name)))
        if self.axes.shape != (3, 3) or not np.allclose(self.axes.T @ self.axes, np.eye(3), atol=1e-6):
            raise InputError("axes must be (3, 3) with orthonormal columns: septum, anterior wall, base")
        if np.linalg.det(self.axes) < 0:
            raise InputError("axes must be right-handed: the anterior wall is base x septum; swap its sign")

    def __repr__(self) -> str:
        return (
            f"VentricleFrame(axis of {self.length:.3g} mm, rotation from {self.origin}, "
            f"confidence {self.confidence:.2f})"
        )

    @property
    def length(self) -> float:
        """Length of the long axis, in mm."""
        return float(np.linalg.norm(self.base - self.apex))

    def local(self, points: ArrayLike) -> FloatArray:
        """Return (n, 3) positions in mm along septum, anterior wall and base, from the middle of the base."""
        moved: FloatArray = (as_floats(points, "points") - self.base) @ self.axes
        return moved

    def cylindrical(self, points: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return along (0 apex, 1 base), turn (degrees from septum to anterior wall, 0 to 360), radius (mm)."""
        x, y, z = self.local(points).T
        return 1 + z / self.length, np.degrees(np.arctan2(y, x)) % 360, np.hypot(x, y)


def ventricle_frame(
    mesh: Mesh,
    *,
    apex: ArrayLike | None = None,
    base: ArrayLike | None = None,
    septum: ArrayLike | None = None,
    right_ventricle: Volume | ArrayLike | None = None,
) -> VentricleFrame:
    """Find the long axis of a left ventricle and the direction of its septum.

    Parameters
    ----------
    mesh : Mesh
        Endocardial surface in mm (RAS where the rotation is automatic), closed, or open at the base.
    apex : (3,) array_like, optional
        The apex, on the surface. By default the vertex farthest from the base's middle.
    base : (3,) array_like, optional
        Middle of the basal plane. By default the middle of the opening, or of the flat cut of a closed surface.
    septum : (3, 3) array_like, optional
        Three landmarks across the septum, on the surface: front insertion of the right ventricle, middle of the
        septum, lower insertion. They are 60 degrees apart in the model; the rotation fits all three.
    right_ventricle : Volume or (m, 3) array_like, optional
        Instead of ``septum``: a mask of the right ventricle's blood (1 inside) on any grid, or points inside it in
        mm. The septum is the part of the surface that faces it nearest.

    Returns
    -------
    VentricleFrame

    Raises
    ------
    InputError
        If a landmark is off the surface by more than an eighth of the axis (at least 8 mm), apex and base coincide,
        the septal landmarks lie on one line or within 20 degrees around the axis, they run from below to the front
        (which would mirror the segments), or the mask is empty.
    MeshError
        If the mesh is empty, flat, or has several openings.

    Notes
    -----
    Without landmarks and without a right ventricle the septum is taken to look to the patient's right and front, as
    it does in most people: that is worth a confidence of 0.4 at most, and wrong coordinates (LPS for RAS) turn it by
    180 degrees. A closed surface without a flat cut leaves base and apex to guesswork, with confidence to match.

    References
    ----------
    Cerqueira et al., Standardized myocardial segmentation and nomenclature for tomographic imaging of the heart,
    Circulation 105, 2002; dissertation, section 5.3.

    Examples
    --------
    >>> from pliant.heart import heart_phantom
    >>> phantom = heart_phantom(spacing=4.0, mesh_step=3.0, rng=1)
    >>> ventricle_frame(phantom.mesh, **phantom.landmarks).confidence
    1.0
    """
    if septum is not None and right_ventricle is not None:
        raise InputError("give septum or right_ventricle, not both")
    ends = {name: checked_point(p, name) for name, p in (("apex", apex), ("base", base)) if p is not None}
    found = long_axis(mesh, base=ends.get("base"))
    top, bottom = ends.get("base", found.base), ends.get("apex", found.apex)
    sure = 1.0 if len(ends) == 2 else found.confidence
    length = float(np.linalg.norm(top - bottom))
    size = float(np.ptp(mesh.vertices, axis=0).max())
    if length < 0.05 * size:
        message = f"apex and base are {length:.3g} mm apart on a surface {size:.3g} mm across: no long axis"
        raise InputError(message)
    if apex is not None:
        refuse_far(mesh, bottom[None], "apex", length)
    if base is not None:
        refuse_far(mesh, top[None], "base", length, least=0.6 * length)
    up = (top - bottom) / length
    origin: Origin = "automatic"
    if septum is not None:
        towards, certain = rotation_of_landmarks(mesh, septum, bottom, up, length), 1.0
        origin = "landmarks"
    elif right_ventricle is not None:
        towards, certain = rotation_of_ventricle(mesh, right_ventricle, bottom, up, length)
        origin = "right ventricle"
    else:
        towards, certain = rotation_of_prior(up)
    axes = np.column_stack([towards, np.cross(up, towards), up])
    return VentricleFrame(bottom, top, axes, origin, min(sure, certain))


def aha_segments(mesh: Mesh, frame: VentricleFrame, *, cuts: Sequence[float] = CUTS) -> IntArray:
    """Label every vertex with its segment of the American Heart Association's model.

    Parameters
    ----------
    mesh : Mesh
        Endocardial surface, in the frame's millimetres.
    frame : VentricleFrame
        See :func:`ventricle_frame`.
    cuts : (3,) sequence of float
        Where the axis is cut, apex 0 to base 1: the cap of the apex ends, then the apical and the mid third.

    Returns
    -------
    (n,) array of int
        1 to 17; 0 on the cut at the base and beyond it. The cut is what lies within half a mean edge of the basal plane
        and, of the upper tenth, what faces the base.

    Raises
    ------
    InputError
        If the cuts do not ascend within 0 to 1.
    MeshError
        If a segment has no vertex; the message names the segments.

    Notes
    -----
    Basal and mid rings have six sectors of 60 degrees, the apical ring four of 90, turned from the septum towards the
    anterior wall in a right-handed frame. Linear in the vertices.

    References
    ----------
    Cerqueira et al. 2002; dissertation, section 5.3.

    Examples
    --------
    >>> from pliant.heart import heart_phantom
    >>> phantom = heart_phantom(spacing=4.0, mesh_step=3.0, rng=1)
    >>> labels = aha_segments(phantom.mesh, ventricle_frame(phantom.mesh, **phantom.landmarks))
    >>> bool((labels == phantom.labels).mean() > 0.97)
    True
    """
    limits = as_floats(cuts, "cuts")
    if limits.shape != (3,) or not (np.diff([0.0, *limits, 1.0]) > 0).all():
        message = f"cuts must be three numbers that ascend within 0 to 1, got {limits.tolist()}"
        raise InputError(message)
    along, turn, _ = frame.cylindrical(mesh.vertices)
    six, four = _SIX[(turn // 60).astype(int) % 6], _FOUR[((turn + 45) // 90).astype(int) % 4]
    level = np.searchsorted(limits, along, side="right")
    labels = np.choose(level, [np.full(len(six), 17), four, six + 6, six])
    tolerance = 0.5 * float(mesh.edge_lengths.mean()) / frame.length
    facing = mesh.vertex_normals @ frame.axes[:, 2] > np.cos(np.radians(30.0))
    labels[(along > 1 - tolerance) | (facing & (along > 0.9))] = 0
    empty = np.setdiff1d(np.arange(1, 18), labels)
    if empty.size:
        message = (
            f"{empty.size} of 17 segments have no vertex: {', '.join(map(str, empty))}; the mesh is too coarse, "
            "or the frame is not this surface's"
        )
        raise MeshError(message)
    return labels.astype(np.int64)
