"""``pliant bench descriptors``, ``maps`` and ``symmetry``: shapes against their ground truth."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from .bench import AsJson, show_rows
from .ending import complain
from .output import given, say_json

Cache = Annotated[
    Path | None,
    typer.Option(metavar="DIR", file_okay=False, help="Keep spectra and signatures here, for the next run."),
]


def descriptors(
    shapes: Annotated[
        Path,
        typer.Argument(metavar="SHAPES", callback=given, help="Folder with tosca/ and tosca_remeshed_5k/."),
    ],
    groups: Annotated[
        str, typer.Option(metavar="G,G,...", help="Of poses, remeshed and perturbations.")
    ] = "poses,remeshed,perturbations",
    names: Annotated[
        str | None, typer.Option(metavar="N;N;...", help="Signatures to compare; all of them without it.")
    ] = None,
    cache: Cache = None,
    as_json: AsJson = False,
) -> None:
    """Measure hit rates of signatures on poses and on the nine classes of perturbation."""
    from ..bench import descriptors as measurements

    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) if cache is None else cache
        folder.mkdir(parents=True, exist_ok=True)
        wanted = names.split(";") if names else None
        for group, pairs in measurements.groups(shapes, groups.split(",")).items():
            rows += measurements.run(pairs, group=group, cache=folder, names=wanted)
            complain("done", group)
    if as_json:
        say_json(rows)
        return
    show_rows("Hit rates", rows)


def maps(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", callback=given, help="NAME.ply, NAME.vts and NAME.sym.vts.")
    ],
    pairs: Annotated[int | None, typer.Option(min=1, help="Map so many pairs, drawn at random.")] = None,
    cache: Cache = None,
    as_json: AsJson = False,
) -> None:
    """Measure dense maps without landmarks between shapes of a class: mean geodesic error over sqrt(area)."""
    from ..bench import maps as measurements

    rows = measurements.run(folder, pairs=pairs, cache=cache)
    if as_json:
        say_json(rows)
        return
    show_rows("Dense maps", rows)


def symmetry(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER", callback=given, help="NAME.ply and CLASS.symmetry.csv, as TOSCA has."
        ),
    ],
    names: Annotated[
        str | None, typer.Option(metavar="N,N,...", help="Shapes; all of them without it.")
    ] = None,
    repeated: Annotated[
        str | None, typer.Option(metavar="C,C,...", help="Also measure repeatability on these classes.")
    ] = None,
    cache: Cache = None,
    as_json: AsJson = False,
) -> None:
    """Measure reflections and pairs of limbs against the truth, beside two older ways on the same eigenpairs."""
    from ..bench import symmetry as measurements

    # Said before what comes first has been measured, not after.
    given([folder / f"{name}0.ply" for name in repeated.split(",")] if repeated else [])
    rows = measurements.run(folder, names.split(",") if names else None, cache=cache)
    again = measurements.repeatability(folder, repeated.split(","), cache=cache) if repeated else []
    if as_json:
        say_json({"rows": rows, "repeatability": again})
        return
    show_rows("Symmetry: mean geodesic error over sqrt(area)", rows)
    if again:
        show_rows("Repeatability", again)
