"""Local edits of an oriented manifold mesh in rounds: each round edits edges that do not touch one another.

The boundary of the mesh is the curve on the mirror plane. No edit may join two of its vertices by an inner
edge: after gluing the mirror image, four triangles would share that edge.
"""

from __future__ import annotations

import math

import numpy as np

from ..._arrays import BoolArray, FloatArray, IntArray
from ..._kernels import kernel


def edge_table(faces: IntArray, n_vertices: int) -> tuple[IntArray, IntArray]:
    """Edges (e, 2) and, for each, the half-edge (face * 3 + corner) on either side; -1 beyond the boundary."""
    edges, sides = _edge_table(faces, n_vertices)
    return edges, sides


def vertex_faces(faces: IntArray, n_vertices: int) -> tuple[IntArray, IntArray]:
    """Faces around each vertex in compressed rows: (starts, faces)."""
    starts, around = _rows(faces, n_vertices)
    return starts, around


def relative_lengths(vertices: FloatArray, edges: IntArray) -> FloatArray:
    """Length of each edge over the mean size, the fourth column, of its ends."""
    lengths: FloatArray = _relative_lengths(vertices, edges)
    return lengths


def split_edges(
    vertices: FloatArray, faces: IntArray, excess: FloatArray, edges: IntArray, sides: IntArray, most: int
) -> tuple[FloatArray, IntArray]:
    """Cut edges with positive ``excess`` in the middle, greatest first, at most ``most`` of them."""
    order = np.argsort(-excess, kind="stable")
    order = order[excess[order] > 0]
    grown = np.empty((len(faces) + 2 * len(order), 3), dtype=np.int64)
    grown[: len(faces)] = faces
    count, chosen = _split(grown, len(faces), len(vertices), order, edges, sides, most)
    middle = vertices[edges[chosen]].mean(axis=1)
    return np.vstack([vertices, middle]), grown[:count]


def collapse_edges(
    vertices: FloatArray, faces: IntArray, excess: FloatArray, edges: IntArray, sides: IntArray, most: int
) -> tuple[FloatArray, IntArray]:
    """Contract edges with positive ``excess``, greatest first, while they lower the count by ``most`` or less."""
    order = np.argsort(-excess, kind="stable")
    order = order[excess[order] > 0]
    boundary = boundary_mask(len(vertices), edges, sides)
    rows = vertex_faces(faces, len(vertices))
    points, kept = vertices.copy(), faces.copy()
    alive = _collapse(points, kept, boundary, *rows, order, edges, sides, most)
    kept = kept[alive]
    used = np.zeros(len(points), dtype=bool)
    used[kept.ravel()] = True
    return points[used], (np.cumsum(used) - 1)[kept]


def flip_edges(vertices: FloatArray, faces: IntArray) -> tuple[IntArray, int]:
    """Turn edges whose opposite angles add up to more than half a turn (Delaunay); the count says how many."""
    edges, sides = edge_table(faces, len(vertices))
    boundary = boundary_mask(len(vertices), edges, sides)
    rows = vertex_faces(faces, len(vertices))
    turned = faces.copy()
    count = _flip(vertices, turned, boundary, *rows, edges, sides)
    return turned, int(count)


def boundary_mask(n_vertices: int, edges: IntArray, sides: IntArray) -> BoolArray:
    """Vertices on a boundary edge."""
    mask = np.zeros(n_vertices, dtype=bool)
    mask[edges[sides[:, 1] < 0].ravel()] = True
    return mask


@kernel
def _split(
    faces: IntArray,
    n_faces: int,
    n_vertices: int,
    order: IntArray,
    edges: IntArray,
    sides: IntArray,
    most: int,
) -> tuple[int, IntArray]:
    locked = np.zeros(n_faces, dtype=np.bool_)
    chosen = np.empty(len(order), dtype=np.int64)
    n_chosen = 0
    count = n_faces
    for e in order:
        cost = 1 if sides[e, 1] < 0 else 2
        if most < cost:
            break
        if locked[sides[e, 0] // 3] or (sides[e, 1] >= 0 and locked[sides[e, 1] // 3]):
            continue
        middle = n_vertices + n_chosen
        for side in range(2):
            half = sides[e, side]
            if half < 0:
                continue
            f, corner = half // 3, half % 3
            head, apex = faces[f, (corner + 1) % 3], faces[f, (corner + 2) % 3]
            faces[f, (corner + 1) % 3] = middle
            faces[count, 0], faces[count, 1], faces[count, 2] = middle, head, apex
            count += 1
            locked[f] = True
        chosen[n_chosen] = e
        n_chosen += 1
        most -= cost
    return count, chosen[:n_chosen]


@kernel
def _ring_of(
    v: int, faces: IntArray, starts: IntArray, around: IntArray, locked: BoolArray, ring: IntArray
) -> int:
    """Neighbours of a vertex, each once, into ``ring``; the count, or -1 if one is locked or there is no room."""
    count = 0
    for i in range(starts[v], starts[v + 1]):
        for corner in range(3):
            u = faces[around[i], corner]
            if u == v:
                continue
            if locked[u]:
                return -1
            known = False
            for j in range(count):
                known = known or ring[j] == u
            if not known:
                if count == len(ring):
                    return -1
                ring[count] = u
                count += 1
    return count


@kernel
def _cross(vertices: FloatArray, a: int, b: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Twice the vector area of the triangle of two vertices and a point."""
    bx, by, bz = (
        vertices[b, 0] - vertices[a, 0],
        vertices[b, 1] - vertices[a, 1],
        vertices[b, 2] - vertices[a, 2],
    )
    cx, cy, cz = x - vertices[a, 0], y - vertices[a, 1], z - vertices[a, 2]
    return by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx


@kernel
def _distance2(vertices: FloatArray, a: int, x: float, y: float, z: float) -> float:
    dx, dy, dz = vertices[a, 0] - x, vertices[a, 1] - y, vertices[a, 2] - z
    return float(dx * dx + dy * dy + dz * dz)


@kernel
def _stays_upright(
    vertices: FloatArray, faces: IntArray, starts: IntArray, around: IntArray,
    v: int, other: int, x: float, y: float, z: float,
) -> bool:  # fmt: skip
    """Whether no triangle of ``v`` turns over or becomes a sliver when ``v`` moves to (x, y, z)."""
    for i in range(starts[v], starts[v + 1]):
        f = around[i]
        a, b = faces[f, 1], faces[f, 2]
        if faces[f, 1] == v:
            a, b = faces[f, 2], faces[f, 0]
        elif faces[f, 2] == v:
            a, b = faces[f, 0], faces[f, 1]
        if a == other or b == other:
            continue
        px, py, pz = _cross(vertices, a, b, vertices[v, 0], vertices[v, 1], vertices[v, 2])
        qx, qy, qz = _cross(vertices, a, b, x, y, z)
        before, after = px * px + py * py + pz * pz, qx * qx + qy * qy + qz * qz
        if px * qx + py * qy + pz * qz < 0.7 * math.sqrt(before * after) or before * after == 0.0:
            return False
        longest = max(_distance2(vertices, a, x, y, z), _distance2(vertices, b, x, y, z))
        longest = max(longest, _distance2(vertices, a, vertices[b, 0], vertices[b, 1], vertices[b, 2]))
        if math.sqrt(after) < 0.15 * longest:
            return False
    return True


@kernel
def _may_collapse(
    u: int, on_boundary: bool, boundary: BoolArray, ring_u: IntArray, n_u: int, ring_v: IntArray, n_v: int
) -> bool:
    """Link condition: exactly the apices are shared, so the surface stays a manifold when v merges into u."""
    shared = 0
    for i in range(n_v):
        w = ring_v[i]
        common = False
        for j in range(n_u):
            common = common or ring_u[j] == w
        if common:
            shared += 1
        elif w != u and boundary[u] and boundary[w] and not on_boundary:
            return False
    return shared == (1 if on_boundary else 2) and n_u + n_v - shared - 2 >= (3 if on_boundary else 4)


@kernel
def _collapse(
    vertices: FloatArray, faces: IntArray, boundary: BoolArray, starts: IntArray, around: IntArray,
    order: IntArray, edges: IntArray, sides: IntArray, most: int,
) -> BoolArray:  # fmt: skip
    alive = np.ones(len(faces), dtype=np.bool_)
    locked = np.zeros(len(vertices), dtype=np.bool_)
    ring_u, ring_v = np.empty(32, dtype=np.int64), np.empty(32, dtype=np.int64)
    for e in order:
        u, v = edges[e, 0], edges[e, 1]
        on_boundary = sides[e, 1] < 0
        cost = 1 if on_boundary else 2
        if most < cost:
            break
        if locked[u] or locked[v] or (boundary[u] and boundary[v] and not on_boundary):
            continue
        if boundary[v] and not boundary[u]:
            u, v = v, u
        n_u = _ring_of(u, faces, starts, around, locked, ring_u)
        if n_u < 0:
            continue
        n_v = _ring_of(v, faces, starts, around, locked, ring_v)
        if n_v < 0 or not _may_collapse(u, on_boundary, boundary, ring_u, n_u, ring_v, n_v):
            continue
        if not _apices_can_lose(e, sides, faces, starts, boundary):
            continue
        # A vertex of the mirror plane stays there; otherwise meet in the middle.
        share = 0.0 if boundary[u] and not on_boundary else 0.5
        x = vertices[u, 0] + share * (vertices[v, 0] - vertices[u, 0])
        y = vertices[u, 1] + share * (vertices[v, 1] - vertices[u, 1])
        z = vertices[u, 2] + share * (vertices[v, 2] - vertices[u, 2])
        if not _stays_upright(vertices, faces, starts, around, u, v, x, y, z):
            continue
        if not _stays_upright(vertices, faces, starts, around, v, u, x, y, z):
            continue
        _merge(e, u, v, faces, starts, around, sides, alive)
        vertices[u, 0], vertices[u, 1], vertices[u, 2] = x, y, z
        locked[u], locked[v] = True, True
        for i in range(n_u):
            locked[ring_u[i]] = True
        for i in range(n_v):
            locked[ring_v[i]] = True
        most -= cost
    return alive


@kernel
def _merge(
    e: int,
    u: int,
    v: int,
    faces: IntArray,
    starts: IntArray,
    around: IntArray,
    sides: IntArray,
    alive: BoolArray,
) -> None:
    for i in range(starts[v], starts[v + 1]):
        for corner in range(3):
            if faces[around[i], corner] == v:
                faces[around[i], corner] = u
    for side in range(2):
        if sides[e, side] >= 0:
            alive[sides[e, side] // 3] = False


@kernel
def _can_lose(v: int, starts: IntArray, boundary: BoolArray) -> bool:
    """Whether a vertex keeps four neighbours in the glued mesh after losing a triangle."""
    count = starts[v + 1] - starts[v]
    return bool(count > (2 if boundary[v] else 4))


@kernel
def _apices_can_lose(e: int, sides: IntArray, faces: IntArray, starts: IntArray, boundary: BoolArray) -> bool:
    for side in range(2):
        half = sides[e, side]
        if half >= 0 and not _can_lose(faces[half // 3, (half % 3 + 2) % 3], starts, boundary):
            return False
    return True


@kernel
def _flip(
    vertices: FloatArray, faces: IntArray, boundary: BoolArray, starts: IntArray, around: IntArray,
    edges: IntArray, sides: IntArray,
) -> int:  # fmt: skip
    locked = np.zeros(len(vertices), dtype=np.bool_)
    ring = np.empty(32, dtype=np.int64)
    count = 0
    for e in range(len(edges)):
        if sides[e, 1] < 0:
            continue
        f, i, g, j = sides[e, 0] // 3, sides[e, 0] % 3, sides[e, 1] // 3, sides[e, 1] % 3
        a, b, c, d = faces[f, i], faces[f, (i + 1) % 3], faces[f, (i + 2) % 3], faces[g, (j + 2) % 3]
        if locked[a] or locked[b] or locked[c] or locked[d] or (boundary[c] and boundary[d]):
            continue
        if not (_can_lose(a, starts, boundary) and _can_lose(b, starts, boundary)):
            continue
        if not _is_better_turned(vertices, a, b, c, d):
            continue
        n = _ring_of(c, faces, starts, around, locked, ring)
        known = n < 0
        for k in range(n):
            known = known or ring[k] == d
        if known:
            continue
        faces[f, 0], faces[f, 1], faces[f, 2] = c, d, b
        faces[g, 0], faces[g, 1], faces[g, 2] = d, c, a
        locked[a], locked[b], locked[c], locked[d] = True, True, True, True
        count += 1
    return count


@kernel
def _is_better_turned(vertices: FloatArray, a: int, b: int, c: int, d: int) -> bool:
    """Whether the angles at c and d over the edge a-b exceed half a turn, and turning it folds nothing."""
    x1, y1, z1 = _cross(vertices, a, b, vertices[c, 0], vertices[c, 1], vertices[c, 2])
    x2, y2, z2 = _cross(vertices, b, a, vertices[d, 0], vertices[d, 1], vertices[d, 2])
    size1, size2 = math.sqrt(x1 * x1 + y1 * y1 + z1 * z1), math.sqrt(x2 * x2 + y2 * y2 + z2 * z2)
    dot1, dot2 = 0.0, 0.0
    for i in range(3):
        dot1 += (vertices[a, i] - vertices[c, i]) * (vertices[b, i] - vertices[c, i])
        dot2 += (vertices[a, i] - vertices[d, i]) * (vertices[b, i] - vertices[d, i])
    if dot1 * size2 + dot2 * size1 >= -1e-3 * size1 * size2:
        return False
    x, y, z = x1 + x2, y1 + y2, z1 + z2
    limit = 0.5 * math.sqrt(x * x + y * y + z * z)
    x3, y3, z3 = _cross(vertices, c, d, vertices[b, 0], vertices[b, 1], vertices[b, 2])
    x4, y4, z4 = _cross(vertices, d, c, vertices[a, 0], vertices[a, 1], vertices[a, 2])
    size3, size4 = math.sqrt(x3 * x3 + y3 * y3 + z3 * z3), math.sqrt(x4 * x4 + y4 * y4 + z4 * z4)
    upright3 = x3 * x + y3 * y + z3 * z > limit * size3
    upright4 = x4 * x + y4 * y + z4 * z > limit * size4
    return upright3 and upright4


@kernel
def _rows(faces: IntArray, n_vertices: int) -> tuple[IntArray, IntArray]:
    starts = np.zeros(n_vertices + 1, dtype=np.int64)
    for f in range(len(faces)):
        for corner in range(3):
            starts[faces[f, corner] + 1] += 1
    for v in range(n_vertices):
        starts[v + 1] += starts[v]
    fill = starts[:-1].copy()
    around = np.empty(3 * len(faces), dtype=np.int64)
    for f in range(len(faces)):
        for corner in range(3):
            v = faces[f, corner]
            around[fill[v]] = f
            fill[v] += 1
    return starts, around


@kernel
def _edge_table(faces: IntArray, n_vertices: int) -> tuple[IntArray, IntArray]:
    starts, around = _rows(faces, n_vertices)
    edges = np.empty((3 * len(faces), 2), dtype=np.int64)
    sides = np.empty((3 * len(faces), 2), dtype=np.int64)
    count = 0
    for f in range(len(faces)):
        for corner in range(3):
            tail, head = faces[f, corner], faces[f, (corner + 1) % 3]
            twin = -1
            for i in range(starts[head], starts[head + 1]):
                g = around[i]
                if faces[g, 0] == head:
                    other = 0
                elif faces[g, 1] == head:
                    other = 1
                else:
                    other = 2
                if faces[g, (other + 1) % 3] == tail:
                    twin = 3 * g + other
                    break
            if 0 <= twin < 3 * f + corner:
                continue
            edges[count, 0], edges[count, 1] = tail, head
            sides[count, 0], sides[count, 1] = 3 * f + corner, twin
            count += 1
    return edges[:count].copy(), sides[:count].copy()


@kernel
def _relative_lengths(vertices: FloatArray, edges: IntArray) -> FloatArray:
    out = np.empty(len(edges))
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        length2 = _distance2(vertices, a, vertices[b, 0], vertices[b, 1], vertices[b, 2])
        out[e] = 2.0 * math.sqrt(length2) / (vertices[a, 3] + vertices[b, 3])
    return out
