"""Work spread over processes of this machine; results come back in order, and workers end with their parent."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, TypeVar

from ._parallel import job_count
from ._progress import progress_bar

T = TypeVar("T")
R = TypeVar("R")

# Seconds between a worker's looks at whether it is still wanted.
_LOOK = 0.2


def process_map(
    work: Callable[[T], R],
    items: Sequence[T],
    n_jobs: int | None,
    *,
    failed: Callable[[BaseException], R] | None = None,
    description: str = "",
    progress: bool = False,
) -> Iterator[R]:
    """Yield ``work(item)`` for every item, in order, with a few items for each process under way.

    ``work`` is pickled with every item; with one process it is called here. What a worker raises is raised here, and
    so is its death, unless ``failed`` makes a result of it.
    """
    processes = min(job_count(n_jobs), max(1, len(items)))
    with progress_bar(description, len(items), show=progress) as advance:
        results = map(work, items) if processes == 1 else _pooled(work, items, processes, failed)
        for result in results:
            advance()
            yield result


def _pooled(
    work: Callable[[T], R], items: Sequence[T], processes: int, failed: Callable[[BaseException], R] | None
) -> Iterator[R]:
    def outcome(future: Future[R]) -> R:
        problem = future.exception()
        if problem is None or failed is None:
            return future.result()
        return failed(problem)

    waiting: deque[Future[R]] = deque()
    with _worker_pool(processes) as pool:
        for item in items:
            waiting.append(_submitted(pool, work, item))
            if len(waiting) > 4 * processes:
                yield outcome(waiting.popleft())
        while waiting:
            yield outcome(waiting.popleft())


def _submitted(pool: ProcessPoolExecutor, work: Callable[[T], R], item: T) -> Future[R]:
    try:
        with _undisturbed():
            return pool.submit(work, item)
    except BrokenProcessPool as error:
        # A worker died at an earlier item: the pool takes no more.
        lost: Future[R] = Future()
        lost.set_exception(error)
        return lost


@contextmanager
def _worker_pool(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool whose workers end at once when this process is killed, interrupted or wants no more results."""
    # A fresh interpreter: a forked one may not use the threads of compiled code.
    context = multiprocessing.get_context("spawn")
    unwanted = context.RawValue("b", 0)
    pool = ProcessPoolExecutor(
        processes, mp_context=context, initializer=_end_with_parent, initargs=(os.getpid(), unwanted)
    )
    try:
        yield pool
    except BaseException:
        unwanted.value = 1
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let processes that start here never see the terminal's interrupt: it is for the parent, which ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_parent(parent: int, unwanted: Any) -> None:
    """Let a worker end when the process that started it is gone or stops, rather than wait for work for ever."""

    def watch() -> None:
        while os.getppid() == parent and not unwanted.value:
            time.sleep(_LOOK)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
