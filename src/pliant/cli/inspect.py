"""``pliant inspect``: the check-up of meshes."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .ending import BAD_INPUT, at_the_shell, complain, explanation
from .output import say, say_json

if TYPE_CHECKING:
    from ..mesh import CheckUp

Meshes = Annotated[list[Path], typer.Argument(metavar="MESH...", help="Mesh files of any known format.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]


def inspect(meshes: Meshes, as_json: AsJson = False) -> None:
    """Examine meshes: what they are, what is wrong with them, and the call that mends it.

    A file that cannot be read is reported, the others are still examined, and the exit code is 3.
    """
    from .. import check_up, load_mesh
    from ..errors import PliantError

    reports = []
    failed = False
    for path in meshes:
        try:
            report = check_up(load_mesh(path))
        except (PliantError, OSError) as error:
            failed = True
            complain("error", explanation(error))
            reports.append({"file": str(path), "error": explanation(error)})
            continue
        reports.append({"file": str(path), **report.to_dict()})
        if not as_json:
            text = f"{path}\n{report}{_mending(path, report)}"
            say(text if path is meshes[0] else f"\n{text}")
    if as_json:
        say_json(reports)
    if failed:
        raise typer.Exit(BAD_INPUT)


def _mending(path: Path, report: CheckUp) -> str:
    """Return a last line with the command that makes all the repairs at once; empty where there is none to make."""
    commands = " ".join(at_the_shell(finding.remedy) for finding in report.findings)
    if "pliant mend" not in commands:
        return ""
    options = [option for option in ("--merge 0", "--largest") if option in commands]
    return f"\n  at the shell: {' '.join(['pliant mend', shlex.quote(str(path)), *options])} --output FILE"
