"""A cohort with a truth: one brain-shaped surface folded anew for each subject, more in some places than in others."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np

from .._arrays import FloatArray, IntArray, frozen
from ..datasets import Hemisphere, fsaverage5
from ..errors import InputError
from ..matching import farthest_points
from ..mesh import Mesh, save_mesh
from .context import ContextSignature

__all__ = ["SyntheticCohort", "synthetic_cohort"]

# The inflated surface has no unit of its own: it is given a brain's length, in mm.
_LENGTH = 170.0
_WAVES = 300
_SMOOTHING = 5
# Band of the map of amplitudes, in mm, and its least value over its largest.
_PLACES, _LEAST = (45.0, 90.0), 1 / 40
# Share of the surface at either end over which a logistic spread does not grow further: its tails have no end.
_TAIL = 0.01
Spread: TypeAlias = Literal["logistic", "logarithmic", "even"]


@dataclass(frozen=True, eq=False)
class SyntheticCohort:
    """How to fold each subject, and the truth.

    Parameters
    ----------
    base : Mesh
        What is folded, 10,242 vertices, in mm.
    amplitude : (n,) array of float
        Standard deviation of the folds' depth at each vertex, in mm.
    sites : (s,) array of int
        Landmark vertices, spread evenly.
    wavelengths : tuple of two floats
        Band of the folds, in mm.
    seeds : (subjects,) array of int
        Of each subject's folds.
    common : (n,) array of float
        Depth of the folds that all subjects have, in mm.
    sliding : float
        Standard deviation of displacements within the surface, over that of the folds' depth.
    """

    base: Mesh
    amplitude: FloatArray
    sites: IntArray
    wavelengths: tuple[float, float]
    seeds: IntArray
    common: FloatArray
    sliding: float = 0.0

    def __post_init__(self) -> None:
        for name in ("amplitude", "sites", "seeds", "common"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.seeds)

    @property
    def truth(self) -> FloatArray:
        """(s,) amplitude at the sites, in mm."""
        values: FloatArray = self.amplitude[self.sites]
        return values

    def subject(self, i: int) -> Mesh:
        """Fold the base for one subject: displacements of known amplitude along the normals and, if asked, across."""
        generator = np.random.default_rng(int(self.seeds[i]))
        points, normals = self.base.vertices, self.base.vertex_normals
        depth = self.common + self.amplitude * _band_limited(generator, points, self.wavelengths)
        moved = points + depth[:, None] * normals
        if self.sliding:
            waves = np.stack([_band_limited(generator, points, self.wavelengths) for _ in range(3)], axis=1)
            across = waves - (waves * normals).sum(axis=1, keepdims=True) * normals
            moved = moved + (self.sliding * self.amplitude)[:, None] * across
        return self.base.with_vertices(moved)

    def save(self, folder: str | Path) -> Path:
        """Write meshes, landmarks, the truth and the table of subjects; return the table's path."""
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        names = [f"s{i:03d}" for i in range(len(self))]
        for i, name in enumerate(names):
            save_mesh(place / f"{name}.ply", self.subject(i))
        _write_rows(place / "landmarks.csv", ("name", "vertex"), [(v, v) for v in self.sites.tolist()])
        truth = zip(self.sites.tolist(), self.truth.tolist(), strict=True)
        _write_rows(place / "truth.csv", ("name", "amplitude_mm"), list(truth))
        _write_rows(place / "cohort.csv", ("subject", "mesh"), [(name, f"{name}.ply") for name in names])
        return place / "cohort.csv"


def synthetic_cohort(
    n_subjects: int = 31,
    *,
    n_sites: int = 120,
    amplitude: float = 8.0,
    spread: Spread = "logistic",
    shared: float = 0.0,
    sliding: float = 0.5,
    wavelengths: tuple[float, float] = (15.0, 30.0),
    hemisphere: Hemisphere = "left",
    rng: np.random.Generator | int | None = None,
) -> SyntheticCohort:
    """Make a cohort whose true variability is known: fsaverage5 inflated, then folded anew for each subject.

    Parameters
    ----------
    n_subjects, n_sites : int
        Subjects, at least 1, and landmarks, at least 2.
    amplitude : float
        Largest standard deviation of the folds' depth, in mm; the least is a fortieth of it.
    spread : {"logistic", "logarithmic", "even"}
        How amplitudes are distributed over the surface. "logistic": their logarithms have a logistic distribution,
        so that most places are in between and the extremes stand apart. "logarithmic": their logarithms are spread
        evenly. "even": they are themselves, and the most variable places differ by less than 31 subjects can tell.
    shared : float
        Standard deviation of the depth of folds that all subjects have in common, in mm.
    sliding : float
        Standard deviation of displacements within the surface, in each of its two directions, over that of depth.
    wavelengths : tuple of two floats
        Shortest and longest wave of the folds, in mm. Shorter than about three edges (7 mm) they are not resolved.
    hemisphere : {"left", "right"}
        Which base.
    rng : numpy.random.Generator or int, optional
        Seed: it sets where folds are deep and each subject's folds.

    Returns
    -------
    SyntheticCohort

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    A fold is a sum of 300 plane waves of random direction, phase and wavelength within the band, evaluated in space.
    Amplitudes change over 45 to 90 mm. Deep folds may pass through each other; the geometry measured here is that of
    the surface itself and does not mind. The truth is a depth in space: what is measured within the surface sees it
    through the stretching that it causes, which is stronger where the base itself is bent.

    Examples
    --------
    >>> cohort = synthetic_cohort(2, n_sites=5, rng=0)
    >>> cohort.subject(0), cohort.truth.shape
    (Mesh(10242 vertices, 20480 faces), (5,))
    """
    shortest, longest = wavelengths
    if n_subjects < 1 or n_sites < 2 or not amplitude > 0 or not 0 < shortest <= longest:
        message = (
            "needs a subject, two sites, a positive amplitude and ascending wavelengths; got "
            f"{n_subjects}, {n_sites}, {amplitude}, {wavelengths}"
        )
        raise InputError(message)
    if spread not in get_args(Spread) or not (shared >= 0 and sliding >= 0):
        message = (
            f"spread must be one of {', '.join(get_args(Spread))} and shared and sliding 0 or more; got "
            f"{spread!r}, {shared}, {sliding}"
        )
        raise InputError(message)
    inflated = fsaverage5("infl", hemisphere=hemisphere)
    base = inflated.scaled(_LENGTH / np.ptp(inflated.vertices[:, 1]))
    base = ContextSignature(smoothing=_SMOOTHING).surface(base)
    if n_sites > base.n_vertices:
        message = f"n_sites must be at most {base.n_vertices}, got {n_sites}"
        raise InputError(message)
    generator = np.random.default_rng(rng)
    rank = np.argsort(np.argsort(_band_limited(generator, base.vertices, _PLACES))) / (base.n_vertices - 1)
    seeds = generator.integers(0, 2**32, n_subjects)
    common = shared * _band_limited(generator, base.vertices, wavelengths) if shared else np.zeros(len(rank))
    return SyntheticCohort(
        base, amplitude * _spread(rank, spread), farthest_points(base, n_sites), (float(shortest), float(longest)),
        seeds, common, float(sliding),
    )  # fmt: skip


def _spread(rank: FloatArray, kind: Spread) -> FloatArray:
    """Amplitudes over the largest, of places in ascending order from 0 to 1."""
    if kind == "even":
        return _LEAST + (1 - _LEAST) * rank
    if kind == "logarithmic":
        return np.asarray(_LEAST ** (1 - rank))
    inner = np.clip(rank, _TAIL, 1 - _TAIL)
    place = np.log(inner / (1 - inner)) / np.log((1 - _TAIL) / _TAIL)
    return np.asarray(_LEAST ** (0.5 - 0.5 * place))


def _band_limited(rng: np.random.Generator, points: FloatArray, band: tuple[float, float]) -> FloatArray:
    """(n,) random function of unit variance made of plane waves within a band of lengths."""
    directions = rng.normal(size=(_WAVES, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    numbers = 2 * np.pi / rng.uniform(*band, _WAVES)
    phases = rng.uniform(0, 2 * np.pi, _WAVES)
    weights = rng.normal(size=_WAVES) * np.sqrt(2 / _WAVES)
    waves: FloatArray = np.cos(points @ (directions * numbers[:, None]).T + phases) @ weights
    return waves


def _write_rows(path: Path, header: tuple[str, ...], rows: list[tuple[object, ...]]) -> None:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    path.write_text(text.getvalue(), encoding="utf-8")
