"""``pliant image``: matching two pictures, and evaluating matchers on a list of pairs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .ending import complain
from .files import write_figure, write_json
from .output import given, output_folder, say, say_json, show_facts, show_table

if TYPE_CHECKING:
    from ..images import PairMatch, PairStudy

image = typer.Typer(
    name="image", help="Partial matching of pictures that look nothing alike.", no_args_is_help=True
)

Picture_ = Annotated[Path, typer.Argument(callback=given, help="A picture: JPEG, PNG, TIFF, ...")]
Folder = Annotated[
    Path,
    typer.Option("--output", "-o", metavar="DIR", callback=output_folder, help="Folder for the results."),
]
Mask = Annotated[
    Path | None, typer.Option(callback=given, help="A picture that is black where its picture is fill.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the feature points.")]


@image.command()
def match(
    first: Picture_,
    second: Picture_,
    folder: Folder = Path("pliant-match"),
    mask1: Mask = None,
    mask2: Mask = None,
    features: Annotated[int, typer.Option(min=8, help="Points in each picture.")] = 300,
    dim: Annotated[int, typer.Option(min=1, help="Eigenvectors of the joint graph.")] = 30,
    share: Annotated[float, typer.Option(help="Part of the shared evidence that each box holds.")] = 0.83,
    seed: Seed = 0,
    as_json: AsJson = False,
) -> None:
    """Find the part of each of two pictures that shows the same thing.

    Writes match.png (both pictures, boxes, correspondences), match.html (the same, interactive, opens from disk)
    and match.json.
    """
    from ..images import load_picture, match_pair
    from ..report import write_page
    from ..report.matches import match_figure, match_page

    pictures = load_picture(first, mask=mask1), load_picture(second, mask=mask2)
    result = match_pair(*pictures, features=features, dim=dim, share=share, rng=seed)
    folder.mkdir(parents=True, exist_ok=True)
    title = f"{first.name} and {second.name}"
    write_figure(folder / "match.png", match_figure(*pictures, result, title=title))
    settings = {"image 1": str(first), "image 2": str(second), "seed": seed}
    write_page(folder / "match.html", match_page(*pictures, result, title=title, settings=settings))
    values = _plain(result) | {"image1": str(first), "image2": str(second), "seed": seed}
    write_json(folder / "match.json", values)
    if as_json:
        say_json(values)
        return
    show_facts(title, _facts(result))
    for name in ("match.png", "match.html", "match.json"):
        say(f"wrote {folder / name}")


@image.command()
def evaluate(
    pairs: Annotated[
        Path, typer.Argument(metavar="PAIRS.json", callback=given, help="A list of pairs with true boxes.")
    ],
    seed: Seed = 0,
    moved: Annotated[
        bool, typer.Option(help="Also evaluate after turning and resizing each second picture at random.")
    ] = True,
    jobs: Annotated[int, typer.Option(min=1, help="Threads.")] = 1,
    as_json: AsJson = False,
) -> None:
    """Score the proposed method and every baseline on a list of pairs: mean relevance (MRS) and false share (FPR)."""
    from ..images import evaluate_pairs, read_pairs

    records = read_pairs(pairs)
    study = evaluate_pairs(records, rng=seed, n_jobs=jobs, progress=not as_json)
    again = (
        evaluate_pairs(records, rng=seed, motion="moved", n_jobs=jobs, progress=not as_json)
        if moved
        else None
    )
    for name, why in study.failures.items():
        complain("warning", f"{name} was not run: {why}")
    if as_json:
        say_json(_scores(study) | ({"moved": _scores(again)} if again else {}) | {"seed": seed})
        return
    _show(study, f"{pairs}: {len(records)} pairs as given")
    if again:
        _show(again, "The same, second pictures turned by up to 15 degrees and resized by .5 to 1.4")


def _plain(result: PairMatch) -> dict[str, Any]:
    return {
        "box1": result.box1.tolist(),
        "box2": result.box2.tolist(),
        "transform": None if result.transform is None else result.transform.tolist(),
        "score": result.score,
        "reason": result.reason,
        "points1": result.points1.tolist(),
        "points2": result.points2.tolist(),
        "distances": result.distances.tolist(),
        "settings": result.settings,
    }


def _facts(result: PairMatch) -> dict[str, str]:
    boxes = (", ".join(f"{value:.0f}" for value in box) for box in (result.box1, result.box2))
    facts = dict(zip(("box in the first", "box in the second"), boxes, strict=True))
    facts["score"] = f"{result.score:g} matches agree with one transform"
    return facts | ({"reason": result.reason} if result.reason else {})


# What every evaluation reports, in this order; the rest comes apart.
_MAIN = ("proposed", "sift", "orb", "akaze", "fast", "gb", "whole", "centre")


def _scores(study: PairStudy) -> dict[str, Any]:
    mrs, fpr = study.mrs(), study.fpr()
    others = [name for name in mrs if name not in _MAIN]
    return {
        "mrs": {name: mrs[name] for name in _MAIN},
        "fpr": {name: fpr[name] for name in _MAIN},
        "others": {name: {"mrs": mrs[name], "fpr": fpr[name]} for name in others},
        "pairs": len(study.names),
        **study.summary(),
    }


def _show(study: PairStudy, title: str) -> None:
    mrs, fpr = study.mrs(), study.fpr()
    text = [(name, _text(mrs[name]), _text(fpr[name])) for name in mrs]
    show_table(title, ("method", "MRS", "FPR"), text)
    best = study.above_best()
    interval = best["interval"]
    span = (
        ""
        if interval is None
        else f" (95 % interval over monuments {interval[0]:+.3f} to {interval[1]:+.3f})"
    )
    facts = {
        f"above {best['baseline']}, the best baseline": f"{best['difference']:+.3f}{span}",
        "transform within 5 % of the diagonal": _text(study.transform_share()),
    }
    show_facts("The proposed method", facts)


def _text(value: float | None) -> str:
    return "not run" if value is None else f"{value:.3f}"
