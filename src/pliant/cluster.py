"""Work spread over the machines of a Dask cluster: results in order, whoever computes them and whoever dies."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

from ._progress import progress_bar
from .errors import InputError, UnavailableError, require

__all__ = ["Scheduler", "connected", "map_ordered", "thread_count"]

# An address such as "tcp://10.0.0.1:8786", or a distributed.Client connected already.
Scheduler: TypeAlias = Any

T = TypeVar("T")
R = TypeVar("R")

# Seconds a scheduler is given to answer, and then to have a worker.
ANSWER = 10.0
# Seconds it is given to have one again whenever it has lost all.
PATIENCE = 30.0
# Items in flight for every thread of the cluster: one at work, one ready, one on its way back.
AHEAD = 3
# Times in a row that everything is sent again when every worker that held the shared part has died.
LOSSES = 3
# Seconds after which a scheduler has noticed that a worker is gone.
PAUSE = 0.5


def map_ordered(
    function: Callable[[T], R],
    items: Sequence[T],
    *,
    scheduler: Scheduler | None,
    description: str = "",
    progress: bool = False,
) -> Iterator[R]:
    """Yield ``function(item)`` for every item, in order, computed by the workers of a Dask cluster.

    Parameters
    ----------
    function : callable
        Of one item; pickled, sent to every worker once, and kept there. Put what all items share into it, with
        ``functools.partial`` or as a callable object. On a worker it may be called from several threads at once.
    items : sequence
        Each is pickled by itself.
    scheduler : str, distributed.Client or None
        Address of the cluster's scheduler, ``"tcp://host:8786"``, or a client that is connected. None: one item
        after another in this process.
    description : str
        Of the progress bar.
    progress : bool
        Show a bar on a terminal.

    Yields
    ------
    object
        Results in the order of the items; only a few wait in memory.

    Raises
    ------
    UnavailableError
        If no scheduler answers, it has no worker, or one item has ended several workers.
    MissingExtraError
        If the extra ``cluster`` is not installed.

    Notes
    -----
    An item whose worker dies is computed again by another, so a result must depend on its item alone. What
    ``function`` raises is raised here. Workers need this package in the same version.

    Examples
    --------
    >>> list(map_ordered(abs, [-1, 2, -3], scheduler=None))
    [1, 2, 3]
    """
    with progress_bar(description, len(items), show=progress) as advance:
        for result in _results(function, items, scheduler):
            advance()
            yield result


def _results(function: Callable[[T], R], items: Sequence[T], scheduler: Scheduler | None) -> Iterator[R]:
    if scheduler is None:
        yield from map(function, items)
        return
    if not len(items):
        return
    with connected(scheduler) as client:
        yield from _Run(client, function).over(items)


@contextmanager
def connected(scheduler: Scheduler, *, waiting: Callable[[], None] | None = None) -> Iterator[Any]:
    """Yield a ``distributed.Client`` of a cluster with at least one worker; close it afterwards if opened here.

    Parameters
    ----------
    scheduler : str or distributed.Client
        Address, or a client that is connected and stays so.
    waiting : callable, optional
        Called where the scheduler answers and has no worker yet.

    Yields
    ------
    distributed.Client

    Raises
    ------
    InputError
        If it is neither an address nor a client.
    UnavailableError
        If no scheduler answers within 10 seconds, or it has no worker 10 seconds later.
    MissingExtraError
        If the extra ``cluster`` is not installed.
    """
    distributed = require("distributed", "cluster")
    if isinstance(scheduler, distributed.Client):
        yield scheduler
        return
    if not isinstance(scheduler, str):
        message = f"scheduler must be an address or a distributed.Client, got {type(scheduler).__name__}"
        raise InputError(message)
    _refuse_malformed(scheduler)
    try:
        client = distributed.Client(scheduler, timeout=ANSWER, set_as_default=False)
    except OSError as error:
        message = (
            f"no Dask scheduler answers at {scheduler} ({error}); check the address, or start one with "
            "`dask scheduler` and workers with `dask worker ADDRESS`"
        )
        raise UnavailableError(message) from error
    with client:
        if waiting is not None and not client.nthreads():
            waiting()
        try:
            client.wait_for_workers(1, timeout=ANSWER)
        except TimeoutError as error:
            message = (
                f"the scheduler at {scheduler} has no workers; start some with `dask worker {scheduler}`"
            )
            raise UnavailableError(message) from error
        yield client


def _refuse_malformed(address: str) -> None:
    """Refuse what is no address at once: a client made with one would wait in vain when it is thrown away."""
    from distributed.comm.addressing import get_address_host_port, parse_address

    try:
        # Others have no host and port in their names.
        if parse_address(address)[0] not in ("inproc", "ucx"):
            get_address_host_port(address)
    except ValueError as error:
        message = f"{address!r} is no address of a Dask scheduler, as tcp://10.0.0.1:8786: {error}"
        raise InputError(message) from error


def thread_count(client: Any) -> int:
    """Return how many threads the workers of a ``distributed.Client`` have at present, at least 1."""
    threads: int = sum(client.nthreads().values())
    return max(1, threads)


class _Run:
    """One function on its way over many items."""

    def __init__(self, client: Any, function: Callable[[T], R]) -> None:
        self.client, self.function = client, function
        self.waiting: deque[_Sent] = deque()
        self.losses = 0
        self.shared = self._shared()

    def _shared(self) -> Any:
        """Send the function to every worker, again where one ends while it is sent."""
        for _ in range(LOSSES):
            try:
                return self.client.scatter(self.function, broadcast=True, hash=False)
            except OSError:
                time.sleep(PAUSE)
                self.client.wait_for_workers(1, timeout=PATIENCE)
        return self.client.scatter(self.function, broadcast=True, hash=False)

    def _submitted(self, item: Any) -> Any:
        return self.client.submit(_applied, self.shared, item, pure=False)

    def over(self, items: Sequence[Any]) -> Iterator[Any]:
        ahead = AHEAD * thread_count(self.client)
        try:
            for item in items:
                self.waiting.append(_Sent(item, self._submitted(item)))
                if len(self.waiting) >= ahead:
                    yield self._next()
            while self.waiting:
                yield self._next()
        finally:
            for sent in self.waiting:
                sent.future.cancel()

    def _next(self) -> Any:
        from distributed.client import FutureCancelledError
        from distributed.scheduler import KilledWorker

        while True:
            try:
                # From the worker itself: by way of the scheduler it would be copied once more.
                result = self.client.gather(self.waiting[0].future, direct=True)
            except FutureCancelledError as error:
                self._recover(error)
            except KilledWorker as error:
                message = f"one item ended several workers, perhaps for want of memory: {error}"
                raise UnavailableError(message) from error
            else:
                self.losses = 0
                self.waiting.popleft()
                return result

    def _recover(self, error: Exception) -> None:
        """Send the shared part and the items again: all workers that held it are gone."""
        self.losses += 1
        try:
            self.client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            self.losses = LOSSES + 1
        if self.losses > LOSSES:
            message = "all workers of the cluster ended, perhaps for want of memory; see their logs"
            raise UnavailableError(message) from error
        self.shared = self._shared()
        for sent in self.waiting:
            if not sent.future.done() or sent.future.cancelled():
                sent.future = self._submitted(sent.item)


@dataclass
class _Sent:
    item: Any
    future: Any


def _applied(function: Callable[[T], R], item: T) -> R:
    return function(item)
