"""Files of volumes: NIfTI by nibabel; DICOM series, NRRD and MetaImage by SimpleITK; everything to RAS."""

from __future__ import annotations

import contextlib
import os
import tempfile
import warnings
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray
from ..errors import FileFormatError, InputError, require

Read: TypeAlias = tuple[NDArray[np.float32], FloatArray, str]

_NIFTI, _ITK = (".nii", ".nii.gz"), (".nrrd", ".nhdr", ".mha", ".mhd")
# DICOM and ITK count x to the left and y to the back.
_FLIP = np.diag([-1.0, -1.0, 1.0, 1.0])
# Slices this far from an even step, as a part of it, are not rounding of the header's decimals.
_UNEVEN = 0.05


def read_volume(path: Path, *, modality: str | None, series: str | None) -> Read:
    """Return values, the affine to RAS mm and the modality ("" where the file does not say)."""
    if path.is_dir():
        return _dicom(path, modality, series)
    if not path.exists():
        message = f"{path} does not exist"
        raise InputError(message)
    name = path.name.lower()
    if name.endswith(_NIFTI):
        return _nifti(path)
    if name.endswith(_ITK):
        return _itk_file(path)
    message = f"{path.name}: not a folder of DICOM slices, nor a file ending in {', '.join(_NIFTI + _ITK)}"
    raise FileFormatError(message)


def write_image(path: Path, values: NDArray[Any], affine: FloatArray) -> None:
    """Write an image of whole numbers, whole or not at all."""
    ending = next((e for e in (".nii.gz", *_NIFTI, *_ITK) if path.name.lower().endswith(e)), None)
    if ending is None or ending in {".nhdr", ".mhd"}:
        message = f"{path.name}: the name must end in .nii, .nii.gz, .nrrd or .mha"
        raise InputError(message)
    if not path.absolute().parent.is_dir():
        message = f"the folder {path.parent} does not exist"
        raise InputError(message)
    handle, draft = tempfile.mkstemp(suffix=ending, dir=path.absolute().parent)
    os.close(handle)
    try:
        if ending in _NIFTI:
            _write_nifti(draft, values, affine)
        else:
            _write_itk(draft, values, affine)
        Path(draft).chmod(0o644)
        Path(draft).replace(path)
    finally:
        Path(draft).unlink(missing_ok=True)


def _write_nifti(path: str, values: NDArray[Any], affine: FloatArray) -> None:
    import nibabel

    image = nibabel.Nifti1Image(values, affine)
    image.header.set_xyzt_units("mm")
    nibabel.save(image, path)


def _write_itk(path: str, values: NDArray[Any], affine: FloatArray) -> None:
    sitk = require("SimpleITK", "heart")
    matrix = _FLIP @ affine
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    image = sitk.GetImageFromArray(np.ascontiguousarray(values.transpose(2, 1, 0)))
    image.SetSpacing(lengths.tolist())
    image.SetDirection((matrix[:3, :3] / lengths).ravel().tolist())
    image.SetOrigin(matrix[:3, 3].tolist())
    sitk.WriteImage(image, path, True)


def _nifti(path: Path) -> Read:
    import nibabel
    from nibabel.imageglobals import LoggingOutputSuppressor
    from nibabel.openers import Opener

    try:
        with LoggingOutputSuppressor(), Opener(path) as file:
            image = nibabel.load(path)
            header = type(image.header).from_fileobj(file, check=False)
        values = np.asarray(image.dataobj, dtype=np.float32)
    # nibabel lets zlib's, the file system's and its own errors through.
    except Exception as error:
        message = f"{path.name}: not a readable NIfTI file, or one cut short ({error})"
        raise FileFormatError(message) from error
    _refuse_steps(path, np.asarray(image.header.get_zooms()[:3], dtype=float))
    if int(header["sform_code"]) == 0:
        # The steps give the spacing; nibabel has turned negative ones positive.
        _refuse_steps(path, np.asarray(header["pixdim"][1:4], dtype=float))
    while values.ndim > 3 and values.shape[-1] == 1:
        values = values[..., 0]
    _refuse_shape(path, values.shape)
    return values, np.asarray(image.affine, dtype=float), ""


def _itk_file(path: Path) -> Read:
    sitk = require("SimpleITK", "heart")
    _refuse_header_steps(path)
    try:
        image = sitk.ReadImage(str(path))
    except RuntimeError as error:
        message = f"{path.name}: not readable, or cut short ({_last_line(error)})"
        raise FileFormatError(message) from error
    return *_from_itk(sitk, image, path), ""


def _from_itk(sitk: Any, image: Any, path: Path) -> tuple[NDArray[np.float32], FloatArray]:
    if image.GetNumberOfComponentsPerPixel() != 1:
        message = f"{path.name}: {image.GetNumberOfComponentsPerPixel()} numbers a voxel; one is needed"
        raise InputError(message)
    _refuse_shape(path, image.GetSize())
    steps = np.asarray(image.GetSpacing())
    _refuse_steps(path, steps)
    affine = np.eye(4)
    affine[:3, :3] = np.asarray(image.GetDirection()).reshape(3, 3) * steps
    affine[:3, 3] = image.GetOrigin()
    values = sitk.GetArrayFromImage(image).transpose(2, 1, 0).astype(np.float32)
    return values, _FLIP @ affine


def _dicom(folder: Path, modality: str | None, series: str | None) -> Read:
    sitk = require("SimpleITK", "heart")
    reader = sitk.ImageSeriesReader()
    with _quiet(sitk):
        names = _series_files(reader, folder, series)
        headers = [_header(sitk, name) for name in names]
        found = {header["modality"] for header in headers}
        if len(found) > 1 or (modality is not None and found != {modality}):
            wanted = modality or "one modality"
            message = f"{folder.name}: the series is {' and '.join(sorted(found))}; {wanted} is needed"
            raise InputError(message)
        ordered = _ordered(folder, headers)
        reader.SetFileNames([str(header["file"]) for header in ordered])
        try:
            image = reader.Execute()
        except RuntimeError as error:
            message = f"{folder.name}: a slice is damaged or cut short ({_last_line(error)})"
            raise FileFormatError(message) from error
    values, affine = _from_itk(sitk, image, folder)
    if len(ordered) > 1:
        # The step between slices comes from their positions; a tilted gantry shears the axes.
        step = (ordered[-1]["position"] - ordered[0]["position"]) / (len(ordered) - 1)
        affine[:3, 2] = _FLIP[:3, :3] @ step
    return values, affine, found.pop()


def _series_files(reader: Any, folder: Path, series: str | None) -> list[str]:
    ids = list(reader.GetGDCMSeriesIDs(str(folder)))
    if not ids:
        message = f"{folder.name}: no readable DICOM slices in this folder"
        raise FileFormatError(message)
    if series is not None and series not in ids:
        message = f"{folder.name}: no series {series}; it holds {', '.join(ids)}"
        raise InputError(message)
    if series is None and len(ids) > 1:
        message = (
            f"{folder.name}: {len(ids)} series mixed in one folder: {', '.join(ids)}; name one with series="
        )
        raise InputError(message)
    files = list(reader.GetGDCMSeriesFileNames(str(folder), series or ids[0]))
    unread = _unread(reader, folder, ids)
    if unread:
        message = f"{folder.name}: {len(unread)} files are not readable DICOM or cut short, first {unread[0]}"
        raise FileFormatError(message)
    return files


def _unread(reader: Any, folder: Path, ids: list[str]) -> list[str]:
    """Names of files that look like DICOM but are in no series."""
    read = {Path(name).name for uid in ids for name in reader.GetGDCMSeriesFileNames(str(folder), uid)}
    return sorted(p.name for p in folder.iterdir() if p.is_file() and p.name not in read and _looks_dicom(p))


def _looks_dicom(path: Path) -> bool:
    if path.suffix.lower() in {".dcm", ".ima"}:
        return True
    with path.open("rb") as file:
        return file.read(132)[128:] == b"DICM" and path.name.upper() != "DICOMDIR"


def _header(sitk: Any, name: str) -> dict[str, Any]:
    reader = sitk.ImageFileReader()
    reader.SetFileName(name)
    try:
        reader.ReadImageInformation()
        position = np.array([float(x) for x in reader.GetMetaData("0020|0032").split("\\")])
        rows = np.array([float(x) for x in reader.GetMetaData("0020|0037").split("\\")]).reshape(2, 3)
    except (RuntimeError, ValueError) as error:
        message = f"{Path(name).name}: damaged, or without a position in space ({_last_line(error)})"
        raise FileFormatError(message) from error
    kind = reader.GetMetaData("0008|0060").strip() if reader.HasMetaDataKey("0008|0060") else ""
    return {"file": name, "position": position, "normal": np.cross(*rows), "modality": kind}


def _ordered(folder: Path, headers: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Sort slices along their normal, and refuse gaps, doubles and slices that are not parallel."""
    normal = headers[0]["normal"]
    askew = [Path(h["file"]).name for h in headers if not np.allclose(h["normal"], normal, atol=1e-3)]
    if askew:
        message = f"{folder.name}: {len(askew)} slices are not parallel to the first, as {askew[0]}"
        raise InputError(message)
    ordered = sorted(headers, key=lambda h: float(h["position"] @ normal))
    gaps = np.diff([h["position"] @ normal for h in ordered])
    if not len(gaps):
        return ordered
    step = float(np.median(gaps))
    if step <= 1e-6 or (gaps <= 1e-6).any():
        at = int(np.argmin(gaps))
        message = (
            f"{folder.name}: {int((gaps <= 1e-6).sum())} slices lie at the place of another, first slice {at}"
        )
        raise InputError(message)
    uneven = np.flatnonzero(np.abs(gaps - step) > _UNEVEN * step)
    if uneven.size:
        missing = int(np.maximum(np.round(gaps[uneven] / step) - 1, 0).sum())
        what = f"about {missing} missing" if missing else "none missing, but unequally spaced"
        message = (
            f"{folder.name}: slices are {step:g} mm apart but {gaps[uneven[0]]:g} mm after slice {uneven[0]} "
            f"({uneven.size} such gaps; {what}); export the series again, or resample it evenly first"
        )
        raise InputError(message)
    return ordered


def _refuse_shape(path: Path, shape: tuple[int, ...]) -> None:
    if len(shape) != 3:
        message = f"{path.name}: {len(shape)} dimensions, {tuple(shape)}; a single 3D volume is needed"
        raise InputError(message)


def _refuse_steps(path: Path, steps: FloatArray) -> None:
    if not (np.isfinite(steps) & (steps > 0)).all():
        message = f"{path.name}: the spacing must be positive, in mm; the header says {steps.tolist()}"
        raise InputError(message)


def _refuse_header_steps(path: Path) -> None:
    """Refuse a MetaImage header with a negative spacing, which the reader would silently turn positive."""
    if path.suffix.lower() not in {".mha", ".mhd"}:
        return
    with path.open("rb") as file:
        head = file.read(4096)
    for line in head.split(b"\n"):
        key, _, text = line.partition(b"=")
        if key.strip() in {b"ElementSpacing", b"ElementSize"}:
            try:
                steps = np.array([float(x) for x in text.split()])
            except ValueError:
                return
            _refuse_steps(path, steps)
        if key.strip() == b"ElementDataFile":
            return


def _last_line(error: BaseException) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__


@contextlib.contextmanager
def _quiet(sitk: Any) -> Any:
    """Keep the reader's own warnings off standard error: what matters is said by exceptions here."""
    before = sitk.ProcessObject.GetGlobalWarningDisplay()
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            yield
    finally:
        sitk.ProcessObject.SetGlobalWarningDisplay(before)
