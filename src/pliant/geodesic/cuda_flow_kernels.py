"""Flow on a CUDA device: dependencies level by level, then every arc's sum over all sources at once.

What the arrays are, and why no two threads ever write to the same place, is said in
:mod:`pliant.geodesic.cuda_kernels`; what they compute, in :mod:`pliant.geodesic.flow` and
:mod:`pliant.geodesic.sampled`. A vertex takes over what lower ones send, rather than being sent it, so
that sums have one order without atomic additions.
"""

from __future__ import annotations

from typing import Any

from numba import cuda, float64

from .cuda_kernels import THREADS, UNREACHED, block_sum, device_kernel, first_not_below


@device_kernel
def begin_exact(
    lowest: Any,
    lanes: Any,
    sources: Any,
    both_ways: Any,
    forth: Any,
    back: Any,
    distance: Any,
    count: Any,
    due: Any,
) -> None:
    """Set what every vertex, as a target, sends towards every source, over the number of shortest paths."""
    v = lowest + cuda.blockIdx.x
    lane = cuda.blockIdx.y * cuda.blockDim.x + cuda.threadIdx.x
    if lane < lanes:
        s = sources[lane]
        weight = 0.0
        if v > s or (v < s and not both_ways):
            weight = forth[s] * back[v]
            if both_ways:
                weight += back[s] * forth[v]
        if distance[v, lane] < UNREACHED and count[v, lane] > 0.0:
            due[v, lane] = weight / count[v, lane]
        else:
            due[v, lane] = 0.0


@device_kernel
def begin_sampled(lanes: Any, lane_weights: Any, weights: Any, distance: Any, count: Any, due: Any) -> None:
    """:func:`begin_exact` for sampled sources: twice the weight over the distance."""
    v = cuda.blockIdx.x
    lane = cuda.blockIdx.y * cuda.blockDim.x + cuda.threadIdx.x
    if lane < lanes:
        reach = distance[v, lane]
        due[v, lane] = 0.0
        if reach > 0 and reach < UNREACHED and count[v, lane] > 0.0:
            due[v, lane] = 2.0 * lane_weights[lane] * weights[v] / reach / count[v, lane]


@device_kernel
def collect(
    first: Any,
    lanes: Any,
    lowest: Any,
    vertices: Any,
    lower_rows: Any,
    lower: Any,
    lower_arcs: Any,
    lengths: Any,
    counts: Any,
    distance: Any,
    due: Any,
) -> None:
    """Take over what later levels send along tight arcs; a block a vertex of one level, the last level first."""
    v = vertices[first + cuda.blockIdx.x]
    lane = cuda.blockIdx.y * cuda.blockDim.x + cuda.threadIdx.x
    if lane < lanes:
        reach = distance[v, lane]
        if reach < UNREACHED:
            total = due[v, lane]
            for i in range(lower_rows[v], lower_rows[v + 1]):
                u = lower[i]
                arc = lower_arcs[i]
                if u >= lowest and reach + lengths[arc] == distance[u, lane]:
                    total += due[u, lane] * counts[arc]
            due[v, lane] = total


@device_kernel
def carry_down_climb(
    sources: Any,
    depth: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    path: Any,
    label: Any,
    distance: Any,
    due: Any,
    waiting: Any,
) -> None:
    """Bring what arrived at the tops of a source's climbs down to it; a block a source."""
    partial = cuda.shared.array(THREADS, float64)
    lane = cuda.blockIdx.x
    thread = cuda.threadIdx.x
    for d in range(depth[sources[lane]] + 1):
        v = path[lane, d]
        reach = label[lane, d]
        mine = 0.0
        for arc in range(rows[v] + thread, rows[v + 1], cuda.blockDim.x):
            above = depth[heads[arc]]
            if reach + lengths[arc] == label[lane, above]:
                mine += waiting[lane, above] * counts[arc]
        total = block_sum(mine, partial)
        if thread == 0:
            if reach < UNREACHED and reach == distance[v, lane]:
                total += due[v, lane]
            waiting[lane, d] = total
        cuda.syncthreads()


@device_kernel
def sum_flow(
    lowest: Any,
    lanes: Any,
    sources: Any,
    depth: Any,
    size: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    label: Any,
    ways: Any,
    waiting: Any,
    distance: Any,
    count: Any,
    due: Any,
    flow: Any,
) -> None:
    """Add the flow of all sources to a vertex's arcs; a block a vertex."""
    partial = cuda.shared.array(THREADS, float64)
    v = lowest + cuda.blockIdx.x
    thread = cuda.threadIdx.x
    low = first_not_below(sources, lanes, v - size[v] + 1)
    high = first_not_below(sources, lanes, v + 1)
    for arc in range(rows[v], rows[v + 1]):
        u = heads[arc]
        mine = 0.0
        for lane in range(thread, lanes, cuda.blockDim.x):
            if distance[u, lane] + lengths[arc] == distance[v, lane]:
                mine += due[v, lane] * counts[arc] * count[u, lane]
        for lane in range(low + thread, high, cuda.blockDim.x):
            if label[lane, depth[v]] + lengths[arc] == label[lane, depth[u]]:
                mine += waiting[lane, depth[u]] * counts[arc] * ways[lane, depth[v]]
        total = block_sum(mine, partial)
        if thread == 0:
            flow[arc] += total


@device_kernel
def sum_sampled(
    lanes: Any,
    lane_weights: Any,
    weights: Any,
    sources: Any,
    depth: Any,
    size: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    label: Any,
    ways: Any,
    waiting: Any,
    distance: Any,
    count: Any,
    due: Any,
    sums: Any,
    ending: Any,
) -> None:
    """Sum flow up and down a vertex's arcs, also times the lower end's distance, and what ends there; a block each."""
    partial = cuda.shared.array(THREADS, float64)
    v = cuda.blockIdx.x
    thread = cuda.threadIdx.x
    low = first_not_below(sources, lanes, v - size[v] + 1)
    high = first_not_below(sources, lanes, v + 1)
    for arc in range(rows[v], rows[v + 1]):
        u = heads[arc]
        down = 0.0
        down_moment = 0.0
        for lane in range(thread, lanes, cuda.blockDim.x):
            if distance[u, lane] + lengths[arc] == distance[v, lane]:
                moved = due[v, lane] * counts[arc] * count[u, lane]
                down += moved
                down_moment += moved * distance[v, lane]
        up = 0.0
        up_moment = 0.0
        for lane in range(low + thread, high, cuda.blockDim.x):
            if label[lane, depth[v]] + lengths[arc] == label[lane, depth[u]]:
                moved = waiting[lane, depth[u]] * counts[arc] * ways[lane, depth[v]]
                up += moved
                up_moment += moved * label[lane, depth[v]]
        up = block_sum(up, partial)
        up_moment = block_sum(up_moment, partial)
        down = block_sum(down, partial)
        down_moment = block_sum(down_moment, partial)
        if thread == 0:
            sums[arc, 0] += up
            sums[arc, 1] += up_moment
            sums[arc, 2] += down
            sums[arc, 3] += down_moment
    ends = 0.0
    for lane in range(thread, lanes, cuda.blockDim.x):
        if distance[v, lane] > 0 and distance[v, lane] < UNREACHED:
            ends += 2.0 * lane_weights[lane] * weights[v]
    ends = block_sum(ends, partial)
    if thread == 0:
        ending[v] += ends
