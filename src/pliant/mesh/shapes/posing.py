"""Poses: how far every joint of a figure turns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..._arrays import FloatArray
from ...errors import InputError
from ._body import mirrored_name
from ._checks import checked_triple

__all__ = ["Pose"]


@dataclass(frozen=True)
class Pose:
    """How far the joints of a figure turn away from its rest pose.

    Parameters
    ----------
    turns : mapping of str to (3,) array_like of float
        For each joint that turns, its rotation vector in degrees: the direction is the axis (x to the
        figure's left, y up, z to the front, as at rest, carried along by the joints before), the length is
        the angle. Joints left out do not turn.
    name : str
        What the pose is called.

    Raises
    ------
    InputError
        If a turn is not three finite numbers, or longer than 180 degrees.

    See Also
    --------
    Figure.posed : Bend a figure into a pose.

    Examples
    --------
    >>> nod = Pose({"head": (20, 0, 0), "left_elbow": (-30, -30, 0)}, name="nod")
    >>> nod.mirrored().turns["right_elbow"]
    (-30.0, 30.0, 0.0)
    """

    turns: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    name: str = "custom"

    def __post_init__(self) -> None:
        if not isinstance(self.turns, Mapping):
            message = f"turns must map joint names to rotation vectors, got {type(self.turns).__name__}"
            raise InputError(message)
        checked = {str(joint): _checked_turn(turn, str(joint)) for joint, turn in self.turns.items()}
        object.__setattr__(self, "turns", checked)

    def mirrored(self) -> Pose:
        """Return the pose as a mirror shows it: left and right exchanged."""
        turns = {mirrored_name(joint): (x, 0.0 - y, 0.0 - z) for joint, (x, y, z) in self.turns.items()}
        return Pose(turns, name=self.name)

    def scaled(self, factor: float) -> Pose:
        """Return the pose with every turn multiplied by a factor: 0 is rest, 0.5 is half-way."""
        return Pose(
            {joint: (x * factor, y * factor, z * factor) for joint, (x, y, z) in self.turns.items()},
            self.name,
        )

    def as_array(self, joints: tuple[str, ...]) -> FloatArray:
        """Return the rotation vectors in the order of the joints of a figure, (j, 3), in degrees.

        Raises
        ------
        InputError
            If the pose turns a joint that is not among them.
        """
        unknown = sorted(set(self.turns) - set(joints))
        if unknown:
            message = (
                f"{len(unknown)} unknown joints, first {unknown[:5]}; this figure has: {', '.join(joints)}"
            )
            raise InputError(message)
        return np.array([self.turns.get(joint, (0.0, 0.0, 0.0)) for joint in joints])


def _checked_turn(turn: object, joint: str) -> tuple[float, float, float]:
    x, y, z = checked_triple(turn, f"turn of {joint}").tolist()
    angle = float(np.linalg.norm([x, y, z]))
    if angle > 180:
        message = f"{joint} turns by {angle:.0f} degrees; a rotation vector is at most 180 long"
        raise InputError(message)
    return (x, y, z)
