"""Shortest-path forests: how far the nearest source is, which it is, and the step towards it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from .._arrays import FloatArray, IntArray
from .._kernels import kernel
from .graph import EdgeGraph

# Routes whose lengths differ by no more than rounding are as long as each other.
_ROUNDING = 1e-12


class Forest(NamedTuple):
    """Per vertex: distance to the nearest source, its place in the list, the vertex before, the step from there."""

    distances: FloatArray
    labels: IntArray
    before: IntArray
    steps: FloatArray


def shortest_path_forest(graph: EdgeGraph, sources: IntArray, limit: float = np.inf) -> Forest:
    """Grow shortest paths from several sources at once.

    Among sources at one distance the first listed wins; among shortest paths from it the one of fewest steps, and
    then, from the target backwards, of lowest vertices. Beyond ``limit``, or where no path leads: inf, -1, -1.
    """
    matrix = graph.matrix()
    if len(sources):
        found = sp.csgraph.dijkstra(matrix, indices=np.unique(sources), min_only=True, limit=limit)
        distances = np.asarray(found, dtype=np.float64)
    else:
        distances = np.full(graph.n_vertices, np.inf)
    links = (matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64), matrix.data)
    labels, before, steps = _grow(*links, distances, sources, 1.0 + _ROUNDING)
    return Forest(distances, labels, before, steps)


@kernel
def _grow(start: Any, heads: Any, lengths: Any, distances: Any, sources: Any, slack: Any) -> Any:
    """Spread each source over the arcs that shortest paths use, breadth first, where no earlier one has been.

    Levels rise along every path, so edges of no length make no circles.
    """
    n = len(distances)
    labels = np.full(n, -1, np.int64)
    before = np.full(n, -1, np.int64)
    levels = np.zeros(n, np.int64)
    steps = np.zeros(n, np.float64)
    queue = np.empty(n, np.int64)
    for i in range(len(sources)):
        if labels[sources[i]] >= 0:
            continue  # listed twice, or no way at all from one before
        labels[sources[i]] = i
        queue[0] = sources[i]
        first, last = 0, 1
        while first < last:
            u = queue[first]
            first += 1
            for arc in range(start[u], start[u + 1]):
                v = heads[arc]
                if not np.isfinite(distances[v]) or distances[u] + lengths[arc] > distances[v] * slack:
                    continue
                if labels[v] < 0:
                    labels[v] = i
                    levels[v] = levels[u] + 1
                    queue[last] = v
                    last += 1
                elif labels[v] != i or levels[v] != levels[u] + 1 or before[v] < u:
                    continue
                before[v] = u
                steps[v] = lengths[arc]
    return labels, before, steps
