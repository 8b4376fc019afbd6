"""What the device needs to know before it sweeps: levels, ancestors, transposed arcs, and how many lanes fit.

Everything here is plain NumPy and runs anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arrays import IntArray
from .._kernels import kernel
from ..errors import UnavailableError
from .customise import Arcs, CountedArcs
from .elimination import Elimination, Int32Array

# Lanes are handed out in multiples of a warp, so that rows of labels stay aligned.
WARP = 32
# More sources at once than this gain nothing: the widest levels fill any device long before.
MOST_LANES = 8192
# Share of the device's free bytes that may be used; the rest is for the driver and for fragmentation.
USABLE = 0.9


@dataclass(frozen=True, eq=False)
class Levels:
    """The arcs arranged for a device; vertices are named by rank.

    Vertices of one level have arcs to earlier levels only: level i is ``vertices[starts[i]:starts[i + 1]]``, ascending.
    ``depth`` is the number of ancestors in the elimination tree, so that a source's ancestors are told apart by
    it, and ``size`` the number of descendants, itself included: v is an ancestor of s where
    ``v - size[v] < s <= v``. ``lower[lower_rows[v]:lower_rows[v + 1]]``, ascending, are the tails of the arcs
    that end at v, and ``lower_arcs`` their numbers.
    """

    vertices: Int32Array
    starts: IntArray
    parent: Int32Array
    depth: Int32Array
    size: Int32Array
    rows: IntArray
    heads: Int32Array
    lower_rows: IntArray
    lower: Int32Array
    lower_arcs: Int32Array

    @property
    def height(self) -> int:
        """Vertices on the longest way up the elimination tree."""
        return int(self.depth.max()) + 1

    def from_rank(self, lowest: int) -> list[tuple[int, int]]:
        """List (first, stop) of each level's vertices of rank at least ``lowest`` in ``vertices``; none empty."""
        spans = []
        for start, stop in zip(self.starts[:-1].tolist(), self.starts[1:].tolist(), strict=True):
            first = start + int(np.searchsorted(self.vertices[start:stop], lowest))
            if first < stop:
                spans.append((first, stop))
        return spans


def levels_of(skeleton: Elimination, arcs: Arcs | CountedArcs) -> Levels:
    """Arrange arcs for a device."""
    depth, size, level = _tree(skeleton.parent, arcs.rows, arcs.heads)
    vertices = np.argsort(level, kind="stable").astype(np.int32)
    starts = np.concatenate([[0], np.cumsum(np.bincount(level))]).astype(np.int64)
    tails = np.repeat(np.arange(len(level), dtype=np.int32), np.diff(arcs.rows))
    by_head = np.argsort(arcs.heads, kind="stable")
    lower_rows = np.zeros(len(level) + 1, dtype=np.int64)
    np.cumsum(np.bincount(arcs.heads, minlength=len(level)), out=lower_rows[1:])
    return Levels(
        vertices,
        starts,
        skeleton.parent,
        depth,
        size,
        arcs.rows,
        arcs.heads,
        lower_rows,
        tails[by_head],
        by_head.astype(np.int32),
    )


@kernel
def _tree(parent: Any, rows: Any, heads: Any) -> Any:
    """Depth and subtree size in the elimination tree, and level over the arcs that were kept."""
    n = len(parent)
    depth = np.zeros(n, np.int32)
    size = np.ones(n, np.int32)
    level = np.zeros(n, np.int32)
    for v in range(n):
        if parent[v] >= 0:
            size[parent[v]] += size[v]
    for v in range(n - 1, -1, -1):
        if parent[v] >= 0:
            depth[v] = depth[parent[v]] + 1
        for arc in range(rows[v], rows[v + 1]):
            level[v] = max(level[v], level[heads[arc]] + 1)
    return depth, size, level


def lanes_that_fit(wanted: int, *, free: float, fixed: int, per_lane: int) -> int:
    """Return how many sources to sweep at once.

    Parameters
    ----------
    wanted : int
        Sources there are.
    free : float
        Bytes free on the device; infinite where it does not tell.
    fixed : int
        Bytes needed whatever the number of lanes: arcs, levels, sums.
    per_lane : int
        Bytes for every lane.

    Returns
    -------
    int
        At most ``wanted``; a multiple of 32 where it is less.

    Raises
    ------
    UnavailableError
        If not even 32 lanes fit.
    """
    most = min(wanted, MOST_LANES)
    if not np.isfinite(free):
        return most
    lanes = int((USABLE * free - fixed) // per_lane)
    if lanes >= most:
        return most
    lanes -= lanes % WARP
    if lanes < WARP:
        message = (
            f"the graph needs {(fixed + WARP * per_lane) / 2**20:,.0f} MiB on the CUDA device and "
            f'{USABLE * free / 2**20:,.0f} are free: end other programs on it, or use device="cpu"'
        )
        raise UnavailableError(message)
    # Slabs of equal size: the last one would otherwise be nearly empty.
    slabs = -(-wanted // lanes)
    even = -(-wanted // slabs)
    return min(lanes, -(-even // WARP) * WARP)


def nbytes(*values: Any) -> int:
    """Bytes of all arrays among the fields of dataclasses, or of arrays themselves."""
    total = 0
    for value in values:
        fields = [value] if isinstance(value, np.ndarray) else list(vars(value).values())
        total += sum(field.nbytes for field in fields if isinstance(field, np.ndarray))
    return total
