"""Reflections of a whole surface as dense maps: many first guesses, refined, measured, accepted or refused."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from ..._arrays import BoolArray, FloatArray, IntArray
from ...errors import InputError
from ...mesh import Mesh
from ...spectral import Spectrum
from ._frame import Coarse, Frame
from ._further import new_guesses
from ._guesses import FIRST, FOLDS, MOVES, QUICK, SAME, SHARED, WIDTHS, Guess, distinct_guesses, measured
from ._harmonic import mended
from ._refine import coarse_points, dense_points, grown, orthogonal
from ._slide import slides
from .measures import MapQuality, quality_of
from .voting import candidate_pairs

__all__ = ["GlobalSearch", "Limits", "Reflection", "reflections"]

# A careful look at the best guesses: samples, step.
_SAMPLES, _STEP = 1500, 4
# Times that further reflections are sought from those found.
_MOST = 4
# Distortion of the mirrors of a surface that has several; beyond, the others are turned versions of the best.
# Of a bent surface the first reflection is hard enough to find; its turned versions are no further ones.
_EXACT = 0.015
# Maps that are mended, the best of the first guesses.
_MENDED = 3
# What keeps the orientation or hardly moves is not worth a dense map, but for the reasons of the first.
_HOPELESS = 5.0
# Between surfaces of revolution (0 to .1 with a mesh's noise) and an ellipsoid (.14), round limbs (.22).
_ORBITS = 0.13
# Of channels whose mean is 1: a sphere has the noise of its mesh.
_VARIES = 0.05


@dataclass(frozen=True)
class Limits:
    """What a map must keep to be taken for a reflection; every limit of :class:`MapQuality`, and of the trace.

    True reflections of bent animals and humans measured reversed area .82-.98, trace .08-.25, distortion up
    to .035, residual up to .017; the identity reversed area under .15, trace .8; maps of random blobs,
    which have no symmetry, residual from .036 and over support from .07, where bent animals have up to .035.

    Attributes
    ----------
    reversed_area : float
        Least reversed area.
    trace : float
        Largest trace of the functional map over its size.
    distortion, residual, involution : float
        Largest values.
    displacement : float
        Least mean way a point moves.
    mismatch : float
        Largest residual over support, the share of the voters that have a partner where the map takes them: smooth
        blobs come near a reflection in each of the two, seldom in both.

    Examples
    --------
    >>> Limits(residual=0.05).residual
    0.05
    """

    reversed_area: float = 0.75
    trace: float = 0.5
    distortion: float = 0.06
    residual: float = 0.028
    involution: float = 0.08
    displacement: float = 0.1
    mismatch: float = 0.06

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not (np.isfinite(value) and value >= 0):
                message = f"the limit of {name} must be a number of 0 or more, got {value}"
                raise InputError(message)

    def failures(self, quality: MapQuality, trace: float, support: float) -> tuple[str, ...]:
        """Say which limits a map does not keep, and by how much."""
        values = asdict(quality) | {"trace": trace, "mismatch": quality.residual / max(support, 1e-12)}
        found = []
        for name, limit in asdict(self).items():
            value = values[name]
            least = name in ("reversed_area", "displacement")
            if (value < limit) if least else (value > limit):
                found.append(f"{name.replace('_', ' ')} {value:.3f} {'<' if least else '>'} {limit:g}")
        return tuple(found)


@dataclass(frozen=True, eq=False, repr=False)
class Reflection:
    """A reflection of a whole surface.

    Attributes
    ----------
    point_map : (n,) array of int
        The image of each vertex.
    matrix : (k, k) array of float
        The functional map, orthogonal.
    support : float
        Share of the voters with a pair that the reflection carries one to the other.
    quality : MapQuality
        Its measures.
    """

    point_map: IntArray
    matrix: FloatArray
    support: float
    quality: MapQuality

    def __repr__(self) -> str:
        q = self.quality
        return f"Reflection(support {self.support:.2f}, distortion {q.distortion:.3f}, residual {q.residual:.3f})"


@dataclass(frozen=True, eq=False)
class GlobalSearch:
    """Reflections found, the least distorted first; and why there are none, or not more.

    Attributes
    ----------
    reflections : tuple of Reflection
    reasons : tuple of str
    """

    reflections: tuple[Reflection, ...]
    reasons: tuple[str, ...]


def reflections(
    mesh: Mesh,
    spectrum: Spectrum,
    *,
    samples: int = 100,
    k: int = 120,
    limits: Limits | None = None,
    rng: int | np.random.Generator | None = None,
) -> GlobalSearch:
    """Find the reflections of a whole surface, each as a dense map.

    Parameters
    ----------
    mesh : Mesh
        In one piece, wound alike throughout.
    spectrum : Spectrum
        Of the mesh, 30 eigenpairs at least; 200 are good.
    samples : int
        Voters.
    k : int
        Eigenfunctions in the final maps; fewer where the spectrum has fewer.
    limits : Limits, optional
        What a map must keep.
    rng : int or numpy.random.Generator, optional
        Draws the first sample; by default it is the point farthest out.

    Returns
    -------
    GlobalSearch
        Several reflections where there are several; none, with the reason, where no map keeps the limits or
        where there are arbitrarily many (surfaces of revolution, spheres).

    Raises
    ------
    InputError
        If the mesh is in pieces, the spectrum is not of this mesh or too short, or an option is out of range.

    Notes
    -----
    Consistent sets of pairs, from several seeds and at several tolerances, give first maps by least squares
    (landmarks exchanged, and signatures); ZoomOut with orthogonal maps on samples refines them. In a pose that is no
    isometry that leaves a trunk turned or a limb on the wrong side; so each of the best is made smooth and its own
    inverse (least Dirichlet energy, images and preimages together) and sharpened again, while that helps. What looks
    like a reflection is taken to all vertices, from coarse to fine, and measured there. Where the first is nearly
    exact, further ones are sought from it: with other signs, turned within a repeated eigenvalue, and carried along by
    one another.

    Cost: some seconds, mostly proportional to the vertices.

    References
    ----------
    Dissertation, section 4.3; S. Melzi et al., ZoomOut, 2019; D. Ezuz, J. Solomon, M. Ben-Chen,
    Reversible harmonic maps between discrete surfaces, 2019.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> figure = shapes.quadruped(1000)
    >>> found = reflections(figure.mesh, eigenbasis(figure.mesh, 80))
    >>> bool((found.reflections[0].point_map == figure.symmetry).mean() > 0.8)
    True
    """
    frame = Frame(mesh, spectrum)
    reason = continuous_symmetry(frame)
    if reason:
        return GlobalSearch((), (reason,))
    return search_reflections(frame, voting_pairs(frame, samples, rng), k, limits or Limits())


def voting_pairs(
    frame: Frame, samples: int, rng: int | np.random.Generator | None
) -> tuple[IntArray, IntArray]:
    """Return samples and their partners."""
    if isinstance(samples, bool) or int(samples) != samples or samples < 10:
        message = f"samples must be a whole number of 10 or more, got {samples}"
        raise InputError(message)
    return candidate_pairs(frame, frame.samples(samples, rng))


def search_reflections(
    frame: Frame, pairs: tuple[IntArray, IntArray], k: int, limits: Limits
) -> GlobalSearch:
    """Run the search on a surface that has been seen to have no continuous symmetry."""
    if isinstance(k, bool) or int(k) != k or k < FIRST:
        message = f"k must be a whole number of {FIRST} or more, got {k}"
        raise InputError(message)
    coarse = Coarse(frame, frame.samples(_SAMPLES))
    k = min(k, frame.spectrum.k, len(coarse.samples) // 3)
    with threadpool_limits(1):  # matrices this small lose more than they gain by threads
        guesses = distinct_guesses(coarse.first(QUICK[0]), *pairs, k)
        return _judged(coarse, guesses, pairs, k, limits)


def continuous_symmetry(frame: Frame) -> str:
    """Return why a surface has symmetry without end, or nothing."""
    if frame.variation < _VARIES:
        return (
            "continuous symmetry: every point looks alike (signatures vary by "
            f"{frame.variation:.4f} of what is noticed), as on a sphere; no one reflection is meant"
        )
    if frame.weak_direction < _ORBITS:
        return (
            "continuous symmetry: signatures hardly change along one direction "
            f"({frame.weak_direction:.3f} of the other, limit {_ORBITS}), as on a surface of revolution; no one "
            "reflection is meant"
        )
    return ""


def _judged(
    coarse: Coarse, guesses: list[Guess], pairs: tuple[IntArray, IntArray], k: int, limits: Limits
) -> GlobalSearch:
    if not guesses:
        reason = "asymmetric: no set of points far apart looks alike and keeps its distances"
        return GlobalSearch((), (reason,))
    trial = _Trial(coarse, pairs, k, limits)
    for i, guess in enumerate(guesses):
        # From the start again: what few samples put wrong above the first eigenfunctions would stay wrong.
        trial.take(guess.matrix[: guess.settled, : guess.settled], hopeless=i == 0)
    taken = _distinct(coarse.frame, trial.passed)
    quick = coarse.first(QUICK[0])
    if any(_arbitrary(quick, found) for found in taken):
        reason = (
            "continuous symmetry: a reflection turned by any angle is as good, as on a surface of revolution; "
            "no one reflection is meant"
        )
        return GlobalSearch((), (reason,))
    return GlobalSearch(_with_further(trial, taken), () if taken else tuple(dict.fromkeys(trial.reasons)))


@dataclass(frozen=True, eq=False)
class _Passed:
    """A reflection, and how bad it is on the samples and on all vertices together: each alone took worse ones."""

    reflection: Reflection
    merit: float


@dataclass(eq=False)
class _Trial:
    """Takes first corners of maps to dense ones, and sorts them into those that pass and reasons why not."""

    coarse: Coarse
    pairs: tuple[IntArray, IntArray]
    k: int
    limits: Limits

    def __post_init__(self) -> None:
        self.mended = 0
        self.passed: list[_Passed] = []
        self.reasons: list[str] = []

    def take(self, corner: FloatArray, *, mend: bool = True, hopeless: bool = False) -> None:
        """Refine, mend, measure; what is hopeless too, where its reasons are wanted."""
        frame, coarse = self.coarse.frame, self.coarse
        first = min(len(corner), self.k)
        start = orthogonal(corner[:first, :first])
        guess = measured(coarse, grown(coarse, start, self.k, _STEP, symmetric=True))
        if guess.merit > _HOPELESS and not hopeless:
            return
        # What is wrong as a whole would only look right: distances would agree, points would not.
        whole = guess.merit <= _HOPELESS and guess.distortion <= self.limits.distortion
        if whole and mend and self.mended < _MENDED:
            guess = mended(coarse, guess, _STEP)
            self.mended += 1
        image = dense_points(coarse, guess.matrix)
        quality = quality_of(frame, image)
        support = support_of(frame, *self.pairs, image)
        failures = self.limits.failures(quality, float(np.trace(guess.matrix)) / self.k, support)
        if failures:
            self.reasons.append(_refusal(quality, failures))
        else:
            merit = guess.merit + _merit(quality)
            self.passed.append(_Passed(Reflection(image, guess.matrix, support, quality), merit))


def _distinct(frame: Frame, passed: list[_Passed]) -> list[Reflection]:
    taken: list[Reflection] = []
    best = min((one.reflection.quality.distortion for one in passed), default=0.0)
    for found in (one.reflection for one in sorted(passed, key=lambda one: one.merit)):
        if found.quality.distortion > 2 * best + _EXACT:
            continue
        if all(_agreeing_area(frame, found.point_map, other.point_map) < SHARED for other in taken):
            taken.append(found)
    return taken


def _with_further(trial: _Trial, taken: list[Reflection]) -> tuple[Reflection, ...]:
    """Look for more reflections from those found, one at a time, until none is new."""
    quick = trial.coarse.first(QUICK[0])
    size = min(QUICK[1], trial.k)
    for _ in range(_MOST):
        if not taken or taken[0].quality.distortion > _EXACT:
            break
        known = [found.matrix for found in taken]
        places = [coarse_points(quick, matrix[:size, :size]) for matrix in known]
        guesses = new_guesses(quick, known, places, size, QUICK[2])
        if not guesses:
            break
        before, tried = len(taken), len(trial.passed)
        for guess in guesses:
            trial.take(guess.matrix, mend=False)
        # Across the axis of a surface of revolution there is one mirror, along it arbitrarily many.
        trial.passed[tried:] = [one for one in trial.passed[tried:] if not _arbitrary(quick, one.reflection)]
        taken = _distinct(trial.coarse.frame, trial.passed)
        if len(taken) <= before:
            break
    return tuple(taken)


def _arbitrary(coarse: Coarse, found: Reflection) -> bool:
    return slides(coarse, found.matrix, min(QUICK[1], len(found.matrix)), QUICK[2])


def _merit(quality: MapQuality) -> float:
    folding = FOLDS * (1 - quality.reversed_area)
    return quality.distortion + quality.residual + quality.involution + folding - MOVES * quality.displacement


def _agreeing_area(frame: Frame, a: IntArray, b: IntArray) -> float:
    near: BoolArray = np.linalg.norm(frame.embedding[a] - frame.embedding[b], axis=1) < SAME
    return float(frame.areas[near].sum())


def support_of(frame: Frame, sources: IntArray, targets: IntArray, image: IntArray) -> float:
    """Share of the voters, of those that have an image, one of whose partners is near it."""
    known = image[sources] >= 0
    if not known.any():
        return 0.0
    sources, targets = sources[known], targets[known]
    gaps = np.linalg.norm(frame.embedding[image[sources]] - frame.embedding[targets], axis=1)
    near: BoolArray = gaps < 2 * WIDTHS[-1]
    return len(np.unique(sources[near])) / len(np.unique(sources))


def _refusal(quality: MapQuality, failures: tuple[str, ...]) -> str:
    if quality.reversed_area < 0.1 and len(failures) == 1:
        kind = "a rotation, not a reflection"
    elif quality.displacement < SAME:
        kind = "collapsed to the identity"
    else:
        kind = "asymmetric: the best map found is no reflection"
    return f"{kind} ({', '.join(failures)})"
