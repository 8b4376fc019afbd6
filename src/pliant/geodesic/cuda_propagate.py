"""All-pairs shortest paths the dissertation's way (section 2.4): update and propagate at once, in groups of sources.

The graph is cut into patches of neighbouring vertices. A block holds the edges of one patch in shared memory and
the labels of a group of sources, which stay in global memory, and shortens labels until its patch has settled: many
steps of the search tree between two global synchronisations. What it writes is used by other blocks at once, in the
same launch. Only patches next to a change run again.

A label that a block reads may be shortened by another at that moment. Labels only ever shrink and each has
one writer, so what is read is some path's length, old or new, and a patch next to a change runs in the next launch: at
the end every label is the least, in whatever order things happened. Importing this module needs numba-cuda.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numba import cuda, int32

from .._arrays import IntArray
from .cuda_kernels import UNREACHED, device_kernel
from .elimination import Int32Array

# Vertices of a patch; its edges that have room in shared memory; those past it, of very busy vertices, stay outside.
PATCH = 64
SHARED_EDGES = 1024
# Steps inside a launch after which others get their turn.
STEPS = 64
# Launches between two looks at whether anything still changes.
LAUNCHES = 8


@dataclass(frozen=True, eq=False)
class Patches:
    """A graph cut into patches: first vertex and neighbouring patches of each, CSR neighbours of every vertex."""

    first: Int32Array
    start: Int32Array
    neighbours: Int32Array
    lengths: Int32Array
    near_rows: Int32Array
    near: Int32Array

    @property
    def count(self) -> int:
        """Number of patches."""
        return len(self.first) - 1


def cut(n: int, edges: IntArray, lengths: Int32Array, size: int) -> Patches:
    """Cut a graph into runs of ``size`` vertices; vertices that follow one another should be neighbours."""
    ends = np.concatenate([edges, edges[:, ::-1]])
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    start = np.concatenate([[0], np.cumsum(np.bincount(ends[:, 0], minlength=n))]).astype(np.int32)
    first = np.append(np.arange(0, n, size), n).astype(np.int32)
    of = np.arange(n) // size
    own = np.arange(len(first) - 1)
    pairs = np.concatenate([of[ends], np.column_stack([own, own])])
    near = sp.csr_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])))
    near.sum_duplicates()
    return Patches(
        first,
        start,
        ends[order, 1].astype(np.int32),
        np.concatenate([lengths, lengths])[order],
        near.indptr.astype(np.int32),
        near.indices.astype(np.int32),
    )


@device_kernel
def propagate(
    launch: Any,
    lanes: Any,
    first: Any,
    start: Any,
    neighbours: Any,
    lengths: Any,
    near_rows: Any,
    near: Any,
    mark: Any,
    changed: Any,
    label: Any,
) -> None:
    """Shorten the labels of a patch for a group of sources, a block for each; threads are (source, vertex).

    ``mark`` is the last launch that changed a patch for a group.
    """
    heads = cuda.shared.array(SHARED_EDGES, int32)
    costs = cuda.shared.array(SHARED_EDGES, int32)
    patch = cuda.blockIdx.x
    group = cuda.blockIdx.y
    lane = group * cuda.blockDim.x + cuda.threadIdx.x
    thread = cuda.threadIdx.y * cuda.blockDim.x + cuda.threadIdx.x
    threads = cuda.blockDim.x * cuda.blockDim.y
    fresh = 0
    for i in range(near_rows[patch] + thread, near_rows[patch + 1], threads):
        if mark[near[i], group] >= launch - 1:
            fresh = 1
    # The whole block leaves, or none of it, though marks may change while they are read.
    if cuda.syncthreads_or(fresh) == 0:
        return
    base = start[first[patch]]
    held = min(start[first[patch + 1]] - base, SHARED_EDGES)
    for i in range(thread, held, threads):
        heads[i] = neighbours[base + i]
        costs[i] = lengths[base + i]
    cuda.syncthreads()
    steps = 0
    again = 1
    while again != 0 and steps < STEPS:
        moved = 0
        for v in range(first[patch] + cuda.threadIdx.y, first[patch + 1], cuda.blockDim.y):
            if lane < lanes:
                before = label[v, lane]
                best = before
                for i in range(start[v] - base, start[v + 1] - base):
                    if i < held:
                        best = min(best, label[heads[i], lane] + costs[i])
                    else:
                        best = min(best, label[neighbours[base + i], lane] + lengths[base + i])
                if best < before:
                    label[v, lane] = best
                    moved = 1
        again = cuda.syncthreads_or(moved)
        steps += 1
    if thread == 0 and (steps > 1 or again != 0):
        mark[patch, group] = launch
        cuda.atomic.max(changed, 0, launch)


def settle(patches: Patches, sources: Int32Array, *, group: int, rows: int) -> Any:
    """Return labels (n, s) on the device: fixed-point distances of every vertex from every source.

    A block has ``group`` sources by ``rows`` vertices.
    """
    n, lanes = len(patches.start) - 1, len(sources)
    groups = -(-lanes // group)
    parts = (
        patches.first,
        patches.start,
        patches.neighbours,
        patches.lengths,
        patches.near_rows,
        patches.near,
    )
    on_device = [cuda.to_device(part) for part in parts]
    begin = np.full((n, lanes), UNREACHED, dtype=np.int32)
    begin[sources, np.arange(lanes)] = 0
    label = cuda.to_device(begin)
    marks = np.full((patches.count, groups), -1, dtype=np.int32)
    size = int(patches.first[1]) if patches.count > 1 else n
    marks[sources // size, np.arange(lanes) // group] = 0
    mark = cuda.to_device(marks)
    changed = cuda.to_device(np.zeros(1, dtype=np.int32))
    launch = 0
    while int(changed.copy_to_host()[0]) == launch:
        for _ in range(LAUNCHES):
            launch += 1
            propagate[(patches.count, groups), (group, rows)](launch, lanes, *on_device, mark, changed, label)
    return label
