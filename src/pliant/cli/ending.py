"""How a command ends: exit codes, and one line on standard error."""

from __future__ import annotations

import os
import re
import sys
import warnings
from typing import TextIO

from ..errors import PliantError, PliantWarning

BAD_INPUT, INTERRUPTED, BROKEN_PIPE = 3, 130, 141


# What the library names as remedies, and the command that does the same.
_REMEDIES = (
    (r"pliant\.largest_component\b(\(mesh\))?|\blargest_component\(mesh\)", "`pliant mend --largest`"),
    (r"(pliant\.)?\bmerged\(mesh, tolerance=0\)", "`pliant mend --merge 0`"),
    (r"(pliant\.)?\b(orient|repaired|without_[a-z_]+)\(mesh\)|pliant\.(orient|repaired)\b(?!\()", "`pliant mend`"),
    # No command has this option: what is left is to mend the mesh.
    (r"use kind='robust'(, which takes non-manifold meshes)?, or | or use kind='robust'", ""),
    (r"""weights=['"]uniform['"]""", "--weights uniform"),
    (r"""\bdevice=['"](cpu|cuda)['"]""", r"--device \1"),
    (r"\bscheduler=(?=:)", "--scheduler"),
    (r"pliant\.check_up\b(\(mesh\))?", "`pliant inspect`"),
)  # fmt: skip


def at_the_shell(text: str) -> str:
    """Name commands where a message of the library names its functions."""
    for call, command in _REMEDIES:
        text = re.sub(call, command, text)
    return text


def complain(kind: str, text: str) -> None:
    """Write one line to standard error."""
    sys.stderr.write(f"pliant: {kind}: {' '.join(at_the_shell(text).split())}\n")


def explanation(error: BaseException) -> str:
    """Say what an exception means to someone at a shell."""
    if isinstance(error, MemoryError):
        return f"not enough memory: {error}" if str(error) else "not enough memory"
    if isinstance(error, OSError) and not isinstance(error, PliantError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename is not None else error.strerror
    return str(error)


def show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Write Pliant's warnings as one line and others as Python does; takes ``warnings.showwarning``'s place."""
    if issubclass(category, PliantWarning):
        complain("warning", str(message))
    else:
        (file or sys.stderr).write(warnings.formatwarning(message, category, filename, lineno, line))


def open_streams() -> None:
    """Give the program streams to write to where the shell has closed them (``>&-``)."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))


def abandon_output() -> int:
    """Let go of a standard output that nobody reads, and return the exit code for it."""
    # What is still buffered would fail again when the interpreter ends.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return BROKEN_PIPE
