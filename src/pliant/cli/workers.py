"""The workers of a Dask cluster that a command computes on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import typer

from ..errors import require
from .ending import complain

Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler", metavar="ADDRESS", help="Compute on the workers of a Dask cluster: tcp://HOST:8786."
    ),
]


@dataclass(frozen=True)
class Workers:
    """Where a command computes.

    Attributes
    ----------
    client : distributed.Client or None
        What the library takes as ``scheduler``; None for this machine.
    address : str
        Of the scheduler.
    count, threads : int
        Of the workers, when the work began.
    """

    client: Any = None
    address: str = ""
    count: int = 0
    threads: int = 0

    def facts(self) -> dict[str, str]:
        """Return a line for a table of facts; nothing on this machine."""
        return {"computed on": self.words()} if self.address else {}

    def words(self) -> str:
        """Say where, and with how many."""
        workers = "1 worker" if self.count == 1 else f"{self.count} workers"
        threads = "1 thread" if self.threads == 1 else f"{self.threads} threads"
        return f"{workers} with {threads} at {self.address}"

    def record(self) -> dict[str, Any]:
        """Return the same for JSON."""
        if not self.address:
            return {}
        return {"cluster": {"scheduler": self.address, "workers": self.count, "threads": self.threads}}


@contextmanager
def workers(address: str | None) -> Iterator[Workers]:
    """Connect to a cluster, saying so before and after, or yield this machine where there is no address."""
    if address is None:
        yield Workers()
        return
    from ..cluster import ANSWER, connected, thread_count

    require("distributed", "cluster")  # without it nothing connects
    complain("note", f"connecting to the Dask scheduler at {address}")
    with connected(address, waiting=partial(_waits, address, ANSWER)) as client:
        found = Workers(client, address, len(client.nthreads()), thread_count(client))
        complain("note", f"computing on {found.words()}")
        yield found


def _waits(address: str, seconds: float) -> None:
    complain("note", f"the scheduler at {address} has no workers yet; waiting {seconds:g} s for one")
