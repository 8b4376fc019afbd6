"""Vertex order and symbolic elimination: the skeleton of the hierarchy, independent of lengths.

Vertices are ordered by nested dissection and eliminated in that order, each one's remaining neighbours
being joined to one another. The chordal supergraph that results has, for each vertex, a sorted row of arcs to
vertices of higher rank, every two of which are joined by an arc themselves.
(Customizable contraction hierarchies: Dibbelt, Strasser and Wagner 2016.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pymetis
from numpy.typing import NDArray

from .._arrays import IntArray
from .._kernels import kernel
from ..errors import InputError
from .graph import EdgeGraph

Int32Array = NDArray[np.int32]

# Below this size any order will do, and METIS is not worth asking.
SMALLEST_DISSECTED = 32


@dataclass(frozen=True, eq=False)
class Elimination:
    """Order, elimination tree and rows of arcs; vertices are named by their rank from here on.

    ``order[r]`` is the vertex of rank r and ``rank`` its inverse; ``parent[r]`` is the lowest neighbour of
    higher rank (-1 at a root); row r of arcs is ``heads[rows[r]:rows[r + 1]]``, ascending.
    """

    order: Int32Array
    rank: Int32Array
    parent: Int32Array
    rows: IntArray
    heads: Int32Array


def eliminate(graph: EdgeGraph, order: IntArray | None = None) -> Elimination:
    """Order the vertices of a graph, unless an order is given, and eliminate them symbolically."""
    n = graph.n_vertices
    first_order = _dissection(graph) if order is None else _permutation(order, n)
    start, neighbours = _adjacency(graph, first_order)
    final_order = first_order[_postorder(_elimination_tree(start, neighbours))]
    start, neighbours = _adjacency(graph, final_order)
    parent = _elimination_tree(start, neighbours)
    rows, heads = _rows(start, neighbours, parent)
    rank = np.empty(n, dtype=np.int32)
    rank[final_order] = np.arange(n, dtype=np.int32)
    return Elimination(final_order, rank, parent, rows, heads)


def _permutation(order: IntArray, n: int) -> Int32Array:
    if order.shape != (n,) or not np.array_equal(np.sort(order), np.arange(n)):
        message = f"an order must be a permutation of 0..{n - 1}"
        raise InputError(message)
    return order.astype(np.int32)


def _dissection(graph: EdgeGraph) -> Int32Array:
    """Order of elimination: position -> vertex."""
    n = graph.n_vertices
    identity = np.arange(n, dtype=np.int32)
    if n < SMALLEST_DISSECTED or not graph.n_edges:
        return identity
    start, neighbours = _adjacency(graph, identity)
    adjacency = pymetis.CSRAdjacency(start.astype(np.int32), neighbours)
    order, _ = pymetis.nested_dissection(adjacency)
    return np.asarray(order, dtype=np.int32)


def _adjacency(graph: EdgeGraph, order: Int32Array) -> tuple[IntArray, Int32Array]:
    """Neighbour lists, ascending, with vertices renamed by their position in the order."""
    rank = np.empty(graph.n_vertices, dtype=np.int64)
    rank[order] = np.arange(graph.n_vertices)
    found: tuple[IntArray, Int32Array] = _neighbour_lists(graph.n_vertices, rank[graph.edges])
    return found


@kernel
def _neighbour_lists(n: Any, ends: Any) -> Any:
    """Sort by head, then, keeping that order, by tail."""
    start = np.zeros(n + 1, np.int64)
    for e in range(len(ends)):
        start[ends[e, 0] + 1] += 1
        start[ends[e, 1] + 1] += 1
    for v in range(n):
        start[v + 1] += start[v]
    by_head = np.empty(2 * len(ends), np.int32)
    filled = start[:-1].copy()
    for e in range(len(ends)):
        for tail, head in ((ends[e, 0], ends[e, 1]), (ends[e, 1], ends[e, 0])):
            by_head[filled[head]] = tail
            filled[head] += 1
    neighbours = np.empty(2 * len(ends), np.int32)
    filled[:] = start[:-1]
    for head in range(n):
        for at in range(start[head], start[head + 1]):
            tail = by_head[at]
            neighbours[filled[tail]] = head
            filled[tail] += 1
    return start, neighbours


@kernel
def _elimination_tree(start: Any, neighbours: Any) -> Any:
    """Parent of each vertex (Liu 1990), with path compression."""
    n = len(start) - 1
    parent = np.full(n, -1, np.int32)
    ancestor = np.full(n, -1, np.int32)
    for v in range(n):
        for i in range(start[v], start[v + 1]):
            u = neighbours[i]
            while u != -1 and u < v:
                above = ancestor[u]
                ancestor[u] = v
                if above == -1:
                    parent[u] = v
                u = above
    return parent


@kernel
def _postorder(parent: Any) -> Any:
    """Children before parents, each subtree in one run: position -> vertex."""
    n = len(parent)
    first = np.full(n, -1, np.int32)
    sibling = np.full(n, -1, np.int32)
    for v in range(n - 1, -1, -1):
        p = parent[v]
        if p >= 0:
            sibling[v] = first[p]
            first[p] = v
    out = np.empty(n, np.int32)
    stack = np.empty(n, np.int32)
    filled = 0
    for root in range(n):
        if parent[root] >= 0:
            continue
        depth = 0
        stack[0] = root
        while depth >= 0:
            v = stack[depth]
            child = first[v]
            if child >= 0:
                first[v] = sibling[child]
                depth += 1
                stack[depth] = child
            else:
                out[filled] = v
                filled += 1
                depth -= 1
    return out


@kernel
def _rows(start: Any, neighbours: Any, parent: Any) -> Any:
    """Rows of the chordal supergraph: a vertex's higher neighbours and those its children leave it."""
    n = len(parent)
    first = np.full(n, -1, np.int32)
    sibling = np.full(n, -1, np.int32)
    for v in range(n - 1, -1, -1):
        if parent[v] >= 0:
            sibling[v] = first[parent[v]]
            first[parent[v]] = v
    rows = np.zeros(n + 1, np.int64)
    heads = np.empty(max(16, 4 * len(neighbours)), np.int32)
    seen = np.full(n, -1, np.int32)
    row = np.empty(n, np.int32)
    total = 0
    for v in range(n):
        size = 0
        seen[v] = v
        for i in range(start[v], start[v + 1]):
            u = neighbours[i]
            if u > v:
                seen[u] = v
                row[size] = u
                size += 1
        child = first[v]
        while child >= 0:
            for i in range(rows[child], rows[child + 1]):
                u = heads[i]
                if seen[u] != v:
                    seen[u] = v
                    row[size] = u
                    size += 1
            child = sibling[child]
        if total + size > len(heads):
            grown = np.empty(2 * (total + size), np.int32)
            grown[:total] = heads[:total]
            heads = grown
        heads[total : total + size] = np.sort(row[:size])
        total += size
        rows[v + 1] = total
    return rows, heads[:total].copy()
