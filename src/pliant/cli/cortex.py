"""``pliant cortex``: regularity and variability of folding at landmarks, over a cohort."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from .output import say, say_json, show_facts, show_table

if TYPE_CHECKING:
    from ..cortex import CohortResult, ContextSignature, GroupComparison, Variability

_GREEN, _PINK = "#2e8b57", "#d6336c"

Table = Annotated[
    Path,
    typer.Argument(metavar="COHORT", help="A CSV with columns subject, mesh, and perhaps group, landmarks."),
]
Out = Annotated[
    Path, typer.Option("--out", "-o", metavar="DIR", help="Folder for results; a run resumes there.")
]
LandmarkFile = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Landmarks of all subjects: .csv, .annot or .annot.gz.")
]
Count = Annotated[
    int | None, typer.Option(min=1, help="Vertices a neighbourhood; 50 without it or --radius.")
]
Radius = Annotated[float | None, typer.Option(help="Radius of a neighbourhood instead, in the meshes' unit.")]
Bins = Annotated[int, typer.Option(min=2, help="Bins a histogram.")]
Scale = Annotated[Literal["linear", "log"], typer.Option(help="Bins over the field or its logarithm.")]
Graph = Annotated[
    Literal["edges", "refined"], typer.Option(help="Paths along edges, or across pairs of triangles too.")
]
Smoothing = Annotated[int, typer.Option(min=0, help="Rounds of smoothing before paths are measured.")]
Resamples = Annotated[int, typer.Option(min=1, help="Bootstrap cohorts and permutations.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the resampling.")]
Jobs = Annotated[int | None, typer.Option(min=1, help="Processes; all cores without it.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]


def cortex(
    cohort: Table,
    out: Out,
    landmarks: LandmarkFile = None,
    count: Count = None,
    radius: Radius = None,
    bins: Bins = 10,
    scale: Scale = "linear",
    graph: Graph = "edges",
    smoothing: Smoothing = 0,
    resamples: Resamples = 1000,
    seed: Seed = 0,
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Rank landmarks by how much the folding around them varies over a cohort."""
    from ..cortex import ContextSignature, compare_groups, read_cohort, study_cohort, variability

    signature = ContextSignature(
        count=count, radius=radius, bins=bins, scale=scale, graph=graph, smoothing=smoothing
    )
    subjects = read_cohort(cohort)
    found = study_cohort(
        subjects, out, landmarks=landmarks, signature=signature, n_jobs=jobs, progress=not as_json
    )
    ranking = variability(found.histograms, resamples=resamples, rng=seed)
    whole = [i for i, error in enumerate(found.errors) if not error]
    groups = [subjects[i].group for i in whole]
    compared = None
    if min((groups.count(name) for name in set(groups)), default=0) >= 2 and len(set(groups)) == 2:
        compared = compare_groups(found.histograms[whole], groups, permutations=resamples, rng=seed)
    written = _write(out, found, ranking, compared, _settings(signature, resamples, seed))
    summary = _summary(found, ranking, compared)
    if as_json:
        say_json({**summary, "written": [str(path) for path in written]})
        return
    _show(found, ranking, summary)
    for path in written:
        say(f"wrote {path}")


def _settings(signature: ContextSignature, resamples: int, seed: int) -> dict[str, Any]:
    from dataclasses import asdict

    from .. import __version__

    chosen = {key: value for key, value in asdict(signature).items() if value is not None}
    if signature.radius is None:
        chosen["count"] = signature.count or 50
    return {**chosen, "resamples": resamples, "seed": seed, "pliant": __version__}


def _summary(found: CohortResult, ranking: Variability, compared: GroupComparison | None) -> dict[str, Any]:
    import math

    summary: dict[str, Any] = {
        "subjects": len(found.subjects),
        "failed": {s.name: e for s, e in zip(found.subjects, found.errors, strict=True) if e},
        "sites": len(found.sites),
        "rank_stability": None if math.isnan(ranking.rank_stability) else ranking.rank_stability,
        "regular": [found.sites[i] for i in ranking.regular],
        "variable": [found.sites[i] for i in ranking.variable],
    }
    if compared is not None:
        summary["groups"] = list(compared.names)
        summary["differing"] = [site for site, q in zip(found.sites, compared.q, strict=True) if q < 0.05]
    return summary


def _show(found: CohortResult, ranking: Variability, summary: dict[str, Any]) -> None:
    stability = summary["rank_stability"]
    facts = {
        "subjects": f"{summary['subjects']}, {found.n_failed} failed",
        "sites": str(summary["sites"]),
        "rank stability": "too few subjects" if stability is None else f"{stability:.2f}",
    }
    if "groups" in summary:
        facts["groups"] = (
            f"{' and '.join(summary['groups'])}: {len(summary['differing'])} sites differ (q < 0.05)"
        )
    show_facts("Cohort", facts)
    rows = [
        (found.sites[i], kind, f"{ranking.mad[i]:.3f}", f"{ranking.low[i]:.3f} to {ranking.high[i]:.3f}")
        for kind, sites in (("regular", ranking.regular), ("variable", ranking.variable))
        for i in sites
    ]
    show_table("Extreme sites", ("site", "", "MAD", "95 % interval"), rows)
    for name, error in summary["failed"].items():
        say(f"failed: {name}: {error}")


def _write(
    out: Path,
    found: CohortResult,
    ranking: Variability,
    compared: GroupComparison | None,
    settings: dict[str, Any],
) -> list[Path]:
    """Write tables, arrays, figures and the page; the same input gives the same tables and arrays, byte for byte."""
    from .. import save_arrays

    settings = {**settings, "edges": found.edges.tolist()}
    _write_text(out / "settings.json", json.dumps(settings, indent=2) + "\n")
    _write_rows(out / "sites.csv", _site_rows(found, ranking, compared))
    _write_rows(out / "subjects.csv", _subject_rows(found))
    arrays = {
        "histograms": found.histograms, "edges": found.edges, "vertices": found.vertices,
        "distances": found.distances, "mad": ranking.mad,
    }  # fmt: skip
    save_arrays(out / "cohort.npz", arrays)
    _ranking_figure(found, ranking).savefig(out / "ranking.png")
    names = ["settings.json", "sites.csv", "subjects.csv", "cohort.npz", "ranking.png"]
    return [out / name for name in [*names, *_write_surface(out, found, ranking, settings)]]


def _site_rows(
    found: CohortResult, ranking: Variability, compared: GroupComparison | None
) -> list[dict[str, object]]:
    rows: list[dict[str, object]] = []
    for i, site in enumerate(found.sites):
        kind = "regular" if i in ranking.regular else "variable" if i in ranking.variable else ""
        row: dict[str, object] = {
            "site": site, "class": kind, "subjects": int(ranking.n_subjects[i]), "mad": _cell(ranking.mad[i]),
            "low": _cell(ranking.low[i]), "high": _cell(ranking.high[i]),
            "p_regular": _cell(ranking.p_regular[i]), "p_variable": _cell(ranking.p_variable[i]),
            "regular_frequency": _cell(ranking.regular_frequency[i]),
            "variable_frequency": _cell(ranking.variable_frequency[i]),
        }  # fmt: skip
        if compared is not None:
            row |= {"group_distance": _cell(compared.distance[i])}
            row |= {"group_p": _cell(compared.p[i]), "group_q": _cell(compared.q[i])}
        rows.append(row)
    return rows


def _subject_rows(found: CohortResult) -> list[dict[str, object]]:
    rows: list[dict[str, object]] = []
    for subject, error, vertices, distances in zip(
        found.subjects, found.errors, found.vertices, found.distances, strict=True
    ):
        snapped = max((float(d) for d in distances if d == d), default=float("nan"))
        rows.append(
            {
                "subject": subject.name,
                "group": subject.group,
                "sites": int((vertices >= 0).sum()),
                "largest_snap": _cell(snapped),
                "error": error,
            }
        )
    return rows


def _cell(value: float) -> str:
    """Write a number; nothing where there is none."""
    return "" if value != value else f"{float(value):.6g}"


def _write_rows(path: Path, rows: list[dict[str, object]]) -> None:
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    _write_text(path, text.getvalue())


def _write_text(path: Path, text: str) -> None:
    from ..mesh.formats import write_atomically

    write_atomically(path, text.encode())


def _ranking_figure(found: CohortResult, ranking: Variability) -> Any:
    """Draw the sites' deviations in ascending order with their intervals, and the histograms of the two extremes."""
    import numpy as np
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), dpi=150, layout="constrained")
    curve, regular, variable = figure.subplots(1, 3, width_ratios=(2, 1, 1))
    order = np.argsort(ranking.mad)[: int(np.isfinite(ranking.mad).sum())]
    place = np.arange(len(order))
    curve.fill_between(
        place, ranking.low[order], ranking.high[order], color="#c9d3dd", lw=0, label="95 % interval"
    )
    curve.plot(place, ranking.mad[order], color="#2a6f97", lw=1.2)
    for sites, colour, label in ((ranking.regular, _GREEN, "regular"), (ranking.variable, _PINK, "variable")):
        inside = np.isin(order, sites)
        curve.scatter(place[inside], ranking.mad[order][inside], s=12, color=colour, label=label, zorder=3)
    curve.set(title="Variability of the sites", xlabel="rank", ylabel="cumulative MAD")
    curve.legend(frameon=False, fontsize=8)
    for axes, sites, colour in ((regular, ranking.regular, _GREEN), (variable, ranking.variable, _PINK)):
        axes.stairs(np.nanmean(found.histograms[:, sites[0]], axis=0), found.edges, color="black", lw=1.4)
        for row in found.histograms[:, sites[0]]:
            axes.stairs(row, found.edges, color=colour, alpha=0.35, lw=0.7)
        axes.set(title=f"site {found.sites[sites[0]]}", xlabel="field", ylim=(0, None))
        axes.tick_params(labelsize=7)
    return figure


def _write_surface(
    out: Path, found: CohortResult, ranking: Variability, settings: dict[str, Any]
) -> list[str]:
    """Draw the sites on the first subject that was measured; return the files' names."""
    import numpy as np

    from .. import load_mesh, nearest
    from ..report import surface_figure, surface_page, write_page

    first = next(i for i, error in enumerate(found.errors) if not error)
    mesh = load_mesh(found.subjects[first].mesh)
    known = np.flatnonzero(found.vertices[first] >= 0)
    deviation, kind = np.full(mesh.n_vertices, np.nan), np.full(mesh.n_vertices, np.nan)
    # Extreme sites are painted last, over neighbours that overlap them.
    extreme = np.isin(known, np.concatenate([ranking.regular, ranking.variable]))
    for site in [*known[~extreme], *known[extreme]]:
        around = nearest(mesh, [int(found.vertices[first, site])], count=20)[0]
        deviation[around] = ranking.mad[site]
        kind[around] = 1.0 if site in ranking.variable else -1.0 if site in ranking.regular else 0.0
    layers = {"cumulative MAD": deviation, "-1 regular, 1 variable": kind}
    title = f"Variability over {len(found.subjects) - found.n_failed} subjects"
    notes = f"Sites on subject {found.subjects[first].name}; grey is no site."
    write_page(out / "report.html", surface_page(mesh, layers, title=title, notes=notes, settings=settings))
    surface_figure(mesh, deviation, title=title, colour_bar_label="cumulative MAD").savefig(out / "sites.png")
    return ["sites.png", "report.html"]
