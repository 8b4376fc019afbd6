"""Landmarks: the vertices at which surfaces are compared, from vertex numbers, coordinates or parcels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from .._arrays import FloatArray, IntArray, as_floats, as_indices, frozen, vertex_indices
from .._tables import table_rows
from ..errors import FileFormatError, InputError, first_indices
from ..mesh import Mesh
from ..mesh.parcellation import load_parcellation

__all__ = ["Landmarks", "landmarks_at", "parcel_centres", "read_landmarks", "snapped_landmarks"]

# Names of what is no cortex: the medial wall.
_NO_CORTEX = {"unknown", "corpuscallosum", "medial_wall", "medialwall", "medial wall", "???", "none", ""}
# A parcel's centre is found from paths out of so many of its vertices.
_SAMPLES = 64


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Named vertices of one surface.

    Parameters
    ----------
    names : tuple of str
        What corresponds between surfaces; all different.
    vertices : (s,) array of int
        A vertex for each name.
    distances : (s,) array of float
        How far each vertex is from the position asked for, in the mesh's unit; 0 where a vertex was asked for.
    """

    names: tuple[str, ...]
    vertices: IntArray
    distances: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(str(name) for name in self.names))
        for name in ("vertices", "distances"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        if not len(self.names) == len(self.vertices) == len(self.distances):
            message = f"{len(self.names)} names for {len(self.vertices)} landmarks"
            raise InputError(message)
        twice = [name for i, name in enumerate(self.names) if name in self.names[:i]]
        if twice:
            message = f"{len(twice)} landmarks share a name with another, first {twice[0]!r}"
            raise InputError(message)


def landmarks_at(mesh: Mesh, vertices: ArrayLike, *, names: Sequence[str] | None = None) -> Landmarks:
    """Take landmarks by vertex number, for surfaces that share their vertices.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    vertices : (s,) array_like of int
        Vertex numbers.
    names : sequence of str, optional
        The vertex numbers by default.

    Returns
    -------
    Landmarks

    Raises
    ------
    InputError
        If a vertex is out of range or a name occurs twice.

    Examples
    --------
    >>> from pliant import shapes
    >>> landmarks_at(shapes.icosphere(1), [3, 7]).names
    ('3', '7')
    """
    chosen = vertex_indices(vertices, mesh.n_vertices, "landmarks")
    return Landmarks(_names(names, [str(v) for v in chosen]), chosen, np.zeros(len(chosen)))


def snapped_landmarks(mesh: Mesh, coordinates: ArrayLike, *, names: Sequence[str] | None = None) -> Landmarks:
    """Take the vertex nearest to each position, and say how far it is.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    coordinates : (s, 3) array_like of float
        Positions in the mesh's own space and unit.
    names : sequence of str, optional
        0, 1, ... by default.

    Returns
    -------
    Landmarks

    Raises
    ------
    InputError
        If the coordinates are not finite numbers of shape (s, 3), or a name occurs twice.

    Notes
    -----
    Straight-line distance: a position inside a fold may snap to the wrong bank; distances beyond an edge or two say so.

    Examples
    --------
    >>> from pliant import shapes
    >>> found = snapped_landmarks(shapes.icosphere(3), [[0, 0, 2]])
    >>> float(found.distances[0])
    1.0
    """
    points = as_floats(coordinates, "coordinates")
    if points.ndim != 2 or points.shape[1] != 3:
        message = f"coordinates must have shape (s, 3), got {points.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        message = f"{bad.size} landmark positions are not finite, first {first_indices(bad)}"
        raise InputError(message)
    used = np.unique(mesh.faces)
    distances, nearest = cKDTree(mesh.vertices[used]).query(points)
    return Landmarks(
        _names(names, [str(i) for i in range(len(points))]), used[nearest], np.atleast_1d(distances)
    )


def parcel_centres(
    mesh: Mesh, labels: ArrayLike, *, names: dict[int, str] | None = None, exclude: Sequence[str] = ()
) -> Landmarks:
    """Take the centre vertex of each parcel of a labelling.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    labels : (n,) array_like of int
        A label for each vertex; negative where there is none.
    names : dict of int to str, optional
        Names of the labels; the numbers by default. Parcels named as medial wall (unknown, corpuscallosum,
        medial_wall, ...) are left out.
    exclude : sequence of str
        Names of further parcels to leave out.

    Returns
    -------
    Landmarks
        In ascending order of the labels.

    Raises
    ------
    InputError
        If the labels do not fit the mesh, or no parcel is left.

    Notes
    -----
    The centre is the vertex of the parcel's largest piece with the least sum of squared distances, along edges inside
    the parcel, to 64 of its vertices spread by number.

    Examples
    --------
    >>> from pliant import shapes
    >>> sheet = shapes.grid(5, 9)
    >>> parcel_centres(sheet, np.where(sheet.vertices[:, 0] < 4.5, 0, 1), names={0: "a", 1: "unknown"}).names
    ('a',)
    """
    parcel = as_indices(labels, "labels")
    if parcel.shape != (mesh.n_vertices,):
        message = f"labels must have one number a vertex, shape ({mesh.n_vertices},), got {parcel.shape}"
        raise InputError(message)
    left_out = _NO_CORTEX | {name.lower() for name in exclude}
    found = []
    for label in np.unique(parcel[parcel >= 0]).tolist():
        name = (names or {}).get(label, str(label))
        if name.lower() not in left_out:
            found.append((name, _centre(mesh, np.flatnonzero(parcel == label))))
    if not found:
        raise InputError("no parcel is left: every label is negative or stands for the medial wall")
    return Landmarks(
        tuple(name for name, _ in found), np.array([vertex for _, vertex in found]), np.zeros(len(found))
    )


def read_landmarks(path: str | Path, mesh: Mesh) -> Landmarks:
    r"""Read landmarks of a surface from a file.

    Parameters
    ----------
    path : str or path-like
        A ``.csv`` with a header and the columns ``vertex``, or ``x``, ``y`` and ``z``, and optionally ``name``; or a
        parcellation, whose parcels' centres are taken: FreeSurfer's ``.annot`` or ``.annot.gz``, or GIFTI's
        ``.label.gii``.
    mesh : Mesh
        The surface they lie on.

    Returns
    -------
    Landmarks

    Raises
    ------
    FileFormatError
        If the file is not what its ending says, or lacks a column.
    InputError
        If the landmarks do not fit the mesh.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from pliant import shapes
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "sites.csv"
    >>> _ = path.write_text("name,vertex\ntop,4\nside,9\n")
    >>> read_landmarks(path, shapes.icosphere(1)).vertices.tolist()
    [4, 9]
    """
    path = Path(path)
    if path.name.lower().endswith((".annot", ".annot.gz", ".gii")):
        parcels = load_parcellation(path)
        return parcel_centres(mesh, parcels.labels, names=parcels.names)
    if path.suffix.lower() != ".csv":
        message = f"{path}: landmarks are read from .csv, .annot, .annot.gz and .label.gii"
        raise FileFormatError(message)
    rows = table_rows(path)
    columns = set(rows[0]) if rows else set()
    named = [row["name"] for row in rows] if "name" in columns else None
    try:
        if "vertex" in columns:
            return landmarks_at(mesh, [float(row["vertex"]) for row in rows], names=named)
        if {"x", "y", "z"} <= columns:
            positions = [[float(row[axis]) for axis in "xyz"] for row in rows]
            return snapped_landmarks(mesh, positions, names=named)
    except (TypeError, ValueError) as error:
        message = f"{path}: {error}"
        raise FileFormatError(message) from error
    found = ", ".join(sorted(map(str, columns))) or "nothing"
    message = f"{path}: needs a header with vertex, or x, y and z, and at least one row; found {found}"
    raise FileFormatError(message)


def _names(names: Sequence[str] | None, default: list[str]) -> tuple[str, ...]:
    return tuple(default if names is None else names)


def _centre(mesh: Mesh, members: IntArray) -> int:
    number = np.full(mesh.n_vertices, -1)
    number[members] = np.arange(len(members))
    ends = number[mesh.edges]
    inside = (ends >= 0).all(axis=1)
    links = sp.coo_array(
        (mesh.edge_lengths[inside], (ends[inside, 0], ends[inside, 1])), shape=(len(members), len(members))
    ).tocsr()
    _, piece = connected_components(links, directed=False)
    largest = np.flatnonzero(piece == np.argmax(np.bincount(piece)))
    sample = largest[np.unique(np.linspace(0, len(largest) - 1, _SAMPLES).round().astype(np.int64))]
    squares = dijkstra(links, directed=False, indices=sample)[:, largest] ** 2
    return int(members[largest[np.argmin(squares.sum(axis=0))]])
