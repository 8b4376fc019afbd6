"""``pliant retrieval add``, ``remove``, ``query`` and ``serve``: an index of pictures, and asking it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .ending import complain
from .files import write_figure, write_json
from .output import given, output_folder, say, say_json, show_facts, show_table

if TYPE_CHECKING:
    from ..retrieval import QueryResult, ShapeIndex

IndexFolder = Annotated[Path, typer.Argument(metavar="INDEX", help="Folder of the index.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]
# Matches of which the page with shared features is written.
_LOOKED_INTO = 3


def add(
    index: IndexFolder,
    folder: Annotated[Path, typer.Argument(callback=given, help="Pictures, as FOLDER/class/picture.jpg.")],
    model: Annotated[
        Path | None,
        typer.Option(callback=given, help="Model from 'pliant retrieval train'; makes a new index with it."),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Threads.")] = 1,
    as_json: AsJson = False,
) -> None:
    """Add every picture below a folder. Run again, it goes on where it stopped and takes in what changed.

    A picture that cannot be used is named on standard error; the others are added.
    """
    from ..retrieval import add_folder

    with _opened(index, model) as opened:
        report = add_folder(opened, folder, n_jobs=jobs, progress=not as_json)
        size = len(opened)
    for path, why in report.failures.items():
        complain("warning", why if path in why else f"{path}: {why}")
    if as_json:
        values = {"added": report.ids.tolist(), "unchanged": report.unchanged, "failures": report.failures}
        say_json({"index": str(index), **values, "items": size})
        return
    facts = {
        "added": str(report.ids.size),
        "there already": str(report.unchanged),
        "could not be used": str(len(report.failures)),
        "in the index": str(size),
    }
    show_facts(f"{folder} into {index}", facts)


def remove(
    index: IndexFolder,
    ids: Annotated[list[int], typer.Argument(metavar="ID...", min=1, help="As a query gives them.")],
) -> None:
    """Remove pictures by id: all of them, or none if one is not there."""
    from ..retrieval import ShapeIndex

    with ShapeIndex.load(index) as opened:
        opened.remove(ids)
        say(f"removed {len(set(ids))}; {len(opened)} are left in {index}")


def query(
    index: IndexFolder,
    image: Annotated[Path, typer.Argument(callback=given, help="A picture: JPEG, PNG, TIFF, ...")],
    count: Annotated[int, typer.Option("--count", "-k", min=1, help="Matches wanted.")] = 12,
    label: Annotated[str | None, typer.Option(help="Only among pictures of this class.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            callback=output_folder,
            help="Write query.json, query.png, and a page of shared features for each of the first three.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find the pictures of an index that are most like one: by Hamming distance, then by id."""
    from ..retrieval import ShapeIndex, query_index

    with ShapeIndex.load(index) as opened:
        result = query_index(opened, image, count=count, label=label)
        values = _plain(index, image, result)
        written = [] if out is None else _write(out, image.name, opened, result, values)
    if as_json:
        say_json(values)
        return
    rows = [(m.name or "-", m.label, str(m.distance), str(m.id)) for m in result.matches]
    show_table(f"Nearest to {image.name}", ("picture", "class", "distance", "id"), rows)
    if result.label:
        agree = sum(match.label == result.label for match in result.matches)
        say(f"most likely: {result.label} ({agree} of {len(result.matches)})")
    for note in result.notes:
        say(f"note: {note}")
    for path in written:
        say(f"wrote {path}")


def serve(
    index: IndexFolder,
    host: Annotated[
        str, typer.Option(help="Address to bind to; other machines reach any but a loopback one.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 for any that is free.")] = 8000,
    token: Annotated[
        str | None,
        typer.Option(
            envvar="PLIANT_TOKEN",
            help="What clients must send; required beyond loopback. Better in PLIANT_TOKEN.",
        ),
    ] = None,
    upload: Annotated[float, typer.Option(min=0.001, help="Largest request, in MB.")] = 20.0,
    pixels: Annotated[float, typer.Option(min=0.001, help="Largest picture, in millions of pixels.")] = 50.0,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Pictures worked on at once; one a processor by default.")
    ] = None,
) -> None:
    """Serve a page to search the index with, and the interface behind it, until interrupted."""
    from ..retrieval import ServiceLimits
    from ..retrieval import serve as run

    limits = ServiceLimits(upload_bytes=int(upload * 1e6), pixels=int(pixels * 1e6), workers=workers)

    def ready(address: str) -> None:
        say(f"serving {index} at {address} (the interface is described at {address}docs)")

    run(index, host=host, port=port, token=token, limits=limits, ready=ready)


def _opened(folder: Path, model: Path | None) -> ShapeIndex:
    """Open an index, a new one where there is none and a model is given."""
    from ..retrieval import RetrievalModel, ShapeIndex

    if not folder.exists():
        if model is None:
            message = f"{folder}: there is no such index; name a model with --model to make one"
            raise InputError(message)
        ShapeIndex(model=RetrievalModel.load(model)).save(folder)
    elif model is not None:
        message = f"{folder} exists already and has its own model; leave --model away"
        raise InputError(message)
    return ShapeIndex.load(folder)


def _plain(index: Path, image: Path, result: QueryResult) -> dict[str, Any]:
    return {
        "index": str(index),
        "image": str(image),
        "bits": result.bits,
        "label": result.label,
        "matches": [dict(vars(match)) for match in result.matches],
    }


def _write(
    folder: Path, name: str, index: ShapeIndex, result: QueryResult, values: dict[str, Any]
) -> list[Path]:
    from ..images import decode_picture, match_pair
    from ..report import write_page
    from ..report.matches import match_page
    from ..report.retrieval import query_figure

    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / "query.json", folder / "query.png"]
    write_json(written[0], values)
    found = [(match, index.preview(match.id)) for match in result.matches]
    pictures = [None if jpeg is None else decode_picture(jpeg, name=match.name) for match, jpeg in found]
    write_figure(written[1], query_figure(result, pictures, title=name))
    for rank, (match, picture) in enumerate(zip(result.matches[:_LOOKED_INTO], pictures, strict=False), 1):
        if picture is None:
            continue
        pair = result.picture, picture
        html = match_page(*pair, match_pair(*pair), title=f"{name} and {match.name}", settings=vars(match))
        written.append(write_page(folder / f"match-{rank}.html", html))
    return written
