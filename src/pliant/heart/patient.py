"""One patient from a volume or a surface to described segments, every step's settings written down."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, IntArray, as_floats, frozen
from .._progress import Advance, progress_bar
from ..errors import InputError, PliantWarning
from ..mesh import Mesh, check_up
from ._axis import long_axis
from .features import SegmentFeatures, endocardial_features
from .segmentation import segment_blood_pool
from .segments import VentricleFrame, aha_segments, ventricle_frame
from .surface import endocardial_surface
from .volume import Volume

__all__ = ["HeartDescription", "describe_heart"]

Plane: TypeAlias = tuple[FloatArray, FloatArray]

_LANDMARKS = ("apex", "base", "septum")


@dataclass(frozen=True, eq=False, repr=False)
class HeartDescription:
    """A left ventricle, described.

    Parameters
    ----------
    mesh : Mesh
        Endocardial surface in RAS mm.
    labels : (n,) array of int
        AHA segment of each vertex, 0 on the cut at the base.
    frame : VentricleFrame
        Long axis and septum.
    features : SegmentFeatures
        The 23 numbers, roughness and cavity volume.
    steps : mapping of str to mapping
        Settings and findings of each step, in the order they were taken.
    cautions : tuple of str
        What to look at before using the numbers.
    volume : Volume, optional
        The image, where one was given.
    mask : (nx, ny, nz) array of bool, optional
        Its blood pool.
    """

    mesh: Mesh
    labels: IntArray
    frame: VentricleFrame
    features: SegmentFeatures
    steps: Mapping[str, Mapping[str, Any]]
    cautions: tuple[str, ...] = ()
    volume: Volume | None = None
    mask: BoolArray | None = field(default=None)

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", frozen(self.labels))

    def __repr__(self) -> str:
        return f"HeartDescription({self.features.cavity_ml:.1f} ml, {self.frame!r}, {len(self.cautions)} cautions)"


def describe_heart(
    source: Volume | Mesh,
    *,
    mask: ArrayLike | None = None,
    landmarks: Mapping[str, ArrayLike] | None = None,
    right_ventricle: Volume | None = None,
    points: int = 500,
    radius: float = 3.0,
    rng: int = 0,
    n_jobs: int | None = None,
    progress: bool = False,
) -> HeartDescription:
    """Find, divide and describe the left ventricle of one patient.

    Parameters
    ----------
    source : Volume or Mesh
        A contrast CT, or an endocardial surface in RAS mm made already.
    mask : (nx, ny, nz) array_like of bool, optional
        The blood pool of the left ventricle below its base, instead of finding it.
    landmarks : mapping, optional
        Any of ``"apex"`` (3,), ``"base"`` (3,), ``"septum"`` (3, 3), in RAS mm; see :func:`ventricle_frame`.
    right_ventricle : Volume, optional
        A mask of the right ventricle, instead of septal landmarks.
    points, radius, rng
        As for :func:`endocardial_features`.
    n_jobs : int, optional
        Threads.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    HeartDescription

    Raises
    ------
    InputError
        If no ventricle is found, or a landmark is unknown or unusable.
    MeshError
        If no closed surface or no complete division comes out.

    Notes
    -----
    Research software, not a medical device. About 25 s of one core for a CT of 160³ voxels at 1 mm.

    Examples
    --------
    >>> from pliant.heart import heart_phantom
    >>> phantom = heart_phantom(spacing=4.0, mesh_step=2.0, rng=1)
    >>> describe_heart(phantom.mesh, landmarks=phantom.landmarks, points=40).cautions
    ()
    """
    marks = dict(landmarks or {})
    unknown = sorted(set(marks) - set(_LANDMARKS))
    if unknown:
        message = f"landmarks are {', '.join(_LANDMARKS)}; got {', '.join(unknown)}"
        raise InputError(message)
    with progress_bar("describing the heart: steps", 4, show=progress) as advance:
        return _described(
            source,
            mask,
            marks,
            right_ventricle,
            n_jobs,
            {"points": points, "radius": radius, "rng": rng},
            advance,
        )


def _described(
    source: Volume | Mesh,
    mask: ArrayLike | None,
    marks: dict[str, ArrayLike],
    right_ventricle: Volume | None,
    n_jobs: int | None,
    sampling: dict[str, Any],
    advance: Advance,
) -> HeartDescription:
    steps: dict[str, Mapping[str, Any]] = {}
    cautions: list[str] = []
    if isinstance(source, Mesh):
        mesh, found = source, None
        steps["surface"] = {"from": "a mesh", "vertices": mesh.n_vertices, "genus": check_up(mesh).genus}
        advance()
    else:
        found, plane = _blood_pool(source, mask, marks, steps, cautions, n_jobs)
        advance()
        mesh = _surface(source, found, plane, steps)
        if plane is not None:
            marks.setdefault("base", plane[0])
        advance()
    frame = ventricle_frame(mesh, right_ventricle=right_ventricle, **marks)
    labels = aha_segments(mesh, frame)
    steps["segments"] = {
        "rotation from": frame.origin, "confidence": round(frame.confidence, 3),
        "long axis (mm)": round(frame.length, 2),
        "apex (mm)": frame.apex.round(2).tolist(), "base (mm)": frame.base.round(2).tolist(),
    }  # fmt: skip
    if "base" not in marks and (axis := long_axis(mesh).confidence) < 0.5:
        cautions.append(f"the long axis is found from the surface, confidence {axis:.2f}: give apex and base")
    if frame.confidence < 0.5:
        cautions.append(
            f"the rotation of the segments is {frame.origin}, confidence {frame.confidence:.2f}: give septal landmarks"
        )
    advance()
    features = endocardial_features(mesh, labels, frame, n_jobs=n_jobs, **sampling)
    advance()
    steps["features"] = {
        **features.settings,
        "seed": sampling["rng"],
        "points with a number missing": features.n_missing,
    }
    image = None if isinstance(source, Mesh) else source
    return HeartDescription(mesh, labels, frame, features, steps, tuple(cautions), image, found)


def _blood_pool(
    volume: Volume,
    mask: ArrayLike | None,
    landmarks: Mapping[str, ArrayLike],
    steps: dict[str, Mapping[str, Any]],
    cautions: list[str],
    n_jobs: int | None,
) -> tuple[BoolArray, Plane | None]:
    steps["volume"] = {
        "voxels": " x ".join(map(str, volume.shape)), "spacing (mm)": volume.spacing.round(3).tolist(),
        "modality": volume.modality or "not stated",
    }  # fmt: skip
    plane: Plane | None = None
    if "apex" in landmarks and "base" in landmarks:
        base = as_floats(landmarks["base"], "base")
        plane = (base, base - as_floats(landmarks["apex"], "apex"))
    if mask is not None:
        given = np.asarray(mask, dtype=bool)
        millilitres = round(float(given.sum()) * volume.voxel_volume / 1000, 1)
        steps["blood pool"] = {"from": "a mask", "volume (ml)": millilitres}
        return given, plane
    with warnings.catch_warnings():
        # They are among the pool's warnings, and so among the cautions.
        warnings.simplefilter("ignore", PliantWarning)
        pool = segment_blood_pool(volume, basal_plane=plane, n_jobs=n_jobs)
    steps["blood pool"] = {
        "from": "the image", "confidence": round(pool.confidence, 3), "volume (ml)": round(pool.millilitres, 1),
        "leak": pool.leak, **pool.settings,
    }  # fmt: skip
    if pool.leak:
        cautions.append("the blood pool leaks out of the ventricle: look at the contour")
    elif pool.confidence < 0.5:
        cautions.append(
            f"the basal plane was found with a confidence of {pool.confidence:.2f}: look at the contour"
        )
    cautions.extend(pool.warnings)
    return np.asarray(pool.mask), pool.basal_plane


def _surface(
    volume: Volume, mask: BoolArray, plane: Plane | None, steps: dict[str, Mapping[str, Any]]
) -> Mesh:
    surface = endocardial_surface(volume, mask=mask, basal_plane=plane)
    steps["surface"] = {
        **surface.settings, "volume (ml)": round(surface.volume_ml, 2),
        "change by denoising": f"{surface.volume_change:.1e}", "genus": surface.genus,
        "vertices": surface.mesh.n_vertices, "vertices dropped": surface.dropped,
    }  # fmt: skip
    return surface.mesh
