"""The sweeps on a CUDA device: a block for a vertex and many sources, or for one source and its ancestors.

Vertices are named by rank. Arrays over (vertex, lane) are contiguous in lanes, so that the threads of a warp read
next to one another; arrays over (lane, depth) belong to a source's ancestors. No two threads of a launch ever
write to the same place, and every sum has one fixed order: results are the same bytes on every run. Importing this
module needs numba-cuda; :mod:`pliant.geodesic.cuda` does so when a device is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

from numba import cuda, float64

from .customise import UNREACHED as _UNREACHED
from .flow import LARGEST_COUNT as _LARGEST

F = TypeVar("F", bound=Callable[..., Any])

UNREACHED = int(_UNREACHED)
LARGEST_COUNT = float(_LARGEST)
# Threads of a block, and the side of a tile that is transposed; numba wants shapes of shared memory as constants.
THREADS = 128
TILE = 16
TILE_SHAPE = (TILE, TILE + 1)


def device_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that is launched over a grid."""
    return cuda.jit(function)


def device_function(function: F) -> F:
    """Compile a function that kernels call."""
    compiled: F = cuda.jit(device=True)(function)
    return compiled


@device_function
def block_sum(value: Any, partial: Any) -> Any:
    """Add up one value a thread, always in the same order; the block's size is a power of two.

    Every thread of the block has to call it, with shared memory for one number a thread.
    """
    thread = cuda.threadIdx.x
    cuda.syncthreads()
    partial[thread] = value
    cuda.syncthreads()
    half = cuda.blockDim.x // 2
    while half > 0:
        if thread < half:
            partial[thread] += partial[thread + half]
        cuda.syncthreads()
        half //= 2
    return partial[0]


@device_function
def first_not_below(values: Any, count: Any, bound: Any) -> Any:
    """Place of the first of ``count`` ascending values that is at least ``bound``."""
    low = 0
    high = count
    while low < high:
        middle = (low + high) // 2
        if values[middle] < bound:
            low = middle + 1
        else:
            high = middle
    return low


@device_kernel
def climb(
    sources: Any, parent: Any, depth: Any, rows: Any, heads: Any, lengths: Any, far: Any, label: Any
) -> None:
    """Find distances to a source's ancestors over upward paths only, ``far`` where there is none; a block a source."""
    lane = cuda.blockIdx.x
    thread = cuda.threadIdx.x
    v = sources[lane]
    for d in range(thread, depth[v], cuda.blockDim.x):
        label[lane, d] = far
    if thread == 0:
        label[lane, depth[v]] = 0
    cuda.syncthreads()
    while v >= 0:
        reach = label[lane, depth[v]]
        # The arcs of a row end at different depths: no two threads meet.
        for arc in range(rows[v] + thread, rows[v + 1], cuda.blockDim.x):
            d = depth[heads[arc]]
            label[lane, d] = min(label[lane, d], reach + lengths[arc])
        cuda.syncthreads()
        v = parent[v]


@device_kernel
def climb_ways(
    sources: Any,
    parent: Any,
    depth: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    label: Any,
    ways: Any,
    path: Any,
) -> None:
    """Count shortest upward paths after :func:`climb`, and list the ancestors by depth; a block a source."""
    lane = cuda.blockIdx.x
    thread = cuda.threadIdx.x
    v = sources[lane]
    for d in range(thread, depth[v], cuda.blockDim.x):
        ways[lane, d] = 0.0
    if thread == 0:
        ways[lane, depth[v]] = 1.0
    cuda.syncthreads()
    while v >= 0:
        reach = label[lane, depth[v]]
        many = ways[lane, depth[v]]
        if thread == 0:
            path[lane, depth[v]] = v
        for arc in range(rows[v] + thread, rows[v + 1], cuda.blockDim.x):
            d = depth[heads[arc]]
            if reach + lengths[arc] == label[lane, d]:
                ways[lane, d] += counts[arc] * many
        cuda.syncthreads()
        v = parent[v]


@device_kernel
def descend(
    first: Any,
    lanes: Any,
    vertices: Any,
    sources: Any,
    depth: Any,
    size: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    far: Any,
    label: Any,
    distance: Any,
) -> None:
    """Find distances from those of upward paths and of earlier levels; a block a vertex of one level."""
    v = vertices[first + cuda.blockIdx.x]
    lane = cuda.blockIdx.y * cuda.blockDim.x + cuda.threadIdx.x
    if lane < lanes:
        best = far
        if v - size[v] < sources[lane] and sources[lane] <= v:
            best = label[lane, depth[v]]
        for arc in range(rows[v], rows[v + 1]):
            best = min(best, distance[heads[arc], lane] + lengths[arc])
        distance[v, lane] = best


@device_kernel
def count_down(
    first: Any,
    lanes: Any,
    vertices: Any,
    sources: Any,
    depth: Any,
    size: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    label: Any,
    ways: Any,
    distance: Any,
    count: Any,
    overflow: Any,
) -> None:
    """:func:`descend` in fixed point, with numbers of shortest paths."""
    v = vertices[first + cuda.blockIdx.x]
    lane = cuda.blockIdx.y * cuda.blockDim.x + cuda.threadIdx.x
    if lane < lanes:
        best = UNREACHED
        many = 0.0
        if v - size[v] < sources[lane] and sources[lane] <= v:
            best = label[lane, depth[v]]
            many = ways[lane, depth[v]]
        climbed = best
        for arc in range(rows[v], rows[v + 1]):
            best = min(best, distance[heads[arc], lane] + lengths[arc])
        distance[v, lane] = best
        if climbed != best or best == UNREACHED:
            many = 0.0
        for arc in range(rows[v], rows[v + 1]):
            if distance[heads[arc], lane] + lengths[arc] == best:
                many += counts[arc] * count[heads[arc], lane]
        count[v, lane] = many
        if not many < LARGEST_COUNT:
            cuda.atomic.max(overflow, 0, 1)


@device_kernel
def by_source(lanes: Any, distance: Any, rank: Any, limit: Any, out: Any) -> None:
    """Transpose (rank, lane) to (lane, vertex), tile by tile, so that reading and writing both stay in rows."""
    tile = cuda.shared.array(TILE_SHAPE, float64)
    lane = cuda.blockIdx.y * TILE + cuda.threadIdx.x
    v = cuda.blockIdx.x * TILE + cuda.threadIdx.y
    if v < len(rank) and lane < lanes:
        tile[cuda.threadIdx.y, cuda.threadIdx.x] = distance[rank[v], lane]
    cuda.syncthreads()
    v = cuda.blockIdx.x * TILE + cuda.threadIdx.x
    lane = cuda.blockIdx.y * TILE + cuda.threadIdx.y
    if v < len(rank) and lane < lanes:
        reach = tile[cuda.threadIdx.x, cuda.threadIdx.y]
        out[lane, v] = reach if reach <= limit else math.inf
