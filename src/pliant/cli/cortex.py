"""``pliant cortex``: regularity and variability of folding at landmarks, over a cohort."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from .output import ResultsFolder, given, say, say_json, show_facts, show_table
from .workers import Scheduler, workers

if TYPE_CHECKING:
    from ..cortex import ContextSignature
    from .cohort_files import Findings

Table = Annotated[
    Path,
    typer.Argument(
        metavar="COHORT",
        callback=given,
        help="A CSV with columns subject, mesh, and perhaps group, landmarks, map_NAME; or a folder of FreeSurfer's "
        "or BIDS derivatives.",
    ),
]
LandmarkFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        callback=given,
        help="Landmarks of all subjects: .csv, .annot, .annot.gz or .label.gii.",
    ),
]
Surface = Annotated[str, typer.Option(help="Which surface of a folder.")]
Side = Annotated[Literal["left", "right"], typer.Option(help="Which hemisphere of a folder.")]
Annotation = Annotated[
    str | None, typer.Option(metavar="NAME", help="FreeSurfer parcellation whose parcels are the landmarks.")
]
Count = Annotated[
    int | None, typer.Option(min=1, help="Vertices a neighbourhood; 50 without it or --radius.")
]
Radius = Annotated[float | None, typer.Option(help="Radius of a neighbourhood instead, in the meshes' unit.")]
Bins = Annotated[int, typer.Option(min=2, help="Bins a histogram.")]
Scale = Annotated[Literal["linear", "log"], typer.Option(help="Bins over the field or its logarithm.")]
Deviation = Annotated[
    Literal["cumulative", "bins"],
    typer.Option(help="Compare cumulative histograms, which do not saturate, or sum over bins."),
]
Graph = Annotated[
    Literal["edges", "refined"], typer.Option(help="Paths along edges, or across pairs of triangles too.")
]
Smoothing = Annotated[int, typer.Option(min=0, help="Rounds of smoothing before paths are measured.")]
Samples = Annotated[
    int | None, typer.Option(min=32, help="On larger meshes, estimate the field from so many sources.")
]
Against = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME", help="Also rank by curvature, or by a map of the subjects, such as sulc."),
]
Beside = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="DIR", callback=given, help="Results to agree with, site by site: the other hemisphere's."
    ),
]
Resamples = Annotated[int, typer.Option(min=1, help="Bootstrap cohorts and permutations.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the resampling.")]
Jobs = Annotated[int | None, typer.Option(min=1, help="Processes; all cores without it.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON to standard output, and nothing else.")]


def cortex(
    cohort: Table,
    out: ResultsFolder,
    landmarks: LandmarkFile = None,
    surface: Surface = "white",
    hemisphere: Side = "left",
    annotation: Annotation = None,
    count: Count = None,
    radius: Radius = None,
    bins: Bins = 30,
    scale: Scale = "log",
    deviation: Deviation = "cumulative",
    graph: Graph = "edges",
    smoothing: Smoothing = 0,
    samples: Samples = None,
    against: Against = None,
    beside: Beside = None,
    resamples: Resamples = 1000,
    seed: Seed = 0,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Rank landmarks by how much the folding around them varies over a cohort.

    The dissertation's settings are --scale linear --bins 10 --deviation bins.
    """
    from ..cortex import ContextSignature, read_cohort
    from .cohort_files import read_deviations, write_all

    for folder in beside or []:
        read_deviations(folder)  # refused before hours of measuring, not after them

    signature = ContextSignature(
        count=count, radius=radius, bins=bins, scale=scale, graph=graph, smoothing=smoothing, samples=samples,
        percentile=99.9 if deviation == "cumulative" else 98.0,
    )  # fmt: skip
    subjects = read_cohort(cohort, surface=surface, hemisphere=hemisphere, annotation=annotation)
    with workers(scheduler) as where:
        study = _Study(
            subjects, out,
            {"landmarks": landmarks, "n_jobs": jobs, "scheduler": where.client, "progress": not as_json},
            cumulative=deviation == "cumulative", resamples=resamples, seed=seed,
        )  # fmt: skip
        found = study.findings(signature, against or [], beside or [])
    settings = _settings(signature, deviation, resamples, seed)
    written = write_all(out, found, settings)
    summary = {**_summary(found), **where.record()}
    if as_json:
        say_json({**summary, "written": [str(path) for path in written]})
        return
    _show(found, summary, where.facts())
    for path in written:
        say(f"wrote {path}")


class _Study:
    """What all rankings of one cohort share."""

    def __init__(
        self,
        subjects: Any,
        out: Path,
        options: dict[str, Any],
        *,
        cumulative: bool,
        resamples: int,
        seed: int,
    ) -> None:
        self.subjects, self.out, self.options = subjects, out, options
        self.cumulative, self.resamples, self.seed = cumulative, resamples, seed

    def findings(self, signature: ContextSignature, against: list[str], beside: list[Path]) -> Findings:
        from dataclasses import replace

        from ..cortex import rank_agreement
        from .cohort_files import Findings, read_deviations

        cohort, ranking = self._ranked(signature, None, self.out)
        others = {}
        for name in against:
            # Curvature and depth have both signs: no logarithm.
            plain = replace(signature, scale="linear")
            other, deviations = self._ranked(plain, name, self.out / "against" / name)
            by_site = dict(zip(other.sites, deviations.mad.tolist(), strict=True))
            others[name] = [by_site.get(site, math.nan) for site in cohort.sites]
        for folder in beside:
            known = read_deviations(folder)
            others[str(folder)] = [known.get(site, math.nan) for site in cohort.sites]
        agreements = {
            name: rank_agreement(ranking.mad, values, resamples=self.resamples, rng=self.seed)
            for name, values in others.items()
        }
        mine = {name: values for name, values in others.items() if name in against}
        return Findings(cohort, ranking, self._compared(cohort), mine, agreements)

    def _ranked(self, signature: ContextSignature, measure: str | None, folder: Path) -> Any:
        from ..cortex import study_cohort, variability

        found = study_cohort(self.subjects, folder, signature=signature, measure=measure, **self.options)
        edges = found.edges if self.cumulative else None
        return found, variability(found.histograms, edges=edges, resamples=self.resamples, rng=self.seed)

    def _compared(self, found: Any) -> Any:
        """Compare the groups, where there are two with two subjects each."""
        from ..cortex import compare_groups

        whole = [i for i, error in enumerate(found.errors) if not error and self.subjects[i].group]
        groups = [self.subjects[i].group for i in whole]
        if len(set(groups)) != 2 or min(groups.count(name) for name in set(groups)) < 2:
            return None
        return compare_groups(found.histograms[whole], groups, permutations=self.resamples, rng=self.seed)


def _settings(signature: ContextSignature, deviation: str, resamples: int, seed: int) -> dict[str, Any]:
    from dataclasses import asdict

    from .. import __version__

    chosen = {key: value for key, value in asdict(signature).items() if value is not None}
    if signature.radius is None:
        chosen["count"] = signature.count or 50
    return {**chosen, "deviation": deviation, "resamples": resamples, "seed": seed, "pliant": __version__}


def _summary(found: Findings) -> dict[str, Any]:
    cohort, ranking = found.cohort, found.ranking
    summary: dict[str, Any] = {
        "subjects": len(cohort.subjects),
        "failed": {s.name: e for s, e in zip(cohort.subjects, cohort.errors, strict=True) if e},
        "sites": len(cohort.sites),
        "rank_stability": None if math.isnan(ranking.rank_stability) else ranking.rank_stability,
        "regular": [cohort.sites[i] for i in ranking.regular],
        "variable": [cohort.sites[i] for i in ranking.variable],
        "agreement": {
            name: {"spearman": a.spearman, "low": a.low, "high": a.high, "p": a.p, "sites": a.n_sites}
            for name, a in found.agreements.items()
        },
    }
    if found.compared is not None:
        summary["groups"] = list(found.compared.names)
        summary["differing"] = [
            site for site, q in zip(cohort.sites, found.compared.q, strict=True) if q < 0.05
        ]
    return summary


def _show(found: Findings, summary: dict[str, Any], where: dict[str, str]) -> None:
    show_facts("Cohort", {**found.facts(), **where})
    cohort, ranking = found.cohort, found.ranking
    rows = [
        (cohort.sites[i], kind, f"{ranking.mad[i]:.3g}", f"{ranking.low[i]:.3g} to {ranking.high[i]:.3g}")
        for kind, sites in (("regular", ranking.regular), ("variable", ranking.variable))
        for i in sites
    ]
    show_table("Extreme sites", ("site", "", "MAD", "95 % interval"), rows)
    for name, error in summary["failed"].items():
        say(f"failed: {name}: {error}")
