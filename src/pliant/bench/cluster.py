"""The field on a local Dask cluster of one worker process, and of several: the same bytes, how much sooner."""

from __future__ import annotations

import hashlib
import statistics
import time
from collections.abc import Iterator, Sequence

from .. import mesh as meshes
from ..errors import require
from ..geodesic import gfe
from .harness import Row

__all__ = ["run"]


def run(*, level: int = 6, workers: Sequence[int] = (1, 2), repeats: int = 3) -> Iterator[Row]:
    """Measure the exact field of a bumpy sphere on clusters of worker processes of one thread each.

    Parameters
    ----------
    level : int
        Subdivisions: 5, 6 have 10,242 and 40,962 vertices.
    workers : sequence of int
        Numbers of worker processes; the first is what the others are compared with.
    repeats : int
        Runs of each, after one to warm up.

    Yields
    ------
    dict
        Keys ``workers``, ``n``, ``seconds`` (median of whole calls from mesh to field), ``fastest``, ``slowest``,
        ``speedup``, ``sha256`` (of the field's bytes: the same in every row). The first row, ``workers`` 0, is
        threads of this process.
    """
    distributed = require("distributed", "cluster")
    mesh = meshes.shapes.bumpy_sphere(level, rng=0)
    small = meshes.shapes.bumpy_sphere(3, rng=0)
    base: float | None = None
    for count in (0, *workers):
        if not count:
            gfe(small)
            row = _timed(mesh, None, repeats)
        else:
            with distributed.LocalCluster(
                n_workers=count, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
            ) as local:
                # Every worker has to load the compiled sweeps once.
                gfe(small, scheduler=local.scheduler_address)
                row = _timed(mesh, local.scheduler_address, repeats)
            base = row["seconds"] if base is None else base
        speedup = base / row["seconds"] if base is not None else None
        yield {"workers": count, "n": mesh.n_vertices, **row, "speedup": speedup}


def _timed(mesh: meshes.Mesh, scheduler: str | None, repeats: int) -> Row:
    seconds, digests = [], set()
    for _ in range(repeats):
        start = time.perf_counter()
        # Building the hierarchy and sending it are part of the call.
        field = gfe(mesh, scheduler=scheduler)
        seconds.append(time.perf_counter() - start)
        digests.add(hashlib.sha256(field.tobytes()).hexdigest())
    return {
        "seconds": statistics.median(seconds),
        "fastest": min(seconds),
        "slowest": max(seconds),
        "sha256": " ".join(sorted(digests)),
    }
