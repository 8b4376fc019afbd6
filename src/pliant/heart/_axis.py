"""The long axis of a ventricle found from its surface alone: the flat cut at the base, the apex across from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from .._arrays import FloatArray, IntArray
from ..errors import MeshError
from ..mesh import Mesh, boundary_loops

# Hull facets that lie this near to one plane are one flat cut.
_TILT, _STEP = np.cos(np.radians(4.0)), 0.012
# A cut as large as this share of the widest cross-section leaves no doubt which end is the base.
_SURE_SHARE = 0.45
# Part of the axis whose surface gives its direction.
_CAP = 0.2


@dataclass(frozen=True, eq=False)
class LongAxis:
    """Apex and middle of the base, (3,) each in mm, and how sure they are, 0 to 1."""

    apex: FloatArray
    base: FloatArray
    confidence: float


def long_axis(mesh: Mesh, *, base: FloatArray | None = None) -> LongAxis:
    """Find apex and base: the middle of the opening, or of the flat cut, and the vertex farthest from it."""
    if not mesh.n_faces or not mesh.area > 0:
        raise MeshError("the mesh has no surface: a ventricle needs triangles")
    if base is not None:
        return LongAxis(_tip(mesh, base), base, 0.9)
    loops = _checked_loops(mesh)
    if loops:
        rim = mesh.vertices[loops[0]]
        following = np.roll(rim, -1, axis=0)
        lengths = np.linalg.norm(following - rim, axis=1, keepdims=True)
        middle = (0.5 * (rim + following) * lengths).sum(axis=0) / lengths.sum()
        return LongAxis(_tip(mesh, middle), middle, 0.9)
    middle, confidence = _flat_cut(mesh)
    return LongAxis(_tip(mesh, middle), middle, confidence)


def _checked_loops(mesh: Mesh) -> tuple[IntArray, ...]:
    """Return the boundary loops of a surface closed or open at one end; refuse others."""
    loops = boundary_loops(mesh)
    if len(loops) > 1:
        sizes = sorted((len(loop) for loop in loops), reverse=True)
        message = (
            f"the surface has {len(loops)} openings, of {', '.join(map(str, sizes[:5]))} vertices: a ventricle is "
            "closed, or open at its base only; close the other holes, or say where the base is"
        )
        raise MeshError(message)
    return loops


def _tip(mesh: Mesh, middle: FloatArray) -> FloatArray:
    """Return the end of the axis through the middle of the base and the middle of the far tenth of the surface.

    One farthest vertex jumps about on a blunt apex; the mean of a cap does not.
    """
    reach = np.linalg.norm(mesh.vertices - middle, axis=1)
    weights = mesh.vertex_areas * (reach > (1 - _CAP) * reach.max())
    if not weights.sum() > 0:
        weights = (reach == reach.max()).astype(np.float64)
    towards = weights @ mesh.vertices / weights.sum() - middle
    towards /= np.linalg.norm(towards)
    found: FloatArray = middle + float(((mesh.vertices - middle) @ towards).max()) * towards
    return found


def _flat_cut(mesh: Mesh) -> tuple[FloatArray, float]:
    """Middle of the largest flat part of the convex hull, and how much it looks like a cut ventricle's base."""
    try:
        hull = ConvexHull(mesh.vertices)
    except QhullError as error:
        message = "the mesh is flat: its vertices lie in one plane, so it has no long axis"
        raise MeshError(message) from error
    corners = mesh.vertices[hull.simplices]
    areas = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    size = float(np.ptp(mesh.vertices, axis=0).max())
    centres = corners.mean(axis=1)
    best, chosen = 0.0, np.zeros(len(areas), dtype=bool)
    for i in np.argsort(-areas)[:60]:
        height = np.abs(centres @ normals[i] + offsets[i])
        together = (normals @ normals[i] > _TILT) & (height < _STEP * size)
        if areas[together].sum() > best:
            best, chosen = float(areas[together].sum()), together
    # Areas times slants sum to twice the shadow the hull casts along the cut's normal.
    normal = (normals[chosen] * areas[chosen, None]).sum(axis=0)
    normal /= np.linalg.norm(normal)
    shadow = 0.5 * float((areas * np.abs(normals @ normal)).sum())
    middle = (centres[chosen] * areas[chosen, None]).sum(axis=0) / areas[chosen].sum()
    return middle, 0.9 * min(1.0, best / (_SURE_SHARE * shadow))
