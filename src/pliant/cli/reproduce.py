"""``pliant reproduce``: the dissertation's tables and figures, measured again."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .output import given, output_folder, say, say_json, show_table


def _known(names: list[str] | None) -> list[str] | None:
    """Refuse an unknown name as bad usage, like any other choice."""
    if names:
        from ..reproduce.run import chosen

        try:
            chosen(names)
        except InputError as error:
            raise typer.BadParameter(str(error)) from error
    return names


def reproduce(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME...]",
            callback=_known,
            help="Experiments or chapters, as table-2.2 or chapter-3; all by default.",
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            callback=output_folder,
            help="Where report.html, verdicts.json, verdicts.md and results go.",
        ),
    ] = Path("pliant-reproduction"),
    data: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            callback=given,
            help="Evaluation data (see pliant data list); PLIANT_DATA by default.",
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer shapes, draws and subjects.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything random.")] = 0,
    list_only: Annotated[
        bool, typer.Option("--list", help="Say which experiments there are, and stop.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Write the verdicts as JSON, and nothing else.")
    ] = False,
) -> None:
    """Recompute the dissertation's results, put each beside the printed value, and write a report."""
    from ..reproduce import experiments
    from ..reproduce import reproduce as run

    if list_only:
        rows = [
            (e.name, e.title + (f" ({', '.join(e.covers)})" if e.covers else ""), ", ".join(e.needs) or "–")
            for e in experiments()
        ]
        show_table("Experiments", ("name", "what, and what else it covers", "needs"), rows, prose=(0, 1, 2))
        return
    place = data or (Path(os.environ["PLIANT_DATA"]) if os.environ.get("PLIANT_DATA") else None)
    done = run(names or (), folder=output, data=place, quick=quick, rng=seed, progress=not as_json)
    if as_json:
        import json

        say_json(json.loads((output / "verdicts.json").read_text(encoding="utf-8")))
        return
    lines: list[tuple[str, ...]] = [
        (
            o.experiment.name,
            o.experiment.title,
            o.findings.verdict,
            "kept" if o.reused else f"{o.seconds:.0f} s",
        )
        for o in done
    ]
    show_table(
        f"Written to {output / 'report.html'}",
        ("experiment", "what", "verdict", "time"),
        lines,
        prose=(0, 1, 2),
    )
    for o in done:
        if o.findings.verdict == "not tested":
            say(f"{o.experiment.name}, not tested: {o.findings.summary}")
