"""Figure 2.7: a cylinder that a spin transformation bends, and the field on it."""

from __future__ import annotations

import numpy as np

from ..cortex import conformal_cylinder
from ..geodesic import gfe
from ..mesh import quasi_conformal_error
from ..report import surface_figure
from ._cylinders import LEVELS
from .bench import Bench
from .findings import Experiment, Findings, Row, row_of


def _run(bench: Bench) -> Findings:
    rows: list[Row] = []
    errors = {}
    for sides in (24, 48) if bench.quick else (24, 48, 96):
        plain, bent = (
            conformal_cylinder(level, sides=sides, rng=bench.seed).mesh for level in (1, LEVELS[-1])
        )
        errors[sides] = float(quasi_conformal_error(plain, bent).mean()) - 1
        rows.append(
            Row(
                f"mean quasi-conformal error at level 6, less 1, {sides} vertices around", None, errors[sides]
            )
        )
    least, most = min(errors), max(errors)
    rate = float(np.log(errors[least] / errors[most]) / np.log(most / least))
    rows.append(Row("rate at which it falls with the edge length", None, rate))
    levels = [conformal_cylinder(level, sides=32, rng=bench.seed) for level in LEVELS]
    fields = [gfe(level.mesh) for level in levels]
    bump = levels[0].density > np.quantile(levels[0].density, 0.9)
    rows += [
        row_of(
            f"level {level}: mean field on the bump over that elsewhere",
            None,
            [field[bump].mean() / field[~bump].mean()],
        )
        for level, field in zip(LEVELS, fields, strict=True)
    ]
    for i in (0, -1):
        drawn = surface_figure(
            levels[i].mesh, fields[i], views=("front", "left"), colour_bar_label="GFE (per unit area)"
        )
        bench.figure(drawn, f"The field on level {levels[i].level} of the cylinder")
    bench.surface(levels[-1].mesh, {"GFE (per unit area)": fields[-1]}, "Level 6 of the cylinder")
    falls = (rows[-1].ours or 0) < (rows[-len(LEVELS)].ours or 0)
    return Findings(
        "holds" if rate > 0.8 and falls else "holds partly" if rate > 0.8 or falls else "does not hold",
        f"The deformation keeps angles to {errors[most]:.3f} at {most} vertices around, and the "
        f"error falls with power {rate:.1f} of the edge length. The field on the growing bump falls from "
        f"{rows[-len(LEVELS)].ours:.2f} to {rows[-1].ours:.2f} of that elsewhere"
        f"{': paths go around it' if falls else ''}.",
        "Irregular cylinders; the dissertation prints no strength of its six levels.",
        tuple(rows),
        {"levels": 6},
    )


EXPERIMENT = Experiment(
    "figure-2.7",
    "Six levels of conformal deformation",
    "A spin transformation bends a cylinder conformally; the field shows where.",
    "The quasi-conformal error falls with the resolution, and the field on the bump falls with its size.",
    _run,
)
