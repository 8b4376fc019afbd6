"""The retrieval index and its service measured: Hamming search, a query end to end, many clients at once."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, require
from .harness import BenchmarkError, Row

__all__ = ["clients", "hamming", "queries"]

_COMMAND = "from pliant.cli import main; raise SystemExit(main())"
_WARM_UP = 0.5
# Bits set in each byte, to check against without the index.
_BITS_OF = np.array([bin(byte).count("1") for byte in range(256)], dtype=np.uint8)


def hamming(count: int = 1_000_000, bits: int = 128, *, runs: int = 20, neighbours: int = 100) -> Row:
    """Measure an exact search of random codes, one query at a time, in processor time of one thread.

    Parameters
    ----------
    count, bits : int
        Codes and their length.
    runs : int
        Queries.
    neighbours : int
        Wanted of each.

    Returns
    -------
    dict
        ``ms``: median of the queries; ``wrong``: queries whose answer differs from plain counting of bits.
    """
    from threadpoolctl import threadpool_limits

    from ..retrieval import ShapeIndex

    rng = np.random.default_rng(0)
    codes = rng.integers(0, 256, (count, bits // 8), dtype=np.uint8)
    index = ShapeIndex(bits, kind="flat")
    index.add(codes)
    taken, wrong = [], 0
    with threadpool_limits(1):
        require("faiss", "retrieval").omp_set_num_threads(1)
        for query in rng.integers(0, 256, (runs, 1, bits // 8), dtype=np.uint8):
            start = time.process_time()
            found = index.search(query, neighbours)
            taken.append(time.process_time() - start)
            apart = _BITS_OF[codes ^ query].sum(axis=1, dtype=np.int64)
            first = np.argsort(apart, kind="stable")[:neighbours]
            wrong += not (
                np.array_equal(found.ids[0] - 1, first) and np.array_equal(found.distances[0], apart[first])
            )
    return {
        "codes": count,
        "bits": bits,
        "ms": 1e3 * float(np.median(taken)),
        "slowest_ms": 1e3 * max(taken),
        "wrong": wrong,
    }


def queries(index: str | Path, pictures: Sequence[str | Path]) -> Row:
    """Measure queries from the bytes of a file to the named matches, in processor time of one thread.

    Parameters
    ----------
    index : str or Path
        Folder of an index.
    pictures : sequence of str or Path
        Files; the first is asked once before, so that compiled code is there.

    Returns
    -------
    dict
    """
    from threadpoolctl import threadpool_limits

    from ..images import decode_picture
    from ..images._opencv import opencv
    from ..retrieval import ShapeIndex, query_index

    opencv().setNumThreads(1)
    taken = []
    with ShapeIndex.load(index) as opened, threadpool_limits(1):
        query_index(opened, decode_picture(Path(pictures[0]).read_bytes()))
        for path in pictures:
            start = time.process_time()
            query_index(opened, decode_picture(Path(path).read_bytes()))
            taken.append(time.process_time() - start)
        items = len(opened)
    return {
        "items": items,
        "queries": len(taken),
        "seconds": float(np.median(taken)),
        "slowest": max(taken),
    }


def clients(
    index: str | Path, pictures: Sequence[str | Path], *, count: int = 64, seconds: float = 60.0
) -> Row:
    """Serve an index on this machine's own address and let many clients ask it at once.

    Parameters
    ----------
    index : str or Path
        Folder of an index.
    pictures : sequence of str or Path
        What they ask with, in turn.
    count : int
        Clients; each asks again as soon as it is answered.
    seconds : float
        How long. What the service holds is looked at after half of it and after all of it.

    Returns
    -------
    dict
        Answers, errors, waiting times, and the growth of memory, open files and threads between the two looks.
    """
    psutil = require("psutil", "bench")
    bodies = [Path(path).read_bytes() for path in pictures]
    with _served(index) as (address, process):
        held, said, waits = psutil.Process(process.pid), list[str](), list[float]()
        until = time.monotonic() + seconds
        crowd = [
            threading.Thread(target=_ask, args=(address, bodies, k, until, waits, said)) for k in range(count)
        ]
        for one in crowd:
            one.start()
        time.sleep(_WARM_UP * seconds)
        before = _holdings(held)
        for one in crowd:
            one.join()
        time.sleep(1.0)
        after = _holdings(held)
    if not waits:
        message = f"no client was answered; the first said: {said[0] if said else 'nothing'}"
        raise BenchmarkError(message)
    return {
        "clients": count,
        "seconds": seconds,
        "answers": len(waits),
        "errors": len(said),
        "first_error": said[0] if said else "",
        "median_wait": float(np.median(waits)),
        "longest_wait": max(waits),
        "memory_mb": after["memory_mb"],
        **{f"{name}_growth": after[name] - before[name] for name in before},
    }


def _ask(
    address: str, bodies: Sequence[bytes], first: int, until: float, waits: list[float], said: list[str]
) -> None:
    httpx = require("httpx", "test")
    with httpx.Client(
        base_url=address, timeout=120, verify=False
    ) as session:  # Plain HTTP: nothing to verify.
        turn = first
        while time.monotonic() < until:
            start = time.monotonic()
            try:
                answer = session.post("/api/query", files={"image": ("a.jpg", bodies[turn % len(bodies)])})
            except httpx.HTTPError as error:
                said.append(repr(error))
                continue
            if answer.status_code == 200 and answer.json()["matches"]:
                waits.append(time.monotonic() - start)
            else:
                said.append(f"{answer.status_code}: {answer.text[:200]}")
            turn += 1


def _holdings(process: Any) -> dict[str, float]:
    return {
        "memory_mb": process.memory_info().rss / 1e6,
        "open_files": process.num_fds() if hasattr(process, "num_fds") else process.num_handles(),
        "threads": process.num_threads(),
    }


@contextmanager
def _served(index: str | Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Run ``pliant retrieval serve`` on a free port of this machine's own address."""
    command = [sys.executable, "-u", "-c", _COMMAND, "retrieval", "serve", str(index), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            line = process.stdout.readline() if process.stdout else ""
            found = re.search(r"http://127\.0\.0\.1:\d+", line)
            if found is None:
                message = f"{index}: the service did not start; try 'pliant retrieval serve {index}'"
                raise InputError(message)
            yield found.group(), process
        finally:
            process.terminate()
