"""``pliant bench``: measurements against other packages, one command a room."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from .ending import complain
from .output import given, say_json, show_facts, show_table

bench = typer.Typer(
    name="bench",
    help="Measure Pliant beside other packages: same input, same run, medians and ratios.",
    no_args_is_help=True,
)

Repeats = Annotated[int, typer.Option(min=1, help="Runs of each measurement, of which the median is shown.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]


@bench.command()
def field(
    levels: Annotated[
        str, typer.Option(metavar="L,L,...", help="Subdivisions: 4 to 7 are 2.5k, 10k, 41k, 164k vertices.")
    ] = "4,5,6,7",
    repeats: Repeats = 3,
    distances: Annotated[bool, typer.Option(help="Also measure distances from all vertices.")] = True,
    device: Annotated[
        Literal["cpu", "cuda"], typer.Option(help="cuda: the device against the CPU and Johnson (Fig. 2.10).")
    ] = "cpu",
    meshes: Annotated[
        list[Path] | None,
        typer.Option("--mesh", metavar="MESH", help="With --device cuda: mesh files as well."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Measure exact betweenness and many-source distances against NetworKit, igraph and SciPy."""
    if device == "cuda":
        from .bench_scale import cuda_rows

        cuda_rows(meshes, _levels(levels), as_json=as_json)
        return
    from ..bench import field as measurements
    from ..bench.harness import machine

    rows = []
    for row in measurements.run(subdivisions=_levels(levels), repeats=repeats, distances=distances):
        rows.append(row)
        complain("done", f"{row['what']} by {row['engine']} at {row['n']} vertices")
    about = machine(measurements.PEERS)
    if as_json:
        say_json({"machine": about, "rows": rows})
        return
    _show_machine(about)
    columns = ("", "vertices", "seconds", "range", "ms / source", "peak MB", "time / Pliant's", "")
    show_table("All sources; medians of whole calls", columns, (_field_cells(row) for row in rows))


@bench.command()
def spectral(
    meshes: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[MESH...]", callback=given, help="Mesh files to measure as well."),
    ] = None,
    levels: Annotated[str, typer.Option(metavar="L,L,...", help="Subdivisions of the bumpy sphere.")] = "5,6",
    k: Annotated[int, typer.Option("-k", min=2, help="Eigenpairs.")] = 200,
    repeats: Repeats = 3,
    convergence: Annotated[bool, typer.Option(help="Also show how the mesh Laplacian converges.")] = True,
    as_json: AsJson = False,
) -> None:
    """Measure the eigenbasis against SciPy's shift-inverted eigsh, interleaved in one run."""
    from ..bench import spectral as measurements
    from ..bench.harness import machine

    rows = list(measurements.run(_levels(levels), repeats, k=k, meshes=meshes or ()))
    pointwise = measurements.convergence() if convergence else []
    about = machine()
    if as_json:
        say_json({"machine": about, "rows": rows, "convergence": pointwise})
        return
    _show_machine(about)
    show_rows(f"{k} eigenpairs; medians", rows)
    if pointwise:
        show_rows("Laplacian of xy on random points of the unit sphere: error of 6 xy, by kind", pointwise)


@bench.command()
def images(
    pairs: Annotated[
        Path,
        typer.Argument(metavar="PAIRS.json", callback=given, help="A list of image pairs with true boxes."),
    ],
    runs: Annotated[int, typer.Option(min=2, help="Seeds for the repeatability.")] = 50,
    unrelated: Annotated[int, typer.Option(min=1, help="Pairs of unrelated pictures.")] = 200,
    table: Annotated[bool, typer.Option(help="Also recompute the dissertation's table of settings.")] = True,
    as_json: AsJson = False,
) -> None:
    """Measure partial matching: correspondences, repeatability, evidence, time, and the table of settings."""
    from ..bench import images as measurements
    from ..bench.harness import machine

    loaded = measurements.load(pairs)
    found = measurements.run(loaded, runs=runs, unrelated=unrelated)
    rows = list(measurements.settings_table(loaded)) if table else []
    about = machine(("opencv-python-headless", "scikit-image"))
    if as_json:
        say_json({"machine": about, **found, "settings": rows})
        return
    _show_machine(about)
    show_facts(
        f"Partial matching on {len(loaded)} pairs", {k.replace("_", " "): str(v) for k, v in found.items()}
    )
    if rows:
        show_rows("Mean relevance and false share by setting (Table 6.1)", rows)


def show_rows(title: str, rows: Sequence[dict[str, Any]]) -> None:
    """Show rows of one shape under the names of their keys."""

    def text(value: object) -> str:
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    columns = [name.replace("_", " ") for name in rows[0]]
    show_table(title, columns, [[text(value) for value in row.values()] for row in rows])


def _field_cells(row: dict[str, Any]) -> Sequence[str]:
    name = f"{row['what']}, {row['engine']}"
    if "skipped" in row:
        return (name, f"{row['n']:,}", *[""] * 5, row["skipped"])
    return (
        name,
        f"{row['n']:,}",
        f"{row['seconds']:.2f}",
        f"{row['fastest']:.2f}-{row['slowest']:.2f}" if row["runs"] > 1 and not row["sampled"] else "",
        f"{row['ms_per_source']:.3f}",
        f"{row['peak_mb']:.0f}",
        "" if row["engine"] == "pliant" else f"{row['ratio']:.1f}",
        f"scaled from {row['sampled']} sources" if row["sampled"] else "",
    )


def _levels(text: str) -> tuple[int, ...]:
    try:
        levels = tuple(int(part) for part in text.split(","))
    except ValueError as error:
        message = f"{text!r} is not a list of whole numbers"
        raise typer.BadParameter(message) from error
    if not all(3 <= level <= 8 for level in levels):
        raise typer.BadParameter("levels must be between 3 and 8")
    return levels


def _show_machine(about: dict[str, Any]) -> None:
    versions: Iterable[tuple[str, str]] = about["versions"].items()
    facts = {
        "processor": f"{about['processor']}, {about['cores']} cores",
        "python": about["python"],
        "packages": ", ".join(f"{name} {version}" for name, version in versions),
    }
    show_facts("Machine", facts)
