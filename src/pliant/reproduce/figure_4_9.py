"""Figures 4.7 and 4.9: symmetry detection under noise along the normals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._arrays import FloatArray
from ..evaluate import symmetry_noise
from ..matching.symmetry import Symmetry, detect_symmetries
from ..mesh import Mesh, shapes
from ._animals import mirror_error
from ._plots import lines
from .bench import Bench
from .findings import Experiment, Findings, Row, graded, row_of

SIGMAS = (0.1, 0.2, 0.4, 0.6, 0.8, 1.0)
PLATEAU = 0.0007
_FOUND = 0.05


def _run(bench: Bench) -> Findings:
    n = 2000 if bench.quick else 6000
    sigmas = (0.2, 0.4, 1.0) if bench.quick else SIGMAS
    draws = 1 if bench.quick else 2
    change, error = _measured(n, sigmas, draws, bench.seed)
    right = np.nan_to_num(error, nan=np.inf) < _FOUND
    rows: list[Row] = []
    for i, sigma in enumerate(sigmas):
        known = change[np.isfinite(change[:, i]), i]
        if len(known):
            rows.append(
                row_of(
                    f"sigma {sigma:g}: relative change of the squared map",
                    PLATEAU if sigma > 0.4 else None,
                    known,
                )
            )
        rows.append(
            row_of(f"sigma {sigma:g}: share of shapes whose mirror is found to {_FOUND:g}", 1.0, right[:, i])
        )
    means = [float(np.nanmean(column)) if np.isfinite(column).any() else np.nan for column in change.T]
    curves = {"change of the map": means, "share of mirrors found": right.mean(axis=0)}
    figure_ = lines(
        sigmas,
        curves,
        x_label="sigma, mean edge lengths",
        y_label="relative change; share",
        level=(PLATEAU, "printed plateau"),
    )
    bench.figure(
        figure_, "Change of the mirror's functional map and how often the mirror is found, against the noise"
    )
    at = sigmas.index(0.4) if 0.4 in sigmas else 0
    settles = bool(np.isfinite(means[-1]) and means[-1] < 1.2 * means[at])
    low = bool(np.isfinite(means[-1]) and means[-1] < 2 * PLATEAU)
    steady = bool(right.all())
    last = f"{means[-1]:.2g} at 1" if np.isfinite(means[-1]) else "cannot be told at 1, where none is found"
    return Findings(
        graded(settles and low and steady, settles or low or steady),
        f"The mirror is found in {100 * right.mean():.0f} % of the noisy shapes, "
        f"{100 * right[:, -1].mean():.0f} % at sigma 1. "
        f"The squared entries of its map change by {means[0]:.2g} at sigma {sigmas[0]:g} and {last}: it "
        f"{'settles' if settles else 'does not settle'}, {'near' if low else 'far above'} the printed {PLATEAU:g}, "
        "whose normalisation is not stated (over the number of entries or of points a map's change is "
        "any number of times smaller).",
        f"A synthetic human and quadruped of {n} vertices, {draws} draws; sigma in mean edge lengths (the "
        f"dissertation names "
        "no unit). Intervals over shapes and draws.",
        tuple(rows),
        {"eigenfunctions compared": 20, "samples": 100},
    )


def _measured(n: int, sigmas: Sequence[float], draws: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """(shapes and draws, sigmas) changes of the mirror's map, and its errors; NaN where none is found."""
    changes, errors = [], []
    for figure in (shapes.human(n), shapes.quadruped(n)):
        for draw in range(draws):
            seen: list[float] = []

            def detect(mesh: Mesh) -> Sequence[Symmetry]:
                found = detect_symmetries(mesh, parts=False).symmetries
                seen.append(mirror_error(mesh, figure.symmetry, found))  # noqa: B023 (called within this round)
                return found

            changes.append(symmetry_noise(figure.mesh, detect, sigmas=sigmas, rng=seed + draw))
            errors.append(seen[1:])
    return np.array(changes), np.array(errors)


EXPERIMENT = Experiment(
    "figure-4.9",
    "Symmetry detection under noise",
    "Symmetries are found at all levels of noise; the error of the maps settles near 0.0007 past sigma 0.4.",
    "The mirror is found to .05 on every noisy shape, the change at sigma 1 is below 1.2 times that at 0.4 (settles) "
    "and below 0.0014 (near the level); in part if one of these.",
    _run,
    covers=("figure-4.7",),
)
