"""Loaders of the shapes that carry a truth: poses, symmetries, corresponding points."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np

from .._arrays import IntArray
from ..errors import InputError
from ..mesh import Mesh, load_mesh

__all__ = ["kids_symmetry", "load_pose", "pose_symmetry", "remeshed_pose"]


def load_pose(name: str, *, data: str | os.PathLike[str] | None = None) -> Mesh:
    """Load a TOSCA pose: vertex i is the same point in all poses of an animal.

    Parameters
    ----------
    name : str
        As ``"cat0"``.
    data : str or path-like, optional
        The data folder; the variable ``PLIANT_DATA`` by default.

    Returns
    -------
    Mesh

    Raises
    ------
    InputError
        If there is no data folder, or no such pose.

    Examples
    --------
    >>> load_pose("unicorn0", data=".")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    pliant.errors.InputError: ...unicorn0.ply is not there; see pliant data list
    """
    return load_mesh(_file(data, f"shapes/tosca/{_plain(name)}.ply"))


def pose_symmetry(name: str, *, data: str | os.PathLike[str] | None = None) -> IntArray:
    """Load the mirror image of every vertex of a TOSCA animal, good to about 1 per cent of its size.

    Parameters
    ----------
    name : str
        The animal or any pose of it: ``"cat"`` or ``"cat7"``.
    data : str or path-like, optional
        The data folder; the variable ``PLIANT_DATA`` by default.

    Returns
    -------
    (n,) array of int
        -1 where none is known.

    Raises
    ------
    InputError
        If the file is not there.

    Examples
    --------
    >>> pose_symmetry("unicorn0", data=".")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    pliant.errors.InputError: ...unicorn.symmetry.csv is not there; see pliant data list
    """
    kind = re.sub(r"\d+$", "", _plain(name))
    table = np.loadtxt(_file(data, f"shapes/tosca/{kind}.symmetry.csv"), delimiter=",", skiprows=1)
    mirror: IntArray = np.full(int(table[:, 0].max()) + 1, -1)
    mirror[table[:, 0].astype(np.int64)] = table[:, 1].astype(np.int64)
    return mirror


def remeshed_pose(
    name: str, *, data: str | os.PathLike[str] | None = None
) -> tuple[Mesh, IntArray, IntArray | None]:
    """Load a remeshed TOSCA pose with its landmarks: landmark i is the same point in all poses.

    Parameters
    ----------
    name : str
        As ``"cat0"``.
    data : str or path-like, optional
        The data folder; the variable ``PLIANT_DATA`` by default.

    Returns
    -------
    Mesh, (m,) array of int, (m,) array of int or None
        The mesh, the vertex of each landmark, and the vertex of each landmark's mirror image where it is known.

    Raises
    ------
    InputError
        If there is no data folder, or no such pose.

    Examples
    --------
    >>> remeshed_pose("unicorn0", data=".")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    pliant.errors.InputError: ...unicorn0.ply is not there; see pliant data list
    """
    stem = f"shapes/tosca_remeshed_5k/{_plain(name)}"
    mesh = load_mesh(_file(data, f"{stem}.ply"))
    landmarks = np.loadtxt(_file(data, f"{stem}.vts"), dtype=np.int64) - 1
    mirror = _root(data) / f"{stem}.sym.vts"
    return mesh, landmarks, np.loadtxt(mirror, dtype=np.int64) - 1 if mirror.is_file() else None


def kids_symmetry(*, data: str | os.PathLike[str] | None = None) -> IntArray:
    """Load the exact mirror image of every vertex of the child's poses.

    Parameters
    ----------
    data : str or path-like, optional
        The data folder; the variable ``PLIANT_DATA`` by default.

    Returns
    -------
    (n,) array of int

    Raises
    ------
    InputError
        If the file is not there.

    Examples
    --------
    >>> kids_symmetry(data=".")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    pliant.errors.InputError: ...symmetry.txt is not there; see pliant data list
    """
    # The file writes whole numbers as 6.1e+01.
    values = np.loadtxt(_file(data, "shapes/kids/symmetry.txt")).ravel()
    mirror: IntArray = np.rint(values).astype(np.int64) - 1
    return mirror


def _root(data: str | os.PathLike[str] | None) -> Path:
    place = data if data is not None else os.environ.get("PLIANT_DATA")
    if place is None:
        raise InputError("no data folder: give data= or set PLIANT_DATA; see pliant data list")
    return Path(place)


def _file(data: str | os.PathLike[str] | None, part: str) -> Path:
    path = _root(data) / part
    if not path.is_file():
        message = f"{path} is not there; see pliant data list"
        raise InputError(message)
    return path


def _plain(name: str) -> str:
    if not re.fullmatch(r"[A-Za-z]+\d*", name):
        message = f"a pose is named by letters and a number, as cat0; got {name!r}"
        raise InputError(message)
    return name
