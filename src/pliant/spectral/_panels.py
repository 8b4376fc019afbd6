"""Dense algebra on tall matrices, row chunk by row chunk over threads.

The chunks depend on the number of rows alone and partial sums are added in their order, so that results do
not depend on the number of threads. BLAS is to run on one thread inside (:meth:`Panels.__enter__` sees to it).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from types import TracebackType
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from .._arrays import FloatArray
from .._parallel import job_count

T = TypeVar("T")
R = TypeVar("R")

# Rows of a chunk: few enough for sixteen columns of them to stay in a core's cache.
_CHUNK = 4096


class _SingleBlas:
    """Keeps BLAS on one thread while anyone is inside; the setting is the process's, so the users are counted."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0

    def enter(self) -> None:
        with self._lock:
            if self._users == 0:
                self._limits = threadpool_limits(1, user_api="blas")
            self._users += 1

    def leave(self) -> None:
        with self._lock:
            self._users -= 1
            if self._users == 0:
                self._limits.restore_original_limits()


_single_blas = _SingleBlas()


class Panels:
    """Threads and row chunks for matrices of n rows; use as a context."""

    def __init__(self, n: int, n_jobs: int | None) -> None:
        pairs = max(1, -(-n // (2 * _CHUNK)))
        bounds = np.linspace(0, n, 2 * pairs + 1).astype(int)
        self.chunks = [slice(int(a), int(b)) for a, b in pairwise(bounds)]
        self._pool = ThreadPoolExecutor(job_count(n_jobs))

    def __enter__(self) -> Panels:
        _single_blas.enter()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _single_blas.leave()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def run(self, work: Callable[[T], R], items: Iterable[T]) -> list[R]:
        """Return ``work(item)`` of every item, in order."""
        return list(self._pool.map(work, items))

    def each(self, work: Callable[[slice], object]) -> None:
        """Do some work on every row chunk."""
        self.run(work, self.chunks)

    def total(self, work: Callable[[slice], FloatArray]) -> FloatArray:
        """Return the sum of ``work`` over the row chunks."""
        parts = self.run(work, self.chunks)
        result = parts[0]
        for part in parts[1:]:
            result = result + part
        return result
