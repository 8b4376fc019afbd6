"""Per-vertex arrays in and out: NPZ, PLY, VTK, GIFTI."""

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
    """Read the per-vertex arrays of an NPZ, PLY, VTK, VTP, VTU or GIFTI file.

    Parameters
    ----------
    path : str or path-like
        The file. NPZ is read without unpickling anything.

    Returns
    -------
    dict of str to ndarray
        In file order; empty where the file holds a mesh alone. GIFTI arrays without a name are called
        ``array_0``, ``array_1``, ...

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
    if path.name.lower().endswith(".npz"):
        return _read_npz(path)
    contents, notes = read_contents(path)
    report_notes(path, notes)
    return dict(contents.data)


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
    # np.load allocates what an entry's header claims; here the claim is compared with the entry first.
    with archive.open(name) as stream:
        version = np.lib.format.read_magic(stream)
        read_header = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, column_order, dtype = read_header(stream)
        if dtype.hasobject:
            message = f"{name} holds pickled objects, which are not read"
            raise FileFormatError(message)
        size = int(np.prod([*shape], dtype=object)) * dtype.itemsize if shape else dtype.itemsize
        if size > archive.getinfo(name).file_size:
            message = f"{name} claims {size} bytes and has {archive.getinfo(name).file_size}"
            raise FileFormatError(message)
        raw = stream.read(size)
    if len(raw) != size:
        message = f"{name} claims {size} bytes and has {len(raw)}"
        raise FileFormatError(message)
    return np.frombuffer(raw, dtype=dtype).reshape(shape, order="F" if column_order else "C").copy()
