"""``pliant correspond``: points of two surfaces matched by their signatures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .field import AsJson, Figure, MeshFile, Up
from .files import write_figure, write_json, write_rows
from .output import load_examined, named, say, say_json, show_facts

if TYPE_CHECKING:
    from .. import Correspondence, Mesh


Pairs = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="OUT", callback=named(".csv", ".json"), help="Write the pairs: .csv, .json."
    ),
]


def correspond(
    a: MeshFile,
    b: Annotated[Path, typer.Argument(metavar="MESH", help="The other mesh.")],
    out: Pairs = None,
    figure: Figure = None,
    up: Up = "z",
    samples: Annotated[int, typer.Option(min=3, help="Points of each surface to match.")] = 200,
    least_confidence: Annotated[
        float, typer.Option(min=0, max=1, help="Drop pairs below this confidence.")
    ] = 0.0,
    as_json: AsJson = False,
) -> None:
    """Match points of two surfaces by their biharmonic density, up to the shapes' own symmetries."""
    from .. import correspond as matched

    surfaces = [load_examined(path)[0] for path in (a, b)]
    found = matched(*surfaces, samples=samples, least_confidence=least_confidence)
    rows = _rows(found, *surfaces)
    if out is not None:
        _write(out, rows)
    if figure is not None:
        from ..report import correspondence_figure

        title = f"{a.name} and {b.name}"
        one, two = surfaces
        drawn = correspondence_figure(one, two, found.points_a, found.points_b, up=up, title=title)
        write_figure(figure, drawn)
    written = [str(path) for path in (out, figure) if path is not None]
    if as_json:
        say_json({"a": str(a), "b": str(b), "pairs": rows, "written": written})
        return
    show_facts(f"{a.name} and {b.name}", {"pairs": str(len(found)), **_confidences(found)})
    for name in written:
        say(f"wrote {name}")


def _confidences(found: Correspondence) -> dict[str, str]:
    if not len(found):
        return {}
    low, middle, high = (float(found.confidence[i]) for i in (-1, len(found) // 2, 0))
    return {"confidence": f"{low:.2f} to {high:.2f}, median {middle:.2f}"}


def _rows(found: Correspondence, a: Mesh, b: Mesh) -> list[dict[str, Any]]:
    pairs = zip(found.points_a.tolist(), found.points_b.tolist(), found.confidence.tolist(), strict=True)
    return [
        {
            "vertex_a": i,
            "vertex_b": j,
            "confidence": confidence,
            "position_a": a.vertices[i].tolist(),
            "position_b": b.vertices[j].tolist(),
        }
        for i, j, confidence in pairs
    ]


def _write(path: Path, rows: list[dict[str, Any]]) -> None:
    if path.name.lower().endswith(".json"):
        write_json(path, rows)
        return
    names = ["vertex_a", "vertex_b", "confidence", *(f"{c}_{s}" for s in "ab" for c in "xyz")]
    write_rows(
        path, names, ([*(row[n] for n in names[:3]), *row["position_a"], *row["position_b"]] for row in rows)
    )
