"""Time ``eigenbasis`` against the call every other package makes, and show how the mesh Laplacian converges.

Run by hand: ``python benchmarks/spectral.py``. Timings alternate, A B A B, so that whatever else the machine
does falls on both.
"""

from __future__ import annotations

import argparse
import platform
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse.linalg import eigsh
from scipy.spatial import ConvexHull

from pliant import Laplacian, Mesh, eigenbasis, laplacian, shapes
from pliant.mesh import load_mesh

Row = dict[str, Any]


def run(
    sizes: Sequence[int] = (5,), repeats: int = 3, *, k: int = 200, meshes: Sequence[str | Path] = ()
) -> list[Row]:
    """Measure the eigenbasis of bumpy spheres and of mesh files.

    ``sizes`` are subdivisions of the sphere (5: 10,242 vertices, 6: 40,962). A row has the medians of both, in
    seconds, their ratio, and the worst relative residual of either.
    """
    named = [(f"bumpy sphere {s}", shapes.bumpy_sphere(s, rng=0)) for s in sizes]
    named += [(Path(path).stem, load_mesh(path)) for path in meshes]
    return [_compared(name, laplacian(mesh), k, repeats) for name, mesh in named]


def convergence(sizes: Sequence[int] = (500, 1000, 2000, 4000, 8000), *, rng: int = 0) -> list[Row]:
    """Measure L f - 6 f for f = x y on random points of the unit sphere, mean and worst, cotan and mesh kind."""
    rows = []
    for n in sizes:
        points = np.random.default_rng(rng).standard_normal((n, 3))
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        mesh = Mesh(points, ConvexHull(points).simplices)
        f = points[:, 0] * points[:, 1]
        row: Row = {"vertices": n}
        for kind in ("cotan", "mesh"):
            operator = laplacian(mesh, kind)
            error = (operator.stiffness @ f) / operator.mass.diagonal() - 6 * f
            row[f"{kind} rms"] = float(np.sqrt(np.mean(error**2)))
            row[f"{kind} max"] = float(np.abs(error).max())
        rows.append(row)
    return rows


def _compared(name: str, operator: Laplacian, k: int, repeats: int) -> Row:
    def ours() -> tuple[np.ndarray, np.ndarray]:
        spectrum = eigenbasis(operator, k)
        return spectrum.values, spectrum.vectors

    def theirs() -> tuple[np.ndarray, np.ndarray]:
        return eigsh(operator.stiffness, k, operator.mass, sigma=-0.01)

    eigenbasis(operator, 20)  # compiles
    times: dict[str, list[float]] = {"ours": [], "theirs": []}
    residuals: dict[str, float] = {}
    for _ in range(repeats):
        for label, call in (("ours", ours), ("theirs", theirs)):
            seconds, (values, vectors) = _timed(call)
            times[label].append(seconds)
            residuals[label] = _worst_residual(operator, values, vectors)
    ours_s, theirs_s = (float(np.median(times[label])) for label in ("ours", "theirs"))
    return {
        "mesh": name,
        "vertices": operator.n_vertices,
        "k": k,
        "eigenbasis s": ours_s,
        "eigsh s": theirs_s,
        "ratio": theirs_s / ours_s,
        "residual": residuals["ours"],
        "eigsh residual": residuals["theirs"],
    }


def _timed(call: Callable[[], tuple[np.ndarray, np.ndarray]]) -> tuple[float, tuple[np.ndarray, np.ndarray]]:
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def _worst_residual(operator: Laplacian, values: np.ndarray, vectors: np.ndarray) -> float:
    order = np.argsort(values)[1:]
    values, vectors = values[order], vectors[:, order]
    weighed = operator.mass @ vectors
    gap = np.linalg.norm(operator.stiffness @ vectors - weighed * values, axis=0)
    return float((gap / np.abs(values) / np.linalg.norm(weighed, axis=0)).max())


def _table(rows: list[Row]) -> str:
    def text(value: object) -> str:
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    cells = [list(rows[0])] + [[text(value) for value in row.values()] for row in rows]
    widths = [max(len(row[column]) for row in cells) for column in range(len(cells[0]))]
    return "\n".join("  ".join(c.rjust(w) for c, w in zip(row, widths, strict=True)) for row in cells)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("meshes", nargs="*", help="mesh files to measure as well")
    parser.add_argument("--sizes", type=int, nargs="*", default=[5, 6])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--k", type=int, default=200)
    parser.add_argument("--convergence", action="store_true")
    options = parser.parse_args()
    print(platform.processor() or platform.machine(), platform.python_version(), f"numpy {np.__version__}")
    print(_table(run(options.sizes, options.repeats, k=options.k, meshes=options.meshes)))
    if options.convergence:
        print(_table(convergence()))


if __name__ == "__main__":
    main()
