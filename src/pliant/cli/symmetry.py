"""``pliant symmetry``: the intrinsic reflections of a mesh, and its limbs that are alike."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from .ending import at_the_shell
from .files import write_figure
from .output import load_examined, output_folder, say, say_json, show_facts, show_table

if TYPE_CHECKING:
    from ..matching.symmetry import SymmetryResult
    from ..mesh import Mesh

MeshFile = Annotated[Path, typer.Argument(metavar="MESH", help="A mesh file of any known format.")]
Out = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="DIR",
        callback=output_folder,
        help="Write the result: symmetries.json and .npz, a picture a symmetry, and an interactive page.",
    ),
]
Samples = Annotated[int, typer.Option(min=10, help="Points that vote.")]
Pairs = Annotated[int, typer.Option("--eigenfunctions", min=20, help="Eigenfunctions in the final maps.")]
Seed = Annotated[int | None, typer.Option(min=0, help="Draw the first sample with this seed.")]
Parts = Annotated[bool, typer.Option(help="Also look for limbs that are alike.")]
Up = Annotated[Literal["y", "z"], typer.Option(help="The axis that points up in pictures.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]


def symmetry(
    mesh: MeshFile,
    out: Out = None,
    samples: Samples = 100,
    eigenfunctions: Pairs = 120,
    parts: Parts = True,
    seed: Seed = None,
    up: Up = "z",
    as_json: AsJson = False,
) -> None:
    """Find the symmetries of a surface that bending leaves, whole or limb to limb, or say why there are none."""
    from ..matching.symmetry import detect_symmetries

    surface, report = load_examined(mesh)
    result = detect_symmetries(
        surface, samples=samples, k=eigenfunctions, parts=parts, rng=seed, progress=not as_json
    )
    written = [] if out is None else _write(out, mesh.name, surface, result, up)
    if as_json:
        say_json({**result.as_json(), "check_up": report.to_dict(), "written": written})
        return
    _show(mesh.name, result)
    for path in written:
        say(f"wrote {path}")


def _show(name: str, result: SymmetryResult) -> None:
    if not result.symmetries:
        show_facts(f"{name}: no symmetry", _reasons(result))
        return
    columns = ("", "kind", "group", "implied by", "confidence", "support", "distortion", "complexity")
    rows = [
        (
            str(i + 1),
            found.kind,
            str(found.group + 1),
            "" if found.implied_by < 0 else str(found.implied_by + 1),
            f"{found.confidence:.2f}",
            f"{found.support:.2f}",
            f"{found.distortion:.4f}",
            f"{found.complexity:.3f}",
        )
        for i, found in enumerate(result.symmetries)
    ]
    show_table(f"{name}: {len(rows)} of its symmetries", columns, rows)
    if result.reasons:
        show_facts("Not found", _reasons(result))


def _reasons(result: SymmetryResult) -> dict[str, str]:
    return {str(i): at_the_shell(reason) for i, reason in enumerate(result.reasons, start=1)}


def _write(folder: Path, name: str, mesh: Mesh, result: SymmetryResult, up: Literal["y", "z"]) -> list[str]:
    from ..report import correspondence_figure, correspondence_sources, symmetry_page, write_page
    from ..report.symmetry import symmetry_camera, symmetry_names

    result.save(folder)
    written = [folder / "symmetries.json", folder / "symmetries.npz"]
    names = symmetry_names(result)
    for i, (called, found) in enumerate(zip(names, result.symmetries, strict=True), start=1):
        ends = correspondence_sources(mesh, found)
        drawn = correspondence_figure(
            mesh,
            mesh,
            ends,
            found.point_map[ends],
            view=symmetry_camera(mesh, found, up=up),
            title=f"{called} of {name}",
        )
        written.append(folder / f"symmetry-{i}.png")
        write_figure(written[-1], drawn)
    if result.symmetries:
        written.append(folder / "symmetries.html")
        write_page(written[-1], symmetry_page(mesh, result, title=f"Symmetries of {name}", up=up))
    return [str(path) for path in written]
