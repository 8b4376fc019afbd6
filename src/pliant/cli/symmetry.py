"""``pliant symmetry``: the intrinsic reflections of a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from .output import report_findings, say, say_json, show_facts, show_table

if TYPE_CHECKING:
    from .._arrays import FloatArray
    from ..matching.symmetry import SymmetryResult
    from ..mesh import Mesh

MeshFile = Annotated[Path, typer.Argument(metavar="MESH", help="A mesh file of any known format.")]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        "-o",
        metavar="DIR",
        file_okay=False,
        help="Write the result: symmetries.json and .npz, a picture a symmetry, and an interactive page.",
    ),
]
Samples = Annotated[int, typer.Option(min=10, help="Points that vote.")]
Pairs = Annotated[int, typer.Option("--eigenfunctions", min=20, help="Eigenfunctions in the final maps.")]
Seed = Annotated[int | None, typer.Option(min=0, help="Draw the first sample with this seed.")]
Up = Annotated[Literal["y", "z"], typer.Option(help="The axis that points up in pictures.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]


def symmetry(
    mesh: MeshFile,
    out: Out = None,
    samples: Samples = 100,
    eigenfunctions: Pairs = 120,
    seed: Seed = None,
    up: Up = "z",
    as_json: AsJson = False,
) -> None:
    """Find the reflections of a surface that bending leaves, or say why there are none."""
    from ..matching.symmetry import detect_symmetries
    from ..mesh import check_up, load_mesh

    surface = load_mesh(mesh)
    report = check_up(surface)
    report_findings(mesh.name, report.findings)
    result = detect_symmetries(surface, samples=samples, k=eigenfunctions, rng=seed)
    written = [] if out is None else _write(out, mesh.name, surface, result, up)
    if as_json:
        say_json({**result.as_json(), "check_up": report.to_dict(), "written": written})
        return
    _show(mesh.name, result)
    for path in written:
        say(f"wrote {path}")


def _show(name: str, result: SymmetryResult) -> None:
    if not result.symmetries:
        show_facts(f"{name}: no symmetry", {str(i + 1): reason for i, reason in enumerate(result.reasons)})
        return
    columns = ("", "kind", "confidence", "support", "distortion", "residual", "complexity")
    rows = [
        (
            str(i + 1),
            found.kind,
            f"{found.confidence:.2f}",
            f"{found.support:.2f}",
            f"{found.distortion:.4f}",
            f"{found.residual:.4f}",
            f"{found.complexity:.3f}",
        )
        for i, found in enumerate(result.symmetries)
    ]
    show_table(f"{name}: {len(rows)} of its symmetries", columns, rows)


def _write(folder: Path, name: str, mesh: Mesh, result: SymmetryResult, up: Literal["y", "z"]) -> list[str]:
    from ..report import surface_figure, surface_page, write_page

    result.save(folder)
    written = [folder / "symmetries.json", folder / "symmetries.npz"]
    layers: dict[str, FloatArray] = {}
    for i, found in enumerate(result.symmetries, start=1):
        label = f"symmetry {i}: way to the mirror image"
        layers[label] = _distances_moved(mesh, found.point_map)
        drawn = surface_figure(
            mesh,
            layers[label],
            up=up,
            title=f"Symmetry {i} of {name}",
            colour_bar_label="way to the mirror image",
        )
        written.append(folder / f"symmetry-{i}.png")
        drawn.savefig(written[-1])
    if layers:
        notes = "Straight distance from each point to its mirror image: 0 on the line that stays in place."
        settings: dict[str, Any] = dict(result.settings)
        html = surface_page(
            mesh, layers, title=f"Symmetries of {name}", notes=notes, settings=settings, up=up
        )
        written.append(folder / "symmetries.html")
        write_page(written[-1], html)
    return [str(path) for path in written]


def _distances_moved(mesh: Mesh, point_map: Any) -> FloatArray:
    import numpy as np

    moved: FloatArray = np.linalg.norm(mesh.vertices[point_map] - mesh.vertices, axis=1)
    return moved
