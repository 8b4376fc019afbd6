"""What Pliant costs against the number of vertices: hierarchy, field, eigenbasis, densities; a power law; a prediction.

Every size is measured in a process of its own, phase by phase, after a warm-up on a small mesh, with its peak memory.
Processor seconds stand beside elapsed ones: on a machine that others use, they are what can be compared.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from .. import mesh as meshes
from .._arrays import FloatArray
from ..descriptors import bde
from ..geodesic import GeodesicHierarchy, estimate_gfe, gfe
from ..mesh import Mesh, with_noise
from ..spectral import eigenbasis
from .harness import Row, measured, peak_megabytes

__all__ = ["PHASES", "SIZES", "cohort_hours", "laws", "power_law", "run", "surface"]

SIZES = (1_000, 4_000, 16_000, 65_000, 262_000, 1_048_000)
# Phases, what they count in, and the largest size for which each is measured unless asked otherwise.
PHASES = {
    "hierarchy": 2_000_000,
    "field": 70_000,
    "sampled field": 2_000_000,
    "eigenbasis": 2_000_000,
    "densities": 2_000_000,
}
SAMPLES = 2_048
EIGENPAIRS = 100
# Below this size a phase is over before it can be timed; laws are fitted from here on.
FITTED_FROM = 4_000


def run(
    *,
    sizes: Sequence[int] = SIZES,
    phases: Sequence[str] = tuple(PHASES),
    samples: int = SAMPLES,
    n_jobs: int | None = None,
    limit: float = 7200,
) -> Iterator[Row]:
    """Measure each size, smallest first, yielding a row as soon as it is known.

    Parameters
    ----------
    sizes : sequence of int
        About how many vertices the meshes have.
    phases : sequence of str
        Some of ``PHASES``.
    samples : int
        Sources of the sampled field, at most a quarter of the vertices.
    n_jobs : int, optional
        Threads; all processors by default.
    limit : float
        Seconds after which a size is given up.

    Yields
    ------
    dict
        Keys ``n``, ``samples``, ``threads``, ``peak_mb``, ``seconds`` (all phases), ``phases``: a list of rows with
        ``phase``, ``seconds``, ``processor_seconds`` and, for fields, ``ms_per_source``; ``peak_mb`` after each.
    """
    for size in sizes:
        settings = {"size": size, "phases": list(phases), "samples": samples, "n_jobs": n_jobs}
        yield measured(__name__, f"{size} vertices", settings, repeats=1, limit=limit)


def surface(size: int) -> Mesh:
    """Return a torus of about ``size`` vertices, noisy enough that no two paths tie."""
    sides = max(3, round(np.sqrt(size / 2)))
    plain = meshes.shapes.torus(1.0, 0.5, rings=2 * sides, sides=sides)
    return with_noise(plain, 0.1, rng=0)


def power_law(n: Sequence[float], cost: Sequence[float]) -> tuple[float, float, FloatArray]:
    """Fit ``cost = factor * n**exponent`` to logarithms by least squares.

    Returns
    -------
    factor, exponent : float
    residuals : (len(n),) array of float
        Measured over fitted, less 1.
    """
    exponent, logarithm = np.polyfit(np.log(n), np.log(cost), 1)
    fitted = np.exp(logarithm) * np.asarray(n, dtype=np.float64) ** exponent
    return float(np.exp(logarithm)), float(exponent), np.asarray(cost) / fitted - 1


def laws(rows: Sequence[Row], *, least: int = FITTED_FROM) -> list[Row]:
    """Fit a power law to every phase of at least three sizes; rows as :func:`run` yields them."""
    found = []
    for phase in PHASES:
        points = [(row["n"], part) for row in rows for part in row["phases"] if part["phase"] == phase]
        points = [(n, part) for n, part in points if n >= least]
        if len(points) < 3:
            continue
        unit = "ms_per_source" if "ms_per_source" in points[0][1] else "seconds"
        n = [n for n, _ in points]
        factor, exponent, residuals = power_law(n, [part[unit] for _, part in points])
        found.append(
            {
                "phase": phase,
                "unit": unit,
                "factor": factor,
                "exponent": exponent,
                "sizes": n,
                "residuals": residuals.tolist(),
                "worst_residual": float(abs(residuals).max()),
            }
        )
    return found


def cohort_hours(fitted: Sequence[Row], *, subjects: int, vertices: int, workers: Sequence[int]) -> list[Row]:
    """Predict, from the laws, hours of a cohort whose subjects are spread evenly over equal machines.

    Nothing here is measured: it takes machines like the one that the laws were measured on, and no time lost between
    them. A phase without a law is left out and named.
    """
    by_phase = {law["phase"]: law for law in fitted}
    wanted = ("hierarchy", "field", "eigenbasis", "densities")
    missing = [phase for phase in wanted if phase not in by_phase]
    seconds = 0.0
    for phase in wanted:
        if phase in by_phase:
            law = by_phase[phase]
            cost = law["factor"] * vertices ** law["exponent"]
            seconds += cost * vertices / 1e3 if law["unit"] == "ms_per_source" else cost
    return [
        {
            "workers": count,
            "hours": -(-subjects // count) * seconds / 3600,
            "subjects": subjects,
            "vertices": vertices,
            "left_out": missing,
            "prediction": True,
        }
        for count in workers
    ]


def _one(settings: Row) -> Row:
    """Measure one size in this process."""
    _measure({**settings, "size": 600, "samples": 64})
    return _measure(settings)


def _measure(settings: Row) -> Row:
    mesh, jobs = surface(settings["size"]), settings["n_jobs"]
    n = mesh.n_vertices
    samples = max(32, min(settings["samples"], n // 4))
    wanted = [phase for phase in settings["phases"] if n <= PHASES[phase]]
    done: list[Row] = []

    def timed(phase: str, work: Callable[[], Any], sources: int = 0) -> Any:
        start, busy = time.perf_counter(), time.process_time()
        result = work()
        seconds = time.perf_counter() - start
        row = {"phase": phase, "seconds": seconds, "processor_seconds": time.process_time() - busy}
        if sources:
            row["ms_per_source"] = 1e3 * seconds / sources
        done.append({**row, "peak_mb": peak_megabytes()})
        return result

    if {"hierarchy", "field", "sampled field"} & set(wanted):
        solver = timed("hierarchy", lambda: _hierarchy(mesh, jobs))
        if "field" in wanted:
            timed("field", lambda: gfe(mesh, hierarchy=solver, n_jobs=jobs), n)
        if "sampled field" in wanted:
            work = lambda: estimate_gfe(mesh, samples, hierarchy=solver, rng=0, n_jobs=jobs)  # noqa: E731
            timed("sampled field", work, samples)
        del solver
    if {"eigenbasis", "densities"} & set(wanted):
        spectrum = timed("eigenbasis", lambda: eigenbasis(mesh, EIGENPAIRS, n_jobs=jobs))
        if "densities" in wanted:
            timed("densities", lambda: bde(spectrum, n_jobs=jobs))
    seconds = sum(row["seconds"] for row in done)
    return {
        "n": n, "samples": samples, "threads": jobs, "seconds": seconds, "peak_mb": peak_megabytes(), "phases": done,
    }  # fmt: skip


def _hierarchy(mesh: Mesh, n_jobs: int | None) -> GeodesicHierarchy:
    """Order and customise, so that the field's own time is sweeps only."""
    solver = GeodesicHierarchy(mesh)
    solver._counted(n_jobs)
    return solver


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_one(json.loads(sys.argv[2]))) + "\n")
