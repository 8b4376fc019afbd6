"""``pliant field``: the geodesic field estimate of a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from .files import write_figure
from .measure import Measurement, measure
from .output import folder_checked, load_examined, named, say, say_json
from .workers import Scheduler, workers


def _values_file(path: Path | None) -> Path | None:
    """Refuse a file that cannot hold per-vertex arrays, before the work and not after it."""
    from ..errors import InputError
    from ..mesh.formats import FORMATS, for_writing

    name = "" if path is None else path.name.lower()
    if name and not name.endswith((".npz", ".gii", ".gii.gz")):
        try:
            able = for_writing(name).holds_arrays
        except InputError:
            able = False
        if not able:
            others = ", ".join(ending for kind in FORMATS if kind.holds_arrays for ending in kind.endings)
            message = f"{path}: files of this ending hold no values; use .npz, .func.gii, {others}"
            raise typer.BadParameter(message)
    return folder_checked(path)


MeshFile = Annotated[Path, typer.Argument(metavar="MESH", help="A mesh file of any known format.")]
Out = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="OUT",
        callback=_values_file,
        help="Write the values: .npz, .ply, .vtp, .func.gii.",
    ),
]
Figure = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        callback=named(".png", ".pdf", ".svg", ".jpg"),
        help="Write a picture: .png, .pdf, .svg, .jpg.",
    ),
]
Page = Annotated[
    Path | None,
    typer.Option(metavar="FILE", callback=named(".html", ".htm"), help="Write an interactive page: .html."),
]
Weights = Annotated[
    Literal["area", "uniform"], typer.Option(help="Draw points by surface area, or every vertex alike.")
]
Graph = Annotated[
    Literal["edges", "refined"], typer.Option(help="Paths along edges, or across pairs of triangles too.")
]
Samples = Annotated[
    int | None, typer.Option(min=1, help="Estimate from so many sources; exact over all without it.")
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the samples.")]
Jobs = Annotated[int | None, typer.Option(min=1, help="Threads; all cores without it.")]
ComputeDevice = Annotated[
    Literal["cpu", "cuda"], typer.Option("--device", help="Compute on the processor, or on a CUDA device.")
]
Up = Annotated[Literal["y", "z"], typer.Option(help="The axis that points up in pictures.")]
Scale = Annotated[
    Literal["linear", "log"], typer.Option(help="How values spread over the colours, at first on a page.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]


def field(
    mesh: MeshFile,
    out: Out = None,
    figure: Figure = None,
    page: Page = None,
    weights: Weights = "area",
    graph: Graph = "edges",
    samples: Samples = None,
    seed: Seed = 0,
    jobs: Jobs = None,
    device: ComputeDevice = "cpu",
    scheduler: Scheduler = None,
    up: Up = "z",
    scale: Scale = "log",
    as_json: AsJson = False,
) -> None:
    """Measure how many shortest paths pass each vertex: the geodesic field estimate (GFE)."""
    surface, report = load_examined(mesh)
    with workers(scheduler) as where:
        result = measure(
            surface,
            mesh.name,
            weights=weights,
            graph=graph,
            samples=samples,
            seed=seed,
            jobs=jobs,
            length_unit=_unit_of(mesh),
            device=device,
            scheduler=where.client,
            progress=not as_json,
        )
    if out is not None:
        _write_values(out, result)
    if figure is not None:
        _write_figure(figure, result, up, scale)
    if page is not None:
        _write_page(page, result, up, scale)
    written = [str(path) for path in (out, figure, page) if path is not None]
    if as_json:
        say_json({**result.summary(), **where.record(), "check_up": report.to_dict(), "written": written})
        return
    result.show(where.facts())
    for path in written:
        say(f"wrote {path}")


def _unit_of(path: Path) -> str:
    """Return "mm" for the formats that are in millimetres by definition, "" for those that do not say."""
    from ..errors import InputError
    from ..mesh.formats import for_writing

    name = path.name.lower().removesuffix(".gz")
    if name.endswith(".gii"):
        return "mm"
    try:
        return "mm" if for_writing(name).name.startswith("FreeSurfer") else ""
    except InputError:
        return ""


def _write_values(path: Path, result: Measurement) -> None:
    import json

    from .. import save_arrays

    arrays: dict[str, Any] = dict(result.arrays())
    if path.name.lower().endswith(".npz"):
        arrays["settings"] = json.dumps(result.settings)
        save_arrays(path, arrays)
    else:
        save_arrays(path, arrays, mesh=result.mesh)


def _write_figure(
    path: Path, result: Measurement, up: Literal["y", "z"], scale: Literal["linear", "log"]
) -> None:
    from ..report import surface_figure

    drawn = surface_figure(
        result.mesh,
        result.values,
        up=up,
        # Where no path passes anywhere there is nothing to take the logarithm of.
        scale=scale if (result.values > 0).any() else "linear",
        title=f"Geodesic field estimate, {result.name}",
        colour_bar_label=result.label,
        length_unit=result.length_unit,
    )
    write_figure(path, drawn)


def _write_page(
    path: Path, result: Measurement, up: Literal["y", "z"], scale: Literal["linear", "log"]
) -> None:
    from ..report import surface_page, write_page

    layers = {result.label: result.values}
    if result.half_widths is not None:
        layers["half-width of its confidence interval"] = result.half_widths
    html = surface_page(
        result.mesh,
        layers,
        title=f"Geodesic field estimate, {result.name}",
        notes=result.meaning,
        settings=result.settings,
        up=up,
        scale=scale,
        length_unit=result.length_unit,
        **result.context(),
    )
    write_page(path, html)
