"""``pliant path``: the shortest path between two vertices of a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .field import AsJson, Graph, MeshFile
from .files import write_rows
from .output import load_examined, named, say, say_json, show_facts

if TYPE_CHECKING:
    from .. import GeodesicPath

Source = Annotated[int, typer.Argument(metavar="SOURCE", help="Number of the vertex it starts at, from 0.")]
Target = Annotated[int, typer.Argument(metavar="TARGET", help="Number of the vertex it ends at.")]
Table = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="OUT",
        callback=named(".csv"),
        help="Write the points: .csv with vertex (-1 within an edge), x, y, z, length so far.",
    ),
]


def path(
    mesh: MeshFile,
    source: Source,
    target: Target,
    out: Table = None,
    graph: Graph = "edges",
    as_json: AsJson = False,
) -> None:
    """Find the shortest path over a surface between two vertices."""
    from .. import geodesic_path
    from ..errors import InputError

    surface, _ = load_examined(mesh)
    found = geodesic_path(surface, source, target, graph=graph)
    if not len(found):
        message = f"{mesh}: no path leads from vertex {source} to {target}; they lie in different pieces of the mesh"
        raise InputError(message)
    if out is not None:
        _write(out, found)
    facts = _facts(found)
    if as_json:
        written = [] if out is None else [str(out)]
        asked = {"mesh": str(mesh), "source": source, "target": target, "graph": graph}
        say_json({**asked, **facts, "vertices": found.vertices.tolist(), "written": written})
        return
    shown = {name.replace("_", " "): f"{value:,.6g}" for name, value in facts.items()}
    show_facts(f"Shortest path from {source} to {target}, {mesh.name}, {graph}", shown)
    if out is not None:
        say(f"wrote {out}")


def _facts(found: GeodesicPath) -> dict[str, Any]:
    """Length, the straight line between the ends, and the steps from vertex to vertex."""
    first, last = found.points[0], found.points[-1]
    return {
        "length": found.length,
        "straight_line": float(((last - first) ** 2).sum() ** 0.5),
        "steps": int((found.vertices >= 0).sum()) - 1,
    }


def _write(out: Path, found: GeodesicPath) -> None:
    rows = zip(found.vertices.tolist(), found.points.tolist(), found.along.tolist(), strict=True)
    write_rows(out, ("vertex", "x", "y", "z", "along"), ([v, *point, along] for v, point, along in rows))
