"""Who carries the flow: threads of this process, workers of a cluster, or a CUDA device."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypedDict

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray
from .._parallel import ordered_map
from ..cluster import Scheduler, connected, map_ordered, thread_count
from ..errors import InputError
from .cuda import CudaEngine, Device, on_cuda
from .customise import CountedArcs
from .elimination import Elimination
from .flow import FlowJob
from .sampled import SampledFlowJob
from .sweeps import batches

# Flows are summed in fixed parts, and these in fixed runs: the result does not depend on who computed which.
PARTS, RUNS = 32, 4
# With fewer runs than this for a thread of a cluster, parts are sent one by one, or the last would be waited for.
TASKS = 2


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
        job = FlowJob(skeleton, arcs.swept(), forth, back, both_ways=both_ways)
        runs = _runs(batches(ranks))
        if not runs:
            return np.zeros(len(arcs.heads))
        parts = [part for run in runs for part in run]
        if self.scheduler is None:
            return _sum_of_runs(ordered_map(job, parts, self.n_jobs, **self._said), runs)
        with connected(self.scheduler) as client:
            if len(runs) < TASKS * thread_count(client):
                return _sum_of_runs(map_ordered(job, parts, scheduler=client, **self._said), runs)
            # Workers add up their runs: an eighth of the bytes has to travel.
            return _sum(map_ordered(partial(_sum_of, job), runs, scheduler=client, **self._said))

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
        items = [batches(group) for group in groups]
        if self.scheduler is None:
            return list(ordered_map(job, items, self.n_jobs, **self._said))
        return list(map_ordered(job, items, scheduler=self.scheduler, **self._said))

    @property
    def _said(self) -> _Said:
        return {"description": "shortest paths", "progress": self.progress}


class _Said(TypedDict):
    description: str
    progress: bool


def _runs(lanes: list[NDArray[Any]]) -> list[list[list[NDArray[Any]]]]:
    """Cut batches into parts of neighbouring sources, whose shortest paths are alike, and deal these out in runs.

    Sweeps get shorter from part to part; dealt out to and fro, runs cost the same.
    """
    cuts = np.linspace(0, len(lanes), min(PARTS, len(lanes)) + 1).astype(int)
    parts = [lanes[a:b] for a, b in itertools.pairwise(cuts)]
    rounds = [parts[a : a + RUNS] for a in range(0, len(parts), RUNS)]
    to_and_fro = [part if i % 2 == 0 else part[::-1] for i, part in enumerate(rounds)]
    return [[part[r] for part in to_and_fro if r < len(part)] for r in range(min(RUNS, len(parts)))]


def _sum_of(job: FlowJob, run: Sequence[Sequence[NDArray[Any]]]) -> FloatArray | None:
    """Flow of a run of parts, computed here; one array serves all parts, or each would be paged in anew."""
    total, part = np.zeros((2, len(job.arcs.heads)))
    for lanes in run:
        if not job.into(part, lanes):
            return None
        total += part
    return total


def _sum(flows: Iterable[FloatArray | None]) -> FloatArray | None:
    """Add up in order; None where one part is."""
    total: FloatArray | None = None
    for flow in flows:
        if flow is None:
            return None
        if total is None:
            total = flow
        else:
            total += flow
    return total


def _sum_of_runs(flows: Iterator[FloatArray | None], runs: Sequence[Sequence[Any]]) -> FloatArray | None:
    """Add up the flows of parts run by run, as workers that sum whole runs do."""
    return _sum(_sum(itertools.islice(flows, len(run))) for run in runs)
