"""Kernels of the curvature estimator: neighbourhoods grown over edges, and the polynomial fitted to each."""

from __future__ import annotations

import numpy as np

from .._arrays import FloatArray, IntArray
from .._kernels import kernel

# Monomials of the height polynomial in order of degree, so that the leading 6 are the quadratic fit.
_N_CUBIC = 10
_N_QUADRATIC = 6
WANTED_NEIGHBOURS = 15

# A pivot this small (all columns scaled to length one) means that the points do not fix the coefficient.
_LEAST_PIVOT = 1e-6


@kernel
def _sift_up(heap_keys: FloatArray, heap_items: IntArray, position: int) -> None:
    key, item = heap_keys[position], heap_items[position]
    while position > 0:
        parent = (position - 1) >> 1
        if heap_keys[parent] <= key:
            break
        heap_keys[position], heap_items[position] = heap_keys[parent], heap_items[parent]
        position = parent
    heap_keys[position], heap_items[position] = key, item


@kernel
def _sift_down(heap_keys: FloatArray, heap_items: IntArray, size: int) -> None:
    key, item = heap_keys[0], heap_items[0]
    position = 0
    while True:
        child = 2 * position + 1
        if child >= size:
            break
        if child + 1 < size and heap_keys[child + 1] < heap_keys[child]:
            child += 1
        if heap_keys[child] >= key:
            break
        heap_keys[position], heap_items[position] = heap_keys[child], heap_items[child]
        position = child
    heap_keys[position], heap_items[position] = key, item


@kernel
def grow_neighbourhood(
    centre: int,
    radius: float,
    wanted: int,
    starts: IntArray,
    neighbours: IntArray,
    lengths: FloatArray,
    settled: IntArray,
    distance: FloatArray,
    found: IntArray,
    heap_keys: FloatArray,
    heap_items: IntArray,
) -> tuple[int, float]:
    """Settle vertices in order of path length until past the radius and at least `wanted` are found.

    `settled` holds 2 * centre + 1 for what is final and 2 * centre for what has been reached, so that it
    needs no clearing between centres (it starts at -1). Returns the number found and the radius used.
    """
    reached, done = 2 * centre, 2 * centre + 1
    settled[centre], distance[centre] = reached, 0.0
    heap_keys[0], heap_items[0] = 0.0, centre
    size, count, used = 1, 0, radius
    while size > 0:
        length, vertex = heap_keys[0], heap_items[0]
        size -= 1
        heap_keys[0], heap_items[0] = heap_keys[size], heap_items[size]
        if size > 0:
            _sift_down(heap_keys, heap_items, size)
        if settled[vertex] == done:
            continue
        if length > radius:
            if count >= wanted:
                break
            used = length
        settled[vertex] = done
        found[count] = vertex
        count += 1
        for arc in range(starts[vertex], starts[vertex + 1]):
            other = neighbours[arc]
            through = length + lengths[arc]
            if settled[other] == done or (settled[other] == reached and distance[other] <= through):
                continue
            settled[other], distance[other] = reached, through
            heap_keys[size], heap_items[size] = through, other
            _sift_up(heap_keys, heap_items, size)
            size += 1
    return count, used


@kernel
def _frame(normal: FloatArray, frame: FloatArray) -> None:
    """Complete a unit normal to a right-handed orthonormal frame, rows (e1, e2, normal)."""
    axis = 0
    for k in range(1, 3):
        if abs(normal[k]) < abs(normal[axis]):
            axis = k
    for k in range(3):
        frame[0, k] = -normal[axis] * normal[k]
        frame[2, k] = normal[k]
    frame[0, axis] += 1.0
    norm = np.sqrt(frame[0, 0] ** 2 + frame[0, 1] ** 2 + frame[0, 2] ** 2)
    for k in range(3):
        frame[0, k] /= norm
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        frame[1, k] = normal[i] * frame[0, j] - normal[j] * frame[0, i]


@kernel
def _mean_normal(
    centre: int,
    count: int,
    used: float,
    found: IntArray,
    distance: FloatArray,
    normals: FloatArray,
    areas: FloatArray,
    normal: FloatArray,
) -> bool:
    normal[:] = 0.0
    for i in range(count):
        vertex = found[i]
        weight = np.exp(-2.0 * (distance[vertex] / used) ** 2)
        for k in range(3):
            normal[k] += weight * areas[vertex] * normals[vertex, k]
    norm = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    # A neighbourhood that closes around a small part has no mean normal: fall back on the centre's own.
    if norm <= 0.1 * areas[centre]:
        normal[:] = normals[centre]
        norm = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    if not norm > 0.0:
        return False
    normal /= norm
    return True


@kernel
def _accumulate(
    centre: int,
    count: int,
    used: float,
    found: IntArray,
    distance: FloatArray,
    vertices: FloatArray,
    normals: FloatArray,
    frame: FloatArray,
    matrix: FloatArray,
    right: FloatArray,
) -> int:
    """Sum the weighted normal equations of the cubic height polynomial, coordinates in units of `used`.

    Weights fade as a vertex's normal turns away from the frame's: past a right angle the surface is no graph
    over the tangent plane. Returns the number of vertices that take part.
    """
    matrix[:] = 0.0
    right[:] = 0.0
    row = np.empty(_N_CUBIC)
    local = np.empty(3)
    taken = 0
    for i in range(count):
        vertex = found[i]
        upright = 0.0
        for k in range(3):
            upright += normals[vertex, k] * frame[2, k]
        if upright <= 0.0:
            continue
        taken += 1
        weight = upright * np.exp(-2.0 * (distance[vertex] / used) ** 2)
        for k in range(3):
            local[k] = 0.0
            for axis in range(3):
                local[k] += frame[k, axis] * (vertices[vertex, axis] - vertices[centre, axis])
            local[k] /= used
        x, y = local[0], local[1]
        row[0], row[1], row[2] = 1.0, x, y
        row[3], row[4], row[5] = x * x, x * y, y * y
        row[6], row[7], row[8], row[9] = x * x * x, x * x * y, x * y * y, y * y * y
        for j in range(_N_CUBIC):
            right[j] += weight * row[j] * local[2]
            for k in range(j + 1):
                matrix[j, k] += weight * row[j] * row[k]
    return taken


@kernel
def _solve(
    matrix: FloatArray, right: FloatArray, size: int, factor: FloatArray, solution: FloatArray
) -> bool:
    """Solve the leading block by Cholesky with columns scaled to length one; False where it is not fixed."""
    for j in range(size):
        if not matrix[j, j] > 0.0:
            return False
    for j in range(size):
        for k in range(j + 1):
            total = matrix[j, k] / np.sqrt(matrix[j, j] * matrix[k, k])
            for i in range(k):
                total -= factor[j, i] * factor[k, i]
            if j == k:
                if not total > _LEAST_PIVOT:
                    return False
                factor[j, j] = np.sqrt(total)
            else:
                factor[j, k] = total / factor[k, k]
    for j in range(size):
        total = right[j] / np.sqrt(matrix[j, j])
        for i in range(j):
            total -= factor[j, i] * solution[i]
        solution[j] = total / factor[j, j]
    for back in range(size):
        j = size - 1 - back
        total = solution[j]
        for i in range(j + 1, size):
            total -= factor[i, j] * solution[i]
        solution[j] = total / factor[j, j]
    for j in range(size):
        solution[j] /= np.sqrt(matrix[j, j])
    return True


@kernel
def _principal(jet: FloatArray, used: float, frame: FloatArray, out: FloatArray, axes: FloatArray) -> None:
    """Principal curvatures and directions of the graph of the jet at the centre."""
    gx, gy = jet[1], jet[2]
    xx, xy, yy = 2.0 * jet[3] / used, jet[4] / used, 2.0 * jet[5] / used
    # The first fundamental form is L L^T; in the columns of L^-T the shape operator is symmetric.
    l11 = np.sqrt(1.0 + gx * gx)
    l21 = gx * gy / l11
    l22 = np.sqrt(1.0 + gy * gy - l21 * l21)
    steep = -np.sqrt(1.0 + gx * gx + gy * gy)
    a = xx / (l11 * l11) / steep
    b = (xy - xx * l21 / l11) / (l11 * l22) / steep
    c = (yy - 2.0 * xy * l21 / l11 + xx * (l21 / l11) ** 2) / (l22 * l22) / steep
    mean, half = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    out[0], out[1] = mean + half, mean - half
    angle = 0.5 * np.arctan2(2.0 * b, a - c)
    for i in range(2):
        u, v = np.cos(angle), np.sin(angle)
        if i == 1:
            u, v = -v, u
        q = v / l22
        p = (u - l21 * q) / l11
        largest = 0
        for k in range(3):
            axes[i, k] = p * (frame[0, k] + gx * frame[2, k]) + q * (frame[1, k] + gy * frame[2, k])
            if abs(axes[i, k]) > abs(axes[i, largest]) * (1.0 + 1e-9):
                largest = k
        if axes[i, largest] < 0.0:
            axes[i] *= -1.0


@kernel
def fit_jets(
    first: int,
    last: int,
    radius: float,
    vertices: FloatArray,
    normals: FloatArray,
    areas: FloatArray,
    starts: IntArray,
    neighbours: IntArray,
    lengths: FloatArray,
    curvatures: FloatArray,
    axes: FloatArray,
    radii: FloatArray,
) -> None:
    """Fill rows first..last of curvatures (n, 2), axes (n, 2, 3), radii (n,); NaN where there is no fit."""
    n = len(vertices)
    settled, distance, found = np.full(n, -1), np.empty(n), np.empty(n, np.int64)
    heap_keys, heap_items = np.empty(len(neighbours) + 1), np.empty(len(neighbours) + 1, np.int64)
    normal, frame, jet = np.empty(3), np.empty((3, 3)), np.empty(_N_CUBIC)
    matrix, factor = np.empty((_N_CUBIC, _N_CUBIC)), np.empty((_N_CUBIC, _N_CUBIC))
    right = np.empty(_N_CUBIC)
    for centre in range(first, last):
        curvatures[centre] = np.nan
        axes[centre] = np.nan
        count, used = grow_neighbourhood(
            centre, radius, WANTED_NEIGHBOURS, starts, neighbours, lengths, settled, distance, found,
            heap_keys, heap_items,
        )  # fmt: skip
        radii[centre] = used
        if count < _N_QUADRATIC:
            continue
        if not _mean_normal(centre, count, used, found, distance, normals, areas, normal):
            continue
        _frame(normal, frame)
        taken = _accumulate(centre, count, used, found, distance, vertices, normals, frame, matrix, right)
        if taken < _N_QUADRATIC:
            continue
        fitted = taken > _N_CUBIC and _solve(matrix, right, _N_CUBIC, factor, jet)
        if fitted or _solve(matrix, right, _N_QUADRATIC, factor, jet):
            _principal(jet, used, frame, curvatures[centre], axes[centre])
