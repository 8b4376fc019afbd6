"""Progress bars on long work: a bar where someone is watching, silence elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol


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
        Whether the caller asked for a bar. Without a terminal on standard error there is none.
    """
    if not (show and sys.stderr.isatty()):
        yield _silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(description, total=total)
        yield lambda steps=1.0: bar.advance(task, steps)
