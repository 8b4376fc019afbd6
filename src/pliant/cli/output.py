"""What commands share: words on standard output, tables, JSON, and checks of where files go."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from .ending import abandon_output, complain

if TYPE_CHECKING:
    from rich.console import RenderableType


def say(text: str = "") -> None:
    """Write a line to standard output; end the program quietly where nobody reads it."""
    try:
        typer.echo(text)
    except BrokenPipeError as error:
        raise typer.Exit(abandon_output()) from error


def say_json(value: Any) -> None:
    """Write a value as JSON, the only thing on standard output."""
    say(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))


def show_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Write a table under a title: the first column to the left, numbers to the right."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    headed = any(columns)
    table = Table(box=box.SIMPLE_HEAD if headed else None, show_edge=False, show_header=headed)
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right", no_wrap=i > 0)
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    _show(Text(title, style="bold"), table)


def show_facts(title: str, facts: Mapping[str, str]) -> None:
    """Write names and values under a title."""
    show_table(title, ("", ""), facts.items())


def _show(*parts: RenderableType) -> None:
    from rich.console import Console

    # Without a terminal there is no width to fit; give tables room so that no number is cut.
    console = Console(file=sys.stdout) if sys.stdout.isatty() else Console(file=sys.stdout, width=120)
    with console.capture() as captured:
        console.print(*parts, sep="\n")
    lines = (line.rstrip() for line in captured.get().rstrip("\n").split("\n"))
    say("\n".join(lines) + "\n")


def folder_checked(path: Path | None) -> Path | None:
    """Refuse an output file whose folder is not there, before the work and not after it."""
    if path is not None and not path.absolute().parent.is_dir():
        message = f"the folder {path.parent} does not exist"
        raise typer.BadParameter(message)
    if path is not None and not os.access(path.absolute().parent, os.W_OK):
        message = f"the folder {path.absolute().parent} cannot be written to"
        raise typer.BadParameter(message)
    if path is not None and path.is_dir():
        message = f"{path} is a folder; name a file"
        raise typer.BadParameter(message)
    return path


def with_ending(path: Path | None, endings: Sequence[str]) -> Path | None:
    """Refuse an output file of a kind that cannot be written."""
    if path is not None and not path.name.lower().endswith(tuple(endings)):
        message = f"{path}: the name must end in {', '.join(endings)}"
        raise typer.BadParameter(message)
    return folder_checked(path)


def report_findings(name: str, findings: Iterable[Any]) -> None:
    """Write what a check-up found, short of mere notes, as warnings on standard error."""
    for finding in findings:
        if finding.severity != "note":
            complain("warning", f"{name}: {finding}")
