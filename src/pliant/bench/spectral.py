"""``eigenbasis`` against the call every other package makes, and how the mesh Laplacian converges.

Timings alternate, A B A B, so that whatever else the machine does falls on both.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.sparse.linalg import eigsh
from scipy.spatial import ConvexHull

from .._arrays import FloatArray
from ..mesh import Mesh, load_mesh, shapes
from ..spectral import Laplacian, eigenbasis, laplacian
from .harness import Row


def run(
    sizes: Sequence[int] = (5, 6), repeats: int = 3, *, k: int = 200, meshes: Sequence[str | Path] = ()
) -> Iterator[Row]:
    """Measure the eigenbasis of bumpy spheres and of mesh files.

    ``sizes`` are subdivisions of the sphere (5: 10,242 vertices, 6: 40,962). A row has the medians of both, in
    seconds, their ratio, and the worst relative residual of either.
    """
    named = [(f"bumpy sphere {s}", shapes.bumpy_sphere(s, rng=0)) for s in sizes]
    named += [(Path(path).stem, load_mesh(path)) for path in meshes]
    for name, mesh in named:
        yield _compared(name, laplacian(mesh), k, repeats)


def convergence(sizes: Sequence[int] = (500, 1000, 2000, 4000, 8000), *, rng: int = 0) -> list[Row]:
    """Measure L f - 6 f for f = x y on random points of the unit sphere, mean and worst, cotan and mesh kind."""
    rows = []
    for n in sizes:
        points = np.random.default_rng(rng).standard_normal((n, 3))
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        mesh = Mesh(points, ConvexHull(points).simplices.astype(np.int64))
        f = points[:, 0] * points[:, 1]
        row: Row = {"vertices": n}
        for kind in ("cotan", "mesh"):
            operator = laplacian(mesh, kind)
            image = np.asarray(operator.stiffness @ f)
            error = image / operator.mass.diagonal() - 6 * f
            row[f"{kind}_rms"] = float(np.sqrt(np.mean(error**2)))
            row[f"{kind}_max"] = float(np.abs(error).max())
        rows.append(row)
    return rows


def _compared(name: str, operator: Laplacian, k: int, repeats: int) -> Row:
    def ours() -> tuple[FloatArray, FloatArray]:
        spectrum = eigenbasis(operator, k)
        return spectrum.values, spectrum.vectors

    def theirs() -> tuple[FloatArray, FloatArray]:
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
        "seconds": ours_s,
        "eigsh_seconds": theirs_s,
        "ratio": theirs_s / ours_s,
        "residual": residuals["ours"],
        "eigsh_residual": residuals["theirs"],
    }


def _timed(call: Callable[[], tuple[FloatArray, FloatArray]]) -> tuple[float, tuple[FloatArray, FloatArray]]:
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def _worst_residual(operator: Laplacian, values: FloatArray, vectors: FloatArray) -> float:
    order = np.argsort(values)[1:]
    values, vectors = values[order], vectors[:, order]
    weighed = np.asarray(operator.mass @ vectors)
    gap = np.linalg.norm(np.asarray(operator.stiffness @ vectors) - weighed * values, axis=0)
    return float((gap / np.abs(values) / np.linalg.norm(weighed, axis=0)).max())
