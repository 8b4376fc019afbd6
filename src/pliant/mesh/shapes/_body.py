"""What a figure is made of: limbs of round cones, blended smoothly, over a tree of joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..._arrays import FloatArray

Point: TypeAlias = tuple[float, float, float]
Turns: TypeAlias = dict[str, Point]

_LINKS = 3


@dataclass(frozen=True)
class Joint:
    """A point of the skeleton, and how far it turns in random poses.

    ``limits`` are (low, high) degrees about x, y and z. A joint named ``left_...`` stands for its mirror
    image too.
    """

    name: str
    parent: str | None
    position: Point
    limits: tuple[tuple[float, float], tuple[float, float], tuple[float, float]] = ((0, 0), (0, 0), (0, 0))


@dataclass(frozen=True)
class Blob:
    """A round cone: the hull of two balls, stretched along the axes; it moves with one joint."""

    joint: str
    part: str
    start: Point
    start_radius: float
    stop: Point
    stop_radius: float
    stretch: Point = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Limb:
    """Round cones blended into each other over ``blend``, then into the limbs before over ``join``."""

    blobs: tuple[Blob, ...]
    blend: float
    join: float
    paired: bool = False


@dataclass(frozen=True)
class Body:
    """Skeleton and flesh of one figure, the left side standing for both."""

    joints: tuple[Joint, ...]
    limbs: tuple[Limb, ...]

    def all_joints(self) -> tuple[Joint, ...]:
        """Every joint, each left one followed by its mirror image; parents come first."""
        out: list[Joint] = []
        for joint in self.joints:
            out.append(joint)
            if joint.name.startswith("left_"):
                out.append(_mirrored_joint(joint))
        return tuple(out)

    def part_names(self) -> tuple[str, ...]:
        """Name of every part, each left one followed by its mirror image."""
        names: dict[str, None] = {}
        for limb in self.limbs:
            for blob in limb.blobs:
                names[blob.part] = None
                names[mirrored_name(blob.part)] = None
        return tuple(names)


@dataclass(frozen=True, eq=False)
class Flesh:
    """A body as two tables for the kernels, packed because a kernel's call costs by the argument.

    ``solids`` (blobs, 12): start, stop (in stretched space), two radii, shrink along x, y, z, least stretch.
    ``limbs`` (limbs, 10): first and last + 1 blob, blend, join, paired, then the ball around the limb (centre,
    radius) and the least share of a true distance its field can show outside.
    """

    solids: FloatArray
    limbs: FloatArray


def flesh_of(body: Body) -> Flesh:
    """Lay out the limbs of a body in tables."""
    solids = np.array([_solid_row(blob) for limb in body.limbs for blob in limb.blobs])
    firsts = np.cumsum([0, *(len(limb.blobs) for limb in body.limbs)])
    limbs = [
        (firsts[i], firsts[i + 1], limb.blend, limb.join, float(limb.paired), *_surrounding(limb))
        for i, limb in enumerate(body.limbs)
    ]
    return Flesh(solids, np.array(limbs))


def _solid_row(blob: Blob) -> FloatArray:
    stretch = np.array(blob.stretch)
    ends = [np.array(blob.start) / stretch, np.array(blob.stop) / stretch]
    return np.concatenate([*ends, [blob.start_radius, blob.stop_radius], 1 / stretch, [stretch.min()]])


def _surrounding(limb: Limb) -> tuple[float, float, float, float, float]:
    ends = np.array([end for blob in limb.blobs for end in (blob.start, blob.stop)])
    balls = [r * max(blob.stretch) for blob in limb.blobs for r in (blob.start_radius, blob.stop_radius)]
    reach = np.array(balls)[:, None]
    low, high = (ends - reach).min(axis=0), (ends + reach).max(axis=0)
    ratio = min(min(blob.stretch) / max(blob.stretch) for blob in limb.blobs)
    x, y, z = ((low + high) / 2).tolist()
    return x, y, z, float(np.linalg.norm(high - low) / 2), ratio


def chain(
    joints: Sequence[str],
    parts: Sequence[str],
    points: Sequence[Point],
    radii: Sequence[float],
    *,
    stretch: Point = (1.0, 1.0, 1.0),
) -> tuple[Blob, ...]:
    """Round cones along a smooth curve through points with radii, the i-th stretch moving with the i-th joint."""
    knots = np.column_stack([np.array(points), np.array(radii)])
    steps = np.linalg.norm(np.diff(knots[:, :3], axis=0), axis=1)
    curve = PchipInterpolator(np.concatenate([[0], np.cumsum(steps)]), knots)
    blobs = []
    for i, (joint, part) in enumerate(zip(joints, parts, strict=True)):
        places = curve(steps[:i].sum() + steps[i] * np.linspace(0, 1, _LINKS + 1)).tolist()
        for (x, y, z, r), (u, v, w, q) in pairwise(places):
            blobs.append(Blob(joint, part, (x, y, z), r, (u, v, w), q, stretch))
    return tuple(blobs)


def grown(
    body: Body,
    root: str,
    length: float,
    *,
    girth: float = 1.0,
    until: str | None = None,
    only_y: bool = False,
) -> Body:
    """Scale what hangs on a joint about that joint; what hangs on ``until`` is only carried along."""
    inside, carried = _descendants(body, root), _descendants(body, until)
    places = {joint.name: np.array(joint.position) for joint in body.joints}
    factors = np.array([1, length, 1]) if only_y else np.full(3, length)

    def moved(point: Point, joint: str) -> Point:
        if joint not in inside:
            return point
        at = np.array(point)
        if until is not None and joint in carried:
            at = at + (factors - 1) * (places[until] - places[root])
        else:
            at = places[root] + factors * (at - places[root])
        return (float(at[0]), float(at[1]), float(at[2]))

    def fed(blob: Blob) -> Blob:
        wide = girth if blob.joint in inside - carried else 1.0
        return replace(
            blob,
            start=moved(blob.start, blob.joint),
            stop=moved(blob.stop, blob.joint),
            start_radius=blob.start_radius * wide,
            stop_radius=blob.stop_radius * wide,
        )

    joints = tuple(replace(joint, position=moved(joint.position, joint.name)) for joint in body.joints)
    limbs = tuple(replace(limb, blobs=tuple(map(fed, limb.blobs))) for limb in body.limbs)
    return Body(joints, limbs)


def _descendants(body: Body, root: str | None) -> set[str]:
    found = set() if root is None else {root}
    for joint in body.joints:
        if joint.parent in found:
            found.add(joint.name)
    return found


def mirrored_name(name: str) -> str:
    """Swap left and right at the start of a name."""
    if name.startswith("left"):
        return "right" + name[4:]
    return "left" + name[5:] if name.startswith("right") else name


def _mirrored_joint(joint: Joint) -> Joint:
    x, y, z = joint.position
    about_x, (low_y, high_y), (low_z, high_z) = joint.limits
    parent = None if joint.parent is None else mirrored_name(joint.parent)
    limits = (about_x, (-high_y, -low_y), (-high_z, -low_z))
    return replace(joint, name=mirrored_name(joint.name), parent=parent, position=(-x, y, z), limits=limits)
