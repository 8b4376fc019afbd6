"""Symmetry against truth, and beside two older ways on the same eigenpairs; repeatability under perturbation.

pliant bench symmetry SHAPES
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import FloatArray, IntArray
from ..errors import InputError
from ..evaluate import map_error, symmetry_repeatability
from ..matching import farthest_points
from ..matching.symmetry import SymmetryResult, detect_symmetries, symmetric_pairs
from ..mesh import Mesh, load_mesh, perturb
from ..spectral import Spectrum, eigenbasis
from ..spectral.kernels import biharmonic_embedding

__all__ = ["eigenfunction_signs", "repeatability", "run", "symmetry_factored"]

Row = dict[str, Any]

_POINTS = 200
_SIGNS = 8
_PERTURBATIONS = ("micro_holes", "scale", "noise")


def run(
    folder: str | Path, names: Sequence[str] | None = None, *, cache: str | Path | None = None
) -> list[Row]:
    """Detect the symmetries of TOSCA's shapes; one row a shape.

    Parameters
    ----------
    folder : path-like
        Holds NAME.ply and CLASS.symmetry.csv.
    names : sequence of str, optional
        Shapes; all of them without it.
    cache : path-like, optional
        Folder to keep eigenpairs in.

    Returns
    -------
    list of dict
        ``error``, ``signs`` and ``factored``: mean geodesic error over sqrt(area) of Pliant's most confident
        reflection, of eigenfunction signs and of the symmetry-factored embedding, None where there is none; ``limbs``,
        pairs of limbs; processor seconds of one process without the eigenpairs, and ``reason``.

    Raises
    ------
    InputError
        If there is no shape, or a file of one is missing.
    """
    folder = Path(folder)
    found = sorted(path.stem for path in folder.glob("*.ply") if "." not in path.stem)
    chosen = found if names is None else names
    if not chosen:
        message = f"{folder}: no shape is there, as cat0.ply with cat.symmetry.csv"
        raise InputError(message)
    files = [file for name in chosen for file in (f"{name}.ply", f"{_class(name)}.symmetry.csv")]
    missing = sorted({file for file in files if not (folder / file).is_file()})
    if missing:
        message = f"{folder}: {len(missing)} files are missing: {', '.join(missing[:5])}"
        raise InputError(message)
    return [_row(folder, name, cache) for name in chosen]


def _class(name: str) -> str:
    return name.rstrip("0123456789")


def _row(folder: Path, name: str, cache: str | Path | None) -> Row:
    mesh, vertices, mirrored = load(folder, name)
    spectrum = eigenbasis(mesh, min(200, mesh.n_vertices // 3), cache=cache)
    start = time.process_time()
    result = detect_symmetries(mesh, spectrum=spectrum)
    seconds = time.process_time() - start
    whole = [one.point_map for one in result.symmetries if one.kind == "global"]
    points, images = symmetry_factored(mesh, spectrum)
    truth = np.full(mesh.n_vertices, -1)
    truth[vertices] = mirrored
    return {
        "shape": name,
        "vertices": mesh.n_vertices,
        "error": _error(whole[0][vertices], mirrored, mesh) if whole else None,
        "signs": _error(eigenfunction_signs(mesh, spectrum)[vertices], mirrored, mesh),
        "factored": _error(images, truth[points], mesh),
        "limbs": sum(one.kind == "partial" for one in result.symmetries),
        "cpu_seconds": seconds,
        "reason": "" if whole else result.reasons[0],
    }


def load(folder: Path, name: str) -> tuple[Mesh, IntArray, IntArray]:
    """Read a shape of TOSCA with the vertices whose mirror image is known."""
    rows = np.loadtxt(folder / f"{_class(name)}.symmetry.csv", delimiter=",", comments="#")
    return load_mesh(folder / f"{name}.ply"), rows[:, 0].astype(np.int64), rows[:, 1].astype(np.int64)


def _error(images: IntArray, truth: IntArray, mesh: Mesh) -> float | None:
    known = np.flatnonzero((truth >= 0) & (images >= 0))
    if not len(known):
        return None
    return map_error(images[known], truth[known], mesh, samples=min(_POINTS, len(known))).mean


def eigenfunction_signs(mesh: Mesh, spectrum: Spectrum, k: int = 20) -> IntArray:
    """Reflect by signs of eigenfunctions, in the way of Ovsjanikov, Sun and Guibas 2008.

    The global point signature, eigenfunctions over the roots of their eigenvalues, goes onto itself by a change of
    signs: those of the first eight are enumerated on samples, further ones decided one by one.

    Parameters
    ----------
    mesh : Mesh
    spectrum : Spectrum
    k : int
        Eigenfunctions used.

    Returns
    -------
    (n,) array of int
        The image of each vertex.
    """
    embedding = spectrum.vectors[:, 1:k] / np.sqrt(spectrum.values[1:k])
    at = embedding[farthest_points(embedding, min(_POINTS, mesh.n_vertices))]
    few = min(_SIGNS, at.shape[1])
    trials = [np.array(signs) for signs in product((1.0, -1.0), repeat=few)][1:]
    costs = [_nearest_gap(at[:, :few] * signs, at[:, :few]) for signs in trials]
    signs = trials[int(np.argmin(costs))]
    for size in range(few + 1, at.shape[1] + 1):
        both = [np.append(signs, sign) for sign in (1.0, -1.0)]
        signs = min(both, key=lambda one: _nearest_gap(at[:, :size] * one, at[:, :size]))
    from scipy.spatial import KDTree

    found: Any = KDTree(embedding).query(embedding * signs)[1]
    return np.asarray(found, dtype=np.int64)


def _nearest_gap(a: FloatArray, b: FloatArray) -> float:
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * a @ b.T
    return float(np.sqrt(np.maximum(squares.min(axis=1), 0)).mean())


def symmetry_factored(mesh: Mesh, spectrum: Spectrum, samples: int = 200) -> tuple[IntArray, IntArray]:
    """Pair samples by a symmetry-factored embedding, in the way of Lipman et al. 2010.

    The voted pairs, spread to their neighbours, make a correspondence matrix between samples; its first eigenvectors,
    each times the root of its eigenvalue after scaling by rows' sums, place the samples so that orbits lie in one
    direction. A sample's partner is the one of the largest inner product there that is not near on the surface, so
    points near a mirror's line get a wrong one.

    Parameters
    ----------
    mesh : Mesh
    spectrum : Spectrum
    samples : int

    Returns
    -------
    points, images : (s,) array of int
    """
    pairs = symmetric_pairs(mesh, spectrum, samples=samples, kept=0.0)
    embedding = biharmonic_embedding(spectrum.truncated(min(60, spectrum.k))) / pairs.scale
    points = farthest_points(embedding[:, :20], min(samples, mesh.n_vertices))
    if not len(pairs):
        return points, np.full(len(points), -1)
    sides = [_spread(embedding[points], embedding[side]) for side in (pairs.sources, pairs.targets)]
    matrix = sides[0] * (pairs.support / pairs.support.max()) @ sides[1].T
    matrix = matrix + matrix.T
    matrix += 1e-3 * matrix.max() * np.eye(len(points))
    roots = np.sqrt(matrix.sum(axis=1))
    values, vectors = np.linalg.eigh(matrix / roots[:, None] / roots)
    factored = vectors * np.sqrt(np.clip(values, 0, None))
    likeness = factored @ factored.T
    apart = np.linalg.norm(embedding[points][:, None] - embedding[points], axis=2)
    likeness[apart < 0.15] = -np.inf
    return points, np.where(np.isfinite(likeness.max(axis=1)), points[likeness.argmax(axis=1)], -1)


def _spread(points: FloatArray, centres: FloatArray, width: float = 0.1) -> FloatArray:
    squares = ((points[:, None] - centres) ** 2).sum(axis=2)
    weights: FloatArray = np.exp(-squares / (2 * width**2))
    return weights


def repeatability(
    folder: str | Path,
    classes: Sequence[str],
    *,
    strength: int = 3,
    samples: int = 50,
    cache: str | Path | None = None,
) -> list[Row]:
    """Find the symmetries of null shapes again after bending and perturbation (Fig. 4.10).

    Parameters
    ----------
    folder : path-like
    classes : sequence of str
        ``"dog"`` reads dog0 as the null shape and the other dogs as isometries of it.
    strength : int
        Of micro-holes, scale and noise.
    samples : int
        Voters; the dissertation uses 50.
    cache : path-like, optional
        Folder to keep eigenpairs in.

    Returns
    -------
    list of dict
        Class, what was done, symmetries found, the rate of eq. 4.7 and the share with overlap of .75 and more.
    """
    folder = Path(folder)
    rows = []
    for name in classes:
        null = load_mesh(folder / f"{name}0.ply")
        reference = _detected(null, samples, cache)
        others = sorted(path for path in folder.glob(f"{name}*.ply") if path.stem[len(name) :].isdigit())
        changed = [
            (f"isometry {path.stem}", load_mesh(path), np.arange(null.n_vertices))
            for path in others
            if path.stem != f"{name}0"
        ]
        for kind in _PERTURBATIONS:
            made = perturb.perturbed(null, kind, strength=strength, rng=0)  # type: ignore[arg-type]
            changed.append((kind, made.mesh, made.source))
        for kind, mesh, source in changed:
            found = _detected(mesh, samples, cache)
            score = symmetry_repeatability(reference.symmetries, found.symmetries, null, source)
            rows.append(
                {
                    "class": name,
                    "change": kind,
                    "symmetries": len(found.symmetries),
                    "reference": len(reference.symmetries),
                    "rate": score.rate if len(score.overlaps) else None,
                    "at .75": score.at(0.75) if len(score.overlaps) else None,
                }
            )
    return rows


def _detected(mesh: Mesh, samples: int, cache: str | Path | None) -> SymmetryResult:
    return detect_symmetries(mesh, samples=samples, cache=cache)
