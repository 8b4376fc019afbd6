"""The field from worker processes, one of which is killed: the same bytes as from threads."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import distributed
import numpy as np
import pytest

import pliant
from pliant.geodesic import engines
from pliant.geodesic.flow import FlowJob


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
    ) as local:
        yield local


class KillingJob(FlowJob):
    """End the process of the worker that is first to come to its third part."""

    def __init__(self, folder: Path, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.folder, self.calls = folder, 0

    def into(self, flow: Any, lanes: Any) -> Any:
        self.calls += 1
        if self.calls == 3 and not list(self.folder.iterdir()):
            (self.folder / str(os.getpid())).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().into(flow, lanes)


def test_a_killed_worker_changes_nothing(
    cluster: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    mesh = pliant.shapes.bumpy_sphere(4, rng=2)
    expected = pliant.gfe(mesh)
    monkeypatch.setattr(engines, "FlowJob", partial(KillingJob, tmp_path))
    found = pliant.gfe(mesh, scheduler=cluster.scheduler_address)
    assert len(list(tmp_path.iterdir())) == 1
    assert found.tobytes() == expected.tobytes()


def test_samples_and_edge_flow_are_the_same_bytes(cluster: Any) -> None:
    mesh = pliant.shapes.bumpy_sphere(3, rng=1)
    address = cluster.scheduler_address
    here = pliant.estimate_gfe(mesh, 128, rng=0)
    there = pliant.estimate_gfe(mesh, 128, rng=0, scheduler=address)
    assert here.values.tobytes() == there.values.tobytes()
    assert here.half_widths.tobytes() == there.half_widths.tobytes()
    solver = pliant.GeodesicHierarchy(mesh)
    rng = np.random.default_rng(0)
    sources, forth = rng.integers(0, mesh.n_vertices, 200), rng.random(mesh.n_vertices)
    assert (
        solver.edge_flow(forth, sources=sources, scheduler=address).tobytes()
        == solver.edge_flow(forth, sources=sources).tobytes()
    )


def test_the_shell_takes_a_scheduler(
    cluster: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from pliant.cli import main

    mesh = pliant.shapes.bumpy_sphere(3, rng=1)
    pliant.save_mesh(tmp_path / "m.ply", mesh)
    out = tmp_path / "m.npz"
    arguments = ["field", str(tmp_path / "m.ply"), "-o", str(out), "--scheduler", cluster.scheduler_address]
    assert main(arguments) == 0
    loaded = pliant.load_mesh(tmp_path / "m.ply")
    np.testing.assert_array_equal(pliant.load_arrays(out)["gfe"], pliant.gfe(loaded))


def test_a_scheduler_and_a_device_do_not_go_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "on_cuda", lambda device: device == "cuda")
    with pytest.raises(pliant.InputError, match="either"):
        pliant.gfe(pliant.shapes.icosphere(1), device="cuda", scheduler="tcp://127.0.0.1:1")
