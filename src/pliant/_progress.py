"""Progress of long work: a bar on a terminal, a few plain lines where standard error is a file or a pipe."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Protocol

# Seconds before the first plain line, so that short work says nothing, and between lines. A long wait between them
# grows by a share of the time passed: a night's work is a page of lines.
FIRST, BETWEEN, SHARE = 2.0, 10.0, 0.1


class Advance(Protocol):
    """What a long computation calls as it goes."""

    def __call__(self, steps: float = 1.0) -> None:
        """Report that so many of the announced steps are done."""


def _silent(steps: float = 1.0) -> None:
    return None


@contextmanager
def progress_bar(description: str, total: float, *, show: bool) -> Iterator[Advance]:
    """Yield a function to call with the number of steps done.

    Parameters
    ----------
    description : str
        What is being done.
    total : float
        Number of steps announced.
    show : bool
        Whether the caller asked to be told. On a terminal that is a bar on standard error; elsewhere a line there
        after 2 seconds, another about every 10, and one at the end.
    """
    # Without a console there is no standard error at all.
    if not show or sys.stderr is None:
        yield _silent
    elif sys.stderr.isatty():
        with _bar(description, total) as advance:
            yield advance
    else:
        with _Lines(description, total).told() as advance:
            yield advance


@contextmanager
def _bar(description: str, total: float) -> Iterator[Advance]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(description, total=total)
        yield lambda steps=1.0: bar.advance(task, steps)


class _Lines:
    """Tells how far work is from a thread of its own, so that a step that takes minutes is no silence."""

    def __init__(self, description: str, total: float) -> None:
        self.description, self.total = description or "working", total
        self.done = 0.0
        self.start = time.monotonic()
        self.ended = threading.Event()
        self.spoken = False

    @contextmanager
    def told(self) -> Iterator[Advance]:
        """Yield the function that counts steps; the last line comes only if all went well."""
        teller = threading.Thread(target=self._tell, daemon=True)
        teller.start()
        well = False
        try:
            yield self._advance
            well = True
        except GeneratorExit:
            # Who takes just as many results as there are leaves the generator that gives them at its last one.
            well = self.done >= self.total
            raise
        finally:
            self.ended.set()
            teller.join()
            if well and self.spoken:
                self._say(f"done in {self._elapsed():.0f} s")

    def _advance(self, steps: float = 1.0) -> None:
        self.done += steps

    def _tell(self) -> None:
        wait = FIRST
        while not self.ended.wait(wait):
            elapsed = self._elapsed()
            self._say(f"{self.done:.0f} of {self.total:.0f} after {elapsed:.0f} s")
            self.spoken = True
            wait = max(BETWEEN, SHARE * elapsed)

    def _elapsed(self) -> float:
        return time.monotonic() - self.start

    def _say(self, text: str) -> None:
        # Nobody reads, or the stream is closed: work goes on without its lines.
        with suppress(OSError, ValueError):
            sys.stderr.write(f"pliant: {self.description}: {text}\n")
            sys.stderr.flush()
