"""A cohort of hearts on a Dask cluster: the same bytes as at home, whichever worker dies."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from pliant.heart import describe_cohort, phantom_cohort, read_heart_cohort

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals")


def kill_one_at_work(cluster: Any, killed: list[int], stop: threading.Event) -> None:
    """End the first worker process that is seen to have a subject in hand."""
    while not killed and not stop.is_set():
        for nanny in cluster.workers.values():
            state = cluster.scheduler.workers.get(nanny.worker_address)
            if state is not None and state.processing and nanny.pid:
                killed.append(nanny.pid)
                os.kill(nanny.pid, signal.SIGKILL)
                return
        time.sleep(0.005)


def test_a_killed_worker_changes_nothing(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    phantom_cohort(5, rng=2, spacing=4.0, mesh_step=3.0).save(tmp_path, volumes=False)
    subjects = read_heart_cohort(tmp_path / "cohort.csv")
    expected = describe_cohort(subjects, tmp_path / "home", points=20, n_jobs=1)
    killed: list[int] = []
    stop = threading.Event()
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
    ) as cluster:
        killer = threading.Thread(target=kill_one_at_work, args=(cluster, killed, stop))
        killer.start()
        try:
            found = describe_cohort(
                subjects, tmp_path / "away", points=20, scheduler=cluster.scheduler_address
            )
        finally:
            stop.set()
            killer.join()
    assert len(killed) == 1
    assert not found.failed
    assert [f.values.tobytes() for f in found.features] == [f.values.tobytes() for f in expected.features]  # type: ignore[union-attr]
    for path in sorted((tmp_path / "home" / "subjects").iterdir()):
        assert path.read_bytes() == (tmp_path / "away" / "subjects" / path.name).read_bytes()
