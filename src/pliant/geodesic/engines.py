"""Who carries the flow: threads of this process, workers of a cluster, or a CUDA device."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray
from .._parallel import ordered_map
from ..cluster import Scheduler, map_ordered
from ..errors import InputError
from .cuda import CudaEngine, Device, on_cuda
from .customise import CountedArcs
from .elimination import Elimination
from .flow import FlowJob
from .sampled import SampledFlowJob
from .sweeps import batches

# Flows are summed in this many fixed parts, so that the result does not depend on who computed which.
PARTS = 32


class Engine(Protocol):
    """What turns sources into flow; sources are ranks, ascending, and None means that path counts overflowed."""

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
        """Flow on every arc, before unpacking; weights are by rank."""

    def sampled(
        self,
        skeleton: Elimination,
        arcs: CountedArcs,
        weights: FloatArray,
        stands_for: FloatArray,
        groups: Sequence[NDArray[Any]],
    ) -> list[FloatArray | None]:
        """Half the scaled traffic through each rank, from each group of sources."""


def engine(device: Device, scheduler: Scheduler | None, n_jobs: int | None, *, progress: bool) -> Engine:
    """Choose the engine that a call's options ask for, and check that it is there."""
    if on_cuda(device):
        if scheduler is not None:
            raise InputError('choose either device="cuda" or scheduler=: workers compute on their CPUs')
        return CudaEngine(progress)
    return MappedEngine(n_jobs, scheduler, progress)


@dataclass(frozen=True)
class MappedEngine:
    """Batches of sources spread over threads, or over the workers of a cluster; the bytes are the same."""

    n_jobs: int | None = None
    scheduler: Scheduler | None = None
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
        """See :class:`Engine`."""
        job = FlowJob(skeleton, arcs, forth, back, both_ways=both_ways)
        lanes = batches(ranks)
        # Runs of neighbouring sources, whose shortest paths are alike; the longest sweeps come first.
        cuts = np.linspace(0, len(lanes), min(PARTS, len(lanes)) + 1).astype(int)
        total = np.zeros(len(arcs.heads))
        for part in self._map(job, [lanes[a:b] for a, b in itertools.pairwise(cuts)]):
            if part is None:
                return None
            total += part
        return total

    def sampled(
        self,
        skeleton: Elimination,
        arcs: CountedArcs,
        weights: FloatArray,
        stands_for: FloatArray,
        groups: Sequence[NDArray[Any]],
    ) -> list[FloatArray | None]:
        """See :class:`Engine`."""
        job = SampledFlowJob(skeleton, arcs, weights, stands_for)
        return list(self._map(job, [batches(group) for group in groups]))

    def _map(
        self, job: Callable[[Sequence[NDArray[Any]]], FloatArray | None], parts: list[list[NDArray[Any]]]
    ) -> Iterator[FloatArray | None]:
        said = {"description": "shortest paths", "progress": self.progress}
        if self.scheduler is None:
            return ordered_map(job, parts, self.n_jobs, **said)  # type: ignore[arg-type]
        return map_ordered(job, parts, scheduler=self.scheduler, **said)  # type: ignore[arg-type]
