"""Volumes of voxels in millimetres: the value, and the files it comes from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from .._arrays import BoolArray, FloatArray, as_floats, frozen
from ..errors import InputError, first_indices
from ._volume_files import read_volume, write_image

__all__ = ["Volume", "load_volume", "save_mask"]


@dataclass(frozen=True, eq=False, repr=False)
class Volume:
    """A volume of voxels and where they lie in the body.

    Parameters
    ----------
    values : (nx, ny, nz) array_like
        One number a voxel, kept as float32, read-only.
    affine : (4, 4) array_like
        Takes voxel indices (i, j, k, 1) to RAS millimetres: x to the patient's right, y forward, z to the head.
    modality : str
        ``"CT"``, ``"MR"`` and so on; empty where the file does not say.
    units : str
        Of the values, ``"HU"`` for CT.

    Raises
    ------
    InputError
        If the values are not a three-dimensional array of finite numbers, or the affine is singular.

    Examples
    --------
    >>> volume = Volume(np.zeros((4, 5, 6)), np.diag([0.5, 0.5, 2.0, 1.0]), modality="CT", units="HU")
    >>> volume
    Volume(4 x 5 x 6 voxels of 0.5 x 0.5 x 2 mm, CT)
    >>> volume.points([[1, 1, 1]]).tolist()
    [[0.5, 0.5, 2.0]]
    """

    values: NDArray[np.float32]
    affine: FloatArray
    modality: str = ""
    units: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(_checked_values(self.values)))
        object.__setattr__(self, "affine", frozen(_checked_affine(self.affine)))

    def __repr__(self) -> str:
        size = " x ".join(str(n) for n in self.values.shape)
        steps = " x ".join(f"{step:g}" for step in self.spacing.round(4))
        kind = f", {self.modality}" if self.modality else ""
        return f"Volume({size} voxels of {steps} mm{kind})"

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along each axis."""
        nx, ny, nz = self.values.shape
        return nx, ny, nz

    @property
    def spacing(self) -> FloatArray:
        """(3,) distance between voxel centres along each axis, in mm; positive whatever the axes' directions."""
        lengths: FloatArray = np.linalg.norm(self.affine[:3, :3], axis=0)
        return lengths

    @property
    def voxel_volume(self) -> float:
        """Volume of one voxel, in mm³."""
        return float(abs(np.linalg.det(self.affine[:3, :3])))

    def points(self, indices: ArrayLike) -> FloatArray:
        """Return (..., 3) RAS positions in mm of voxel indices (..., 3), fractions allowed."""
        at = as_floats(indices, "indices")
        moved: FloatArray = at @ self.affine[:3, :3].T + self.affine[:3, 3]
        return moved

    def indices(self, points: ArrayLike) -> FloatArray:
        """Return (..., 3) voxel indices, with fractions, of RAS positions in mm (..., 3)."""
        offset = as_floats(points, "points") - self.affine[:3, 3]
        found: FloatArray = offset @ np.linalg.inv(self.affine[:3, :3]).T
        return found

    def with_values(self, values: ArrayLike) -> Volume:
        """Return a volume on the same grid with other values.

        Raises
        ------
        InputError
            If the shape differs.
        """
        if np.shape(values) != self.shape:
            message = f"values must have the volume's shape {self.shape}, got {np.shape(values)}"
            raise InputError(message)
        return Volume(np.asarray(values, dtype=np.float32), self.affine, self.modality, self.units)

    def resampled(self, spacing: float | ArrayLike) -> Volume:
        """Return the volume on a grid of another spacing with the same first voxel, interpolated linearly.

        Parameters
        ----------
        spacing : float or (3,) array_like
            New distance between voxel centres along each axis, in mm.

        Returns
        -------
        Volume
            Covers the centres of the old grid. Where voxels grow, the volume is smoothed first by a Gaussian of
            half the new spacing.

        Raises
        ------
        InputError
            If a spacing is not positive.
        """
        wanted = checked_spacing(spacing)
        step = wanted / self.spacing
        shape = tuple(int(n) for n in np.floor((np.array(self.shape) - 1) / step + 1e-6) + 1)
        values = np.asarray(self.values)
        coarser = np.where(step > 1, 0.5 * np.sqrt(np.maximum(step**2 - 1, 0)), 0.0)
        if coarser.any():
            values = ndimage.gaussian_filter(values, coarser)
        taken = ndimage.affine_transform(values, step, output_shape=shape, order=1, mode="nearest")
        affine = self.affine.copy()
        affine[:3, :3] = affine[:3, :3] * step
        return Volume(taken, affine, self.modality, self.units)


def load_volume(path: str | Path, *, modality: str | None = None, series: str | None = None) -> Volume:
    """Read a volume: a folder of one DICOM series, or a NIfTI, NRRD, MHA or MHD file.

    Parameters
    ----------
    path : path-like
        A folder with the slices of a DICOM series, or a file.
    modality : str, optional
        The modality the volume must have, as ``"CT"``. A DICOM series of another one is refused; a file that does
        not say is taken to be of this one.
    series : str, optional
        Which series to read, by its Series Instance UID, where a folder holds several.

    Returns
    -------
    Volume
        In RAS millimetres whatever the file's convention. DICOM values are rescaled (HU for CT).

    Raises
    ------
    FileFormatError
        If a file is damaged or cut short, or is of no kind known here.
    InputError
        If the folder holds several series, slices are missing, doubled or unequally spaced, the modality is another
        one than asked for, the spacing is not positive, or the image is not a single 3D volume.
    MissingExtraError
        For DICOM, NRRD and MHA without SimpleITK (``pip install 'pliant[heart]'``).

    Notes
    -----
    Slices are ordered by their position along the normal, never by file name. Time is linear in the voxels; 64 MB for
    256³ voxels. Nothing here looks at the gantry: a tilted series keeps its sheared axes in the affine.

    Examples
    --------
    >>> import tempfile
    >>> volume = Volume(np.ones((3, 4, 5)), np.eye(4), modality="CT", units="HU")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_mask(volume.values > 0, volume, Path(folder) / "mask.nii.gz")
    ...     load_volume(Path(folder) / "mask.nii.gz").shape
    (3, 4, 5)
    """
    values, affine, found = read_volume(Path(path), modality=modality, series=series)
    kind = found or modality or ""
    return Volume(values, affine, kind, "HU" if kind == "CT" else "")


def save_mask(mask: ArrayLike, volume: Volume, path: str | Path) -> None:
    """Write a mask on a volume's grid as 0 and 1: NIfTI (.nii, .nii.gz), NRRD or MHA.

    Parameters
    ----------
    mask : (nx, ny, nz) array_like of bool
        What to write.
    volume : Volume
        Whose grid the mask lies on.
    path : path-like
        Where to; the ending says which format. The file appears whole or not at all.

    Raises
    ------
    InputError
        If the shapes differ, or the ending is unknown.

    Examples
    --------
    See :func:`load_volume`.
    """
    array: BoolArray = np.asarray(mask, dtype=bool)
    if array.shape != volume.shape:
        message = f"the mask must have the volume's shape {volume.shape}, got {array.shape}"
        raise InputError(message)
    write_image(Path(path), array.astype(np.uint8), np.asarray(volume.affine))


def checked_spacing(spacing: float | ArrayLike, name: str = "spacing", dimensions: int = 3) -> FloatArray:
    """Return (dimensions,) positive spacings in mm, or refuse."""
    given = as_floats(spacing, name)
    if given.shape not in {(), (dimensions,)}:
        message = f"{name} must be one number or {dimensions}, got shape {given.shape}"
        raise InputError(message)
    values = np.broadcast_to(given, (dimensions,)).copy()
    bad = np.flatnonzero(~(np.isfinite(values) & (values > 0)))
    if bad.size:
        message = f"{name} must be positive, in mm: {values[bad[0]]:g} along axis {bad[0]}"
        raise InputError(message)
    return values


def _checked_values(values: Any) -> NDArray[np.float32]:
    try:
        array = np.asarray(values, dtype=np.float32)
    except (TypeError, ValueError) as error:
        message = f"values must be an array of numbers: {error}"
        raise InputError(message) from error
    if array.ndim != 3 or array.size == 0:
        message = f"values must be a volume of shape (nx, ny, nz) with at least one voxel, got {array.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(array).ravel())
    if bad.size:
        message = (
            f"values: {bad.size} of {array.size} voxels are not finite, first at flat indices "
            f"{first_indices(bad)}; fill them, as with air at -1000 HU"
        )
        raise InputError(message)
    return array


def _checked_affine(affine: Any) -> FloatArray:
    matrix = as_floats(affine, "affine")
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        message = f"affine must be a finite (4, 4) matrix, got shape {matrix.shape}"
        raise InputError(message)
    if not np.array_equal(matrix[3], [0, 0, 0, 1]):
        message = f"affine must end in the row [0, 0, 0, 1], got {matrix[3].tolist()}"
        raise InputError(message)
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if not (lengths > 0).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-6 * lengths.prod():
        message = (
            f"affine is singular: its axes have lengths {lengths.round(6).tolist()} mm and do not span space"
        )
        raise InputError(message)
    return matrix
