"""``pliant heart study``: what shape says of disease, over a cohort."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from ..errors import InputError
from .ending import complain
from .files import write_rows, write_text
from .heart_options import AsJson, Jobs, Points, Radius, Seed
from .heart_patient import heart as heart
from .output import ResultsFolder, given, say, say_json, show_table
from .workers import Scheduler, workers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..heart import HeartStudy, HeartSubject
    from ..heart._scores import Score

# Per cent, as heart_study has it.
DISEASED_FROM = 70.0


@heart.command()
def study(
    cohort: Annotated[
        Path,
        typer.Argument(
            metavar="COHORT", callback=given, help="CSV: subject, mesh or volume, landmarks, stenosis_LAD ..."
        ),
    ],
    out: ResultsFolder,
    scenario: Annotated[
        Literal["global", "segment", "territory"],
        typer.Option(help="One bag a subject, segment or territory."),
    ] = "territory",
    folds: Annotated[int, typer.Option(min=0, help="Of the cross-validation; 0 leaves one out.")] = 10,
    repeats: Annotated[int, typer.Option(min=1, help="How often folds are drawn.")] = 3,
    permutations: Annotated[int, typer.Option(min=0, help="Shuffles of the labels for the null.")] = 100,
    words: Annotated[int, typer.Option(min=2, help="Size of the vocabulary.")] = 20,
    weighting: Annotated[
        Literal["blocks", "plain"], typer.Option(help="Kinds of numbers alike, or columns.")
    ] = "blocks",
    points: Points = 500,
    radius: Radius = 3.0,
    seed: Seed = 0,
    scheduler: Scheduler = None,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Predict stenosis from shape over a cohort, beside references, baselines and a null."""
    from ..heart import BagOfFeatures, describe_cohort, heart_study, read_heart_cohort

    subjects = read_heart_cohort(cohort)
    _refuse_labels(cohort, subjects, scenario)
    with workers(scheduler) as where:
        measured = describe_cohort(
            subjects,
            out,
            points=points,
            radius=radius,
            rng=seed,
            n_jobs=jobs,
            scheduler=where.client,
            progress=not as_json,
        )
    graded = any(subject.stenosis for subject in subjects)
    features, labels, left_out = measured.for_stenosis() if graded else measured.for_disease()
    found = heart_study(
        features,
        labels if graded else None,
        diseased=None if graded else labels,
        scenario=scenario if graded else "global",
        methods={"bag of features": BagOfFeatures(words, weighting=weighting, rng=seed)},
        folds=folds or "leave-one-out",
        repeats=repeats,
        permutations=permutations,
        rng=seed,
        n_jobs=jobs,
        progress=not as_json,
    )
    rows = found.table()
    _write_table(out / f"{found.scenario}.csv", rows)
    write_rows(out / "left_out.csv", ("subject", "reason"), left_out.items())
    write_text(out / "settings.json", json.dumps({**found.settings, **measured.settings}, indent=2) + "\n")
    for text in found.cautions:
        complain("warning", text)
    if as_json:
        about = {"cautions": found.cautions, "settings": dict(found.settings), **where.record()}
        say_json({"rows": rows, "left_out": left_out, **about})
        return
    _show_study(found)
    if where.address:
        say(f"measured on {where.words()}")
    for name, reason in left_out.items():
        say(f"left out: {name}: {reason}")
    for name in (f"{found.scenario}.csv", "left_out.csv", "settings.json"):
        say(f"wrote {out / name}")


def _refuse_labels(cohort: Path, subjects: Sequence[HeartSubject], scenario: str) -> None:
    """Refuse labels from which nothing can be learned, before hours of measuring and not after them."""
    import numpy as np

    from ..heart._problems import problems_of

    if not any(subject.stenosis or subject.diseased in (0, 1) for subject in subjects):
        message = (
            f"{cohort} has no label: give stenosis_LAD, stenosis_LCX and stenosis_RCA, or diseased (0 or 1)"
        )
        raise InputError(message)
    if any(subject.stenosis for subject in subjects):
        known = [s.stenosis for s in subjects if s.stenosis and np.isfinite(s.stenosis).all()]
        problems_of(len(known), np.reshape(known, (-1, 3)), None, scenario, DISEASED_FROM)
    else:
        labels = [s.diseased for s in subjects if s.diseased in (0, 1)]
        problems_of(len(labels), None, labels, "global", DISEASED_FROM)


def _show_study(found: HeartStudy) -> None:
    rows = [
        (
            f"{row.unit}: {row.method}, {row.model}",
            "balanced accuracy" if row.kind == "class" else "r",
            f"{row.score.value:.2f}",
            _interval(row.score),
            "" if row.score.null != row.score.null else f"{row.score.null:.2f}",
            "" if row.score.p != row.score.p else f"{row.score.p:.3f}",
        )
        for row in found.rows
    ]
    show_table("Study", ("unit: method, model", "score", "value", "95 % interval", "null 95 %", "p"), rows)


def _interval(score: Score) -> str:
    return "too few subjects" if score.low != score.low else f"{score.low:.2f} to {score.high:.2f}"


def _write_table(path: Path, rows: list[dict[str, Any]]) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row))
    write_rows(path, names, ([row.get(name) for name in names] for row in rows))
