"""The engine on a CUDA device: distances, path counts and flow for thousands of sources at once.

The arcs come from the same customisation as on the CPU. Distances, in float64 and in fixed point, are the same to
the last bit: each is the least of the same sums. Path counts are whole numbers and the same up to 2**53. Flow is
summed in another order than on the CPU, so fields agree to rounding; but always in one order, so a device gives
the same bytes every time. Needs the extra ``gpu``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray, IntArray
from .._progress import progress_bar
from ..errors import InputError, UnavailableError, require
from .cuda_plan import Levels, lanes_that_fit, levels_of, nbytes
from .customise import UNREACHED, Arcs, CountedArcs
from .elimination import Elimination, Int32Array
from .sampled import traffic

if TYPE_CHECKING:
    from .hierarchy import GeodesicHierarchy

Device = Literal["cpu", "cuda"]
Method = Literal["sweeps", "propagate"]

# The simulator starts one of the system's threads for each of the device's, so it gets blocks of few.
SIMULATED_THREADS = 4


def on_cuda(device: Device) -> bool:
    """Tell whether a CUDA device is asked for, and refuse it where there is none.

    Raises
    ------
    InputError
        If the device is neither ``"cpu"`` nor ``"cuda"``.
    MissingExtraError
        If the extra ``gpu`` is not installed.
    UnavailableError
        If no driver or no device is found.
    """
    if device == "cpu":
        return False
    if device != "cuda":
        message = f'device must be "cpu" or "cuda", got {device!r}'
        raise InputError(message)
    _cuda()
    return True


def _cuda() -> Any:
    require("numba_cuda", "gpu")
    from numba import cuda

    if not cuda.is_available():
        message = (
            "no CUDA device can be used: an NVIDIA driver, a device and the CUDA libraries are needed "
            '(pip install "numba-cuda[cu12]" or "numba-cuda[cu13]" brings the libraries; `nvidia-smi` shows the '
            'device); use device="cpu", which gives the same result'
        )
        raise UnavailableError(message)
    return cuda


def _threads() -> int:
    from numba.cuda.core import config

    from .cuda_kernels import THREADS

    return SIMULATED_THREADS if config.ENABLE_CUDASIM else THREADS


def _free_bytes() -> float:
    return float(_cuda().current_context().get_memory_info().free)


class _Arranged:
    """Arcs on the device, and the launches that every sweep is made of."""

    def __init__(self, skeleton: Elimination, arcs: Arcs | CountedArcs) -> None:
        self.cuda, self.threads = _cuda(), _threads()
        self.plan: Levels = levels_of(skeleton, arcs)
        self.n = len(skeleton.order)
        send = self.cuda.to_device
        names = ("vertices", "parent", "depth", "size", "rows", "heads", "lower_rows", "lower", "lower_arcs")
        for name in names:
            setattr(self, name, send(getattr(self.plan, name)))
        self.lengths = send(arcs.lengths)

    vertices: Any
    parent: Any
    depth: Any
    size: Any
    rows: Any
    heads: Any
    lower_rows: Any
    lower: Any
    lower_arcs: Any

    def slabs(self, ranks: NDArray[Any], fixed: int, per_vertex: int, per_depth: int) -> Iterator[slice]:
        """Cut sorted sources into runs that fit the device's memory, given bytes a lane by vertex and by depth."""
        per_lane = self.n * per_vertex + self.plan.height * per_depth + 16
        lanes = lanes_that_fit(len(ranks), free=_free_bytes(), fixed=fixed, per_lane=per_lane)
        for start in range(0, len(ranks), max(1, lanes)):
            yield slice(start, min(start + lanes, len(ranks)))

    def wide(self, vertices: int, lanes: int) -> tuple[tuple[int, int], int]:
        """Grid and block of a launch with a block for each vertex and run of lanes."""
        return (vertices, -(-lanes // self.threads)), self.threads


def cuda_distances(
    skeleton: Elimination,
    arcs: Arcs,
    ranks: NDArray[Any],
    places: IntArray,
    out: FloatArray,
    limit: float,
    *,
    progress: bool = False,
) -> None:
    """Write the distances from the sorted ``ranks`` to rows ``places`` of ``out``, as on the CPU to the last bit."""
    from . import cuda_kernels as kernels

    at = _Arranged(skeleton, arcs)
    rank = at.cuda.to_device(skeleton.rank)
    tile = (kernels.TILE, kernels.TILE)
    with progress_bar("distances", len(ranks), show=progress) as advance:
        for part in at.slabs(ranks, 0, 16, 8):
            lanes = part.stop - part.start
            sources = at.cuda.to_device(ranks[part].astype(np.int32))
            label = at.cuda.device_array((lanes, at.plan.height), np.float64)
            distance = at.cuda.device_array((at.n, lanes), np.float64)
            kernels.climb[lanes, at.threads](
                sources, at.parent, at.depth, at.rows, at.heads, at.lengths, np.inf, label
            )
            for first, stop in at.plan.from_rank(0):
                kernels.descend[at.wide(stop - first, lanes)](
                    first, lanes, at.vertices, sources, at.depth, at.size, at.rows, at.heads, at.lengths,
                    np.inf, label, distance,
                )  # fmt: skip
            rows = at.cuda.device_array((lanes, at.n), np.float64)
            tiles = (-(-at.n // kernels.TILE), -(-lanes // kernels.TILE))
            kernels.by_source[tiles, tile](lanes, distance, rank, limit, rows)
            out[places[part]] = rows.copy_to_host()
            advance(lanes)
            del sources, label, distance, rows  # before the next slab asks for as much


@dataclass
class _Slab:
    """Labels of some sources on the device."""

    lanes: int
    lowest: int
    sources: Any
    label: Any
    ways: Any
    path: Any
    distance: Any
    count: Any


class _Counting(_Arranged):
    """Sweeps in fixed point with path counts."""

    # Bytes a lane: distance, count and due by vertex; label, ways, path and waiting by depth.
    PER_VERTEX, PER_DEPTH = 4 + 8 + 8, 4 + 8 + 4 + 8

    def __init__(self, skeleton: Elimination, arcs: CountedArcs) -> None:
        super().__init__(skeleton, arcs)
        self.counts = self.cuda.to_device(arcs.counts)

    def forward(self, ranks: NDArray[Any], lowest: int) -> _Slab | None:
        """Label all ranks from ``lowest`` up, from sorted sources; None where path counts overflow."""
        from . import cuda_kernels as kernels

        lanes, height, new = len(ranks), self.plan.height, self.cuda.device_array
        slab = _Slab(
            lanes, lowest, self.cuda.to_device(ranks.astype(np.int32)), new((lanes, height), np.int32),
            new((lanes, height), np.float64), new((lanes, height), np.int32), new((self.n, lanes), np.int32),
            new((self.n, lanes), np.float64),
        )  # fmt: skip
        overflow = self.cuda.to_device(np.zeros(1, dtype=np.int32))
        upward = (slab.sources, self.parent, self.depth, self.rows, self.heads, self.lengths)
        kernels.climb[lanes, self.threads](*upward, int(UNREACHED), slab.label)
        kernels.climb_ways[lanes, self.threads](*upward, self.counts, slab.label, slab.ways, slab.path)
        for first, stop in self.plan.from_rank(lowest):
            kernels.count_down[self.wide(stop - first, lanes)](
                first, lanes, self.vertices, slab.sources, self.depth, self.size, self.rows, self.heads,
                self.lengths, self.counts, slab.label, slab.ways, slab.distance, slab.count, overflow,
            )  # fmt: skip
        return None if int(overflow.copy_to_host()[0]) else slab

    def backward(self, slab: _Slab, due: Any) -> Any:
        """Carry what is ``due`` at every vertex to the sources, in place; return what waits on the climbs."""
        from . import cuda_flow_kernels as kernels

        for first, stop in reversed(self.plan.from_rank(slab.lowest)):
            kernels.collect[self.wide(stop - first, slab.lanes)](
                first, slab.lanes, slab.lowest, self.vertices, self.lower_rows, self.lower, self.lower_arcs,
                self.lengths, self.counts, slab.distance, due,
            )  # fmt: skip
        waiting = self.cuda.device_array((slab.lanes, self.plan.height), np.float64)
        kernels.carry_down_climb[slab.lanes, self.threads](
            slab.sources, self.depth, self.rows, self.heads, self.lengths, self.counts, slab.path,
            slab.label, slab.distance, due, waiting,
        )  # fmt: skip
        return waiting

    def at_arcs(self, slab: _Slab, waiting: Any, due: Any) -> tuple[Any, ...]:
        """Arguments that the kernels which sum over arcs share."""
        return (
            slab.sources, self.depth, self.size, self.rows, self.heads, self.lengths, self.counts,
            slab.label, slab.ways, waiting, slab.distance, slab.count, due,
        )  # fmt: skip


@dataclass(frozen=True)
class CudaEngine:
    """Flow from many sources on a CUDA device; see :class:`pliant.geodesic.engines.Engine`."""

    progress: bool = False

    def arc_flow(
        self,
        skeleton: Elimination,
        arcs: CountedArcs,
        forth: FloatArray,
        back: FloatArray,
        ranks: NDArray[Any],
        *,
        both_ways: bool,
    ) -> FloatArray | None:
        """Flow on every arc from sorted sources; None where path counts overflow."""
        from . import cuda_flow_kernels as kernels

        at = _Counting(skeleton, arcs)
        flow = at.cuda.to_device(np.zeros(len(arcs.heads)))
        weights = at.cuda.to_device(forth), at.cuda.to_device(back)
        with progress_bar("shortest paths", len(ranks), show=self.progress) as advance:
            for part in at.slabs(ranks, 0, at.PER_VERTEX, at.PER_DEPTH):
                sources = ranks[part]
                slab = at.forward(sources, int(sources[0]) if both_ways else 0)
                if slab is None:
                    return None
                due = at.cuda.device_array((at.n, slab.lanes), np.float64)
                rows = at.n - slab.lowest
                kernels.begin_exact[at.wide(rows, slab.lanes)](
                    slab.lowest, slab.lanes, slab.sources, both_ways, *weights, slab.distance, slab.count, due
                )
                waiting = at.backward(slab, due)
                kernels.sum_flow[rows, at.threads](
                    slab.lowest, slab.lanes, *at.at_arcs(slab, waiting, due), flow
                )
                advance(slab.lanes)
                del slab, due, waiting
        found: FloatArray = flow.copy_to_host()
        return found

    def sampled(
        self,
        skeleton: Elimination,
        arcs: CountedArcs,
        weights: FloatArray,
        stands_for: FloatArray,
        groups: Sequence[NDArray[Any]],
    ) -> list[FloatArray | None]:
        """Half the scaled traffic through each rank, from each group of sorted sources."""
        at = _Counting(skeleton, arcs)
        mass = at.cuda.to_device(weights)
        found: list[FloatArray | None] = []
        with progress_bar("shortest paths", len(groups), show=self.progress) as advance:
            for ranks in groups:
                found.append(self._group(at, arcs, ranks, weights * stands_for, mass))
                if found[-1] is None:
                    break
                advance()
        return found

    def _group(
        self, at: _Counting, arcs: CountedArcs, ranks: NDArray[Any], as_source: FloatArray, mass: Any
    ) -> FloatArray | None:
        from . import cuda_flow_kernels as kernels

        sums = at.cuda.to_device(np.zeros((len(arcs.heads), 4)))
        ending = at.cuda.to_device(np.zeros(at.n))
        for part in at.slabs(ranks, 0, at.PER_VERTEX, at.PER_DEPTH):
            slab = at.forward(ranks[part], 0)
            if slab is None:
                return None
            lane_weights = at.cuda.to_device(as_source[ranks[part]])
            due = at.cuda.device_array((at.n, slab.lanes), np.float64)
            kernels.begin_sampled[at.wide(at.n, slab.lanes)](
                slab.lanes, lane_weights, mass, slab.distance, slab.count, due
            )
            waiting = at.backward(slab, due)
            kernels.sum_sampled[at.n, at.threads](
                slab.lanes, lane_weights, mass, *at.at_arcs(slab, waiting, due), sums, ending
            )
            del slab, due, waiting, lane_weights
        return traffic(arcs, sums.copy_to_host(), ending.copy_to_host())


def fixed_point_distances(
    solver: GeodesicHierarchy, sources: Int32Array | IntArray, *, method: Method = "sweeps"
) -> Int32Array:
    """Compute fixed-point distances (s, n) on the device, by sweeps or the dissertation's way (:mod:`.cuda_propagate`).

    The value for "no path" is 2**30 - 1. Every method and engine gives the same whole numbers.
    """
    _cuda()
    skeleton, arcs = solver._skeleton, solver._counted()
    ranks = skeleton.rank[np.asarray(sources)]
    order = np.argsort(ranks, kind="stable")
    result = np.empty((len(ranks), solver.n_vertices), dtype=np.int32)
    if method == "propagate":
        from . import cuda_propagate as kernels

        edges = skeleton.rank[solver.graph.edges].astype(np.int64)
        patches = kernels.cut(solver.n_vertices, edges, solver._fixed_lengths, kernels.PATCH)
        threads = _threads()
        group, rows = (2, 2) if threads == SIMULATED_THREADS else (32, 8)
        lanes = lanes_that_fit(
            len(ranks), free=_free_bytes(), fixed=nbytes(patches), per_lane=5 * solver.n_vertices
        )
        for start in range(0, len(ranks), lanes):
            part = order[start : start + lanes]
            label = kernels.settle(patches, ranks[part], group=group, rows=rows)
            result[part] = label.copy_to_host().T[:, skeleton.rank]
        return result
    at = _Counting(skeleton, arcs)
    for run in at.slabs(ranks, 0, at.PER_VERTEX, at.PER_DEPTH):
        part = order[run]
        slab = at.forward(ranks[part], 0)
        if slab is None:
            raise InputError("more shortest paths than float64 can count; use the method propagate")
        result[part] = slab.distance.copy_to_host().T[:, skeleton.rank]
        del slab
    return result
