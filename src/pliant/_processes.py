"""Work spread over processes of this machine; results come back in order, and workers end with their parent."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from typing import TypeVar

from ._parallel import job_count
from ._progress import progress_bar

T = TypeVar("T")
R = TypeVar("R")


def process_map(
    work: Callable[[T], R],
    items: Sequence[T],
    n_jobs: int | None,
    *,
    description: str = "",
    progress: bool = False,
) -> Iterator[R]:
    """Yield ``work(item)`` for every item, in order, with a few items for each process under way.

    ``work`` is pickled with every item; with one process it is called here.
    """
    processes = min(job_count(n_jobs), max(1, len(items)))
    with progress_bar(description, len(items), show=progress) as advance:
        results = map(work, items) if processes == 1 else _pooled(work, items, processes)
        for result in results:
            advance()
            yield result


def worker_pool(processes: int) -> ProcessPoolExecutor:
    """Return a pool whose workers end when this process is killed."""
    # A fresh interpreter: a forked one may not use the threads of compiled code.
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(
        processes, mp_context=context, initializer=_end_with_parent, initargs=(os.getpid(),)
    )


def _pooled(work: Callable[[T], R], items: Sequence[T], processes: int) -> Iterator[R]:
    pool = worker_pool(processes)
    waiting: deque[Future[R]] = deque()
    try:
        for item in items:
            waiting.append(pool.submit(work, item))
            if len(waiting) > 4 * processes:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _end_with_parent(parent: int) -> None:
    """Let a worker end when the process that started it is killed, rather than wait for work for ever."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
