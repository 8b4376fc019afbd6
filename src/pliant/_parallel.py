"""Threads over kernels that release the GIL; results come back in order, whoever finishes first."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from ._progress import progress_bar
from .errors import InputError

T = TypeVar("T")
R = TypeVar("R")


def job_count(n_jobs: int | None) -> int:
    """Return the number of threads meant by ``n_jobs``: all usable processors for None or -1."""
    if n_jobs is None or n_jobs == -1:
        affinity = getattr(os, "sched_getaffinity", None)
        return len(affinity(0)) if affinity else os.cpu_count() or 1
    if n_jobs < 1:
        message = f"n_jobs must be a positive number of threads, None or -1 for all, got {n_jobs}"
        raise InputError(message)
    return int(n_jobs)


def ordered_map(
    work: Callable[[T], R],
    items: Sequence[T],
    n_jobs: int | None,
    *,
    description: str = "",
    progress: bool = False,
) -> Iterator[R]:
    """Yield ``work(item)`` for every item, in order, with at most a few results waiting in memory."""
    threads = min(job_count(n_jobs), max(1, len(items)))
    with progress_bar(description, len(items), show=progress) as advance:
        if threads == 1:
            for item in items:
                result = work(item)
                advance()
                yield result
            return
        waiting: deque[Future[R]] = deque()
        pool = ThreadPoolExecutor(threads)
        try:
            for item in items:
                waiting.append(pool.submit(work, item))
                if len(waiting) > threads:
                    result = waiting.popleft().result()
                    advance()
                    yield result
            while waiting:
                result = waiting.popleft().result()
                advance()
                yield result
        finally:
            # A caller that stops early, or an error, leaves nothing running behind.
            pool.shutdown(wait=True, cancel_futures=True)
