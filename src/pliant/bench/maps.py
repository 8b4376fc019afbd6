"""Dense maps without landmarks on remeshed TOSCA: mean geodesic error of every pair within a class.

pliant bench maps FOLDER --pairs 20
"""

from __future__ import annotations

import time
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..evaluate.maps import map_error
from ..matching import dense_map
from ..mesh import load_mesh
from ..spectral import eigenbasis

__all__ = ["run"]


def run(
    folder: str | Path,
    *,
    k: int = 120,
    pairs: int | None = None,
    rng: int = 0,
    cache: str | Path | None = None,
) -> list[dict[str, Any]]:
    """Map every pair within a class, or so many drawn at random; one row a pair.

    Parameters
    ----------
    folder : path-like
        Holds NAME.ply, NAME.vts and NAME.sym.vts, as ``tosca_remeshed_5k`` does.
    k : int
        Eigenfunctions of the final maps.
    pairs : int, optional
        Map only so many pairs.
    rng : int
        Seed of the draw.
    cache : path-like, optional
        Folder to keep eigenbases in.

    Returns
    -------
    list of dict
        ``error`` against the truth, ``symmetric`` against the truth or its mirror image (one choice a map),
        ``pointwise`` against whichever is nearer point by point; all over sqrt(area).

    Raises
    ------
    InputError
        If no class has two shapes.
    """
    folder = Path(folder)
    names = sorted(path.stem for path in folder.glob("*.ply"))
    chosen = [(a, b) for a, b in combinations(names, 2) if _class(a) == _class(b)]
    if not chosen:
        message = f"{folder}: no two shapes of one class are there, as cat0.ply and cat1.ply"
        raise InputError(message)
    if pairs is not None and pairs < len(chosen):
        kept = np.sort(np.random.default_rng(rng).choice(len(chosen), pairs, replace=False))
        chosen = [chosen[i] for i in kept]
    loaded = {
        name: _load(folder, name, k, cache) for name in sorted({name for pair in chosen for name in pair})
    }
    return [_row(a, b, loaded[a], loaded[b], k) for a, b in chosen]


def _class(name: str) -> str:
    return name.rstrip("0123456789")


def _load(folder: Path, name: str, k: int, cache: str | Path | None) -> tuple[Any, ...]:
    mesh = load_mesh(folder / f"{name}.ply")
    points, mirrored = (np.loadtxt(folder / f"{name}{end}", dtype=int) - 1 for end in (".vts", ".sym.vts"))
    symmetry = np.full(mesh.n_vertices, -1)
    symmetry[points] = mirrored
    return mesh, eigenbasis(mesh, k, cache=cache), points, symmetry


def _row(name_a: str, name_b: str, a: tuple[Any, ...], b: tuple[Any, ...], k: int) -> dict[str, Any]:
    start = time.perf_counter()
    found = dense_map(a[0], b[0], spectra=(a[1], b[1]), k=k)
    seconds = time.perf_counter() - start
    error = map_error(found.p_ba[b[2]], a[2], a[0], symmetry=a[3])
    pointwise = error.pointwise_errors
    return {
        "a": name_a,
        "b": name_b,
        "error": error.mean,
        "symmetric": error.symmetric_mean,
        "pointwise": None if pointwise is None else float(pointwise.mean()),
        "reversed_area": found.reversed_area,
        "folding": found.measures["folding"],
        "seconds": seconds,
    }
