"""Left ventricles of known truth: CT volumes, their exact endocardial surfaces and segment labels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from .._arrays import BoolArray, FloatArray, IntArray, frozen
from ..mesh import Mesh
from .volume import Volume

__all__ = ["Change", "HeartPhantom"]

Change: TypeAlias = Literal["mixed", "height", "spacing", "direction", "smoothing", "none"]


@dataclass(frozen=True, eq=False, repr=False)
class HeartPhantom:
    """A contrast CT of a heart and everything that is true of its left ventricle.

    Parameters
    ----------
    volume : Volume
        The CT, in HU.
    mask : (nx, ny, nz) array of bool
        Voxels whose centre lies in the blood of the left ventricle, below the basal plane; papillary muscles are out.
    mesh : Mesh
        The endocardial surface in RAS mm, closed by the flat cut at the basal plane; normals point out of the blood.
    labels : (n,) array of int
        AHA segment 1 to 17 of each vertex; 0 on the cut.
    landmarks : mapping of str to array
        ``"apex"`` (3,) and ``"septum"`` (3, 3) (insertion of the right ventricle in front, middle of the septum,
        insertion below), on the surface; ``"base"`` (3,), the middle of the basal plane. RAS mm.
    right_ventricle : (nx, ny, nz) array of bool
        Voxels in the blood of the right ventricle.
    stenosis : (3,) array of float
        Per cent, of the territories LAD, LCX, RCA.
    settings : mapping
        What made it.
    """

    volume: Volume
    mask: BoolArray
    mesh: Mesh
    labels: IntArray
    landmarks: Mapping[str, FloatArray]
    right_ventricle: BoolArray
    stenosis: FloatArray
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("mask", "labels", "right_ventricle", "stenosis"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __repr__(self) -> str:
        return f"HeartPhantom({self.volume!r}, {self.mesh!r})"
