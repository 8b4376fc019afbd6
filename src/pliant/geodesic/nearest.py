"""Geodesic neighbourhoods: the nearest so many vertices, or all within a radius, without full sweeps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, frozen, vertex_indices
from .._kernels import kernel
from .._parallel import ordered_map
from ..errors import InputError
from ..mesh import Mesh
from .graph import EdgeGraph, GraphKind, as_graph

_CHUNK = 2048


@dataclass(frozen=True, eq=False, repr=False)
class Neighbourhoods:
    """The vertices near each of some vertices, nearest first.

    Parameters
    ----------
    centres : (s,) array of int
        Whose neighbourhoods these are.
    offsets : (s + 1,) array of int
        Neighbourhood i is the slice ``offsets[i]:offsets[i + 1]`` of the arrays below.
    vertices : (total,) array of int
        Each neighbourhood's vertices: the centre itself first, then by distance, then by number.
    distances : (total,) array of float
        Their distances from the centre.
    """

    centres: IntArray
    offsets: IntArray
    vertices: IntArray
    distances: FloatArray

    def __post_init__(self) -> None:
        for name in ("centres", "offsets", "vertices", "distances"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.centres)

    def __getitem__(self, i: int) -> IntArray:
        """Vertices of neighbourhood i."""
        return self.vertices[self.offsets[i] : self.offsets[i + 1]]

    def __repr__(self) -> str:
        sizes = np.diff(self.offsets)
        span = f"{sizes.min()} to {sizes.max()} vertices each" if len(sizes) else "none"
        return f"Neighbourhoods({len(self)}, {span})"

    @property
    def sizes(self) -> IntArray:
        """(s,) number of vertices in each neighbourhood."""
        return np.diff(self.offsets)


def nearest(
    mesh: Mesh | EdgeGraph | sp.sparray,
    vertices: ArrayLike | None = None,
    *,
    count: int | None = None,
    radius: float | None = None,
    graph: GraphKind = "edges",
    n_jobs: int | None = None,
    progress: bool = False,
) -> Neighbourhoods:
    """Find the geodesically nearest vertices of each vertex, by number or by radius.

    Parameters
    ----------
    mesh : Mesh, EdgeGraph or sparse matrix
        Where to look.
    vertices : (s,) array_like of int, optional
        The centres; every vertex by default.
    count : int, optional
        Vertices a neighbourhood, the centre included; 50 when neither ``count`` nor ``radius`` is given.
        A component with fewer gives all it has.
    radius : float, optional
        Take all vertices within this distance instead, in the mesh's unit. 50 vertices are a
        radius of 3 mm on a native cortical hemisphere and of 11 mm on one of 10,000 vertices, so a radius is what
        compares between resolutions.
    graph : {"edges", "refined"}
        Where paths run, see :func:`pliant.edge_graph`.
    n_jobs : int, optional
        Threads; all processors by default.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    Neighbourhoods

    Raises
    ------
    InputError
        If both ``count`` and ``radius`` are given, or one is not positive, or a vertex is out of range.

    Notes
    -----
    Each search stops as soon as it has enough: about 10 microseconds for 50 vertices.

    Examples
    --------
    >>> from pliant import shapes
    >>> near = nearest(shapes.icosphere(2), [0], count=6)
    >>> near[0][0], near.sizes
    (np.int64(0), array([6]))
    """
    metric = as_graph(mesh, graph)
    limit_count, limit_radius = _limits(count, radius, metric.n_vertices)
    n = metric.n_vertices
    centres = np.arange(n) if vertices is None else vertex_indices(vertices, n)
    matrix = metric.matrix()
    links = (matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64), matrix.data)

    def search(chunk: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
        found: tuple[IntArray, IntArray, FloatArray] = _search(*links, chunk, limit_count, limit_radius)
        return found

    chunks = [centres[start : start + _CHUNK] for start in range(0, len(centres), _CHUNK)]
    parts = list(ordered_map(search, chunks, n_jobs, description="neighbourhoods", progress=progress))
    sizes = np.concatenate([part[0] for part in parts]) if parts else np.zeros(0, dtype=np.int64)
    return Neighbourhoods(
        centres,
        np.concatenate([[0], np.cumsum(sizes)]),
        np.concatenate([part[1] for part in parts]) if parts else np.zeros(0, dtype=np.int64),
        np.concatenate([part[2] for part in parts]) if parts else np.zeros(0),
    )


def _limits(count: int | None, radius: float | None, n: int) -> tuple[int, float]:
    if count is not None and radius is not None:
        raise InputError("give count or radius, not both")
    if radius is not None:
        if not (np.isfinite(radius) and radius > 0):
            message = f"radius must be a positive length, got {radius}"
            raise InputError(message)
        return n, float(radius)
    count = 50 if count is None else count
    if count < 1:
        message = f"count must be at least 1, got {count}"
        raise InputError(message)
    return min(int(count), n), np.inf


@kernel
def _search(start: Any, neighbours: Any, lengths: Any, centres: Any, count: Any, radius: Any) -> Any:
    """Dijkstra from each centre, stopped at a number of vertices or at a radius."""
    n = len(start) - 1
    sizes = np.zeros(len(centres), np.int64)
    vertices = np.empty(max(64, len(centres) * min(count, 64)), np.int64)
    distances = np.empty(len(vertices), np.float64)
    best = np.full(n, np.inf)
    # A binary heap with lazy deletion; entries are ordered by distance, then by vertex.
    capacity = 1024
    keys = np.empty(capacity, np.float64)
    items = np.empty(capacity, np.int64)
    touched = np.empty(capacity, np.int64)
    total = 0
    for c in range(len(centres)):
        if total + count > len(vertices):
            size = min(2 * (total + count), max(2 * len(vertices), total + 4096))
            vertices = _longer(vertices, size)
            distances = _longer(distances, size)
        heap = 1
        marks = 1
        keys[0], items[0], touched[0] = 0.0, centres[c], centres[c]
        best[centres[c]] = 0.0
        while heap and sizes[c] < count:
            reach, u = keys[0], items[0]
            heap -= 1
            _sift_down(keys, items, heap)
            if reach > best[u]:
                continue
            if total == len(vertices):
                vertices = _longer(vertices, 2 * total)
                distances = _longer(distances, 2 * total)
            vertices[total], distances[total] = u, reach
            total += 1
            sizes[c] += 1
            for e in range(start[u], start[u + 1]):
                far = reach + lengths[e]
                v = neighbours[e]
                if far < best[v] and far <= radius:
                    if max(heap, marks) + 1 >= capacity:
                        capacity *= 2
                        keys = _longer(keys, capacity)
                        items = _longer(items, capacity)
                        touched = _longer(touched, capacity)
                    if best[v] == np.inf:
                        touched[marks] = v
                        marks += 1
                    best[v] = far
                    _sift_up(keys, items, heap, far, v)
                    heap += 1
        for i in range(marks):
            best[touched[i]] = np.inf
    return sizes, vertices[:total].copy(), distances[:total].copy()


@kernel
def _longer(array: Any, size: Any) -> Any:
    out = np.empty(size, array.dtype)
    out[: len(array)] = array
    return out


@kernel
def _sift_up(keys: Any, items: Any, at: Any, key: Any, item: Any) -> None:
    """Put an entry into the heap, whose size is ``at``."""
    while at > 0:
        above = (at - 1) // 2
        if keys[above] < key or (keys[above] == key and items[above] < item):
            break
        keys[at], items[at] = keys[above], items[above]
        at = above
    keys[at], items[at] = key, item


@kernel
def _sift_down(keys: Any, items: Any, size: Any) -> None:
    """Take the top off the heap: its last entry, at ``size``, sinks from the top."""
    key, item = keys[size], items[size]
    at = 0
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        right = child + 1
        if right < size and (
            keys[right] < keys[child] or (keys[right] == keys[child] and items[right] < items[child])
        ):
            child = right
        if key < keys[child] or (key == keys[child] and item < items[child]):
            break
        keys[at], items[at] = keys[child], items[child]
        at = child
    keys[at], items[at] = key, item
