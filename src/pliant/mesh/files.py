"""Mesh files in and out: vertices keep their numbers, broken files end in a named error."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..errors import FileFormatError, InputError, PliantError, PliantWarning
from .formats import (
    FORMATS,
    Contents,
    checked_arrays,
    fan,
    file_bytes,
    for_writing,
    recognised,
    write_atomically,
)
from .surface import Mesh


def load_mesh(path: str | os.PathLike[str]) -> Mesh:
    r"""Read a triangle mesh.

    Reads OFF, OBJ, PLY (text, binary), STL (text, binary), VTK (legacy, VTP, VTU), GIFTI and FreeSurfer
    geometry, each also gzipped. The format is told by the file's content, then by its ending.

    Vertices keep their order and number, and faces theirs: nothing is merged, dropped or turned. Polygons
    are split into fans of triangles (right for convex ones), in place, which a warning reports. STL stores
    loose triangles, so its corners are kept as they stand, three a face in file order; join them with
    ``merged(mesh, tolerance=0)``. Only the surface is read: no colours, normals or textures, no
    coordinate transforms. :func:`pliant.check_up` says what is wrong with what was read.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    Mesh
        In the file's own unit (millimetres for GIFTI and FreeSurfer).

    Raises
    ------
    FileFormatError
        If the file is missing, empty, truncated, not of a known format, or claims more than it holds.
    MeshError
        If what it holds is not a mesh: coordinates that are not finite, faces that name vertices that are
        not there, points without faces.

    Warns
    -----
    PliantWarning
        If polygons were split, something was left out, or the ending belongs to another format.

    Notes
    -----
    One pass over the file, whose whole content is held in memory. A header's claim is compared with the
    file's size before anything is allocated, and compressed data are unpacked against a limit.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "triangle.off"
    >>> _ = path.write_text("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    >>> load_mesh(path)
    Mesh(3 vertices, 1 faces)
    """
    path = Path(path)
    contents, notes = read_contents(path)
    if contents.vertices is None:
        message = f"{path}: per-vertex arrays without a surface; load_arrays reads them"
        raise FileFormatError(message)
    notes += _polygon_notes(contents.sizes)
    try:
        mesh = Mesh(contents.vertices, fan(contents.corners, contents.sizes))
    except PliantError as error:
        raise _about(path, error) from error
    report_notes(path, notes)
    return mesh


def save_mesh(
    path: str | os.PathLike[str], mesh: Mesh, *, data: Mapping[str, ArrayLike] | None = None
) -> None:
    """Write a triangle mesh, in the format its ending names.

    OFF, OBJ, PLY, VTK, VTP and VTU keep positions to the last bit; STL, GIFTI and FreeSurfer geometry hold
    float32. STL also loses which corners are one vertex. The file appears whole or not at all.

    Parameters
    ----------
    path : str or path-like
        Ends in ``.off``, ``.obj``, ``.ply``, ``.stl``, ``.vtk``, ``.vtp``, ``.vtu``, ``.gii`` or a FreeSurfer
        surface name (``.white``, ``.pial``, ``.inflated``, ...), with ``.gz`` behind it or not.
    mesh : Mesh
        What to write.
    data : mapping of str to (n,) or (n, k) array_like, optional
        Per-vertex arrays, for PLY and the VTK formats.

    Raises
    ------
    InputError
        If path and mesh are swapped, no format has this ending, it holds no per-vertex arrays, an array does not
        have one row a vertex, or the file cannot be written.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "triangle.ply"
    >>> save_mesh(path, Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), data={"height": [0, 0, 1]})
    >>> load_mesh(path)
    Mesh(3 vertices, 1 faces)
    """
    if isinstance(path, Mesh) or not isinstance(mesh, Mesh):
        found = f"{type(path).__name__} and {type(mesh).__name__}"
        message = f"save_mesh takes the path first and then a Mesh, save_mesh(path, mesh); got {found}"
        raise InputError(message)
    path = Path(path)
    chosen = for_writing(path.name)
    arrays = checked_arrays(data or {}, mesh.n_vertices)
    if arrays and not chosen.holds_arrays:
        able = ", ".join(ending for other in FORMATS if other.holds_arrays for ending in other.endings)
        message = (
            f"{path}: {chosen.name} holds no per-vertex arrays; use {able}, or save_arrays beside the mesh"
        )
        raise InputError(message)
    write_atomically(path, chosen.write(mesh, arrays))


def read_contents(path: Path) -> tuple[Contents, tuple[str, ...]]:
    """Read a file's points, polygons and arrays, and what is to be reported about them.

    The one boundary of the readers: whatever goes wrong inside them comes out as a FileFormatError.
    """
    data = file_bytes(path)
    try:
        chosen, notes = recognised(path.name, data)
    except PliantError as error:
        raise _about(path, error) from error
    try:
        with np.errstate(all="ignore"):
            contents = chosen.read(data)
    except PliantError as error:
        raise _about(path, error) from error
    except Exception as error:
        message = f"{path}: not a readable {chosen.name} file: {type(error).__name__}: {error}"
        raise FileFormatError(message) from error
    return contents, notes + contents.notes


def report_notes(path: Path, notes: tuple[str, ...]) -> None:
    """Warn of what was left out or mended, in the name of the caller's caller."""
    for note in notes:
        warnings.warn(f"{path}: {note}", PliantWarning, stacklevel=3)


def _about(path: Path, error: PliantError) -> PliantError:
    return type(error)(f"{path}: {error}")


def _polygon_notes(sizes: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> tuple[str, ...]:
    notes = []
    large, small = sizes[sizes > 3], int((sizes < 3).sum())
    if large.size:
        quads = int((large == 4).sum())
        notes.append(
            f"{quads} quads and {large.size - quads} larger polygons are split into "
            f"{int((large - 2).sum())} triangles"
        )
    if small:
        notes.append(f"{small} faces with fewer than three corners are left out")
    return tuple(notes)
