"""``pliant bench cortex``: rankings of a cohort's sites against their truth, and what a study costs."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer

from .bench import AsJson, show_rows
from .ending import complain
from .output import say_json, show_facts


def cortex(
    seeds: Annotated[str, typer.Option(metavar="S,S,...", help="One synthetic cohort each.")] = "10",
    subjects: Annotated[int, typer.Option(min=3, help="Subjects a cohort.")] = 31,
    sites: Annotated[int, typer.Option(min=20, help="Landmarks.")] = 120,
    spread: Annotated[
        Literal["logistic", "logarithmic", "even"], typer.Option(help="How true amplitudes are distributed.")
    ] = "logistic",
    shared: Annotated[float, typer.Option(min=0, help="Depth in mm of folds that all subjects have.")] = 0.0,
    sliding: Annotated[
        float, typer.Option(min=0, help="Displacements along the surface, over the folds' depth.")
    ] = 0.5,
    cost: Annotated[bool, typer.Option(help="Also time a whole study, from files to histograms.")] = True,
    as_json: AsJson = False,
) -> None:
    """Measure how well statistics of folding rank sites by their true variability, and what a study costs."""
    from ..bench import cortex as measurements

    try:
        chosen = [int(seed) for seed in seeds.split(",")]
    except ValueError as error:
        message = f"{seeds!r} is not a list of whole numbers"
        raise typer.BadParameter(message) from error
    rows = []
    options: dict[str, Any] = {"spread": spread, "shared": shared, "sliding": sliding}
    for row in measurements.run(chosen, subjects=subjects, sites=sites, **options):
        rows.append(row)
        complain("done", f"seed {row['seed']}, {row['statistic']}")
    spent = measurements.study_cost(subjects, sites=sites) if cost else None
    if as_json:
        say_json({"rows": rows, "cost": spent})
        return
    show_rows("Rank correlation with the true amplitude; shares of the extreme 5 % that are right", rows)
    if spent is not None:
        show_facts("A whole study", {name.replace("_", " "): f"{value:.4g}" for name, value in spent.items()})
