"""Work over the elimination tree by several threads: subtrees side by side, what lies above them alone."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from .._arrays import BoolArray, FloatArray, IntArray
from .._kernels import kernel
from .._parallel import job_count, ordered_map
from .elimination import Elimination

T = TypeVar("T")

# How many subtrees of full size a thread may have: more balance better, but leave more above them.
PIECES = (1, 2, 4, 8)


class Subtrees:
    """An elimination tree cut into subtrees, each a run of ranks because ranks are in postorder.

    A pass upwards writes the rows of its ranks and reads those of their descendants; a pass downwards reads those of
    their ancestors. So subtrees are independent, and the result does not depend on how they are cut.

    Parameters
    ----------
    skeleton : Elimination
        The tree and its arcs.
    n_jobs : int, optional
        Threads; all processors by default.
    """

    def __init__(self, skeleton: Elimination, n_jobs: int | None = None) -> None:
        self.skeleton, self.n_jobs = skeleton, n_jobs
        self.below, self.above = _cut(skeleton, job_count(n_jobs))

    def upwards(self, work: Callable[[IntArray], None]) -> None:
        """Run ``work`` on ranks, ascending: children before parents."""
        for _ in ordered_map(work, self.below, self.n_jobs):
            pass
        work(self.above)

    def downwards(self, work: Callable[[IntArray], T]) -> list[T]:
        """Run ``work`` on ranks, ascending all the same: the part above before those below; give what it returns."""
        return [work(self.above), *ordered_map(work, self.below, self.n_jobs)]


def _cut(skeleton: Elimination, threads: int) -> tuple[list[IntArray], IntArray]:
    """Choose the cut that should take least time: its subtrees, costliest first, and the ranks above them."""
    n = len(skeleton.parent)
    if threads == 1 or not n:
        return [], np.arange(n)
    cost, size = _costs(skeleton.parent, skeleton.rows)
    whole = cost[skeleton.parent < 0].sum()

    def cut(share: float) -> tuple[float, IntArray, BoolArray]:
        heavy = cost > share
        roots = np.flatnonzero(~heavy & ((skeleton.parent < 0) | heavy[skeleton.parent]))
        roots = roots[np.argsort(-cost[roots], kind="stable")]
        return whole - cost[roots].sum() + _longest(cost[roots], threads), roots, heavy

    _, roots, heavy = min((cut(whole / (threads * pieces)) for pieces in PIECES), key=lambda found: found[0])
    return [np.arange(root - size[root] + 1, root + 1) for root in roots.tolist()], np.flatnonzero(heavy)


def _longest(costs: FloatArray, threads: int) -> float:
    """Cost of the busiest thread when each takes the next subtree as soon as it is free."""
    busy = [0.0] * threads
    for cost in costs.tolist():
        heapq.heapreplace(busy, busy[0] + cost)
    return max(busy)


@kernel
def _costs(parent: Any, rows: Any) -> Any:
    """Pairs of arcs in the rows of each subtree, and its size."""
    n = len(parent)
    cost = np.empty(n)
    size = np.ones(n, np.int64)
    for v in range(n):
        cost[v] = (rows[v + 1] - rows[v]) ** 2
    for v in range(n):
        if parent[v] >= 0:
            cost[parent[v]] += cost[v]
            size[parent[v]] += size[v]
    return cost, size


@kernel
def arcs_by_head(rows: Any, heads: Any) -> Any:
    """Where the arcs to each rank start in a list of all arcs by their head, that list, and their tails, ascending."""
    n = len(rows) - 1
    start = np.zeros(n + 1, np.int64)
    for head in heads:
        start[head + 1] += 1
    for v in range(n):
        start[v + 1] += start[v]
    arcs = np.empty(len(heads), np.int32)
    tails = np.empty(len(heads), np.int32)
    filled = start[:-1].copy()
    for v in range(n):
        for arc in range(rows[v], rows[v + 1]):
            at = filled[heads[arc]]
            arcs[at], tails[at] = arc, v
            filled[heads[arc]] += 1
    return start, arcs, tails
