"""The sweeps of :mod:`pliant.geodesic.sweeps` in fixed point, with numbers of shortest paths.

Only arcs that are tight in some lane are looked at twice. Rows in which every lane has exactly one shortest path
("plain" rows, nearly all of them on a generic mesh) neither store nor load path counts.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._kernels import inlined_kernel, kernel
from .customise import UNREACHED
from .sweeps import LANES


@kernel
def climb_counting(
    listed: Any,
    place: Any,
    rows: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    label: Any,
    count: Any,
    tight: Any,
    tight_to: Any,
) -> None:
    """Distances and numbers of shortest paths over upward paths only; notes the arcs that are tight."""
    for i in range(len(listed)):
        v = listed[i]
        for arc in range(rows[v], rows[v + 1]):
            above = place[heads[arc]]
            length = lengths[arc]
            for lane in range(LANES):
                label[above, lane] = min(label[above, lane], np.int32(label[i, lane] + length))
    filled = 0
    for i in range(len(listed)):
        v = listed[i]
        for arc in range(rows[v], rows[v + 1]):
            above = place[heads[arc]]
            length = lengths[arc]
            slack = UNREACHED
            for lane in range(LANES):
                late = np.int32(np.int32(label[i, lane] + length) - label[above, lane])
                slack = min(slack, late)
            if slack == 0:
                tight[filled] = arc
                filled += 1
                for lane in range(LANES):
                    reach = np.int32(label[i, lane] + length)
                    gain = counts[arc] * count[i, lane]
                    count[above, lane] += gain if reach == label[above, lane] else 0.0
        tight_to[i] = filled


@kernel
def descend_counting(
    lowest: Any,
    place: Any,
    rows: Any,
    climbed: Any,
    climbed_count: Any,
    numbers: Any,
    heads: Any,
    lengths: Any,
    tight_to: Any,
    counts: Any,
    distance: Any,
    count: Any,
    plain: Any,
) -> Any:
    """Label all ranks from the highest to ``lowest``; put tight arcs first, count paths where there are several.

    Arcs that were tight for the sources before these are tried first; most others then need but one look.
    Returns the largest path count met, infinite on overflow.
    """
    largest = 1.0
    for v in range(len(rows) - 2, lowest - 1, -1):
        at = place[v]
        first = rows[v]
        tight = tight_to[v]
        if at >= 0:
            for lane in range(LANES):
                distance[v, lane] = climbed[at, lane]
        else:
            for lane in range(LANES):
                distance[v, lane] = UNREACHED
        for arc in range(first, tight):
            _relax(v, heads[arc], lengths[arc], distance)
        tight = _relax_others(v, tight, rows[v + 1], numbers, heads, lengths, distance)
        if at < 0 and tight - first == 1:
            alone = plain[heads[first]] and counts[numbers[first]] == 1.0
        else:
            tight, alone = _keep_tight(
                v, at, first, tight, climbed, climbed_count, numbers, heads, lengths, counts, distance, plain
            )
        tight_to[v] = tight
        plain[v] = alone
        if not alone:
            _count_paths(
                v,
                at,
                first,
                tight,
                climbed,
                climbed_count,
                numbers,
                heads,
                lengths,
                counts,
                distance,
                count,
                plain,
            )
            for lane in range(LANES):
                largest = max(largest, count[v, lane])
            if not largest < np.inf:
                return np.inf
    return largest


@inlined_kernel
def _relax(v: Any, u: Any, length: Any, distance: Any) -> None:
    for lane in range(LANES):
        distance[v, lane] = min(distance[v, lane], np.int32(distance[u, lane] + length))


@inlined_kernel
def _slack(v: Any, u: Any, length: Any, distance: Any) -> Any:
    """How far, in the best lane, an arc is from being tight; negative where it would shorten a label."""
    slack = UNREACHED
    for lane in range(LANES):
        slack = min(slack, np.int32(np.int32(distance[u, lane] + length) - distance[v, lane]))
    return slack


@inlined_kernel
def _slack_of_four(v: Any, arc: Any, heads: Any, lengths: Any, distance: Any) -> Any:
    """:func:`_slack` of the best of four arcs in a row, in one pass over the labels."""
    u0, u1, u2, u3 = heads[arc], heads[arc + 1], heads[arc + 2], heads[arc + 3]
    l0, l1, l2, l3 = lengths[arc], lengths[arc + 1], lengths[arc + 2], lengths[arc + 3]
    slack = UNREACHED
    for lane in range(LANES):
        d0 = np.int32(distance[u0, lane] + l0)
        d1 = np.int32(distance[u1, lane] + l1)
        d2 = np.int32(distance[u2, lane] + l2)
        d3 = np.int32(distance[u3, lane] + l3)
        slack = min(slack, np.int32(min(min(d0, d1), min(d2, d3)) - distance[v, lane]))
    return slack


@inlined_kernel
def _relax_others(
    v: Any, tight: Any, stop: Any, numbers: Any, heads: Any, lengths: Any, distance: Any
) -> Any:
    """Look at the arcs not yet relaxed; relax and move to the front those that reach a label."""
    arc = tight
    while arc < stop:
        # The last four may overlap the four before: a second look does no harm, a remainder loop costs.
        base = max(tight, min(arc, stop - 4))
        size = min(4, stop - base)
        if size < 4 or _slack_of_four(v, base, heads, lengths, distance) <= 0:
            for near in range(max(arc, base), base + size):
                if _slack(v, heads[near], lengths[near], distance) <= 0:
                    _relax(v, heads[near], lengths[near], distance)
                    _swap(near, tight, numbers, heads, lengths)
                    tight += 1
        arc = base + size
    return tight


@inlined_kernel
def _swap(i: Any, j: Any, numbers: Any, heads: Any, lengths: Any) -> None:
    numbers[i], numbers[j] = numbers[j], numbers[i]
    heads[i], heads[j] = heads[j], heads[i]
    lengths[i], lengths[j] = lengths[j], lengths[i]


@inlined_kernel
def _keep_tight(
    v: Any,
    at: Any,
    first: Any,
    tight: Any,
    climbed: Any,
    climbed_count: Any,
    numbers: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    distance: Any,
    plain: Any,
) -> Any:
    """Send arcs that are not tight behind the others; say whether every lane has just one shortest path."""
    ways = np.int32(0)
    reached = np.int32(0)
    alone = True
    for lane in range(LANES):
        reached += np.int32(distance[v, lane] < UNREACHED)
    if at >= 0:
        for lane in range(LANES):
            own = climbed[at, lane] == distance[v, lane] and distance[v, lane] < UNREACHED
            ways += np.int32(own)
            alone &= not own or climbed_count[at, lane] == 1.0
    arc = first
    while arc < tight:
        u = heads[arc]
        length = lengths[arc]
        hits = np.int32(0)
        for lane in range(LANES):
            hits += np.int32(np.int32(distance[u, lane] + length) == distance[v, lane])
        if hits:
            ways += hits
            alone &= plain[u] and counts[numbers[arc]] == 1.0
            arc += 1
        else:
            tight -= 1
            _swap(arc, tight, numbers, heads, lengths)
    return tight, alone and ways == reached


@kernel
def _count_paths(
    v: Any,
    at: Any,
    first: Any,
    tight: Any,
    climbed: Any,
    climbed_count: Any,
    numbers: Any,
    heads: Any,
    lengths: Any,
    counts: Any,
    distance: Any,
    count: Any,
    plain: Any,
) -> None:
    for lane in range(LANES):
        count[v, lane] = 0.0
    if at >= 0:
        for lane in range(LANES):
            if climbed[at, lane] == distance[v, lane]:
                count[v, lane] = climbed_count[at, lane]
    for arc in range(first, tight):
        u = heads[arc]
        length = lengths[arc]
        share = counts[numbers[arc]]
        for lane in range(LANES):
            if np.int32(distance[u, lane] + length) == distance[v, lane]:
                count[v, lane] += share if plain[u] else share * count[u, lane]
