"""Kernel of the resampling: half-edge collapses that keep a surface a surface."""

from __future__ import annotations

import numpy as np

from ..._arrays import BoolArray, FloatArray, IntArray
from ..._kernels import kernel

_MOST_NEIGHBOURS = 64
# A triangle may turn by at most arccos of this in one collapse.
_LEAST_AGREEMENT = 0.5


@kernel
def stars_of(faces: IntArray, alive: BoolArray, n: int) -> tuple[IntArray, IntArray]:
    """Faces around each vertex, compressed: (n + 1,) starts and the face numbers."""
    starts = np.zeros(n + 1, np.int64)
    for f in range(len(faces)):
        if alive[f]:
            for c in range(3):
                starts[faces[f, c] + 1] += 1
    for v in range(n):
        starts[v + 1] += starts[v]
    fill, around = starts[:-1].copy(), np.empty(starts[n], np.int64)
    for f in range(len(faces)):
        if alive[f]:
            for c in range(3):
                around[fill[faces[f, c]]] = f
                fill[faces[f, c]] += 1
    return starts, around


@kernel
def _neighbours(vertex: int, faces: IntArray, starts: IntArray, around: IntArray, out: IntArray) -> int:
    """Fill `out` with the vertices next to one; -1 where they are more than it holds."""
    count = 0
    for k in range(starts[vertex], starts[vertex + 1]):
        for c in range(3):
            other = faces[around[k], c]
            if other == vertex:
                continue
            known = False
            for i in range(count):
                known = known or out[i] == other
            if not known:
                if count == len(out):
                    return -1
                out[count] = other
                count += 1
    return count


@kernel
def _corner_of(faces: IntArray, face: int, vertex: int) -> int:
    """Which corner of a face a vertex is, or -1."""
    for c in range(3):
        if faces[face, c] == vertex:
            return c
    return -1


@kernel
def _shared_faces(vertex: int, other: int, faces: IntArray, starts: IntArray, around: IntArray) -> int:
    count = 0
    for k in range(starts[vertex], starts[vertex + 1]):
        if _corner_of(faces, around[k], other) >= 0:
            count += 1
    return count


@kernel
def _may_merge(
    vertex: int,
    into: int,
    faces: IntArray,
    rim: BoolArray,
    starts: IntArray,
    around: IntArray,
    ring: IntArray,
    n_ring: int,
    other_ring: IntArray,
) -> bool:
    """Link condition: the edge's ends meet only in the triangles on the edge."""
    shared = _shared_faces(vertex, into, faces, starts, around)
    if rim[vertex]:
        if shared != 1:
            return False
    elif shared != 2:
        return False
    n_other = _neighbours(into, faces, starts, around, other_ring)
    if n_other < 0:
        return False
    common = 0
    first, second = -1, -1
    for i in range(n_ring):
        for j in range(n_other):
            if ring[i] == other_ring[j]:
                common += 1
                first, second = second, ring[i]
    if common != shared:
        return False
    degree = starts[vertex + 1] - starts[vertex]
    if rim[vertex] and degree == 1:
        # The corner triangle goes; its far side must be held by another one.
        return _shared_faces(into, second, faces, starts, around) == 2
    if not rim[vertex] and n_ring == 3:
        # A tetrahedron would fold flat onto the triangle that is already there.
        for k in range(starts[into], starts[into + 1]):
            face = around[k]
            if _corner_of(faces, face, first) >= 0 and _corner_of(faces, face, second) >= 0:
                return False
    return True


@kernel
def _cross(a: FloatArray, b: FloatArray, c: FloatArray, out: FloatArray) -> None:
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[k] = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i])


@kernel
def badness(
    vertex: int,
    into: int,
    vertices: FloatArray,
    faces: IntArray,
    starts: IntArray,
    around: IntArray,
    before: FloatArray,
    after: FloatArray,
) -> float:
    """How thin and how turned the worst new triangle is: 1 for an equilateral one in place, inf if folded."""
    worst = 1.0
    for k in range(starts[vertex], starts[vertex + 1]):
        face = around[k]
        if _corner_of(faces, face, into) >= 0:
            continue
        at = _corner_of(faces, face, vertex)
        b, c = vertices[faces[face, (at + 1) % 3]], vertices[faces[face, (at + 2) % 3]]
        _cross(vertices[vertex], b, c, before)
        _cross(vertices[into], b, c, after)
        dot, old, new, sides = 0.0, 0.0, 0.0, 0.0
        for i in range(3):
            dot += before[i] * after[i]
            old += before[i] ** 2
            new += after[i] ** 2
            sides += (b[i] - c[i]) ** 2 + (vertices[into, i] - b[i]) ** 2 + (vertices[into, i] - c[i]) ** 2
        if not new > 0.0:
            return np.inf
        agreement = dot / np.sqrt(old * new) if old > 0.0 else 1.0
        if agreement < _LEAST_AGREEMENT:
            return np.inf
        worst = max(worst, (2.0 - agreement) * sides / (2.0 * np.sqrt(3.0 * new)))
    return worst


@kernel
def collapse_pass(
    order: IntArray,
    wanted: int,
    most_badness: float,
    vertices: FloatArray,
    faces: IntArray,
    alive: BoolArray,
    rim: BoolArray,
    locked: BoolArray,
) -> IntArray:
    """Merge vertices into neighbours, in the order given, no two near each other; return those that went.

    `faces` and `alive` are changed in place. A vertex whose star an earlier merge of the pass has changed
    waits for the next pass, which spreads the merges evenly and keeps the stars valid throughout.
    """
    starts, around = stars_of(faces, alive, len(vertices))
    touched = locked.copy()
    ring, other_ring = np.empty(_MOST_NEIGHBOURS, np.int64), np.empty(_MOST_NEIGHBOURS, np.int64)
    before, after = np.empty(3), np.empty(3)
    gone, count = np.empty(wanted, np.int64), 0
    for vertex in order:
        if count == wanted:
            break
        if touched[vertex] or starts[vertex] == starts[vertex + 1]:
            continue
        n_ring = _neighbours(vertex, faces, starts, around, ring)
        best, least = -1, most_badness
        for i in range(n_ring):
            into = ring[i]
            if touched[into] or (rim[vertex] and not rim[into]):
                continue
            if not _may_merge(vertex, into, faces, rim, starts, around, ring, n_ring, other_ring):
                continue
            cost = badness(vertex, into, vertices, faces, starts, around, before, after)
            if cost < least:
                best, least = into, cost
        if best < 0:
            continue
        for k in range(starts[vertex], starts[vertex + 1]):
            face = around[k]
            if _corner_of(faces, face, best) >= 0:
                alive[face] = False
            else:
                faces[face, _corner_of(faces, face, vertex)] = best
        touched[vertex] = True
        for i in range(n_ring):
            touched[ring[i]] = True
        gone[count] = vertex
        count += 1
    return gone[:count]
