"""``pliant retrieval``: find pictures by shape; learning codes for pictures and measuring them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .ending import complain
from .output import given, output_folder, say, say_json, show_facts, show_table
from .workers import Scheduler, workers

if TYPE_CHECKING:
    from ..retrieval import RetrievalStudy

retrieval = typer.Typer(
    name="retrieval", help="Find pictures by shape: train, index, query, serve.", no_args_is_help=True
)

Pictures = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER", callback=given, help="Pictures sorted into classes: FOLDER/CLASS/picture.jpg."
    ),
]
Cache = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR", callback=output_folder, help="Keep descriptors and matches here; go on from them."
    ),
]
Bits = Annotated[int, typer.Option(min=8, help="Length of the codes, a multiple of 8.")]
Pairs = Annotated[int, typer.Option(min=0, help="Pairs matched in each class; 0 uses all features alike.")]
Drawings = Annotated[
    bool,
    typer.Option(
        help="Learn from an outline drawing of each picture too, so that drawings find photographs."
    ),
]
Words = Annotated[int, typer.Option(min=1, help="Visual words.")]
Points = Annotated[int, typer.Option(min=8, help="Points described in each picture.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of every draw.")]
Jobs = Annotated[int | None, typer.Option(min=1, help="Processes; all processors by default.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]


@retrieval.command()
def train(
    folder: Pictures,
    out: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", callback=output_folder, help="Folder for the model."),
    ] = Path("pliant-model"),
    bits: Bits = 128,
    train_per_class: Annotated[
        int | None, typer.Option("--train", min=1, help="Pictures of each class to learn from; default all.")
    ] = None,
    pairs: Pairs = 10,
    drawings: Drawings = True,
    words: Words = 1000,
    points: Points = 600,
    cache: Cache = None,
    seed: Seed = 0,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Learn visual words and binary codes from pictures sorted into classes.

    Writes model.npz and model.json.
    """
    from ..retrieval import train_retrieval

    with workers(scheduler) as where:
        model = train_retrieval(
            folder, bits=bits, n_words=words, points=points, train_per_class=train_per_class,
            pairs_per_class=pairs, drawings=drawings, cache=cache, rng=seed, n_jobs=jobs, scheduler=where.client,
            progress=not as_json,
        )  # fmt: skip
    model.save(out)
    _complain_of(model.settings["left_out"])
    if as_json:
        say_json({"folder": str(out), "bits": model.bits, **model.settings, **where.record()})
        return
    facts = {
        "classes": str(len(model.settings["classes"])),
        "pictures": str(model.settings["pictures"]),
        "left out": str(len(model.settings["left_out"])),
        "words": str(len(model.vocabulary.words_)),
        "bits": str(model.bits),
        **where.facts(),
    }
    show_facts(str(folder), facts)
    say(f"wrote {out}")


@retrieval.command()
def evaluate(
    folder: Pictures,
    bits: Bits = 128,
    train: Annotated[int, typer.Option(min=1, help="Pictures of each class to learn from.")] = 20,
    queries: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", callback=given, help="Ask with these pictures, sorted likewise, instead."
        ),
    ] = None,
    splits: Annotated[int, typer.Option(min=1, help="Draws of the pictures to learn from.")] = 3,
    pairs: Pairs = 10,
    drawings: Drawings = True,
    words: Words = 1000,
    points: Points = 600,
    cache: Cache = None,
    seed: Seed = 0,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Measure kinds of codes: precision of the label that the nearest give, over repeated splits, with intervals.

    About half a second of one processor for each pair in each class and split.
    """
    from ..retrieval import evaluate_retrieval

    with workers(scheduler) as where:
        (study,) = evaluate_retrieval(
            folder, queries=queries, bits=bits, train=train, splits=splits, n_words=words, points=points,
            pairs_per_class=pairs, drawings=drawings, cache=cache, rng=seed, n_jobs=jobs, scheduler=where.client,
            progress=not as_json,
        )  # fmt: skip
    _complain_of(study.left_out)
    values = study.summary() | {"splits": splits, "seed": seed, "pairs_per_class": pairs, "n_words": words}
    if as_json:
        say_json({**values, **where.record()})
        return
    _show(study, values, str(folder))
    if where.address:
        show_facts("", where.facts())


def _complain_of(left_out: Any) -> None:
    for name, why in left_out.items():
        complain("warning", f"{name} was left out: {why}")


def _show(study: RetrievalStudy, values: dict[str, Any], title: str) -> None:
    def cell(value: float | None) -> str:
        return "" if value is None else f"{value:.3f}"

    rows = []
    for method, value in values["precision"].items():
        low, high = values["intervals"][method]
        others = (values["all_features"].get(method), values["held_out_classes"].get(method))
        rows.append((method, cell(value), f"{low:.3f} to {high:.3f}", *(cell(v) for v in others)))
    columns = ("codes", "precision", "95 % interval", "all features", "held-out classes")
    show_table(
        f"{title}: {len(study.classes)} classes, {study.bits} bits, {study.train} a class", columns, rows
    )
    effect = values["effect_of_selection"]
    low, high = effect["interval"]
    show_facts(
        "Consistent features against all",
        {"proposed codes": f"{effect['difference']:+.3f} ({low:+.3f} to {high:+.3f})"},
    )
