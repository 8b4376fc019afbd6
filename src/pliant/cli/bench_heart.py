"""``pliant bench heart``: the study of stenosis on phantoms of known truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .bench import AsJson, show_rows
from .output import given, say_json


def heart(
    tables: Annotated[
        str,
        typer.Option(
            metavar="T,T,...", help="Of 5.3, 5.7, 5.8, 5.9, ablation, direction, none, ct, sunnybrook."
        ),
    ] = "5.9,ablation",
    subjects: Annotated[int, typer.Option(min=12, help="Phantoms a cohort.")] = 32,
    seed: Annotated[int, typer.Option(min=0, help="Of the cohorts.")] = 1000,
    permutations: Annotated[int, typer.Option(min=0, help="Shuffles for the null.")] = 0,
    perceptron: Annotated[bool, typer.Option(help="Also train perceptrons.")] = True,
    repeats: Annotated[int, typer.Option(min=1, help="Draws of the folds.")] = 1,
    spacing: Annotated[float, typer.Option(min=0.5, help="Of the CT volumes of table ct, in mm.")] = 1.0,
    data: Annotated[
        Path | None,
        typer.Option(metavar="DIR", callback=given, help="Folder of the real hearts of table sunnybrook."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Predict stenosis on phantoms of known truth: Tables 5.3, 5.7 to 5.9, the ablation, a null, CT, real hearts."""
    from ..bench import heart as measurements

    rows = measurements.run(
        tables.split(","),
        subjects=subjects,
        seed=seed,
        permutations=permutations,
        perceptron=perceptron,
        repeats=repeats,
        spacing=spacing,
        data=data,
    )
    if as_json:
        say_json(rows)
        return
    for table in dict.fromkeys(row["table"] for row in rows):
        chosen = [row for row in rows if row["table"] == table]
        # Classes and percentages have columns of their own.
        names = list(dict.fromkeys(name for row in chosen for name in row if name != "table"))
        show_rows(f"Table {table}", [{name: row.get(name, "") for name in names} for row in chosen])
