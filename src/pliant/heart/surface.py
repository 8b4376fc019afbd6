"""The endocardial surface of a ventricle: marching cubes without holes, one piece, denoised, its volume kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from .._arrays import BoolArray, FloatArray, as_floats
from ..errors import InputError, MeshError, require
from ..mesh import Mesh, check_up, largest_component, without_unreferenced
from ._denoising import enclosed_volume, mean_face_normal_filter, vertex_diffusion
from .volume import Volume

__all__ = [
    "Denoising",
    "EndocardialSurface",
    "endocardial_surface",
    "mean_face_normal_filter",
    "vertex_diffusion",
]

Denoising: TypeAlias = Literal["normals", "diffusion", "none"]

# A voxel this near to the level (in spreads of the values) is moved just below it.
_NUDGE = 1e-3
# How far past the mask's rim, in mm, the level is looked for in the volume.
_REACH = 1.5
_ROUNDS = {"normals": 10, "diffusion": 10, "none": 0}


@dataclass(frozen=True, eq=False, repr=False)
class EndocardialSurface:
    """A closed surface and how it came about.

    Parameters
    ----------
    mesh : Mesh
        In RAS mm, closed, normals out of the blood.
    volume_ml : float
        What it holds.
    volume_change : float
        What denoising changed of that, as a share; below 0.01.
    genus : int or None
        Handles of the surface: each is a bridge of blood or of muscle, or a speck of noise. None where the surface
        is not a manifold.
    dropped : int
        Vertices of smaller pieces left out.
    settings : mapping
        What made it.
    """

    mesh: Mesh
    volume_ml: float
    volume_change: float
    genus: int | None
    dropped: int
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"EndocardialSurface({self.mesh!r}, {self.volume_ml:.1f} ml, genus {self.genus})"


def endocardial_surface(
    volume: Volume,
    *,
    mask: ArrayLike | None = None,
    basal_plane: tuple[ArrayLike, ArrayLike] | None = None,
    level: float | None = None,
    smoothing: float = 0.5,
    step: float = 1.0,
    denoising: Denoising = "normals",
    rounds: int | None = None,
) -> EndocardialSurface:
    """Triangulate the surface of the blood.

    Parameters
    ----------
    volume : Volume
        The image, or a mask of 0 and 1 (then ``level`` is a half and no ``mask`` is needed).
    mask : (nx, ny, nz) array_like of bool, optional
        The blood pool on the volume's grid. With it the surface runs where the image crosses the level, within
        1.5 mm of the mask's rim: finer than voxels. What the mask cuts off, as at the base, stays off.
    basal_plane : (point, normal), optional
        Cuts the surface flat: a point of the plane in RAS mm and the direction away from the apex.
    level : float, optional
        Value between blood and wall. By default halfway between the median inside the mask and the median of a shell
        around it; for a mask of 0 and 1, a half.
    smoothing : float
        Width (Gaussian sigma) of the smoothing before, in mm.
    step : float
        Distance of the grid the surface is made on, in mm: sets the length of edges. 0 takes the volume's own grid.
    denoising : {"normals", "diffusion", "none"}
        See :func:`mean_face_normal_filter` and :func:`vertex_diffusion`.
    rounds : int, optional
        Of denoising: 10 for either by default.

    Returns
    -------
    EndocardialSurface

    Raises
    ------
    InputError
        If the mask is empty or of another shape, the level is outside the values, or an option is unknown.
    MeshError
        If no closed surface comes out.
    MissingExtraError
        Without scikit-image (``pip install 'pliant[heart]'``).

    Notes
    -----
    Marching cubes in Lewiner's variant. Where a voxel has exactly the level's value, corners of triangles coincide and
    leave holes when degenerate triangles are dropped: such voxels are moved by a thousandth of the values' spread, and
    a layer of outside closes the surface at the volume's own rim. The largest piece is kept. About 0.5 s for 160³
    voxels.

    References
    ----------
    Lewiner et al., Efficient implementation of marching cubes' cases with topological guarantees, 2003; dissertation,
    section 5.2.

    Examples
    --------
    >>> x, y, z = np.mgrid[-12:13, -12:13, -12:13]
    >>> ball = Volume(np.sqrt(x**2 + y**2 + z**2) < 10, np.eye(4))
    >>> surface = endocardial_surface(ball)
    >>> round(surface.volume_ml, 1), surface.genus
    (4.1, 0)
    """
    _refuse_options(smoothing, step, denoising, rounds)
    values, threshold = _field(volume, mask, level, smoothing)
    if basal_plane is not None:
        values = np.minimum(values, threshold + _below(volume, *basal_plane))
    raw, dropped = _cubes(volume.with_values(values), threshold, step)
    count = _ROUNDS[denoising] if rounds is None else int(rounds)
    mesh = raw
    if denoising == "normals":
        mesh = mean_face_normal_filter(raw, rounds=count)
    elif denoising == "diffusion":
        mesh = vertex_diffusion(raw, rounds=count)
    before, after = enclosed_volume(raw), enclosed_volume(mesh)
    if abs(after / before - 1) > 0.01:
        message = f"denoising changed the volume from {before / 1000:.1f} to {after / 1000:.1f} ml; use fewer rounds"
        raise MeshError(message)
    settings = {
        "level": threshold,
        "smoothing": smoothing,
        "step": step,
        "denoising": denoising,
        "rounds": count,
        "from": "mask" if mask is None and set(np.unique(volume.values)) <= {0.0, 1.0} else "image",
    }
    return EndocardialSurface(mesh, after / 1000, after / before - 1, check_up(mesh).genus, dropped, settings)


def _refuse_options(smoothing: float, step: float, denoising: str, rounds: int | None) -> None:
    if denoising not in _ROUNDS:
        message = f'denoising must be "normals", "diffusion" or "none", got {denoising!r}'
        raise InputError(message)
    if not (smoothing >= 0 and step >= 0) or (rounds is not None and rounds < 0):
        message = f"smoothing, step and rounds must not be negative, got {smoothing}, {step} and {rounds}"
        raise InputError(message)


def _field(
    volume: Volume, mask: ArrayLike | None, level: float | None, smoothing: float
) -> tuple[FloatArray, float]:
    """Values whose crossing of the returned level is the surface."""
    values = ndimage.gaussian_filter(np.asarray(volume.values, dtype=np.float64), smoothing / volume.spacing)
    if mask is None:
        threshold = 0.5 if level is None and set(np.unique(volume.values)) <= {0.0, 1.0} else level
        if threshold is None:
            raise InputError("give the level between blood and wall, or a mask of the blood")
        if not values.min() < threshold < values.max():
            message = f"level {threshold:g} lies outside the values, {values.min():.4g} to {values.max():.4g}"
            raise InputError(message)
        return values, float(threshold)
    inside = np.asarray(mask, dtype=bool)
    if inside.shape != volume.shape:
        message = f"the mask must have the volume's shape {volume.shape}, got {inside.shape}"
        raise InputError(message)
    if not inside.any():
        raise InputError("the mask is empty: no voxel is blood")
    away = _distance(inside, volume.spacing, 4 * _REACH)
    blood = float(np.median(np.asarray(volume.values)[inside]))
    around = (away > _REACH) & (away < 3.5)
    if not around.any():
        raise InputError("the mask leaves nothing around it: no voxel next to the blood is wall")
    shell = float(np.median(np.asarray(volume.values)[around]))
    threshold = 0.5 * (blood + shell) if level is None else float(level)
    if not min(blood, shell) < threshold < max(blood, shell):
        message = (
            f"level {threshold:g} does not lie between blood ({blood:.4g}) and what is around ({shell:.4g})"
        )
        raise InputError(message)
    # The signed distance to the mask caps the image: the surface cannot leave the mask's neighbourhood, and where
    # the mask ends in the middle of blood, as at the base, it ends too.
    scaled = (values - threshold) / (0.5 * (blood - shell))
    cut = _cut_distance(inside, away, scaled)
    return np.minimum(scaled, cut), 0.0


def _below(volume: Volume, point: ArrayLike, normal: ArrayLike) -> FloatArray:
    """Distance of each voxel below a plane, in mm."""
    origin, away = as_floats(point, "basal_plane"), as_floats(normal, "basal_plane")
    if origin.shape != (3,) or away.shape != (3,) or not np.linalg.norm(away) > 0:
        raise InputError("basal_plane must be a point and a normal, three numbers each")
    away = away / np.linalg.norm(away)
    slope = away @ volume.affine[:3, :3]
    i, j, k = np.ogrid[tuple(slice(n) for n in volume.shape)]
    below: FloatArray = float(away @ (origin - volume.affine[:3, 3])) - (
        slope[0] * i + slope[1] * j + slope[2] * k
    )
    return below


def _distance(inside: BoolArray, spacing: FloatArray, reach: float) -> FloatArray:
    """Signed distance in mm to the mask's rim, negative inside, up to the reach outside."""
    outside = ndimage.distance_transform_edt(~inside, sampling=spacing)
    within = ndimage.distance_transform_edt(inside, sampling=spacing)
    half = 0.5 * float(spacing.min())
    signed: FloatArray = np.where(inside, half - within, np.minimum(outside - half, reach))
    return signed


def _cut_distance(inside: BoolArray, away: FloatArray, scaled: FloatArray) -> FloatArray:
    """Distance inwards from where the mask ends although blood goes on; the mask's rim plus the reach elsewhere."""
    rim = ndimage.binary_dilation(inside, iterations=2) & ~inside
    # Two voxels past a true wall the image is dark; past a cut it is as bright as blood.
    beyond = ndimage.binary_dilation(rim & (scaled > 0.4), iterations=1)
    near_cut = ndimage.binary_dilation(beyond, iterations=2)
    return np.where(near_cut, -away, _REACH - away)


def _cubes(volume: Volume, level: float, step: float) -> tuple[Mesh, int]:
    measure = require("skimage.measure", "heart")
    taken = volume.resampled(step) if step > 0 else volume
    values = np.asarray(taken.values, dtype=np.float64)
    low, spread = float(values.min()), float(values.std())
    near = np.abs(values - level) < _NUDGE * spread
    values = np.where(near, level - _NUDGE * spread, values)
    values = np.pad(values, 1, constant_values=min(low, level - spread))
    vertices, faces, _, _ = measure.marching_cubes(values, level, allow_degenerate=False)
    points = taken.points(vertices - 1.0)
    largest = largest_component(Mesh(points, faces.astype(np.int64)))
    mesh = without_unreferenced(largest.mesh).mesh
    if enclosed_volume(mesh) < 0:
        mesh = mesh.flipped()
    report = check_up(mesh)
    if report.boundary_loops:
        message = f"marching cubes left {report.boundary_loops} holes; move the level a little from {level:g}"
        raise MeshError(message)
    return mesh, len(points) - mesh.n_vertices
