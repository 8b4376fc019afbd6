"""What commands share: words on standard output, tables, JSON, what is read, and checks of where files go."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .ending import abandon_output, complain

if TYPE_CHECKING:
    from rich.console import RenderableType

    from ..mesh import CheckUp, Mesh

# Wider than any table: where nobody looks at a terminal, lines are not broken.
_UNBROKEN = 10_000


def say(text: str = "") -> None:
    """Write a line to standard output; end the program quietly where nobody reads it."""
    try:
        typer.echo(text)
    except BrokenPipeError as error:
        raise typer.Exit(abandon_output()) from error


def say_json(value: Any) -> None:
    """Write a value as JSON, the only thing on standard output."""
    say(json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False))


def show_table(
    title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], *, prose: Collection[int] = (0,)
) -> None:
    """Write a table under a title: columns of words to the left, the first only by default, numbers to the right."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    headed = any(columns)
    table = Table(box=box.SIMPLE_HEAD if headed else None, show_edge=False, show_header=headed)
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i in prose else "right", no_wrap=i not in prose)
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    _show(Text(title, style="bold"), table)


def show_facts(title: str, facts: Mapping[str, str]) -> None:
    """Write names and values under a title."""
    show_table(title, ("", ""), facts.items())


def _show(*parts: RenderableType) -> None:
    from rich.console import Console

    console = Console(file=sys.stdout) if sys.stdout.isatty() else Console(file=sys.stdout, width=_UNBROKEN)
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


def named(*endings: str) -> Callable[[Path | None], Path | None]:
    """Return the check of an option that names a file to write, of one of these kinds."""

    def checked(path: Path | None) -> Path | None:
        return with_ending(path, endings)

    return checked


def mesh_file(path: Path | None) -> Path | None:
    """Refuse a file that cannot hold a mesh, before the work and not after it."""
    from ..mesh.formats import for_writing

    if path is not None:
        try:
            for_writing(path.name)
        except InputError as error:
            raise typer.BadParameter(str(error)) from error
    return folder_checked(path)


def output_folder(path: Path | None) -> Path | None:
    """Refuse a folder for results that cannot be made or written to, before the work and not after it."""
    if path is None:
        return None
    if path.exists() and not path.is_dir():
        message = f"{path} is a file; name a folder"
        raise typer.BadParameter(message)
    there = next(place for place in (path, *path.absolute().parents) if place.exists())
    if not there.is_dir():
        message = f"{path} cannot be made: {there} is a file"
        raise typer.BadParameter(message)
    if not os.access(there, os.W_OK):
        message = f"the folder {there} cannot be written to"
        raise typer.BadParameter(message)
    return path


MeshOutput = Annotated[
    Path,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE",
        callback=mesh_file,
        help="Mesh to write: .ply, .vtk, .obj and others.",
    ),
]
ResultsFolder = Annotated[
    Path,
    typer.Option(
        "--output",
        "-o",
        metavar="DIR",
        callback=output_folder,
        help="Folder for results; a run resumes there.",
    ),
]


def given(paths: Any) -> Any:
    """Refuse an input that is not there, before the work and not after it: bad input, whichever command reads it."""
    for path in paths if isinstance(paths, (list, tuple)) else [paths]:
        if path is not None and not path.exists():
            message = f"{path}: no such file or folder"
            raise InputError(message)
    return paths


def load_examined(path: Path) -> tuple[Mesh, CheckUp]:
    """Load a mesh and say, as every command that reads one does, what is wrong with it."""
    from .. import check_up, load_mesh

    mesh = load_mesh(path)
    report = check_up(mesh)
    report_findings(path.name, report.findings)
    return mesh, report


def report_findings(name: str, findings: Iterable[Any]) -> None:
    """Write what a check-up found, short of mere notes, as warnings on standard error."""
    for finding in findings:
        if finding.severity != "note":
            complain("warning", f"{name}: {str(finding).removeprefix(f'{finding.severity}: ')}")
