"""Betweenness the textbook way, for graphs too small to be worth compiling a kernel for."""

from __future__ import annotations

from heapq import heappop, heappush

import numpy as np

from .._arrays import FloatArray, IntArray
from .elimination import Int32Array
from .graph import EdgeGraph


def plain_edge_flow(
    graph: EdgeGraph, lengths: Int32Array, forth: FloatArray, back: FloatArray, sources: IntArray
) -> FloatArray:
    """Half the weighted flow on every edge (Brandes 2001), with whole-number lengths so that ties are exact."""
    neighbours: list[list[tuple[int, int, int]]] = [[] for _ in range(graph.n_vertices)]
    for number, ((a, b), length) in enumerate(zip(graph.edges.tolist(), lengths.tolist(), strict=True)):
        neighbours[a].append((b, length, number))
        neighbours[b].append((a, length, number))
    flow = np.zeros(graph.n_edges)
    for source in sources.tolist():
        order, counts, before = _shortest_paths(neighbours, source)
        waiting = back * forth[source]
        for v in reversed(order[1:]):
            for u, number in before[v]:
                share = waiting[v] * counts[u] / counts[v]
                flow[number] += share
                waiting[u] += share
    return 0.5 * flow


def _shortest_paths(
    neighbours: list[list[tuple[int, int, int]]], source: int
) -> tuple[list[int], list[float], list[list[tuple[int, int]]]]:
    """Vertices by distance, numbers of shortest paths, and each vertex's (predecessor, edge) pairs."""
    n = len(neighbours)
    distance: list[float] = [np.inf] * n
    counts = [0.0] * n
    before: list[list[tuple[int, int]]] = [[] for _ in range(n)]
    done = [False] * n
    order: list[int] = []
    distance[source], counts[source] = 0, 1.0
    heap: list[tuple[float, int]] = [(0, source)]
    while heap:
        reach, u = heappop(heap)
        if done[u]:
            continue
        done[u] = True
        order.append(u)
        for v, length, number in neighbours[u]:
            if reach + length < distance[v]:
                distance[v], counts[v], before[v] = reach + length, counts[u], [(u, number)]
                heappush(heap, (distance[v], v))
            elif reach + length == distance[v]:
                counts[v] += counts[u]
                before[v].append((u, number))
    return order, counts, before
