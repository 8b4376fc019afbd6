"""``pliant data``: which public data there are, fetch them, verify them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from .output import say, say_json, show_table

if TYPE_CHECKING:
    from ..datasets import Verification

_NAMED = 5

data = typer.Typer(
    name="data", help="Public data: what there is, on what terms; fetch it, verify it.", no_args_is_help=True
)

Folder = Annotated[
    Path | None, typer.Option("--data", metavar="DIR", help="The data folder; PLIANT_DATA by default.")
]
Names = Annotated[list[str] | None, typer.Argument(metavar="[NAME...]", help="Data sets, as cortex/slam.")]


@data.command("list")
def list_data(
    as_json: Annotated[bool, typer.Option("--json", help="Write JSON, and nothing else.")] = False,
) -> None:
    """Say which data sets there are, whose they are and on what terms; read and download nothing."""
    from ..datasets import registry

    if as_json:
        say_json([{**vars(d), "remote": [vars(part) for part in d.remote]} for d in registry()])
        return
    for dataset in registry():
        how = "can be fetched" if dataset.remote else "by hand"
        say(f"{dataset.name}  ({dataset.files} files, {dataset.size / 1e6:.1f} MB, {how})")
        say(f"    {dataset.title}")
        say(f"    from {dataset.source}")
        say(f"    terms: {dataset.terms}")


@data.command()
def fetch(names: Annotated[list[str], typer.Argument(metavar="NAME...")], folder: Folder = None) -> None:
    """Download data sets into the data folder, at pinned revisions; a file that differs is not kept."""
    from ..datasets import fetch as download

    place = _place(folder)
    for name in names:
        for path in download(name, place, progress=True):
            say(str(path))


@data.command()
def verify(names: Names = None, folder: Folder = None) -> None:
    """Compare the data folder with known digests; exit with 3 if anything that is there differs."""
    from ..datasets import verify as compare

    found = compare(_place(folder), names or ())
    rows = [(v.dataset.name, v.state, _files(v)) for v in found]
    show_table("Data sets", ("name", "state", ""), rows, prose=(0, 1))
    wrong = [f"{v.dataset.name}{_first(v.wrong)}" for v in found if v.state in ("different", "incomplete")]
    if wrong:
        sets = "1 data set differs" if len(wrong) == 1 else f"{len(wrong)} data sets differ"
        message = f"{sets} from what is known: {', '.join(wrong)}"
        raise InputError(message)


def _files(found: Verification) -> str:
    note = "; the rest is made by hand" if found.state == "fetched" else ""
    return f"{found.files} of {found.dataset.files} files{note}"


def _first(wrong: Sequence[str]) -> str:
    named = [*wrong[:_NAMED], "..."] if len(wrong) > _NAMED else wrong
    return f" ({', '.join(named)})" if wrong else ""


def _place(folder: Path | None) -> Path:
    named = folder or os.environ.get("PLIANT_DATA")
    if not named:
        raise InputError("no data folder: give --data DIR or set PLIANT_DATA")
    return Path(named)
