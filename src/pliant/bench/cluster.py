"""The field on a local Dask cluster of one worker process, and of several: the same bytes, how much sooner."""

from __future__ import annotations

import hashlib
import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from .. import mesh as meshes
from ..errors import require
from ..geodesic import gfe
from .harness import Row

__all__ = ["run"]

# Dask's own habits that take processor time from sweeps where processes share cores; docs/scaling.md recommends these.
QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.worker.memory.monitor-interval": "1s",
}


def run(*, level: int = 6, workers: Sequence[int] = (1, 2), repeats: int = 3) -> Iterator[Row]:
    """Measure the exact field of a bumpy sphere on clusters of worker processes of one thread each.

    Parameters
    ----------
    level : int
        Subdivisions: 5, 6 have 10,242 and 40,962 vertices.
    workers : sequence of int
        Numbers of worker processes; the first is what the others are compared with.
    repeats : int
        Runs of each, in turns, so that a machine that slows down slows all of them down.

    Yields
    ------
    dict
        Keys ``workers``, ``n``, ``seconds`` (median of whole calls from mesh to field), ``fastest``, ``slowest``,
        ``speedup``, ``sha256`` (of the field's bytes: the same in every row). The first row, ``workers`` 0, is
        threads of this process.

    Notes
    -----
    Dask's sampling profiler is off and it looks at itself once a second: where processes share cores that takes some.
    """
    mesh = meshes.shapes.bumpy_sphere(level, rng=0)
    counts = (0, *workers)
    seconds: dict[int, list[float]] = {count: [] for count in counts}
    digests: dict[int, set[str]] = {count: set() for count in counts}
    for _ in range(repeats):
        for count in counts:
            with _cluster(count) as address:
                # Every process has to load the compiled sweeps once, also those that only larger meshes need.
                gfe(meshes.shapes.bumpy_sphere(min(level, 5), rng=0), scheduler=address)
                start = time.perf_counter()
                # Building the hierarchy and sending it are part of the call.
                field = gfe(mesh, scheduler=address)
                seconds[count].append(time.perf_counter() - start)
            digests[count].add(hashlib.sha256(field.tobytes()).hexdigest())
    base = statistics.median(seconds[workers[0]])
    for count in counts:
        median = statistics.median(seconds[count])
        yield {
            "workers": count,
            "n": mesh.n_vertices,
            "seconds": median,
            "fastest": min(seconds[count]),
            "slowest": max(seconds[count]),
            "speedup": base / median if count else None,
            "sha256": " ".join(sorted(digests[count])),
        }


@contextmanager
def _cluster(workers: int) -> Iterator[str | None]:
    """Address of a local cluster of worker processes; None for no workers."""
    distributed = require("distributed", "cluster")
    if not workers:
        yield None
        return
    with (
        require("dask", "cluster").config.set(QUIET),
        distributed.LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
        ) as local,
    ):
        yield local.scheduler_address
