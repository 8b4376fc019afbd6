"""The perturbation that changes topology: parts that come close in space are joined by a short tube."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ..._arrays import BoolArray, FloatArray, IntArray
from ...errors import MeshError
from ..adjacency import Stars, edge_matrix
from ..surface import Mesh
from .result import Perturbed, Seed, checked_strength, mean_edge_length, moved

__all__ = ["topology_change"]

_PROBES = 64
# A shortcut is worth the name where the way along the surface is this many times the way through space.
_SHORTCUT = 2.0
# Welds start at least this far apart, in roots of the area.
_SPACING = 0.08


@dataclass(frozen=True)
class _Pair:
    start: int
    end: int
    facing: bool
    gain: float


def topology_change(mesh: Mesh, *, strength: int, rng: Seed) -> Perturbed:
    """Join places that are close in space and far along the surface, as many as the strength says.

    Two vertices are replaced by a tube between their rings of neighbours: what welding them would do, but the
    surface stays manifold and consistently wound, and each weld raises the genus by one. Pairs are sought from
    64 random vertices: those whose surfaces face each other across a gap come first, then those with the most
    gained (path along the surface over distance in space); on a shape without gaps the tube runs through the
    inside. A tube may cut through other parts on its way. Parameters, errors and result as for
    :func:`perturbed`.

    Examples
    --------
    >>> from pliant import shapes
    >>> joined = topology_change(shapes.icosphere(3), strength=1, rng=0)
    >>> mesh = joined.mesh
    >>> mesh.n_vertices - len(mesh.edges) + mesh.n_faces  # 2 for a sphere, 0 for a torus
    0
    """
    strength = checked_strength(strength)
    if not strength:
        return moved(mesh, mesh, "topology", 0, "unchanged")
    stars = Stars(mesh)
    dropped = np.zeros(mesh.n_faces, dtype=bool)
    taken = stars.at_rim.copy()
    strips: list[IntArray] = []
    starts: list[FloatArray] = []
    lengths: list[float] = []
    spacing = _SPACING * float(np.sqrt(mesh.area))
    for pair in _pairs(mesh, taken, np.random.default_rng(rng)):
        if len(strips) == strength:
            break
        start = mesh.vertices[pair.start]
        if any(np.linalg.norm(start - other) < spacing for other in starts):
            continue
        first, second = stars.ring(pair.start), stars.ring(pair.end)
        if first is None or second is None or _too_near(stars, first, second, taken):
            continue
        strips.append(_strip(mesh.vertices, first, second))
        lengths.append(float(np.linalg.norm(start - mesh.vertices[pair.end])))
        starts.append(start)
        dropped[stars.faces_of(pair.start)] = True
        dropped[stars.faces_of(pair.end)] = True
        taken[[pair.start, pair.end, *first, *second]] = True
    if not strips:
        raise MeshError(
            "no two places of the mesh can be joined: it is too small, too coarse or not manifold; "
            "use a finer mesh, or see check_up"
        )
    text = f"{len(strips)} welds, {min(lengths):.3g} to {max(lengths):.3g} long"
    return _rebuilt(mesh, dropped, np.concatenate(strips), strength, text)


def _rebuilt(mesh: Mesh, dropped: BoolArray, strips: IntArray, strength: int, text: str) -> Perturbed:
    faces = np.concatenate([mesh.faces[~dropped], strips])
    gone = np.zeros(mesh.n_vertices, dtype=bool)
    gone[mesh.faces] = True
    gone[faces] = False
    source = np.flatnonzero(~gone)
    number = np.cumsum(~gone) - 1
    return Perturbed(Mesh(mesh.vertices[source], number[faces]), source, "topology", strength, text)


def _pairs(mesh: Mesh, taken: BoolArray, rng: np.random.Generator) -> list[_Pair]:
    """One candidate for each probe, best first; none whose ring meets what is taken."""
    taken = taken.copy()
    taken[mesh.faces[taken[mesh.faces].any(axis=1)]] = True
    able = np.flatnonzero(~taken & mesh.vertex_normals.any(axis=1))
    unit = mean_edge_length(mesh)
    probes = rng.permutation(able)[:_PROBES]
    if not len(probes):
        return []
    pairs = []
    for start, path in zip(probes, dijkstra(edge_matrix(mesh), indices=probes), strict=True):
        offset = mesh.vertices - mesh.vertices[start]
        apart = np.linalg.norm(offset, axis=1)
        gain = np.where(np.isfinite(path) & ~taken & (path > 4 * unit), path / (apart + unit), 0.0)
        facing = (offset @ mesh.vertex_normals[start] > 0) & (
            np.einsum("ij,ij->i", offset, mesh.vertex_normals) < 0
        )
        across = np.where(facing, gain, 0.0)
        best = int(across.argmax())
        if across[best] < _SHORTCUT:
            best = int(gain.argmax())
        if gain[best] > 0:
            pairs.append(_Pair(int(start), best, bool(across[best] >= _SHORTCUT), float(gain[best])))
    return sorted(pairs, key=lambda pair: (not pair.facing, -pair.gain))


def _too_near(stars: Stars, first: list[int], second: list[int], taken: BoolArray) -> bool:
    """Whether two rings, or one and an earlier weld, share a vertex or an edge."""
    if taken[first].any() or taken[second].any():
        return True
    around = {corner for vertex in first for corner in stars.corners_of(vertex)}
    return not around.isdisjoint(second)


def _strip(vertices: FloatArray, first: list[int], second: list[int]) -> IntArray:
    """Triangles between two rings, wound like the fans they replace, turned so that the sides are shortest."""
    ends = second[::-1]
    zips = [_zipped(first, ends[k:] + ends[:k]) for k in range(len(ends))]
    costs = [float(((vertices[z] - vertices[np.roll(z, 1, axis=1)]) ** 2).sum()) for z in zips]
    return zips[int(np.argmin(costs))]


def _zipped(first: list[int], ends: list[int]) -> IntArray:
    # Both rings advance in step: were one to run around first, it would close on itself and use an edge twice.
    p, q = len(first), len(ends)
    faces, i, j = [], 0, 0
    while i < p or j < q:
        if i < p and (i + 1) * q <= (j + 1) * p:
            faces.append((first[i], first[(i + 1) % p], ends[j % q]))
            i += 1
        else:
            faces.append((ends[(j + 1) % q], ends[j], first[i % p]))
            j += 1
    return np.array(faces, dtype=np.int64)
