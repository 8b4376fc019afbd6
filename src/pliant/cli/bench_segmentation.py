"""``pliant bench segmentation``: the left ventricle's blood pool against truth, and level sets against SimpleITK."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .bench import AsJson, show_rows
from .output import given, say_json

_TITLES = {
    "methods": "Overlap with the truth of phantoms (Dice)",
    "median": "Overlap (eq. 5.4) by the median's size: Table 5.2, recomputed",
    "level-set": "Level sets, one thread, processor seconds",
    "time": "One segmentation, processor seconds",
    "real": "Overlap with a rough reference on a real CT",
}


def segmentation(
    tables: Annotated[
        str, typer.Option(metavar="T,T,...", help="Of methods, median, level-set and time.")
    ] = "methods,median",
    subjects: Annotated[int, typer.Option(min=1, help="Phantoms a method.")] = 4,
    size: Annotated[int, typer.Option(min=64, help="Voxels an edge for level-set; 256 for time.")] = 200,
    ct: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", callback=given, help="The evaluation data's heart/ct, for real."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the phantoms.")] = 100,
    as_json: AsJson = False,
) -> None:
    """Segment phantoms of known truth: methods, Table 5.2, level sets beside SimpleITK, time; a real CT."""
    from ..bench import heart_segmentation as measurements

    wanted = [name for name in tables.split(",") if name]
    unknown = sorted(set(wanted) - set(_TITLES) | ({"real"} & set(wanted)))
    if unknown:
        message = f"no table {', '.join(unknown)}; there are methods, median, level-set and time"
        raise typer.BadParameter(message)
    found: dict[str, list[dict[str, Any]]] = {}
    for name in wanted:
        if name == "methods":
            found[name] = measurements.methods_table(subjects, rng=seed)
        elif name == "median":
            found[name] = measurements.median_table(rng=seed)
        elif name == "level-set":
            found[name] = measurements.level_set_row(size, rng=seed)
        else:
            found[name] = [measurements.time_row(rng=seed)]
    if ct is not None:
        found["real"] = measurements.real_rows(ct)
    if as_json:
        say_json(found)
        return
    for name, rows in found.items():
        show_rows(_TITLES[name], rows)
