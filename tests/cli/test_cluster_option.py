"""``--scheduler``: what a command says of the cluster it computes on."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant.cli import main

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def sphere_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("cluster") / "sphere.ply"
    pliant.save_mesh(path, pliant.shapes.icosphere(2))
    return path


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_run_on_a_cluster_says_so(
    sphere_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "field.npz"
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0", silence_logs=50
    ) as cluster:
        address = cluster.scheduler_address
        assert main(["field", str(sphere_file), "--scheduler", address, "-o", str(out), "--json"]) == 0
        said = capsys.readouterr()
        assert json.loads(said.out)["cluster"] == {"scheduler": address, "workers": 2, "threads": 2}
        assert said.err.splitlines() == [
            f"pliant: note: connecting to the Dask scheduler at {address}",
            f"pliant: note: computing on 2 workers with 2 threads at {address}",
        ]
        assert main(["field", str(sphere_file), "--scheduler", address]) == 0
        assert f"2 workers with 2 threads at {address}" in capsys.readouterr().out
    np.testing.assert_array_equal(pliant.load_arrays(out)["gfe"], pliant.gfe(pliant.load_mesh(sphere_file)))


def test_nobody_answers(
    sphere_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from pliant import cluster

    assert cluster.ANSWER <= 10
    monkeypatch.setattr(cluster, "ANSWER", 0.3)
    assert main(["field", str(sphere_file), "--scheduler", "tcp://127.0.0.1:1"]) == 3
    first, last = capsys.readouterr().err.splitlines()
    assert "connecting" in first
    assert "`dask scheduler`" in last


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_waiting_for_workers_is_said(
    sphere_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from pliant import cluster

    monkeypatch.setattr(cluster, "ANSWER", 2.0)
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0", silence_logs=50) as empty:
        assert main(["field", str(sphere_file), "--scheduler", empty.scheduler_address]) == 3
    connecting, waiting, last = capsys.readouterr().err.splitlines()
    assert "connecting" in connecting
    assert "no workers yet; waiting 2 s" in waiting
    assert "`dask worker" in last


def test_nothing_connects_without_the_extra(
    sphere_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["field", str(sphere_file), "--scheduler", "tcp://127.0.0.1:1"]) == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert "pliant[cluster]" in line


def test_what_is_no_address(sphere_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["field", str(sphere_file), "--scheduler", "nonsense"]) == 3
    assert "tcp://10.0.0.1:8786" in capsys.readouterr().err
