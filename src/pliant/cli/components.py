"""``pliant components``: where a shape is locally distinctive."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from .field import AsJson, Figure, MeshFile, Out, Seed, Up
from .files import write_figure
from .output import load_examined, say, say_json, show_table

if TYPE_CHECKING:
    from .. import KeyComponents, Mesh


def components(
    mesh: MeshFile,
    out: Out = None,
    figure: Figure = None,
    radius: Annotated[
        float, typer.Option(min=0, help="Radius of the estimate, in RMS biharmonic distances.")
    ] = 0.1,
    seed: Seed = 0,
    up: Up = "z",
    as_json: AsJson = False,
) -> None:
    """Find the key components of a shape: the connected regions that are locally distinctive."""
    from .. import key_components, save_arrays

    surface, _ = load_examined(mesh)
    found = key_components(surface, radius=radius, rng=seed)
    written = [str(path) for path in (out, figure) if path is not None]
    if out is not None:
        arrays = {"component": found.labels.astype(float)}
        save_arrays(out, arrays, mesh=None if out.name.lower().endswith(".npz") else surface)
    if figure is not None:
        from ..report import surface_figure

        title = f"Key components, {mesh.name}"
        drawn = surface_figure(
            surface,
            found.labels + 1.0,
            up=up,
            title=title,
            colour_bar_label="component (0: none)",
            length_unit="",
        )
        write_figure(figure, drawn)
    rows = _rows(found, surface)
    if as_json:
        say_json({"mesh": str(mesh), "radius": radius, "seed": seed, "components": rows, "written": written})
        return
    columns = ("component", "vertices", "share of the area")
    cells = [(str(row["component"]), str(row["vertices"]), f"{row['area_share']:.1%}") for row in rows]
    show_table(f"Key components of {mesh.name}", columns, cells)
    for path in written:
        say(f"wrote {path}")


def _rows(found: KeyComponents, surface: Mesh) -> list[dict[str, Any]]:
    return [
        {
            "component": i,
            "vertices": len(found[i]),
            "area_share": float(area / surface.area),
            "centre": surface.vertices[found[i]].mean(axis=0).tolist(),
        }
        for i, area in enumerate(found.areas)
    ]
