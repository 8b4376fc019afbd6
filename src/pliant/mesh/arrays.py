"""Per-vertex arrays in and out: NPZ, NPY, tables, PLY, VTK, GIFTI, FreeSurfer."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import FileFormatError, InputError
from .files import read_contents, report_notes
from .formats import FORMATS, checked_arrays, file_bytes, for_writing, gifti, write_atomically
from .loose_arrays import TABLES, read_npy, read_table, stored_array
from .parcellation import ANNOTATIONS, load_parcellation
from .surface import Mesh

_MESH_KEYS = ("vertices", "faces")


def save_arrays(
    path: str | os.PathLike[str], arrays: Mapping[str, ArrayLike], *, mesh: Mesh | None = None
) -> None:
    """Write per-vertex arrays, in the format the ending names.

    ``.npz`` keeps every array as it is, of any shape and type but object, with the mesh beside them as
    ``vertices`` and ``faces`` where one is given. ``.ply``, ``.vtk``, ``.vtp`` and ``.vtu`` hold the mesh and
    its arrays; PLY writes a (n, k) array as k properties ``name_0`` ... ``name_{k-1}``, whole numbers as
    int32. ``.func.gii`` and ``.shape.gii`` hold one data array each, as float32, int32 or uint8, and no mesh.

    Parameters
    ----------
    path : str or path-like
        The file; it appears whole or not at all.
    arrays : mapping of str to (n,) or (n, k) array_like
        What to write.
    mesh : Mesh, optional
        The mesh they live on. PLY and the VTK formats need it.

    Raises
    ------
    InputError
        If no format has this ending, it needs a mesh that is not given, or an array does not fit.

    See Also
    --------
    load_arrays : read them back.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "field.npz"
    >>> save_arrays(path, {"gfe": [0.5, 0.25]})
    >>> load_arrays(path)["gfe"].tolist()
    [0.5, 0.25]
    """
    path = Path(path)
    if path.name.lower().endswith(".npz"):
        write_atomically(path, _npz(arrays, mesh))
        return
    chosen = for_writing(path.name)
    if path.name.lower().removesuffix(".gz").endswith(".gii"):
        checked = checked_arrays(arrays, mesh.n_vertices if mesh is not None else None)
        write_atomically(path, gifti.write_arrays(checked))
        return
    if not chosen.holds_arrays:
        able = ", ".join(ending for other in FORMATS if other.holds_arrays for ending in other.endings)
        message = f"{path}: {chosen.name} holds no per-vertex arrays; use .npz, .func.gii, {able}"
        raise InputError(message)
    if mesh is None:
        message = f"{path}: {chosen.name} holds arrays on a mesh; pass mesh=, or use .npz or .func.gii"
        raise InputError(message)
    write_atomically(path, chosen.write(mesh, checked_arrays(arrays, mesh.n_vertices)))


def load_arrays(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    """Read the per-vertex arrays of a file.

    Reads NPZ and NPY; tables of text with one row a vertex (``.csv``, ``.tsv``, ``.txt``, columns named by a first row
    or numbered); PLY, VTK, VTP, VTU and GIFTI; FreeSurfer's morphometry (``lh.thickness``, ``lh.curv``) and annotations
    (``.annot``), whose names :func:`pliant.mesh.load_parcellation` has.

    Parameters
    ----------
    path : str or path-like
        The file. Nothing is unpickled.

    Returns
    -------
    dict of str to ndarray
        In file order; empty where the file holds a mesh alone. GIFTI arrays without a name are called
        ``array_0``, ``array_1``, ...; a single array without a name is called like its file.

    Raises
    ------
    FileFormatError
        If the file is missing, empty, truncated, not of a known format, or claims more than it holds.

    Warns
    -----
    PliantWarning
        If something was left out, or the ending belongs to another format.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "thickness.shape.gii"
    >>> save_arrays(path, {"thickness": [2.5, 3.0]})
    >>> load_arrays(path)
    {'thickness': array([2.5, 3. ], dtype=float32)}
    """
    path = Path(path)
    name = path.name.lower()
    if name.endswith(".npz"):
        return _read_npz(path)
    if name.endswith(".npy"):
        return read_npy(path)
    if name.endswith(ANNOTATIONS):
        return {path.name: load_parcellation(path).labels}
    if name.endswith(TABLES):
        arrays, notes = read_table(path)
        report_notes(path, notes)
        return arrays
    contents, notes = read_contents(path)
    report_notes(path, notes)
    return {array or path.name: values for array, values in contents.data.items()}


def holds_arrays_only(path: str | os.PathLike[str]) -> bool:
    """Tell per-vertex arrays without a mesh from a mesh, by a file's ending or else by what is in it.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    bool
        False also for what cannot be read: reading it as a mesh says why.

    Examples
    --------
    >>> holds_arrays_only("thickness.csv"), holds_arrays_only("bunny.obj")
    (True, False)
    """
    path = Path(path)
    name = path.name.lower()
    if name.endswith((".npz", ".npy", ".shape.gii", ".func.gii", ".label.gii", *TABLES, *ANNOTATIONS)):
        return True
    if any(name.removesuffix(".gz").endswith(known.endings) for known in FORMATS if known.name != "GIFTI"):
        return False
    try:
        return read_contents(path)[0].vertices is None
    except FileFormatError:
        return False


def _npz(arrays: Mapping[str, ArrayLike], mesh: Mesh | None) -> bytes:
    entries = {name: np.asarray(values) for name, values in arrays.items()}
    if mesh is not None:
        taken = [key for key in _MESH_KEYS if key in entries]
        if taken:
            message = f"{', '.join(taken)}: the names of the mesh's own arrays; rename yours"
            raise InputError(message)
        entries |= {"vertices": mesh.vertices, "faces": mesh.faces}
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in entries.items():
            if array.dtype.hasobject:
                message = f"{name} holds Python objects, which an NPZ file keeps only by pickling"
                raise InputError(message)
            entry = io.BytesIO()
            np.lib.format.write_array(entry, array, allow_pickle=False)
            # A fixed date: the same arrays give the same bytes.
            info = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            archive.writestr(info, entry.getvalue(), compress_type=zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def _read_npz(path: Path) -> dict[str, NDArray[Any]]:
    data = file_bytes(path)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [name for name in archive.namelist() if name.endswith(".npy")]
            return {name.removesuffix(".npy"): _npy(archive, name) for name in names}
    except FileFormatError as error:
        message = f"{path}: {error}"
        raise FileFormatError(message) from error
    except Exception as error:
        message = f"{path}: not a readable NPZ file: {type(error).__name__}: {error}"
        raise FileFormatError(message) from error


def _npy(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    with archive.open(name) as stream:
        return stored_array(stream, archive.getinfo(name).file_size, name)
