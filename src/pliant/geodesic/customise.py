"""Lengths, and numbers of shortest paths, on the arcs of the supergraph; then only the arcs that matter.

An arc (v, a) first takes the length of the shortest path from v to a through lower vertices only, and the number
of such paths. Arcs longer than the true distance lie on no shortest path and are dropped; each
shortest path then has exactly one decomposition into arcs that climb to its highest vertex and descend from it,
so numbers of paths multiply and add without double counting.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .._arrays import FloatArray, IntArray
from .._kernels import kernel
from ..errors import MeshError, first_indices
from .elimination import Elimination, Int32Array
from .graph import EdgeGraph
from .subtrees import Subtrees, arcs_by_head

# Fixed-point "no path": two of them still add up within int32.
UNREACHED = np.int32(2**30 - 1)
# Least common multiples of 1..2, 1..4, 1..6, 1..8, 1..10, 1..12, 1..16: numbers with many divisors.
WHOLE_STEPS = (2, 12, 60, 840, 2520, 27720, 720720)


@dataclass(frozen=True, eq=False)
class Arcs:
    """Upward arcs that lie on shortest paths: row v of ``heads`` / ``lengths`` is ``rows[v]:rows[v + 1]``."""

    rows: IntArray
    heads: Int32Array
    lengths: NDArray[Any]


@dataclass(frozen=True, eq=False)
class SweptArcs:
    """What a counting sweep needs of fixed-point arcs.

    ``counts`` are numbers of shortest paths, scaled by 2**(-damping * length).
    """

    rows: IntArray
    heads: Int32Array
    lengths: Int32Array
    counts: FloatArray


@dataclass(frozen=True, eq=False)
class CountedArcs(SweptArcs):
    """Arcs with path counts, and how each is made of lower arcs.

    Detour i says that the arc ``whole[i]`` is also the pair of arcs ``first[i]``, ``second[i]``; detours come in
    unpacking order. ``edge`` is the graph edge an arc stands for, or -1 where only detours are as short.
    """

    edge: Int32Array
    edge_share: FloatArray
    whole: Int32Array
    first: Int32Array
    second: Int32Array
    damping: float

    def swept(self) -> SweptArcs:
        """Leave out what only unpacking needs, which is most of the bytes."""
        return SweptArcs(self.rows, self.heads, self.lengths, self.counts)


def fixed_point_lengths(graph: EdgeGraph, components: IntArray) -> Int32Array:
    """Edge lengths as whole numbers, each component scaled so that no shortest path can overflow."""
    bad = np.flatnonzero(graph.lengths == 0)
    if bad.size:
        message = (
            f"path counts need every edge to have a length: {bad.size} of {graph.n_edges} have none, first between "
            f"vertices {first_indices(graph.edges[bad[:3]].ravel(), 6)}; join their ends with "
            "pliant.merged(mesh, tolerance=0)"
        )
        raise MeshError(message)
    _, seeds = np.unique(components, return_index=True)
    nearest = sp.csgraph.dijkstra(graph.matrix(), directed=False, indices=seeds, min_only=True)
    reach = np.zeros(len(seeds))
    np.maximum.at(reach, components, nearest)
    # Any shortest path is at most twice an eccentricity; rounding adds at most half a unit an edge.
    unit = (int(UNREACHED) - 1 - graph.n_vertices) / (2 * np.where(reach > 0, reach, 1.0))
    owner = components[graph.edges[:, 0]]
    shortest = np.full(len(seeds), np.inf)
    np.minimum.at(shortest, owner, graph.lengths)
    scaled = np.rint(graph.lengths * _tie_keeping(unit, shortest)[owner])
    # An edge longer than every path is on none, whatever it is cut to.
    return scaled.clip(1, int(UNREACHED) - 1).astype(np.int32)


def _tie_keeping(unit: FloatArray, shortest: FloatArray) -> FloatArray:
    """Shrink each unit so that small fractions and multiples of the shortest edge stay whole, and their ties exact."""
    whole = np.where(np.isfinite(shortest), unit * shortest, 1.0)
    steps = np.ones_like(whole)
    for divisible in WHOLE_STEPS:
        steps = np.where(whole >= 4 * divisible, divisible, steps)
    kept = np.floor(whole / steps) * steps
    return np.where(kept >= 1, unit * kept / whole, unit)


def metric_arcs(skeleton: Elimination, graph: EdgeGraph, n_jobs: int | None = None) -> Arcs:
    """Customise with float64 lengths, for distances."""
    lengths = np.full(len(skeleton.heads), np.inf)
    lengths[_edge_slots(skeleton, graph)] = graph.lengths
    rows, heads = skeleton.rows, skeleton.heads
    lower, arcs, tails = arcs_by_head(rows, heads)
    plan = Subtrees(skeleton, n_jobs)
    plan.upwards(lambda ranks: _customise(ranks, rows, heads, lower, arcs, tails, lengths))
    shortest = lengths.copy()
    plan.downwards(lambda ranks: _perfect(ranks, rows, heads, shortest))
    keep = (lengths <= shortest) & np.isfinite(lengths)
    return Arcs(*_kept_rows(skeleton, keep), lengths[keep])


def counted_arcs(
    skeleton: Elimination,
    graph: EdgeGraph,
    fixed_lengths: Int32Array,
    damping: float = 0.0,
    n_jobs: int | None = None,
) -> CountedArcs:
    """Customise with fixed-point lengths and path counts, for betweenness."""
    lengths = np.full(len(skeleton.heads), UNREACHED, dtype=np.int32)
    counts = np.zeros(len(skeleton.heads))
    slots = _edge_slots(skeleton, graph)
    lengths[slots] = fixed_lengths
    counts[slots] = np.exp2(-damping * fixed_lengths)
    rows, heads = skeleton.rows, skeleton.heads
    lower, arcs, tails = arcs_by_head(rows, heads)
    plan = Subtrees(skeleton, n_jobs)
    plan.upwards(lambda ranks: _customise_counted(ranks, rows, heads, lower, arcs, tails, lengths, counts))
    shortest = lengths.copy()
    plan.downwards(lambda ranks: _perfect(ranks, rows, heads, shortest))
    keep = (lengths == shortest) & (lengths < UNREACHED)
    kept_rows, kept_heads = _kept_rows(skeleton, keep)

    direct = np.flatnonzero(keep[slots] & (fixed_lengths == lengths[slots]))
    kept_lengths, kept_counts = lengths[keep], counts[keep]
    edge = np.full(len(kept_heads), -1, dtype=np.int32)
    edge_share = np.zeros(len(kept_heads))
    places = (np.cumsum(keep) - 1)[slots[direct]]
    edge[places] = direct
    edge_share[places] = np.exp2(-damping * fixed_lengths[direct]) / kept_counts[places]
    found = plan.downwards(lambda ranks: _detours(ranks, kept_rows, kept_heads, kept_lengths))
    whole, first, second = np.concatenate(found, axis=1)
    return CountedArcs(
        kept_rows, kept_heads, kept_lengths, kept_counts, edge, edge_share, whole, first, second, damping
    )


def _edge_slots(skeleton: Elimination, graph: EdgeGraph) -> IntArray:
    """Arc number of each edge of the graph."""
    slots: IntArray = _find_slots(skeleton.rows, skeleton.heads, skeleton.rank[graph.edges])
    return slots


@kernel
def _find_slots(rows: Any, heads: Any, ends: Any) -> Any:
    slots = np.empty(len(ends), np.int64)
    for e in range(len(ends)):
        tail, head = min(ends[e, 0], ends[e, 1]), max(ends[e, 0], ends[e, 1])
        row = heads[rows[tail] : rows[tail + 1]]
        slots[e] = rows[tail] + np.searchsorted(row, head)
    return slots


def _kept_rows(skeleton: Elimination, keep: NDArray[np.bool_]) -> tuple[IntArray, Int32Array]:
    kept_before = np.concatenate([[0], np.cumsum(keep)])
    return kept_before[skeleton.rows].astype(np.int64), skeleton.heads[keep]


@kernel
def _customise(ranks: Any, rows: Any, heads: Any, lower: Any, arcs: Any, tails: Any, lengths: Any) -> None:
    """Bottom-up over ``ranks``: shorten every arc (a, b) by the detours through lower vertices v.

    What remains of v's row is part of a's row, mostly side by side: then whole slices can be compared.
    """
    slot = np.empty(len(rows) - 1, np.int64)
    for a in ranks:
        for j in range(rows[a], rows[a + 1]):
            slot[heads[j]] = j
        for t in range(lower[a], lower[a + 1]):
            left = lengths[arcs[t]]
            first, stop = arcs[t] + 1, rows[tails[t] + 1]
            if first == stop:
                continue
            into = slot[heads[first]]
            if slot[heads[stop - 1]] - into == stop - 1 - first:
                right, whole = lengths[first:stop], lengths[into : into + stop - first]
                for k in range(len(right)):
                    whole[k] = min(whole[k], left + right[k])
                continue
            for k in range(first, stop):
                j = slot[heads[k]]
                lengths[j] = min(lengths[j], left + lengths[k])


@kernel
def _customise_counted(
    ranks: Any, rows: Any, heads: Any, lower: Any, arcs: Any, tails: Any, lengths: Any, counts: Any
) -> None:
    """Bottom-up in fixed point, with the number of shortest paths each arc stands for; see :func:`_customise`."""
    slot = np.empty(len(rows) - 1, np.int64)
    for a in ranks:
        for j in range(rows[a], rows[a + 1]):
            slot[heads[j]] = j
        for t in range(lower[a], lower[a + 1]):
            i = arcs[t]
            left = lengths[i]
            first, stop = i + 1, rows[tails[t] + 1]
            if first == stop:
                continue
            into = slot[heads[first]]
            if slot[heads[stop - 1]] - into == stop - 1 - first:
                right, whole = lengths[first:stop], lengths[into : into + stop - first]
                short = False
                for k in range(len(right)):
                    short |= np.int32(left + right[k]) <= whole[k]
                if not short:
                    continue
            for k in range(first, stop):
                j = slot[heads[k]]
                detour = np.int32(left + lengths[k])
                if detour < lengths[j]:
                    lengths[j] = detour
                    counts[j] = counts[i] * counts[k]
                elif detour == lengths[j] and detour < UNREACHED:
                    counts[j] += counts[i] * counts[k]


@kernel
def _perfect(ranks: Any, rows: Any, heads: Any, lengths: Any) -> None:
    """Top-down over ``ranks``: shorten every arc to the true distance by the detours through higher vertices."""
    number = lengths.dtype.type
    for t in range(len(ranks) - 1, -1, -1):
        v = ranks[t]
        stop = rows[v + 1]
        for i in range(rows[v], stop - 1):
            a = heads[i]
            # What remains of v's row is part of a's row; mostly it is all that ends that row.
            tail = rows[a + 1] - (stop - i - 1)
            if heads[tail] == heads[i + 1]:
                own, between = lengths[i + 1 : stop], lengths[tail : rows[a + 1]]
                shortest = lengths[i]
                for k in range(len(own)):
                    shortest = min(shortest, number(own[k] + between[k]))
                lengths[i] = shortest
                for k in range(len(own)):
                    own[k] = min(own[k], number(shortest + between[k]))
                continue
            j = rows[a]
            for k in range(i + 1, stop):
                b = heads[k]
                while heads[j] != b:
                    j += 1
                lengths[i] = min(lengths[i], lengths[k] + lengths[j])
                lengths[k] = min(lengths[k], lengths[i] + lengths[j])


@kernel
def _detours(ranks: Any, rows: Any, heads: Any, lengths: Any) -> Any:
    """Tight pairs of lower arcs through ``ranks``, the highest first: (3, d) arcs, the whole and its two parts.

    An arc gets flow from detours through its own lower end only, so that other orders which keep this give the same.
    """
    n = len(rows) - 1
    found_arcs = np.empty((max(16, 3 * len(ranks)), 3), np.int32)
    found = 0
    # Row v spread over all ranks: a missing arc is too long to be part of anything.
    spread = np.full(n, UNREACHED, np.int32)
    slot = np.empty(n, np.int32)
    for t in range(len(ranks) - 1, -1, -1):
        v = ranks[t]
        size = rows[v + 1] - rows[v]
        if found + size * size > len(found_arcs):
            larger = np.empty((2 * (found + size * size), 3), np.int32)
            larger[:found] = found_arcs[:found]
            found_arcs = larger
        found = _detours_through(v, rows, heads, lengths, spread, slot, found_arcs, found)
    return found_arcs[:found].T.copy()


@kernel
def _detours_through(
    v: Any, rows: Any, heads: Any, lengths: Any, spread: Any, slot: Any, found_arcs: Any, found: Any
) -> Any:
    for k in range(rows[v], rows[v + 1]):
        spread[heads[k]] = lengths[k]
        slot[heads[k]] = k
    for i in range(rows[v], rows[v + 1]):
        left = lengths[i]
        for j in range(rows[heads[i]], rows[heads[i] + 1]):
            if np.int32(left + spread[heads[j]]) == lengths[j]:
                found_arcs[found, 0] = j
                found_arcs[found, 1] = i
                found_arcs[found, 2] = slot[heads[j]]
                found += 1
    for k in range(rows[v], rows[v + 1]):
        spread[heads[k]] = UNREACHED
    return found


def edge_flow_of(arcs: CountedArcs, total: FloatArray, n_edges: int) -> FloatArray:
    """Hand arc flow (in place) down to the graph's edges; halve it, as each pair has two directions."""
    unpack(total, arcs.counts, arcs.whole, arcs.first, arcs.second)
    direct = arcs.edge >= 0
    edge_flow = np.zeros(n_edges)
    edge_flow[arcs.edge[direct]] = 0.5 * (total * arcs.edge_share)[direct]
    return edge_flow


@kernel
def unpack(flow: Any, counts: Any, whole: Any, first: Any, second: Any) -> None:
    """Hand the flow of every arc down to the arcs it is made of, in place, top-down."""
    for d in range(len(whole)):
        whole_arc, one, two = whole[d], first[d], second[d]
        moved = flow[whole_arc] * (counts[one] * counts[two] / counts[whole_arc])
        flow[one] += moved
        flow[two] += moved
