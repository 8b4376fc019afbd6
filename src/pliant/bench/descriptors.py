"""Hit rates of signatures on poses of one mesh, on remeshed poses, and on the nine classes of perturbation.

Every signature is compared by L2, from the same 200 eigenpairs of the cotangent Laplacian. The metric of a whitened
row is learned from perturbed copies (noise, sampling, pose) of the reference shape alone. Reference points are drawn
at random, or are farthest points in the signature itself, as section 3.5.3 takes them.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeAlias, get_args

import numpy as np

from .._arrays import FloatArray, IntArray
from ..descriptors import Average, Whitener, ball_sums, bde, bdk, hks, rms_biharmonic_distance, wks
from ..evaluate import HitRates, hit_rate, mean_hit_rates
from ..geodesic import estimate_gfe, gch, nearest
from ..matching import farthest_points
from ..mesh import Mesh, load_mesh, perturbed
from ..mesh.perturb import Kind
from ..spectral import Spectrum, biharmonic_embedding, eigenbasis

__all__ = ["run", "speed"]

K = 200
FRACTIONS = (0.001, 0.002, 0.005, 0.01)
POSES = (
    ("cat0", "cat2"),
    ("cat0", "cat7"),
    ("dog0", "dog2"),
    ("dog0", "dog5"),
    ("horse0", "horse6"),
    ("horse0", "horse15"),
    ("victoria0", "victoria4"),
    ("wolf0", "wolf1"),
)
REMESHED = (("cat0", "cat3"), ("dog0", "dog2"), ("dog0", "dog5"), ("horse0", "horse6"))
NULL_SHAPES = ("dog0", "horse0", "victoria0")

Pair: TypeAlias = tuple[Mesh, Mesh, IntArray]


def _context(mesh: Mesh, spectrum: Spectrum) -> FloatArray:
    return gch(_field(mesh), nearest(mesh, count=50), edges=np.linspace(0, 0.02, 11))


def _field(mesh: Mesh) -> FloatArray:
    """Share of the shortest paths that pass a vertex: no unit, from 500 sources."""
    samples = min(500, mesh.n_vertices)
    return estimate_gfe(mesh, samples, weights="uniform", rng=0).values


def _density(average: Average) -> Callable[[Mesh, Spectrum], FloatArray]:
    return lambda mesh, spectrum: bde(spectrum, average=average, form="raw")


# What is computed once a mesh, and the rows that are read off it.
_TABLES: dict[str, Callable[[Mesh, Spectrum], FloatArray]] = {
    "hks": lambda mesh, spectrum: hks(spectrum) * spectrum.area,
    "wks": lambda mesh, spectrum: wks(spectrum) * spectrum.area,
    "bdk": lambda mesh, spectrum: bdk(spectrum)[:, None] / spectrum.area,
    "simple": _density("simple"),
    "gaussian": _density("gaussian"),
    "patches": _density("patches"),
    "gfe": lambda mesh, spectrum: _field(mesh)[:, None],
    "gch": _context,
}


def _all(table: FloatArray) -> FloatArray:
    return table


def _area(table: FloatArray) -> FloatArray:
    return table[:, : table.shape[1] // 2]


def _mean(table: FloatArray) -> FloatArray:
    return table[:, table.shape[1] // 2 :]


def _growth(table: FloatArray) -> FloatArray:
    return np.hstack([np.diff(np.log(part), axis=1) for part in (_area(table), _mean(table))])


SIGNATURES: dict[str, tuple[str, Callable[[FloatArray], FloatArray]]] = {
    "HKS": ("hks", _all),
    "WKS": ("wks", _all),
    "BDK": ("bdk", _all),
    "BDE mean, simple": ("simple", _mean),
    "BDE mean, Gaussian": ("gaussian", _mean),
    "BDE mean, patches": ("patches", _mean),
    "BDE area, simple": ("simple", _area),
    "BDE area, Gaussian": ("gaussian", _area),
    "BDE area, patches": ("patches", _area),
    "BDE both, simple": ("simple", _all),
    "BDE both, patches": ("patches", _all),
    "BDE growth, simple": ("simple", _growth),
    "BDE growth, Gaussian": ("gaussian", _growth),
    "BDE growth, patches (default)": ("patches", _growth),
    "GFE": ("gfe", _all),
    "GCH": ("gch", _all),
}
# Signatures that are not positive throughout have no logarithm.
NO_LOG = frozenset({name for name in SIGNATURES if "growth" in name} | {"GCH"})


class Workbench:
    """Meshes with their spectra and signatures, kept on disk between runs."""

    def __init__(self, cache: Path) -> None:
        self.cache = cache
        cache.mkdir(parents=True, exist_ok=True)

    def spectrum(self, mesh: Mesh) -> Spectrum:
        path = self.cache / f"{_digest(mesh)}.spectrum.npz"
        if not path.exists():
            eigenbasis(mesh, K).save(path)
        return Spectrum.load(path)

    def signature(self, mesh: Mesh, name: str) -> FloatArray:
        plain = name.removesuffix(", log").removesuffix(", whitened")
        source, reading = SIGNATURES[plain]
        path = self.cache / f"{_digest(mesh)}.{source}.npy"
        if not path.exists():
            np.save(path, _TABLES[source](mesh, self.spectrum(mesh)).astype(np.float32))
        table = reading(np.load(path).astype(np.float64))
        if name.endswith(", log") or (name.endswith(", whitened") and plain not in NO_LOG):
            table = np.log(np.maximum(table, 1e-12 * table.max(axis=0)))
        return table

    def metric(self, mesh: Mesh, name: str) -> Whitener:
        """Learned from perturbed copies of this one shape."""
        own = self.signature(mesh, name)
        copies = [perturbed(mesh, kind, strength=1, rng=7) for kind in ("noise", "sampling", "isometry")]
        return Whitener(shrinkage=1e-3).fit([(own, self.signature(c.mesh, name), c.source) for c in copies])


def _digest(mesh: Mesh) -> str:
    return hashlib.sha256(mesh.vertices.tobytes() + mesh.faces.tobytes()).hexdigest()[:24]


def variants(names: Iterable[str]) -> list[str]:
    rows = []
    for name in names:
        rows.append(name)
        if name not in NO_LOG:
            rows.append(f"{name}, log")
        if name != "BDK" and name != "GFE":
            rows.append(f"{name}, whitened")
    return rows


def run(
    pairs: Sequence[Pair],
    *,
    group: str,
    cache: Path,
    names: Sequence[str] | None = None,
    n_points: int = 400,
    farthest: bool = True,
    rng: int = 0,
) -> list[dict[str, Any]]:
    """Measure hit rates of every signature over pairs of shapes: one row a signature and choice of points.

    Parameters
    ----------
    pairs : sequence of (Mesh, Mesh, (n_a,) array of int)
        Two shapes and the vertex of the second that each vertex of the first is, -1 where there is none.
    group : str
        Name of the rows.
    cache : Path
        Folder for spectra and signatures.
    names : sequence of str, optional
        Rows to compute; all of :func:`variants` by default.
    n_points : int
        Random reference points a pair.
    farthest : bool
        Measure on 100 farthest points as well.
    rng : int
        Seed of the random points.

    Returns
    -------
    list of dict
        With the mean over pairs, and its bootstrap interval over pairs at 0.1 per cent.
    """
    bench = Workbench(cache)
    rows = []
    for name in variants(SIGNATURES) if names is None else names:
        start = time.perf_counter()
        results: dict[str, list[HitRates]] = {"random": [], "farthest": []}
        for a, b, truth in pairs:
            f_a, f_b = bench.signature(a, name), bench.signature(b, name)
            if name.endswith(", whitened"):
                metric = bench.metric(a, name)
                f_a, f_b = metric.transform(f_a), metric.transform(f_b)
            known = np.flatnonzero(truth >= 0)
            drawn = np.random.default_rng(rng).choice(known, min(n_points, len(known)), replace=False)
            results["random"].append(hit_rate(f_a, f_b, truth, points=drawn, fractions=FRACTIONS))
            if farthest:
                chosen = farthest_points(f_a, 100)
                chosen = chosen[truth[chosen] >= 0]
                results["farthest"].append(hit_rate(f_a, f_b, truth, points=chosen, fractions=FRACTIONS))
        for points, found in results.items():
            if found:
                rows.append(_row(group, name, points, found, time.perf_counter() - start))
    return rows


def _row(group: str, name: str, points: str, found: list[HitRates], seconds: float) -> dict[str, Any]:
    mean, interval = mean_hit_rates(found)
    return {
        "group": group,
        "signature": name,
        "points": points,
        "pairs": len(found),
        **{f"at {100 * f:g} %": round(float(value), 3) for f, value in zip(FRACTIONS, mean, strict=True)},
        "interval at 0.1 %": [
            None if np.isnan(bound) else round(float(bound), 3) for bound in interval[:, 0]
        ],
        "seconds": round(seconds, 1),
    }


def poses(shapes: Path, pairs: Sequence[tuple[str, str]] = POSES) -> list[Pair]:
    """TOSCA poses: one triangulation, so vertex i is vertex i."""
    found = []
    for a, b in pairs:
        mesh = load_mesh(shapes / "tosca" / f"{a}.ply")
        found.append((mesh, load_mesh(shapes / "tosca" / f"{b}.ply"), np.arange(mesh.n_vertices)))
    return found


def remeshed(shapes: Path, pairs: Sequence[tuple[str, str]] = REMESHED) -> list[Pair]:
    """Poses of different triangulations: nothing of the mesh itself can help."""
    folder = shapes / "tosca_remeshed_5k"
    found = []
    for a, b in pairs:
        mesh, other = (load_mesh(folder / f"{name}.ply") for name in (a, b))
        lines = [np.loadtxt(folder / f"{name}.vts", dtype=np.int64) - 1 for name in (a, b)]
        truth = np.full(mesh.n_vertices, -1)
        truth[lines[0]] = lines[1]
        found.append((mesh, other, truth))
    return found


def perturbations(
    shapes: Path, kind: Kind, strengths: Sequence[int], names: Sequence[str] = NULL_SHAPES
) -> list[Pair]:
    """One class of SHREC 2010, re-made from its null shapes."""
    found = []
    for name in names:
        mesh = load_mesh(shapes / "tosca" / f"{name}.ply")
        for strength in strengths:
            copy = perturbed(mesh, kind, strength=strength, rng=strength)
            truth = np.full(mesh.n_vertices, -1)
            truth[copy.source] = np.arange(copy.mesh.n_vertices)
            found.append((mesh, copy.mesh, truth))
    return found


def groups(
    shapes: Path, chosen: Sequence[str] = ("poses", "remeshed", "perturbations")
) -> dict[str, list[Pair]]:
    """Return the pairs of every group asked for; perturbations at strength 2."""
    found: dict[str, list[Pair]] = {}
    if "poses" in chosen:
        found["poses"] = poses(shapes)
    if "remeshed" in chosen:
        found["remeshed"] = remeshed(shapes)
    for kind in get_args(Kind):
        if "perturbations" in chosen or kind in chosen:
            found[kind] = perturbations(shapes, kind, (2,))
    return found


def speed(spectrum: Spectrum, *, radii: int = 24, rows: int = 512) -> list[dict[str, Any]]:
    """Time ball sums against blocked NumPy, which is scaled up from some of its rows; both statistics."""
    points = biharmonic_embedding(spectrum) / rms_biharmonic_distance(spectrum)
    areas: FloatArray = np.asarray(spectrum.mass.sum(axis=1)).ravel()
    weights = np.column_stack([areas, areas * (points**2).sum(axis=1)])
    steps = np.geomspace(0.02, 2.0, radii)
    ball_sums(points[:200], weights[:200], steps)
    start = time.perf_counter()
    found = ball_sums(points, weights, steps)
    ours = time.perf_counter() - start
    chosen = np.linspace(0, len(points) - 1, rows).astype(int)
    start = time.perf_counter()
    expected = _blocked(points, weights, steps, chosen)
    theirs = (time.perf_counter() - start) * len(points) / rows
    worst = float(np.abs(found[chosen] / expected - 1).max())
    about = {"n": len(points), "radii": radii, "largest difference": worst}
    return [
        {"engine": "pliant", "seconds": ours, "ratio": 1.0, **about},
        {"engine": "blocked NumPy", "seconds": theirs, "ratio": theirs / ours, **about},
    ]


def _blocked(points: FloatArray, weights: FloatArray, radii: FloatArray, rows: IntArray) -> FloatArray:
    norms = (points**2).sum(axis=1)
    sums = np.empty((len(rows), len(radii), 2))
    for first in range(0, len(rows), 256):
        block = rows[first : first + 256]
        squares = norms[block][:, None] + norms - 2 * points[block] @ points.T
        for i, radius in enumerate(radii):
            sums[first : first + 256, i] = (squares <= radius**2) @ weights
    return sums
