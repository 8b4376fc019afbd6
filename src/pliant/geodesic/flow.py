"""Betweenness by lanes: count shortest paths on the way down, carry their flow on the way back.

For a source s and a target t of weight W(s, t), every arc on a shortest path between them receives its share of W.
(Brandes 2001.) What a lane, a climb and a plain row are is said in :mod:`pliant.geodesic.sweeps` and
:mod:`pliant.geodesic.counting`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray, IntArray
from .._kernels import inlined_kernel, summing_kernel
from .counting import climb_counting, descend_counting
from .customise import UNREACHED, SweptArcs
from .elimination import Elimination, Int32Array
from .sweeps import LANES, ancestors_of, forget

# Path counts beyond this are damped: their products with weights must stay within float64.
LARGEST_COUNT = 1e200


class Workspace:
    """What one thread needs to sweep: labels, counts and dependencies over (vertex, lane).

    Its copy of the arcs is reordered as it goes: row v starts with those that were tight in the last sweep, up to
    ``tight_to[v]``. ``listed``, ``label``, ``ways`` and ``waiting`` belong to the sources' ancestors.
    """

    def __init__(self, arcs: SweptArcs) -> None:
        n = len(arcs.rows) - 1
        self.distance = np.empty((n, LANES), dtype=np.int32)
        self.count = np.empty((n, LANES))
        self.dependency = np.zeros((n, LANES))
        self.plain = np.empty(n, dtype=np.bool_)
        self.numbers = np.empty(len(arcs.heads), dtype=np.int32)
        self.heads = np.empty_like(arcs.heads)
        self.lengths = np.empty_like(arcs.lengths)
        self.tight_to = np.empty(n, dtype=np.int64)
        self.tight_climb = np.empty(len(arcs.heads), dtype=np.int32)
        self.tight_climb_to = np.empty(n, dtype=np.int64)
        self.place = np.full(n, -1, dtype=np.int32)
        self.found = np.empty(n, dtype=np.int32)
        self._most = -1
        self.start_climb(self.found[:0])

    def start_climb(self, listed: NDArray[np.int32]) -> None:
        """Make room for a climb to ``listed`` ancestors; new arrays for every climb would be paged in every time."""
        m = len(listed)
        if m > self._most:
            self._most = 2 * m
            self._label = np.empty((self._most, LANES), dtype=np.int32)
            self._ways, self._waiting = np.empty((2, self._most, LANES))
        self.listed = listed
        self.label, self.ways, self.waiting = self._label[:m], self._ways[:m], self._waiting[:m]
        self.label[:], self.ways[:], self.waiting[:] = UNREACHED, 0.0, 0.0

    def reset(self, arcs: SweptArcs) -> None:
        """Forget what earlier sweeps did, so that the next result does not depend on them to the last bit."""
        self.numbers[:] = np.arange(len(arcs.heads))
        self.heads[:] = arcs.heads
        self.lengths[:] = arcs.lengths
        self.tight_to[:] = arcs.rows[:-1]
        self.dependency[:] = 0.0


class Sweep:
    """The way from sources to labels, counts and tight arcs, in workspaces that threads share out."""

    def __init__(self, skeleton: Elimination, arcs: SweptArcs) -> None:
        self.parent, self.arcs = skeleton.parent, arcs
        self._idle: SimpleQueue[Workspace] = SimpleQueue()

    def __getstate__(self) -> tuple[Int32Array, SweptArcs]:
        return self.parent, self.arcs

    def __setstate__(self, state: tuple[Int32Array, SweptArcs]) -> None:
        """Come to another process without workspaces."""
        self.parent, self.arcs = state
        self._idle = SimpleQueue()

    @contextmanager
    def workspace(self) -> Iterator[Workspace]:
        """Lend a workspace, reset."""
        try:
            space = self._idle.get_nowait()
        except Empty:
            space = Workspace(self.arcs)
        space.reset(self.arcs)
        yield space
        self._idle.put(space)

    def forward(self, sources: NDArray[Any], w: Workspace, *, lowest: int) -> bool:
        """Climb from the sources and descend to ``lowest``; False where path counts overflow."""
        arcs = self.arcs
        w.start_climb(ancestors_of(sources, self.parent, w.place, w.found))
        own = (w.place[sources], np.arange(len(sources)))
        w.label[own], w.ways[own] = 0, 1.0
        climb_counting(
            w.listed, w.place, arcs.rows, arcs.heads, arcs.lengths, arcs.counts, w.label, w.ways,
            w.tight_climb, w.tight_climb_to,
        )  # fmt: skip
        largest = descend_counting(
            lowest, w.place, arcs.rows, w.label, w.ways, w.numbers, w.heads, w.lengths, w.tight_to,
            arcs.counts, w.distance, w.count, w.plain,
        )  # fmt: skip
        if largest < LARGEST_COUNT:
            return True
        self.finish(w)
        return False

    def finish(self, w: Workspace) -> None:
        """Make the workspace ready for the next sources."""
        forget(w.listed, w.place)


class FlowJob:
    """Callable for threads: the flow on every arc from a list of source batches, None on overflow.

    ``forth`` and ``back`` are source and target weights by rank. With ``both_ways`` every vertex is a source once,
    each pair is met from its lower rank only, and the sweep down stops there: half the work. Neighbouring
    batches should follow one another: the shortest paths of one guide the next.
    """

    def __init__(
        self,
        skeleton: Elimination,
        arcs: SweptArcs,
        forth: FloatArray,
        back: FloatArray,
        *,
        both_ways: bool,
    ) -> None:
        self.sweep, self.arcs = Sweep(skeleton, arcs), arcs
        self.forth, self.back, self.both_ways = forth, back, both_ways

    def __call__(self, lanes: Sequence[NDArray[Any]]) -> FloatArray | None:
        """Sweep each batch of sources (ranks, at most one a lane) and add up the flow."""
        flow = np.empty(len(self.arcs.heads))
        return flow if self.into(flow, lanes) else None

    def into(self, flow: FloatArray, lanes: Sequence[NDArray[Any]]) -> bool:
        """Write over ``flow`` what a call would return; False on overflow."""
        flow[:] = 0.0
        with self.sweep.workspace() as w:
            for sources in lanes:
                lowest = int(sources.min()) if self.both_ways else 0
                if not self.sweep.forward(sources, w, lowest=lowest):
                    return False
                self._carry(sources, w, lowest, flow)
                self.sweep.finish(w)
        return True

    def _carry(self, sources: NDArray[Any], w: Workspace, lowest: int, flow: FloatArray) -> None:
        arcs = self.arcs
        lane_sources = np.full(LANES, -1, dtype=np.int64)
        lane_sources[: len(sources)] = sources
        carry_back(
            lowest, int(sources.max()), lane_sources, self.both_ways, self.forth, self.back, w.place,
            arcs.rows, w.label, w.waiting, w.numbers, w.heads, w.lengths, w.tight_to, arcs.counts,
            w.distance, w.count, w.plain, w.dependency, flow,
        )  # fmt: skip
        carry_down_climb(
            w.listed, w.place, arcs.heads, arcs.lengths, arcs.counts, w.label, w.ways, w.waiting,
            w.tight_climb, w.tight_climb_to, flow,
        )  # fmt: skip


@summing_kernel
def carry_back(
    lowest: Any,
    last_source: Any,
    sources: Any,
    both_ways: Any,
    source_weights: Any,
    target_weights: Any,
    place: Any,
    rows: Any,
    climbed: Any,
    climbed_flow: Any,
    numbers: Any,
    heads: Any,
    lengths: Any,
    tight_to: Any,
    counts: Any,
    distance: Any,
    count: Any,
    plain: Any,
    dependency: Any,
    flow: Any,
) -> None:
    """Send each target's weight towards its source along tight arcs; what reaches a climb waits there.

    With ``both_ways`` a pair is met once, from its lower rank, and carries both directions' weight.
    Dependencies are 0 on entry and are left so.
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
        if not plain[v]:
            for lane in range(LANES):
                due[lane] = due[lane] / count[v, lane] if count[v, lane] > 0.0 else 0.0
        first, tight, at = rows[v], tight_to[v], place[v]
        if at < 0 and tight - first == 1 and plain[v]:
            u = heads[first]
            total = 0.0
            for lane in range(LANES):
                moved = dependency[v, lane] + due[lane]
                dependency[u, lane] += moved
                dependency[v, lane] = 0.0
                total += moved
            flow[numbers[first]] += total
            continue
        for lane in range(LANES):
            due[lane] += dependency[v, lane]
            dependency[v, lane] = 0.0
        for arc in range(first, tight):
            number = numbers[arc]
            flow[number] += _push(
                v, heads[arc], lengths[arc], counts[number], due, distance, count, plain, dependency
            )
        if at >= 0:
            for lane in range(LANES):
                apex = climbed[at, lane] == distance[v, lane] and distance[v, lane] < UNREACHED
                climbed_flow[at, lane] = due[lane] if apex else 0.0


@inlined_kernel
def _push(
    v: Any, u: Any, length: Any, share: Any, due: Any, distance: Any, count: Any, plain: Any, dependency: Any
) -> Any:
    """Move what is due at v on to u in the lanes where their arc is tight; return the flow it carries."""
    total = 0.0
    if plain[u]:
        for lane in range(LANES):
            tight = np.int32(distance[u, lane] + length) == distance[v, lane]
            moved = due[lane] * share if tight else 0.0
            dependency[u, lane] += moved
            total += moved
    else:
        for lane in range(LANES):
            tight = np.int32(distance[u, lane] + length) == distance[v, lane]
            moved = due[lane] * share if tight else 0.0
            dependency[u, lane] += moved
            total += moved * count[u, lane] if tight else 0.0
    return total


@summing_kernel
def carry_down_climb(
    listed: Any,
    place: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    climbed: Any,
    climbed_count: Any,
    climbed_flow: Any,
    tight: Any,
    tight_to: Any,
    flow: Any,
) -> None:
    """Bring the flow that waits at the tops of the climbs down to the sources."""
    for i in range(len(listed) - 1, -1, -1):
        for t in range(tight_to[i - 1] if i else 0, tight_to[i]):
            arc = tight[t]
            above = place[heads[arc]]
            length = lengths[arc]
            share = counts[arc]
            total = 0.0
            for lane in range(LANES):
                reach = np.int32(climbed[i, lane] + length)
                moved = climbed_flow[above, lane] * share if reach == climbed[above, lane] else 0.0
                climbed_flow[i, lane] += moved
                total += moved * climbed_count[i, lane]
            flow[arc] += total


def passing_flow(
    edges: IntArray, edge_flow: FloatArray, forth: FloatArray, back: FloatArray, components: IntArray
) -> FloatArray:
    """Flow through each vertex: half of what its edges carry, once what begins or ends there is taken off."""
    n = len(forth)
    carried = np.bincount(edges[:, 0], edge_flow, n) + np.bincount(edges[:, 1], edge_flow, n)
    all_forth = np.bincount(components, forth)[components]
    all_back = np.bincount(components, back)[components]
    ending = 0.5 * (forth * (all_back - back) + back * (all_forth - forth))
    through: FloatArray = 0.5 * (carried - ending)
    # What is left of two large equal numbers is rounding, not traffic.
    through[through < 1e-12 * carried] = 0.0
    return through
