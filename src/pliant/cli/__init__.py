"""The command line: one subcommand is one public function."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence

from ..errors import PliantError, PliantWarning
from .ending import (
    BAD_INPUT,
    INTERRUPTED,
    abandon_output,
    complain,
    explanation,
    open_streams,
    show_warning,
)

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; the process's own by default.

    Returns
    -------
    int
        0 done, 2 bad usage, 3 bad input (one line on standard error), 130 interrupted, 141 nobody reads
        the output any more.

    Examples
    --------
    >>> main(["inspect", "no-such-mesh.ply"])
    3
    """
    open_streams()
    with warnings.catch_warnings():
        warnings.simplefilter("always", PliantWarning)
        warnings.showwarning = show_warning
        try:
            code = _run(arguments)
            sys.stdout.flush()
        except KeyboardInterrupt:
            code = INTERRUPTED
        except BrokenPipeError:
            code = abandon_output()
        except (PliantError, OSError, MemoryError) as error:
            complain("error", explanation(error))
            code = BAD_INPUT
        if code == INTERRUPTED:
            complain("interrupted", "stopped before the end")
    return code


def _run(arguments: Sequence[str] | None) -> int:
    from .app import app

    try:
        app(args=arguments, prog_name="pliant")
    except SystemExit as ending:
        code = ending.code if isinstance(ending.code, int) else 0
        # No command ends with 1: the parser does, where nobody reads its help.
        return abandon_output() if code == 1 else code
    return 0
