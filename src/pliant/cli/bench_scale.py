"""``pliant bench cluster`` and ``pliant bench scaling``: more than one process, more than ten thousand vertices."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .bench import AsJson, Repeats, show_rows
from .ending import complain
from .output import say, say_json, show_table


def cluster(
    level: Annotated[int, typer.Option(min=3, max=8, help="Subdivisions: 6 is 41k vertices.")] = 6,
    workers: Annotated[str, typer.Option(metavar="N,N,...", help="Numbers of worker processes.")] = "1,2",
    repeats: Repeats = 3,
    as_json: AsJson = False,
) -> None:
    """Measure the exact field on a local Dask cluster: several worker processes against one."""
    from ..bench import cluster as measurements
    from ..bench.harness import machine

    rows = []
    for row in measurements.run(level=level, workers=_numbers(workers), repeats=repeats):
        rows.append(row)
        complain("done", f"{row['workers']} workers")
    about = machine(("distributed", "numba"))
    if as_json:
        say_json({"machine": about, "rows": rows})
        return
    show_rows("Exact field, whole calls (0 workers: threads of this process)", rows)


def scaling(
    sizes: Annotated[
        str, typer.Option(metavar="N,N,...", help="About how many vertices.")
    ] = "1000,4000,16000,65000,262000,1048000",
    phases: Annotated[
        str, typer.Option(metavar="P,P,...", help="Phases to measure.")
    ] = "hierarchy,field,sampled field,eigenbasis,densities",
    samples: Annotated[int, typer.Option(min=32, help="Sources of the sampled field.")] = 2048,
    jobs: Annotated[int | None, typer.Option(min=1, help="Threads; all cores without it.")] = None,
    subjects: Annotated[int, typer.Option(min=1, help="Subjects of the predicted cohort.")] = 10_000,
    vertices: Annotated[int, typer.Option(min=1000, help="Vertices of each.")] = 149_244,
    as_json: AsJson = False,
) -> None:
    """Measure cost against the number of vertices, fit power laws, and predict a cohort from them."""
    from ..bench import scaling as measurements
    from ..bench.harness import machine

    wanted = phases.split(",")
    unknown = [phase for phase in wanted if phase not in measurements.PHASES]
    if unknown:
        message = f"unknown phases {', '.join(unknown)}; there are {', '.join(measurements.PHASES)}"
        raise typer.BadParameter(message)
    rows = []
    for row in measurements.run(sizes=_numbers(sizes), phases=wanted, samples=samples, n_jobs=jobs):
        rows.append(row)
        complain("done", f"{row['n']:,} vertices in {row['seconds']:.1f} s, {row['peak_mb']:.0f} MB")
    fitted = measurements.laws(rows)
    predicted = measurements.cohort_hours(
        fitted, subjects=subjects, vertices=vertices, workers=(1, 10, 100, 1000)
    )
    about = machine()
    if as_json:
        say_json({"machine": about, "rows": rows, "laws": fitted, "prediction": predicted})
        return
    columns = ("vertices", "phase", "seconds", "processor seconds", "ms / source", "peak MB")
    show_table("Measured", columns, [cells for row in rows for cells in _cells(row)])
    if fitted:
        shown = [
            {k: law[k] for k in ("phase", "unit", "factor", "exponent", "worst_residual")} for law in fitted
        ]
        show_rows("Fitted: factor x vertices ^ exponent", shown)
        show_rows("PREDICTED from the laws, not measured", [_short(row) for row in predicted])
        if predicted[0]["left_out"]:
            say(f"without {', '.join(predicted[0]['left_out'])}: too few sizes for a law")


def cuda_rows(meshes: list[Path] | None, levels: tuple[int, ...], *, as_json: bool) -> None:
    """Write the rows of Fig. 2.10: ``pliant bench field --device cuda``."""
    from ..bench import cuda as measurements
    from ..bench.harness import machine

    rows = []
    for row in measurements.run(tuple(meshes or ()), levels=levels):
        rows.append(row)
        complain("done", f"{row['engine']} on {row['mesh']}")
    about = machine(("numpy", "scipy", "numba", "numba-cuda"))
    if as_json:
        say_json({"machine": about, "rows": rows, "printed": measurements.PRINTED})
        return
    columns = ("mesh", "vertices", "engine", "seconds", "times over Johnson", "")
    show_table("All pairs (Fig. 2.10)", columns, [_cuda_cells(row) for row in rows])
    printed = [
        (what, "", "the dissertation's, GTX 480", "", times, "printed")
        for what, times in measurements.PRINTED.items()
    ]
    show_table("Printed, over Boost's Johnson on an i5-2400", columns, printed)
    reasons = sorted({row["skipped"] for row in rows if row["skipped"]})
    for reason in reasons:
        say(f"not measured: {reason}")


def _cuda_cells(row: dict[str, Any]) -> tuple[str, ...]:
    return (
        row["mesh"],
        f"{row['n']:,}",
        row["engine"],
        "" if row["seconds"] is None else f"{row['seconds']:.2f}",
        "" if row["ratio"] is None else f"{row['ratio']:.1f}",
        "no device" if row["skipped"] else f"scaled from {row['sampled']} sources" if row["sampled"] else "",
    )


def _cells(row: dict[str, Any]) -> list[tuple[str, ...]]:
    return [
        (
            f"{row['n']:,}",
            part["phase"],
            f"{part['seconds']:.2f}",
            f"{part['processor_seconds']:.2f}",
            f"{part['ms_per_source']:.3f}" if "ms_per_source" in part else "",
            f"{part['peak_mb']:.0f}",
        )
        for part in row["phases"]
    ]


def _short(row: dict[str, Any]) -> dict[str, Any]:
    return {name: row[name] for name in ("subjects", "vertices", "workers", "hours")}


def _numbers(text: str) -> tuple[int, ...]:
    try:
        numbers = tuple(int(part) for part in text.split(","))
    except ValueError as error:
        message = f"{text!r} is not a list of whole numbers"
        raise typer.BadParameter(message) from error
    if min(numbers) < 1:
        raise typer.BadParameter("numbers must be positive")
    return numbers
