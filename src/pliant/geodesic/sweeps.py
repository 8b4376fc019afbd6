"""Shortest paths from many sources at once: one sweep up the hierarchy, one down, and the way back.

Vertices are named by rank. Each of the 64 lanes holds one source; every array over (vertex, lane) is
contiguous in its lanes, which is where the compiler finds its vector instructions. The sweep up visits only
ancestors of the sources in the elimination tree, and its labels live in arrays over these ancestors
("climb"); the sweep down visits vertices in decreasing rank. (PHAST: Delling et al. 2011; the way
back: Brandes 2001.)
"""

from __future__ import annotations

from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray
from .._kernels import inlined_kernel, kernel
from ..errors import InputError
from .customise import Arcs
from .elimination import Elimination

LANES = 64


def batches(items: NDArray[Any]) -> list[NDArray[Any]]:
    """Cut an array into runs of at most one item a lane."""
    return [items[start : start + LANES] for start in range(0, len(items), LANES)]


def checked_limit(max_distance: float | None) -> float:
    """Take None to no limit, and refuse what is negative or NaN."""
    if max_distance is None:
        return np.inf
    if not max_distance >= 0:
        message = f"max_distance must be 0 or more, got {max_distance}"
        raise InputError(message)
    return float(max_distance)


class DistanceSweep:
    """Distances from at most as many ranks as there are lanes, in workspaces that threads share out."""

    def __init__(self, skeleton: Elimination, arcs: Arcs) -> None:
        self.skeleton, self.arcs = skeleton, arcs
        self._idle: SimpleQueue[FloatArray] = SimpleQueue()

    def into(self, out: FloatArray, places: NDArray[Any], ranks: NDArray[Any], limit: float) -> None:
        """Write the distances of each rank to a row of ``out`` (r, n), vertices in the graph's own order.

        Distances above ``limit`` become inf.
        """
        n, arcs = len(self.skeleton.order), self.arcs
        try:
            distance = self._idle.get_nowait()
        except Empty:
            distance = np.empty((n, LANES))
        place = np.full(n, -1, dtype=np.int32)
        listed = ancestors_of(ranks, self.skeleton.parent, place, np.empty(n, dtype=np.int32))
        label = np.full((len(listed), LANES), np.inf)
        label[place[ranks], np.arange(len(ranks))] = 0.0
        climb(listed, place, arcs.rows, arcs.heads, arcs.lengths, label)
        descend(place, arcs.rows, arcs.heads, arcs.lengths, label, distance)
        by_source(distance, self.skeleton.rank, places, limit, out)
        self._idle.put(distance)


@kernel
def ancestors_of(sources: Any, parent: Any, place: Any, found: Any) -> Any:
    """List the sources' ancestors, themselves included, ascending; ``place`` maps a rank into the list.

    ``place`` is -1 everywhere on entry; :func:`forget` restores that.
    """
    size = 0
    for lane in range(len(sources)):
        v = sources[lane]
        while v >= 0 and place[v] < 0:
            place[v] = 0
            found[size] = v
            size += 1
            v = parent[v]
    listed = np.sort(found[:size])
    for i in range(size):
        place[listed[i]] = i
    return listed


@kernel
def forget(listed: Any, place: Any) -> None:
    """Undo the marks of :func:`ancestors_of`."""
    for i in range(len(listed)):
        place[listed[i]] = -1


@kernel
def climb(listed: Any, place: Any, rows: Any, heads: Any, lengths: Any, label: Any) -> None:
    """Distances over upward paths only, from labels that are 0 at the sources."""
    for i in range(len(listed)):
        v = listed[i]
        for arc in range(rows[v], rows[v + 1]):
            above = place[heads[arc]]
            length = lengths[arc]
            for lane in range(LANES):
                label[above, lane] = min(label[above, lane], label[i, lane] + length)


@kernel
def descend(place: Any, rows: Any, heads: Any, lengths: Any, climbed: Any, distance: Any) -> None:
    """Distances to every vertex, from those of upward paths."""
    for v in range(len(rows) - 2, -1, -1):
        if place[v] >= 0:
            distance[v] = climbed[place[v]]
        else:
            distance[v] = np.inf
        relax(v, rows, heads, lengths, distance)


@inlined_kernel
def relax(v: Any, rows: Any, heads: Any, lengths: Any, distance: Any) -> None:
    """Shorten the labels of a vertex over all its arcs, four at a time to save passes over its row."""
    arc = rows[v]
    stop = rows[v + 1]
    while arc + 4 <= stop:
        u0, u1, u2, u3 = heads[arc], heads[arc + 1], heads[arc + 2], heads[arc + 3]
        l0, l1, l2, l3 = lengths[arc], lengths[arc + 1], lengths[arc + 2], lengths[arc + 3]
        for lane in range(LANES):
            low = min(distance[u0, lane] + l0, distance[u1, lane] + l1)
            high = min(distance[u2, lane] + l2, distance[u3, lane] + l3)
            distance[v, lane] = min(distance[v, lane], min(low, high))
        arc += 4
    while arc < stop:
        u0 = heads[arc]
        l0 = lengths[arc]
        for lane in range(LANES):
            distance[v, lane] = min(distance[v, lane], distance[u0, lane] + l0)
        arc += 1


@kernel
def by_source(distance: Any, rank: Any, places: Any, limit: Any, out: Any) -> None:
    """Transpose (rank, lane) to (place, vertex), in blocks that fit the cache."""
    block = 16
    for start in range(0, len(rank), block):
        stop = min(start + block, len(rank))
        for lane in range(len(places)):
            for v in range(start, stop):
                reach = distance[rank[v], lane]
                out[places[lane], v] = reach if reach <= limit else np.inf
