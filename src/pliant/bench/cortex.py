"""Cohorts with a truth: how well statistics of folding rank sites by it, and what a whole study costs.

pliant bench cortex --seeds 10,11,12 --spread logistic
"""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from .._arrays import FloatArray
from ..cortex import (
    ContextSignature,
    SyntheticCohort,
    mean_absolute_deviation,
    rank_agreement,
    read_cohort,
    study_cohort,
    synthetic_cohort,
)
from ..cortex.synthetic import Spread
from ..geodesic import nearest
from ..mesh import Mesh, principal_curvatures

__all__ = ["SETTINGS", "run", "study_cost"]

RADIUS = 8.0
_WIDE = ContextSignature(radius=RADIUS, bins=30, percentile=99.9)
# Name -> settings, whether the field is the geodesic one (or mean curvature), whether deviations are cumulative.
SETTINGS: dict[str, tuple[ContextSignature, bool, bool]] = {
    "GCH as printed: n = 50, 10 linear bins": (ContextSignature(), True, False),
    "GCH, 8 mm, 10 logarithmic bins": (ContextSignature(radius=RADIUS, scale="log"), True, False),
    "GCH, 8 mm, logarithmic, cumulative": (replace(_WIDE, scale="log"), True, True),
    "mean curvature, 8 mm, 10 bins": (ContextSignature(radius=RADIUS), False, False),
    "mean curvature, 8 mm, cumulative": (_WIDE, False, True),
}
CEILING = "ceiling: the displacements themselves"


def run(
    seeds: Sequence[int],
    *,
    subjects: int = 31,
    sites: int = 120,
    spread: Spread = "logistic",
    shared: float = 0.0,
    sliding: float = 0.5,
) -> Iterator[dict[str, Any]]:
    """Yield one row a seed and statistic: rank correlation with the true amplitude, and the extremes it finds.

    Parameters
    ----------
    seeds : sequence of int
        One cohort each.
    subjects, sites, spread, shared, sliding
        Of the cohorts, see :func:`pliant.cortex.synthetic_cohort`.

    Yields
    ------
    dict
        ``spearman`` with its bootstrap interval over sites; ``bottom`` and ``top``, the shares of the lowest and
        highest 5 % that are right. The ceiling is what the displacements themselves say within the same radius: no
        statistic of so many subjects can be expected to do better.
    """
    if spread not in get_args(Spread):
        synthetic_cohort(1, spread=spread)  # says which there are
    for seed in seeds:
        cohort = synthetic_cohort(
            subjects, n_sites=sites, spread=spread, shared=shared, sliding=sliding, rng=seed
        )
        for name, deviation in _deviations(cohort).items():
            found = rank_agreement(deviation, cohort.truth, rng=0, resamples=500)
            yield {
                "spread": spread,
                "shared": shared,
                "sliding": sliding,
                "seed": seed,
                "statistic": name,
                "spearman": found.spearman,
                "low": found.low,
                "high": found.high,
                "bottom": found.bottom,
                "top": found.top,
            }


def study_cost(subjects: int = 31, *, sites: int = 120, n_jobs: int | None = None) -> dict[str, Any]:
    """Measure a whole study of so many hemispheres of 10,242 vertices, from files to the last histogram.

    Returns
    -------
    dict
        ``seconds`` as the clock has it and ``processor_seconds`` of all processes together, compiling not counted.
    """
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        people = read_cohort(synthetic_cohort(subjects, n_sites=sites, rng=0).save(folder))
        signature = SETTINGS["GCH, 8 mm, logarithmic, cumulative"][0]
        given: dict[str, Any] = {
            "landmarks": folder / "landmarks.csv",
            "signature": signature,
            "n_jobs": n_jobs,
        }
        study_cohort(people[:1], folder / "first", **given)
        began, spent = time.perf_counter(), _processor_seconds()
        study_cohort(people, folder / "all", **given)
        return {
            "subjects": subjects,
            "seconds": time.perf_counter() - began,
            "processor_seconds": _processor_seconds() - spent,
        }


def _processor_seconds() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _deviations(cohort: SyntheticCohort) -> dict[str, FloatArray]:
    meshes = [cohort.subject(i) for i in range(len(cohort))]
    traffic = [ContextSignature().field(mesh) for mesh in meshes]
    bent = [np.nan_to_num(principal_curvatures(mesh).mean) for mesh in meshes]
    found = {}
    for name, (setting, geodesic, cumulative) in SETTINGS.items():
        fields = traffic if geodesic else bent
        if setting.scale == "log":
            fields = [setting.logarithm(field) for field in fields]
        common = setting.with_edges_of(*fields)
        pairs = zip(meshes, fields, strict=True)
        histograms = [common.histograms(mesh, field, cohort.sites) for mesh, field in pairs]
        found[name] = mean_absolute_deviation(histograms, edges=common.edges if cumulative else None)
    return {**found, CEILING: _ceiling(cohort, meshes)}


def _ceiling(cohort: SyntheticCohort, meshes: Sequence[Mesh]) -> FloatArray:
    """Root mean square displacement from the cohort's mean surface around each site."""
    places = np.stack([mesh.vertices for mesh in meshes])
    squares = ((places - places.mean(axis=0)) ** 2).sum(axis=2).mean(axis=0)
    around = nearest(cohort.base, cohort.sites, radius=RADIUS)
    sizes = np.diff(around.offsets)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    means: FloatArray = np.bincount(owner, squares[around.vertices]) / sizes
    return np.sqrt(means)
