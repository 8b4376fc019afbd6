"""Betweenness from some sources only, with little variance: each pair counted by how far away its source is.

Taken as they are, the contributions of sampled sources to a vertex are mostly small and rarely huge (from sources right
behind it), so that a sample underestimates and does not know it. Here the share that the path from s to t gives to
x is multiplied by ``2 d(s, x) / d(s, t)``. From the other end the factor is ``2 d(t, x) / d(s, t)``, and the two
average to 1: still unbiased, but near sources no longer matter and far ones agree. (Linear scaling:
Geisberger, Sanders and Schultes 2008.)

The factor differs from vertex to vertex along a path, so every arc carries four sums over the sources: flow in the
climbing and in the descending direction, and each times the distance of the arc's lower vertex. Distances along an
arc are linear in these, and unpacking keeps them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray
from .._kernels import inlined_kernel, kernel, summing_kernel
from .customise import UNREACHED, CountedArcs
from .elimination import Elimination
from .flow import Sweep
from .sweeps import LANES

# Columns of the sums an arc carries.
UP, UP_MOMENT, DOWN, DOWN_MOMENT = 0, 1, 2, 3
# Share of what ends at a vertex below which a difference from it is rounding: 3e-15 is seen, and traffic from 1e-5.
ROUNDING = 1e-12


class SampledFlowJob:
    """Callable for threads: traffic through every vertex from a list of source batches, None on overflow.

    ``weights`` are by rank and stand for sources and targets alike; ``stands_for`` multiplies a source.
    """

    def __init__(
        self, skeleton: Elimination, arcs: CountedArcs, weights: FloatArray, stands_for: FloatArray
    ) -> None:
        self.sweep = Sweep(skeleton, arcs)
        self.arcs, self.weights, self.stands_for = arcs, weights, stands_for

    def __call__(self, lanes: Sequence[NDArray[Any]]) -> FloatArray | None:
        """Return half the scaled traffic through each rank, as exact betweenness is half of ordered pairs."""
        arcs = self.arcs
        sums = np.zeros((len(arcs.heads), 4))
        ending = np.zeros(len(self.weights))
        with self.sweep.workspace() as w:
            for sources in lanes:
                if not self.sweep.forward(sources, w, lowest=0):
                    return None
                lane_weights = np.zeros(LANES)
                lane_weights[: len(sources)] = (self.weights * self.stands_for)[sources]
                _carry(
                    lane_weights, self.weights, w.place, arcs.rows, w.label, w.waiting, w.numbers, w.heads,
                    w.lengths, w.tight_to, arcs.counts, w.distance, w.count, w.plain, w.dependency, sums, ending,
                )  # fmt: skip
                _carry_climb(
                    w.listed, w.place, arcs.heads, arcs.lengths, arcs.counts, w.label, w.ways, w.waiting,
                    w.tight_climb, w.tight_climb_to, sums,
                )  # fmt: skip
                self.sweep.finish(w)
        return traffic(arcs, sums, ending)


def traffic(arcs: CountedArcs, sums: FloatArray, ending: FloatArray) -> FloatArray:
    """Half the traffic through each rank, from what the arcs carry (in place) and what ends at each."""
    _unpack(sums, arcs.counts, arcs.lengths, arcs.whole, arcs.first, arcs.second)
    passing = _at_vertices(sums, arcs.edge_share, arcs.lengths, arcs.rows, arcs.heads)
    left = np.asarray(passing - ending)
    # Where no path passes only rounding is left, of either sign; the rarest traffic is far above it.
    left[np.abs(left) <= ROUNDING * np.abs(ending)] = 0.0
    return 0.25 * left


@summing_kernel
def _carry(
    lane_weights: Any,
    weights: Any,
    place: Any,
    rows: Any,
    climbed: Any,
    waiting: Any,
    numbers: Any,
    heads: Any,
    lengths: Any,
    tight_to: Any,
    counts: Any,
    distance: Any,
    count: Any,
    plain: Any,
    dependency: Any,
    sums: Any,
    ending: Any,
) -> None:
    """Send ``2 W / d(s, t)`` from every target towards its source; see :func:`pliant.geodesic.flow.carry_back`."""
    due = np.empty(LANES)
    for v in range(len(place)):
        ends = 0.0
        for lane in range(LANES):
            reach = distance[v, lane]
            weight = 2.0 * lane_weights[lane] * weights[v] if 0 < reach < UNREACHED else 0.0
            ends += weight
            due[lane] = weight / max(reach, 1)
        ending[v] += ends
        if not plain[v]:
            for lane in range(LANES):
                due[lane] = due[lane] / count[v, lane] if count[v, lane] > 0.0 else 0.0
        for lane in range(LANES):
            due[lane] += dependency[v, lane]
            dependency[v, lane] = 0.0
        for arc in range(rows[v], tight_to[v]):
            number = numbers[arc]
            down, moment = _push(
                v, heads[arc], lengths[arc], counts[number], due, distance, count, plain, dependency
            )
            sums[number, DOWN] += down
            sums[number, DOWN_MOMENT] += moment
        at = place[v]
        if at >= 0:
            for lane in range(LANES):
                apex = climbed[at, lane] == distance[v, lane] and distance[v, lane] < UNREACHED
                waiting[at, lane] = due[lane] if apex else 0.0


@inlined_kernel
def _push(
    v: Any, u: Any, length: Any, share: Any, due: Any, distance: Any, count: Any, plain: Any, dependency: Any
) -> Any:
    """Move what is due at v on to u where their arc is tight; return the flow, and the flow times v's distance."""
    total = 0.0
    moment = 0.0
    if plain[u]:
        for lane in range(LANES):
            tight = np.int32(distance[u, lane] + length) == distance[v, lane]
            moved = due[lane] * share if tight else 0.0
            dependency[u, lane] += moved
            total += moved
            moment += moved * distance[v, lane]
    else:
        for lane in range(LANES):
            tight = np.int32(distance[u, lane] + length) == distance[v, lane]
            moved = due[lane] * share if tight else 0.0
            dependency[u, lane] += moved
            passed = moved * count[u, lane] if tight else 0.0
            total += passed
            moment += passed * distance[v, lane]
    return total, moment


@summing_kernel
def _carry_climb(
    listed: Any,
    place: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    climbed: Any,
    ways: Any,
    waiting: Any,
    tight: Any,
    tight_to: Any,
    sums: Any,
) -> None:
    for i in range(len(listed) - 1, -1, -1):
        for t in range(tight_to[i - 1] if i else 0, tight_to[i]):
            arc = tight[t]
            above = place[heads[arc]]
            length = lengths[arc]
            share = counts[arc]
            total = 0.0
            moment = 0.0
            for lane in range(LANES):
                reach = np.int32(climbed[i, lane] + length)
                moved = waiting[above, lane] * share if reach == climbed[above, lane] else 0.0
                waiting[i, lane] += moved
                total += moved * ways[i, lane]
                moment += moved * ways[i, lane] * climbed[i, lane]
            sums[arc, UP] += total
            sums[arc, UP_MOMENT] += moment


@kernel
def _unpack(sums: Any, counts: Any, lengths: Any, whole: Any, first: Any, second: Any) -> None:
    """Hand what an arc carries down to the two it is made of, in place.

    The arc runs from a to b, a lower; its detour through the lower m is the arcs (m, a) and (m, b).
    """
    for d in range(len(whole)):
        arc, to_a, to_b = whole[d], first[d], second[d]
        share = counts[to_a] * counts[to_b] / counts[arc]
        up, down = share * sums[arc, UP], share * sums[arc, DOWN]
        # Climbing passes a, m, b; descending b, m, a. The distance of m follows from that of a.
        up_at_m = share * sums[arc, UP_MOMENT] + up * lengths[to_a]
        down_at_m = share * sums[arc, DOWN_MOMENT] - down * lengths[to_a]
        sums[to_a, DOWN] += up
        sums[to_a, DOWN_MOMENT] += up_at_m
        sums[to_b, UP] += up
        sums[to_b, UP_MOMENT] += up_at_m
        sums[to_b, DOWN] += down
        sums[to_b, DOWN_MOMENT] += down_at_m
        sums[to_a, UP] += down
        sums[to_a, UP_MOMENT] += down_at_m


@kernel
def _at_vertices(sums: Any, share: Any, lengths: Any, rows: Any, heads: Any) -> Any:
    """Sum, over the edges at each vertex, of flow times the vertex's distance from the source."""
    carried = np.zeros(len(rows) - 1)
    for v in range(len(rows) - 1):
        for arc in range(rows[v], rows[v + 1]):
            low = share[arc] * (sums[arc, UP_MOMENT] + sums[arc, DOWN_MOMENT])
            carried[v] += low
            carried[heads[arc]] += low + lengths[arc] * share[arc] * (sums[arc, UP] - sums[arc, DOWN])
    return carried
