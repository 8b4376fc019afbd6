"""Figures 4.1, 4.6 and 4.11: the global mirror and overlapping symmetries of legs, and their groups."""

from __future__ import annotations

import numpy as np

from ..matching.symmetry import Symmetry, detect_symmetries
from ..mesh import shapes
from ..mesh.shapes import Figure
from ..report import surface_figure
from ._animals import LEGS, mirror_error, parts_of
from .bench import Bench
from .findings import Experiment, Findings, Row, row_of

PRINTED = 3.0


def _run(bench: Bench) -> Findings:
    animal = shapes.quadruped(3400 if bench.quick else 8000)
    poses = animal.pose_names[: 3 if bench.quick else None]
    mirrors, legs, wrong, groups = [], [], [], []
    for pose in poses:
        posed = animal.posed(pose)
        found = detect_symmetries(posed.mesh, rng=bench.seed).symmetries
        mirrors.append(mirror_error(posed.mesh, posed.symmetry, found))
        pairs = [parts_of(posed, one) for one in found if one.kind == "partial"]
        legs.append(len({pair for pair in pairs if set(pair) <= set(LEGS)}))
        wrong.append(
            sum(
                1
                for one, pair in zip([s for s in found if s.kind == "partial"], pairs, strict=True)
                if not _alike(posed, one, pair)
            )
        )
        groups.append(len({one.group for one in found if one.kind == "partial" and one.group >= 0}))
        if pose == poses[0]:
            _draw(bench, posed, found)
    known = [error for error in mirrors if np.isfinite(error)]
    rows: list[Row] = [
        row_of("pairs of legs found, of 6", PRINTED, legs, note="the dissertation shows three of six"),
        row_of("pairs of regions that are not alike", None, wrong),
        row_of(
            "groups of partial symmetries", 3.0, groups, note="Fig. 4.11 shows three groups of another shape"
        ),
        Row("poses whose mirror is found", None, float(len(known))),
    ]
    if known:
        rows.append(row_of("error of the mirror, mean over the root of the area", None, known))
    enough = float(np.mean(legs)) >= PRINTED and not sum(wrong)
    return Findings(
        "holds" if enough else "holds partly" if float(np.mean(legs)) >= 1 else "does not hold",
        f"On average {np.mean(legs):.1f} of the six pairs of legs are found as symmetries of their own, "
        f"overlapping with the mirror of the whole, which is found in {len(known)} of {len(poses)} poses; "
        f"{sum(wrong)} pairs of regions are not alike.",
        f"A synthetic quadruped of {animal.mesh.n_vertices} vertices in {len(poses)} poses. Intervals over poses.",
        tuple(rows),
        {"samples": 100, "poses": tuple(poses)},
    )


def _alike(figure: Figure, one: Symmetry, pair: tuple[str, str]) -> bool:
    """Legs are alike, and a region is like its own mirror image."""
    if set(pair) <= set(LEGS):
        return True
    image = np.zeros_like(one.source)
    image[figure.symmetry[one.source]] = True
    return bool((image & one.target).sum() > 0.5 * one.target.sum())


def _draw(bench: Bench, figure: Figure, found: tuple[Symmetry, ...]) -> None:
    for i, one in enumerate([s for s in found if s.kind == "partial"][:3], start=1):
        marks = np.full(figure.mesh.n_vertices, np.nan)
        marks[one.target] = 1.0
        marks[one.source] = 0.0
        drawn = surface_figure(
            figure.mesh, marks, views=("left", "front"), up="y", colour_map="plasma",
            colour_bar_label="source 0, target 1",
        )  # fmt: skip
        bench.figure(drawn, f"Partial symmetry {i} of a quadruped at rest: source and target")


EXPERIMENT = Experiment(
    "figure-4.6",
    "Overlapping symmetries of an animal",
    "Voting finds several overlapping symmetries, such as leg to leg, besides the mirror of the whole.",
    "On average three of the six pairs of legs are found and no pair of regions that are not alike.",
    _run,
    covers=("figure-4.1", "figure-4.11"),
)
