"""What ``pliant cortex`` writes: tidy tables, arrays, figures and one page."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._tables import table_rows
from ..errors import FileFormatError
from .files import write_figure, write_json, write_rows

if TYPE_CHECKING:
    from ..cortex import CohortResult, GroupComparison, RankAgreement, Variability

_UNITS = {"log": "log geodesic field", "linear": "geodesic field"}


@dataclass(frozen=True, eq=False)
class Findings:
    """All that a run of the command found."""

    cohort: CohortResult
    ranking: Variability
    compared: GroupComparison | None
    # Deviations of other measures at the cohort's sites, and how all of them agree with the field's.
    others: dict[str, list[float]] = field(default_factory=dict)
    agreements: dict[str, RankAgreement] = field(default_factory=dict)

    def facts(self) -> dict[str, str]:
        """Return the most important of it, in words."""
        cohort, stability = self.cohort, self.ranking.rank_stability
        facts = {
            "subjects": f"{len(cohort.subjects)}, {cohort.n_failed} failed",
            "sites": str(len(cohort.sites)),
            "rank stability": "too few subjects" if math.isnan(stability) else f"{stability:.2f}",
        }
        if self.compared is not None:
            count = int((self.compared.q < 0.05).sum())
            facts["groups"] = f"{' and '.join(self.compared.names)}: {count} sites differ (q < 0.05)"
        for name, found in self.agreements.items():
            facts[f"agreement with {name}"] = (
                f"{found.spearman:.2f} ({found.low:.2f} to {found.high:.2f}), p = {found.p:.2g}"
            )
        return facts


def write_all(out: Path, found: Findings, settings: dict[str, Any]) -> list[Path]:
    """Write tables, arrays, figures and the page; the same input gives the same tables and arrays, byte for byte."""
    from .. import save_arrays

    cohort, ranking = found.cohort, found.ranking
    settings = {**settings, "edges": cohort.edges.tolist()}
    write_json(out / "settings.json", settings)
    for name, rows in (("sites.csv", _site_rows(found)), ("subjects.csv", _subject_rows(cohort))):
        write_rows(out / name, list(rows[0]), (row.values() for row in rows))
    arrays = {
        "histograms": cohort.histograms, "edges": cohort.edges, "vertices": cohort.vertices,
        "distances": cohort.distances, "mad": ranking.mad,
    }  # fmt: skip
    save_arrays(out / "cohort.npz", arrays)
    names = ["settings.json", "sites.csv", "subjects.csv", "cohort.npz", *_write_report(out, found, settings)]
    return [out / name for name in names]


def read_deviations(folder: Path) -> dict[str, float]:
    """Read the deviation of every site from a folder that the command wrote."""
    path = folder / "sites.csv"
    rows = table_rows(path)
    if not rows or not {"site", "mad"} <= set(rows[0]):
        message = f"{path}: not a table of sites that pliant cortex wrote"
        raise FileFormatError(message)
    return {row["site"]: float(row["mad"] or "nan") for row in rows}


def _site_rows(found: Findings) -> list[dict[str, object]]:
    ranking, compared = found.ranking, found.compared
    rows: list[dict[str, object]] = []
    for i, site in enumerate(found.cohort.sites):
        kind = "regular" if i in ranking.regular else "variable" if i in ranking.variable else ""
        row: dict[str, object] = {
            "site": site, "class": kind, "subjects": int(ranking.n_subjects[i]), "mad": _cell(ranking.mad[i]),
            "low": _cell(ranking.low[i]), "high": _cell(ranking.high[i]),
            "p_regular": _cell(ranking.p_regular[i]), "p_variable": _cell(ranking.p_variable[i]),
            "regular_frequency": _cell(ranking.regular_frequency[i]),
            "variable_frequency": _cell(ranking.variable_frequency[i]),
        }  # fmt: skip
        row |= {f"mad_{name}": _cell(values[i]) for name, values in found.others.items()}
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


def _write_report(out: Path, found: Findings, settings: dict[str, Any]) -> list[str]:
    """Draw the figures and the page, on the first subject that was measured; return the files' names."""
    from .. import load_mesh
    from ..report import cohort_page, extremes_figure, ranking_figure, sites_figure, write_page

    cohort, ranking = found.cohort, found.ranking
    first = next(i for i, error in enumerate(cohort.errors) if not error)
    name, mesh = cohort.subjects[first].name, load_mesh(cohort.subjects[first].mesh)
    unit = _UNITS[settings["scale"]]
    moved = f" ({unit})" if settings["deviation"] == "cumulative" else ""
    figures = {
        "ranking": ranking_figure(cohort, ranking, label=f"cumulative MAD{moved}"),
        "sites": sites_figure(mesh, cohort.vertices[first], ranking),
        "histograms": extremes_figure(cohort, ranking, label=unit),
    }
    for file, figure in figures.items():
        write_figure(out / f"{file}.png", figure)
    captions = {
        "ranking": "Every site's deviation over the subjects, in ascending order.",
        "sites": f"The sites on subject {name}: regular ones green, variable ones pink.",
        "histograms": "Context histograms of the most extreme sites: a thin line a subject, black their mean.",
    }
    page = cohort_page(
        cohort, ranking, title=f"Folding over {len(cohort.subjects) - cohort.n_failed} subjects",
        figures={captions[file]: figure for file, figure in figures.items()},
        surface=_surface(mesh, found, first), facts=found.facts(), tables=_tables(found), settings=settings,
        notes="How much the geodesic field around each landmark varies over a cohort.",
    )  # fmt: skip
    write_page(out / "report.html", page)
    return [*(f"{file}.png" for file in figures), "report.html"]


def _surface(mesh: Any, found: Findings, first: int) -> str:
    import numpy as np

    from .. import nearest
    from ..report import surface_page

    cohort, ranking = found.cohort, found.ranking
    known = np.flatnonzero(cohort.vertices[first] >= 0)
    deviation, kind = np.full(mesh.n_vertices, np.nan), np.full(mesh.n_vertices, np.nan)
    # Extreme sites are painted last, over neighbours that overlap them.
    extreme = np.isin(known, np.concatenate([ranking.regular, ranking.variable]))
    for site in [*known[~extreme], *known[extreme]]:
        around = nearest(mesh, [int(cohort.vertices[first, site])], count=20)[0]
        deviation[around] = ranking.mad[site]
        kind[around] = 1.0 if site in ranking.variable else -1.0 if site in ranking.regular else 0.0
    layers = {"cumulative MAD": deviation, "-1 regular, 1 variable": kind}
    title = f"Sites on subject {cohort.subjects[first].name}"
    return surface_page(mesh, layers, title=title, notes="Grey is no site.")


def _tables(found: Findings) -> list[Any]:
    from ..report import CohortTable

    tables = []
    if found.agreements:
        rows = [
            (name, f"{a.spearman:.2f}", f"{a.low:.2f} to {a.high:.2f}", f"{a.p:.2g}", f"{a.bottom:.0%}",
             f"{a.top:.0%}", str(a.n_sites))
            for name, a in found.agreements.items()
        ]  # fmt: skip
        columns = ("", "Spearman", "interval", "p", "lowest 5 % shared", "highest 5 % shared", "sites")
        note = (
            "Rank correlation of the field's deviations with those of another measure or run, over the sites."
        )
        tables.append(CohortTable("Agreement with other measures", columns, rows, note))
    if found.compared is not None:
        tables.append(_group_table(found.cohort, found.compared))
    return tables


def _group_table(cohort: CohortResult, compared: GroupComparison) -> Any:
    import numpy as np

    from ..report import CohortTable

    order = np.lexsort((compared.p, compared.q))[:10]
    rows = [
        (cohort.sites[i], f"{compared.distance[i]:.3g}", f"{compared.p[i]:.2g}", f"{compared.q[i]:.2g}")
        for i in order
        if np.isfinite(compared.q[i])
    ]
    note = "The ten sites whose mean histograms differ most; q is the false discovery rate over all sites."
    heading = f"Difference between {' and '.join(compared.names)}"
    return CohortTable(heading, ("site", "distance", "p", "q"), rows, note)
