"""Results in order from worker processes, some of which die."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import distributed
import pytest

from pliant.cluster import map_ordered
from pliant.errors import InputError, UnavailableError


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
    ) as local:
        yield local


def slowest_first(item: int) -> tuple[int, int]:
    time.sleep(0.02 * (5 - item) if item < 5 else 0)
    return item, os.getpid()


def test_results_come_in_the_order_of_the_items(cluster: Any) -> None:
    found = list(map_ordered(slowest_first, range(40), scheduler=cluster.scheduler_address))
    assert [item for item, _ in found] == list(range(40))
    processes = {process for _, process in found}
    assert len(processes) == 2
    assert os.getpid() not in processes


def killing(folder: Path, deaths: int, item: int) -> int:
    """End this worker's process the first few times that item 7 is met."""
    mark = folder / f"{len(list(folder.iterdir()))}"
    if item == 7 and len(list(folder.iterdir())) < deaths:
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return item**2


def test_items_of_a_dead_worker_are_computed_again(cluster: Any, tmp_path: Path) -> None:
    found = list(map_ordered(partial(killing, tmp_path, 1), range(30), scheduler=cluster.scheduler_address))
    assert found == [i**2 for i in range(30)]
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("losses", [0, 3])
def test_what_all_items_share_is_sent_again_when_its_only_worker_dies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, losses: int
) -> None:
    monkeypatch.setattr("pliant.cluster.LOSSES", losses)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
    ) as lone:
        run = map_ordered(partial(killing, tmp_path, 1), range(12), scheduler=lone.scheduler_address)
        if not losses:
            with pytest.raises(UnavailableError, match="want of memory"):
                list(run)
        else:
            assert list(run) == [i**2 for i in range(12)]
        assert len(list(tmp_path.iterdir())) == 1


def test_errors_come_back_as_they_are(cluster: Any) -> None:
    with pytest.raises(ZeroDivisionError):
        list(map_ordered((1).__truediv__, [1, 0], scheduler=cluster.scheduler_address))


def test_a_client_that_is_connected_stays_so(cluster: Any) -> None:
    with distributed.Client(cluster, set_as_default=False) as client:
        assert list(map_ordered(abs, [-1, -2], scheduler=client)) == [1, 2]
        assert client.status == "running"


def test_nothing_needs_no_cluster() -> None:
    assert list(map_ordered(abs, [], scheduler="tcp://127.0.0.1:1")) == []
    assert list(map_ordered(abs, [-3, 4], scheduler=None)) == [3, 4]


def test_a_scheduler_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pliant.cluster.ANSWER", 0.5)
    with pytest.raises(UnavailableError, match="dask scheduler"):
        list(map_ordered(abs, [1], scheduler="tcp://127.0.0.1:1"))
    with pytest.raises(InputError, match="address"):
        list(map_ordered(abs, [1], scheduler=8786))
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=":0", silence_logs=50) as empty,
        pytest.raises(UnavailableError, match="no workers"),
    ):
        list(map_ordered(abs, [1], scheduler=empty.scheduler_address))


@pytest.mark.parametrize("address", ["nonsense", "tcp://host-without-port", "foo://host:1"])
def test_what_is_no_address_is_refused_at_once(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def made(*_: Any, **__: Any) -> None:
        pytest.fail("a client was made")

    monkeypatch.setattr("distributed.Client.__init__", made)
    with pytest.raises(InputError, match="no address of a Dask scheduler"):
        list(map_ordered(abs, [1], scheduler=address))


def test_a_worker_that_ends_while_it_is_sent_to(cluster: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []
    scatter = distributed.Client.scatter

    def broken_once(self: Any, *args: Any, **options: Any) -> Any:
        tried.append(1)
        if len(tried) == 1:
            raise OSError("stream is closed")
        return scatter(self, *args, **options)

    monkeypatch.setattr(distributed.Client, "scatter", broken_once)
    assert list(map_ordered(abs, [-1, -2], scheduler=cluster.scheduler_address)) == [1, 2]
    assert len(tried) == 2
