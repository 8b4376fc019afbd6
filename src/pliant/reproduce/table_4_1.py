"""Table 4.1: how long symmetry detection takes."""

from __future__ import annotations

import time

from ..matching.symmetry import detect_symmetries
from ..mesh import Mesh, load_mesh, shapes
from .bench import Bench
from .findings import Experiment, Findings, row_of

PRINTED = {3_400: 39.0, 10_000: 51.0, 50_000: 256.0}
_TOSCA = {3_400: "wolf0", 10_000: "horse0", 50_000: "victoria0"}


def _run(bench: Bench) -> Findings:
    rows = []
    for size in list(PRINTED)[: 2 if bench.quick else 3]:
        name, mesh = _mesh(bench, size)
        seconds = [_seconds(mesh) for _ in range(1 if bench.quick else 3)]
        rows.append(
            row_of(
                f"{size} vertices, processor seconds",
                PRINTED[size],
                seconds,
                note=f"{name}, {mesh.n_vertices} vertices",
            )
        )
    faster = [row.ours is not None and row.printed is not None and row.ours <= row.printed for row in rows]
    return Findings(
        "holds" if all(faster) else "holds partly" if any(faster) else "does not hold",
        f"From the mesh to all symmetries, eigenbasis included, processor time with threads added up: "
        f"{rows[0].ours:.1f} s for the smallest and "
        f"{rows[-1].ours:.1f} s for the largest measured, {PRINTED[3_400]:.0f} and {rows[-1].printed:.0f} s "
        "printed (on a machine of 2013).",
        "One shape a size, TOSCA's where the data are there and synthetic animals otherwise. Intervals over runs.",
        tuple(rows),
        {"samples": 100},
    )


def _mesh(bench: Bench, size: int) -> tuple[str, Mesh]:
    folder = bench.path("shapes/tosca")
    if folder is None or bench.quick:
        return "quadruped", shapes.quadruped(size).mesh
    return _TOSCA[size], load_mesh(folder / f"{_TOSCA[size]}.ply")


def _seconds(mesh: Mesh) -> float:
    start = time.process_time()
    detect_symmetries(mesh, rng=0)
    return time.process_time() - start


EXPERIMENT = Experiment(
    "table-4.1",
    "Time of symmetry detection",
    "39, 51 and 256 seconds for 3,400, 10,000 and 50,000 vertices.",
    "Ours takes no longer at any size.",
    _run,
    uses=("shapes/tosca",),
)
