"""Figures 3.5b and 3.7: hit rates between poses."""

from __future__ import annotations

import numpy as np

from ..bench.descriptors import Pair, poses
from ..mesh import shapes
from ._hits import FRACTIONS, NAMES, hit_rates
from ._plots import lines
from .bench import Bench
from .findings import Experiment, Findings, Row, row_of

_OTHERWISE = (
    "The printed form (a mean of the kernel over a ball) is not above WKS; Pliant's default is the growth of the "
    "balls' areas and means."
)


def _run(bench: Bench) -> Findings:
    pairs, said = _pairs(bench)
    tables = hit_rates(bench, pairs)
    rows: list[Row] = [
        row_of(f"{name}: hit rate at {100 * fraction:g} %", None, tables[name][:, i])
        for name in NAMES
        for i, fraction in enumerate(FRACTIONS[:2])
    ]
    means = {name: tables[name].mean(axis=0) for name in NAMES}
    printed, default = means["BDE as printed, simple"], means["BDE, Pliant's default"]
    others = np.maximum(means["HKS"], means["WKS"])
    figure = lines(
        [100 * fraction for fraction in FRACTIONS],
        means,
        x_label="nearest share of the vertices, %",
        y_label="hit rate",
        log_x=True,
    )
    bench.figure(figure, "Hit rate between poses by signature, mean over pairs")
    holds = bool((printed > others).all())
    return Findings(
        "holds" if holds else "holds partly" if bool((default > others).all()) else "does not hold",
        f"At 0.1 %: WKS {means['WKS'][0]:.2f}, HKS {means['HKS'][0]:.2f}, the density as printed "
        f"{printed[0]:.2f}, as Pliant reads it {default[0]:.2f}. "
        + ("The printed form is above both." if holds else _OTHERWISE),
        f"{said} Random points; intervals over pairs.",
        tuple(rows),
        {"eigenpairs": 200, "points": 300, "pairs": len(pairs)},
    )


def _pairs(bench: Bench) -> tuple[list[Pair], str]:
    folder = bench.path("shapes")
    if folder is not None and not bench.quick:
        return poses(folder), "Eight pairs of TOSCA poses."
    n = 3000 if bench.quick else 8000
    found = []
    for figure, names in ((shapes.human(n), ("walk", "wave")), (shapes.quadruped(n), ("gallop", "graze"))):
        found += [(figure.mesh, figure.posed(name).mesh, np.arange(figure.mesh.n_vertices)) for name in names]
    return found, f"Synthetic human and quadruped of {n} vertices, two poses each."


EXPERIMENT = Experiment(
    "figure-3.7",
    "Hit rates between poses",
    "BDE is above HKS and WKS on TOSCA; simple averaging is above Gaussian.",
    "The printed form is above both at every share of the vertices; in part if only Pliant's reading of it is.",
    _run,
    uses=("shapes/tosca",),
)
