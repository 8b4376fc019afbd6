"""Betweenness by lanes: count shortest paths on the way down, carry their flow on the way back.

For a source s and a target t of weight W(s, t), every arc on a shortest path between them receives its share of W.
Only arcs that are tight in some lane are looked at twice. Rows in which every lane has exactly one shortest path
("plain" rows, nearly all of them on a generic mesh) neither store nor load path counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray
from .._kernels import kernel, summing_kernel
from .customise import UNREACHED, CountedArcs
from .elimination import Elimination
from .sweeps import LANES, ancestors_of, forget

# Path counts beyond this are damped: their products with weights must stay within float64.
LARGEST_COUNT = 1e200


class _Workspace:
    """What one thread needs to sweep: labels, counts and dependencies over (vertex, lane)."""

    def __init__(self, n_vertices: int, n_arcs: int) -> None:
        self.distance = np.empty((n_vertices, LANES), dtype=np.int32)
        self.count = np.empty((n_vertices, LANES))
        self.dependency = np.empty((n_vertices, LANES))
        self.plain = np.empty(n_vertices, dtype=np.bool_)
        self.tight = np.empty(n_arcs, dtype=np.int32)
        self.tight_from = np.empty(n_vertices, dtype=np.int64)
        self.tight_to = np.empty(n_vertices, dtype=np.int64)
        self.place = np.full(n_vertices, -1, dtype=np.int32)
        self.found = np.empty(n_vertices, dtype=np.int32)


class FlowJob:
    """Callable for threads: the flow on every arc from a list of source batches, None on overflow.

    ``forth`` and ``back`` are source and target weights by rank. With ``both_ways`` every vertex is a source once,
    each pair is met from its lower rank only, and the sweep down stops there: half the work.
    """

    def __init__(
        self, skeleton: Elimination, arcs: CountedArcs, forth: FloatArray, back: FloatArray, *, both_ways: bool
    ) -> None:
        self.skeleton, self.arcs = skeleton, arcs
        self.forth, self.back, self.both_ways = forth, back, both_ways
        self._idle: SimpleQueue[_Workspace] = SimpleQueue()

    def __call__(self, lanes: Sequence[NDArray[Any]]) -> FloatArray | None:
        flow = np.zeros(len(self.arcs.heads))
        space = self._workspace()
        fine = all(self._sweep(sources, space, flow) for sources in lanes)
        self._idle.put(space)
        return flow if fine else None

    def _workspace(self) -> _Workspace:
        try:
            return self._idle.get_nowait()
        except Empty:
            return _Workspace(len(self.skeleton.order), len(self.arcs.heads))

    def _sweep(self, sources: NDArray[Any], w: _Workspace, flow: FloatArray) -> bool:
        arcs = self.arcs
        shape = (arcs.rows, arcs.heads, arcs.lengths, arcs.counts)
        lowest = int(sources.min()) if self.both_ways else 0
        lane_sources = np.full(LANES, -1, dtype=np.int64)
        lane_sources[: len(sources)] = sources
        listed = ancestors_of(sources, self.skeleton.parent, w.place, w.found)
        climbed = np.full((len(listed), LANES), UNREACHED, dtype=np.int32)
        climbed_count = np.zeros((len(listed), LANES))
        climbed_flow = np.zeros((len(listed), LANES))
        own = (w.place[sources], np.arange(len(sources)))
        climbed[own], climbed_count[own] = 0, 1.0
        climb_counting(listed, w.place, *shape, climbed, climbed_count)
        labels = (w.distance, w.count, w.dependency, w.plain, w.tight, w.tight_from, w.tight_to)
        largest = descend_counting(lowest, w.place, *shape, climbed, climbed_count, *labels)
        fine = bool(largest < LARGEST_COUNT)
        if fine:
            weights = (self.both_ways, self.forth, self.back)
            carry_back(
                lowest, int(sources.max()), lane_sources, *weights, w.place, *shape[1:], climbed, climbed_flow,
                *labels, flow,
            )
            carry_down_climb(listed, w.place, *shape, climbed, climbed_count, climbed_flow, flow)
        forget(listed, w.place)
        return fine


@kernel
def climb_counting(
    listed: Any, place: Any, rows: Any, heads: Any, lengths: Any, counts: Any, label: Any, count: Any
) -> None:
    """Distances and numbers of shortest paths over upward paths only."""
    for i in range(len(listed)):
        v = listed[i]
        for arc in range(rows[v], rows[v + 1]):
            above = place[heads[arc]]
            length = lengths[arc]
            share = counts[arc]
            for lane in range(LANES):
                reach = np.int32(label[i, lane] + length)
                gain = count[i, lane] * share
                best = label[above, lane]
                kept = count[above, lane] if best <= reach else 0.0
                count[above, lane] = kept + (gain if reach <= best and reach < UNREACHED else 0.0)
                label[above, lane] = min(best, reach)


@kernel
def descend_counting(
    lowest: Any,
    place: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    climbed: Any,
    climbed_count: Any,
    distance: Any,
    count: Any,
    dependency: Any,
    plain: Any,
    tight: Any,
    tight_from: Any,
    tight_to: Any,
) -> Any:
    """Label all ranks from the highest to ``lowest``; note tight arcs, count paths where there are several.

    Returns the largest path count met, infinite or NaN on overflow.
    """
    filled = 0
    largest = 1.0
    for v in range(len(rows) - 2, lowest - 1, -1):
        at = place[v]
        for lane in range(LANES):
            distance[v, lane] = climbed[at, lane] if at >= 0 else UNREACHED
            dependency[v, lane] = 0.0
        _relax_fixed(v, rows, heads, lengths, distance)
        tight_from[v] = filled
        filled, alone = _note_tight(v, at, rows, heads, lengths, counts, climbed, distance, plain, tight, filled)
        tight_to[v] = filled
        if alone and at >= 0:
            for lane in range(LANES):
                alone &= climbed[at, lane] > distance[v, lane] or climbed_count[at, lane] == 1.0 or (
                    climbed[at, lane] >= UNREACHED
                )
        plain[v] = alone
        if not alone:
            _count_paths(
                v, at, tight_from[v], filled, heads, lengths, counts, climbed, climbed_count, distance, count, plain, tight
            )
            for lane in range(LANES):
                largest = max(largest, count[v, lane])
                if not count[v, lane] < np.inf:
                    return np.inf
    return largest


@kernel
def _relax_fixed(v: Any, rows: Any, heads: Any, lengths: Any, distance: Any) -> None:
    """Shorten the labels of a vertex, four arcs at a time; sums stay in 32 bits, as wide vectors need."""
    arc = rows[v]
    stop = rows[v + 1]
    while arc + 4 <= stop:
        u0, u1, u2, u3 = heads[arc], heads[arc + 1], heads[arc + 2], heads[arc + 3]
        l0, l1, l2, l3 = lengths[arc], lengths[arc + 1], lengths[arc + 2], lengths[arc + 3]
        for lane in range(LANES):
            d0 = np.int32(distance[u0, lane] + l0)
            d1 = np.int32(distance[u1, lane] + l1)
            d2 = np.int32(distance[u2, lane] + l2)
            d3 = np.int32(distance[u3, lane] + l3)
            distance[v, lane] = min(distance[v, lane], min(min(d0, d1), min(d2, d3)))
        arc += 4
    while arc < stop:
        u0 = heads[arc]
        l0 = lengths[arc]
        for lane in range(LANES):
            distance[v, lane] = min(distance[v, lane], np.int32(distance[u0, lane] + l0))
        arc += 1


@kernel
def _note_tight(
    v: Any,
    at: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    climbed: Any,
    distance: Any,
    plain: Any,
    tight: Any,
    filled: Any,
) -> Any:
    """List the arcs that end a shortest path in some lane; say whether each lane has just one path."""
    ways = np.int32(0)
    reached = np.int32(0)
    for lane in range(LANES):
        reached += np.int32(distance[v, lane] < UNREACHED)
    if at >= 0:
        for lane in range(LANES):
            ways += np.int32(climbed[at, lane] == distance[v, lane] and distance[v, lane] < UNREACHED)
    alone = True
    for arc in range(rows[v], rows[v + 1]):
        u = heads[arc]
        length = lengths[arc]
        hits = np.int32(0)
        for lane in range(LANES):
            hits += np.int32(np.int32(distance[u, lane] + length) == distance[v, lane])
        if hits:
            tight[filled] = arc
            filled += 1
            ways += hits
            alone &= plain[u] and counts[arc] == 1.0
    return filled, alone and ways == reached


@kernel
def _count_paths(
    v: Any,
    at: Any,
    start: Any,
    stop: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    climbed: Any,
    climbed_count: Any,
    distance: Any,
    count: Any,
    plain: Any,
    tight: Any,
) -> None:
    for lane in range(LANES):
        count[v, lane] = 0.0
    if at >= 0:
        for lane in range(LANES):
            if climbed[at, lane] == distance[v, lane]:
                count[v, lane] = climbed_count[at, lane]
    for t in range(start, stop):
        arc = tight[t]
        u = heads[arc]
        length = lengths[arc]
        share = counts[arc]
        if plain[u]:
            for lane in range(LANES):
                if np.int32(distance[u, lane] + length) == distance[v, lane]:
                    count[v, lane] += share
        else:
            for lane in range(LANES):
                if np.int32(distance[u, lane] + length) == distance[v, lane]:
                    count[v, lane] += share * count[u, lane]


@summing_kernel
def carry_back(
    lowest: Any,
    last_source: Any,
    sources: Any,
    both_ways: Any,
    source_weights: Any,
    target_weights: Any,
    place: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    climbed: Any,
    climbed_flow: Any,
    distance: Any,
    count: Any,
    dependency: Any,
    plain: Any,
    tight: Any,
    tight_from: Any,
    tight_to: Any,
    flow: Any,
) -> None:
    """Send each target's weight towards its source along tight arcs; what reaches a climb waits there.

    With ``both_ways`` a pair is met once, from its lower rank, and carries both directions' weight.
    """
    forth = np.zeros(LANES)
    back = np.zeros(LANES)
    for lane in range(LANES):
        s = sources[lane]
        if s >= 0:
            forth[lane] = source_weights[s]
            back[lane] = target_weights[s] if both_ways else 0.0
    due = np.empty(LANES)
    for v in range(lowest, len(place)):
        as_target = target_weights[v]
        as_source = source_weights[v]
        for lane in range(LANES):
            weight = forth[lane] * as_target + back[lane] * as_source
            due[lane] = weight if distance[v, lane] < UNREACHED else 0.0
        if v <= last_source:
            for lane in range(LANES):
                if v == sources[lane] or (both_ways and v < sources[lane]):
                    due[lane] = 0.0
        if plain[v]:
            for lane in range(LANES):
                dependency[v, lane] += due[lane]
        else:
            for lane in range(LANES):
                if count[v, lane] > 0.0:
                    dependency[v, lane] += due[lane] / count[v, lane]
        for t in range(tight_from[v], tight_to[v]):
            arc = tight[t]
            flow[arc] += _push(v, heads[arc], lengths[arc], counts[arc], distance, count, dependency, plain)
        at = place[v]
        if at >= 0:
            for lane in range(LANES):
                apex = climbed[at, lane] == distance[v, lane] and distance[v, lane] < UNREACHED
                climbed_flow[at, lane] = dependency[v, lane] if apex else 0.0


@summing_kernel
def _push(
    v: Any, u: Any, length: Any, share: Any, distance: Any, count: Any, dependency: Any, plain: Any
) -> Any:
    """Move the dependency of v on to u in the lanes where their arc is tight; return the flow it carries."""
    total = 0.0
    if plain[u]:
        for lane in range(LANES):
            tight = np.int32(distance[u, lane] + length) == distance[v, lane]
            moved = dependency[v, lane] * share if tight else 0.0
            dependency[u, lane] += moved
            total += moved
    else:
        for lane in range(LANES):
            tight = np.int32(distance[u, lane] + length) == distance[v, lane]
            moved = dependency[v, lane] * share if tight else 0.0
            dependency[u, lane] += moved
            total += moved * count[u, lane] if tight else 0.0
    return total


@summing_kernel
def carry_down_climb(
    listed: Any,
    place: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    climbed: Any,
    climbed_count: Any,
    climbed_flow: Any,
    flow: Any,
) -> None:
    """Bring the flow that waits at the tops of the climbs down to the sources."""
    for i in range(len(listed) - 1, -1, -1):
        v = listed[i]
        for arc in range(rows[v], rows[v + 1]):
            above = place[heads[arc]]
            length = lengths[arc]
            share = counts[arc]
            total = 0.0
            for lane in range(LANES):
                reach = np.int32(climbed[i, lane] + length)
                tight = reach == climbed[above, lane] and reach < UNREACHED
                moved = climbed_flow[above, lane] * share if tight else 0.0
                climbed_flow[i, lane] += moved
                total += moved * climbed_count[i, lane]
            flow[arc] += total
