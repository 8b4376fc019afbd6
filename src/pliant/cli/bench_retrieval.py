"""``pliant bench retrieval``: kinds of codes by length and by pictures to learn from, and what stages cost."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .bench import AsJson, show_rows
from .ending import complain
from .output import given, say_json, show_facts
from .retrieval import Cache, Jobs, Pairs, Pictures, Seed


def retrieval(
    folder: Pictures,
    bits: Annotated[str, typer.Option(metavar="B,B,...", help="Lengths.")] = "32,64,128,256,512",
    train: Annotated[
        str, typer.Option(metavar="N,N,...", help="Pictures of each class to learn from.")
    ] = "5,10,20,30,40",
    queries: Annotated[
        Path | None, typer.Option(metavar="DIR", callback=given, help="Ask with these pictures instead.")
    ] = None,
    splits: Annotated[int, typer.Option(min=1, help="Draws of the pictures to learn from.")] = 3,
    pairs: Pairs = 10,
    cache: Cache = None,
    seed: Seed = 0,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Measure kinds of codes at every length and number of pictures to learn from (Fig. 6.6), and what stages cost."""
    from ..bench import retrieval as measurements

    rows = []
    for row in measurements.curves(
        folder, bits=_numbers(bits), train=_numbers(train), queries=queries, splits=splits, pairs_per_class=pairs,
        cache=cache, rng=seed, n_jobs=jobs, progress=True,
    ):  # fmt: skip
        rows.append(row)
        complain("done", f"{row['train']} a class, {row['bits']} bits")
    spent = measurements.costs()
    if as_json:
        say_json({"rows": rows, "cost": spent})
        return
    show_rows("Precision by pictures of each class and length of the codes", rows)
    show_facts("Processor seconds, one thread", {name: f"{value:.3g}" for name, value in spent.items()})


def _numbers(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError as error:
        message = f"{text!r} is not a list of whole numbers"
        raise typer.BadParameter(message) from error
