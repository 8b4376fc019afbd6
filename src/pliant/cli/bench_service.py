"""``pliant bench service``: the retrieval index and its service."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .output import given, say_json, show_facts

AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]


def service(
    index: Annotated[
        Path | None,
        typer.Argument(metavar="[INDEX]", callback=given, help="Folder of an index, to query and to serve."),
    ] = None,
    pictures: Annotated[
        list[Path] | None, typer.Argument(metavar="[PICTURE...]", callback=given, help="What to ask it with.")
    ] = None,
    codes: Annotated[int, typer.Option(min=1, help="Random codes to search among.")] = 1_000_000,
    clients: Annotated[int, typer.Option(min=1, help="Clients at once.")] = 64,
    seconds: Annotated[float, typer.Option(min=1, help="How long they ask.")] = 60.0,
    as_json: AsJson = False,
) -> None:
    """Measure Hamming search, a query end to end, and a served index under many clients (on 127.0.0.1 only)."""
    from ..bench import service as measurements
    from ..bench.harness import machine

    if (index is None) != (not pictures):
        raise typer.BadParameter("name an index and pictures to ask it with, or neither")
    found: dict[str, Any] = {"hamming": measurements.hamming(codes)}
    if index is not None and pictures:
        found["query"] = measurements.queries(index, pictures)
        found["clients"] = measurements.clients(index, pictures, count=clients, seconds=seconds)
    about = machine(("faiss-cpu", "fastapi", "uvicorn"))
    if as_json:
        say_json({"machine": about, **found})
        return
    for name, row in found.items():
        show_facts(
            name,
            {k.replace("_", " "): f"{v:.4g}" if isinstance(v, float) else str(v) for k, v in row.items()},
        )
