"""The rotation of a ventricle about its long axis: from three landmarks, the right ventricle, or where hearts lie."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from .._arrays import FloatArray, as_floats
from ..errors import InputError, first_indices
from ..mesh import Mesh
from .volume import Volume

# Degrees from the middle of the septum: front insertion, middle, lower insertion.
_MODEL = np.array([60.0, 0.0, -60.0])
# In RAS: where most people's septum looks, and where their apex points.
_SEPTUM_PRIOR, _APEX_PRIOR = np.array([0.78, 0.60, -0.17]), np.array([-0.60, 0.62, -0.50])
_PRIOR_CONFIDENCE = 0.4
# The septum is looked for between these heights of the axis; points of the right ventricle beyond this are thinned.
_LEVELS = (0.25, 0.9)
_MOST_POINTS = 20_000


def checked_point(point: ArrayLike, name: str) -> FloatArray:
    """Return a finite (3,) position."""
    found = as_floats(point, name)
    if found.shape != (3,) or not np.isfinite(found).all():
        message = f"{name} must be three finite numbers in mm, got shape {found.shape}"
        raise InputError(message)
    return found


def refuse_far(mesh: Mesh, points: FloatArray, name: str, length: float, *, least: float = 8.0) -> None:
    """Refuse landmarks that are not near the surface."""
    allowed = max(least, length / 8)
    distances = np.asarray(cKDTree(mesh.vertices).query(points)[0])
    far = np.flatnonzero(distances > allowed)
    if far.size:
        which = f" {first_indices(far)}" if len(points) > 1 else ""
        message = (
            f"{name}: {far.size} of {len(points)} landmarks{which} are not on the surface, up to "
            f"{distances.max():.3g} mm away ({allowed:.3g} allowed); give them in the mesh's millimetres (RAS)"
        )
        raise InputError(message)


def rotation_of_landmarks(
    mesh: Mesh, septum: ArrayLike, apex: FloatArray, up: FloatArray, length: float
) -> FloatArray:
    """Return the unit vector, across the axis, to the middle of the septum that fits three landmarks best."""
    points = as_floats(septum, "septum")
    if points.shape != (3, 3) or not np.isfinite(points).all():
        message = f"septum must be three positions in mm, shape (3, 3), got {points.shape}"
        raise InputError(message)
    refuse_far(mesh, points, "septum", length)
    chord = points[2] - points[0]
    reach = float(np.linalg.norm(chord))
    height = float(np.linalg.norm(np.cross(points[1] - points[0], chord))) / reach if reach else 0.0
    if height < 0.01 * reach or reach < 0.02 * length:
        message = (
            "the three septal landmarks are collinear, so they do not fix the rotation; give the front insertion of "
            "the right ventricle, the middle of the septum and the lower insertion"
        )
        raise InputError(message)
    across = np.cross(up, _any_across(up))
    turns = np.degrees(_turns(points - apex, up, across))
    span = (turns[0] - turns[2] + 180) % 360 - 180
    if span < 0:
        message = (
            f"the septal landmarks run the wrong way round ({-span:.0f} degrees): give them from the front insertion "
            "to the lower one, in right-handed millimetres (a flipped image mirrors them)"
        )
        raise InputError(message)
    if span < 20:
        message = (
            f"the septal landmarks span {span:.0f} degrees around the axis, 20 are needed to fix the rotation"
        )
        raise InputError(message)
    return _direction(turns - _MODEL, np.ones(3), up, across)


def rotation_of_ventricle(
    mesh: Mesh, right: Volume | ArrayLike, apex: FloatArray, up: FloatArray, length: float
) -> tuple[FloatArray, float]:
    """Return the direction of the septum's middle, level by level halfway between its ends, and a confidence."""
    points = _points_of(right)
    along = (mesh.vertices - apex) @ up / length
    inside = np.flatnonzero((along > _LEVELS[0]) & (along < _LEVELS[1]))
    distances = cKDTree(points).query(mesh.vertices[inside])[0]
    nearest = float(np.percentile(distances, 2))
    # The septum is about as thick everywhere; past its insertions the distance grows fast.
    facing = distances < max(1.6 * nearest, nearest + 5.0)
    across = np.cross(up, _any_across(up))
    turns = np.degrees(_turns(mesh.vertices[inside][facing] - apex, up, across))
    middle = _circular_mean(turns)
    offsets = (turns - middle + 180) % 360 - 180
    ends = np.percentile(offsets, [3, 97])
    middle += float(ends.mean())
    span = float(ends[1] - ends[0])
    # A septum of 120 degrees is the model's; next to nothing or more than half of the ring is not a septum.
    confidence = 0.9 * float(np.clip(1 - abs(span - 110) / 110, 0, 1)) * float(nearest < 0.4 * length)
    return _direction(np.array([middle]), np.ones(1), up, across), confidence


def rotation_of_prior(up: FloatArray) -> tuple[FloatArray, float]:
    """Return where the septum of most people looks, across this axis, and how far that can be trusted."""
    flat = _SEPTUM_PRIOR - (_SEPTUM_PRIOR @ up) * up
    likely = max(0.0, float(-up @ _APEX_PRIOR) / float(np.linalg.norm(_APEX_PRIOR)))
    size = float(np.linalg.norm(flat))
    if size < 0.2:
        flat, likely = _any_across(up), 0.0
    towards: FloatArray = flat / np.linalg.norm(flat)
    return towards, _PRIOR_CONFIDENCE * likely


def _points_of(right: Volume | ArrayLike) -> FloatArray:
    if isinstance(right, Volume):
        points = right.points(np.argwhere(np.asarray(right.values) > 0.5))
    else:
        points = as_floats(right, "right_ventricle")
    if points.ndim != 2 or points.shape[-1] != 3 or not np.isfinite(points).all():
        message = (
            f"right_ventricle must be a Volume or (m, 3) finite positions in mm, got shape {points.shape}"
        )
        raise InputError(message)
    if len(points) < 10:
        message = f"the right ventricle has {len(points)} points: the mask is empty, or not a mask of 0 and 1"
        raise InputError(message)
    return points[:: max(1, len(points) // _MOST_POINTS)]


def _any_across(up: FloatArray) -> FloatArray:
    other = np.eye(3)[np.argmin(np.abs(up))]
    across: FloatArray = other - (other @ up) * up
    return across / float(np.linalg.norm(across))


def _turns(offsets: FloatArray, up: FloatArray, across: FloatArray) -> FloatArray:
    turns: FloatArray = np.arctan2(offsets @ np.cross(up, across), offsets @ across)
    return turns


def _circular_mean(degrees: FloatArray, weights: FloatArray | None = None) -> float:
    radians = np.radians(degrees)
    weight = np.ones(len(degrees)) if weights is None else weights
    return float(np.degrees(np.arctan2((weight * np.sin(radians)).sum(), (weight * np.cos(radians)).sum())))


def _direction(degrees: FloatArray, weights: FloatArray, up: FloatArray, across: FloatArray) -> FloatArray:
    turn = np.radians(_circular_mean(degrees, weights))
    direction: FloatArray = np.cos(turn) * across + np.sin(turn) * np.cross(up, across)
    return direction
