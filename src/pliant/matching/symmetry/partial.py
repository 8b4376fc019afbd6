"""Symmetries of parts: limbs that are alike, each pair with its own regions, eigenbases and maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from ..._arrays import BoolArray, FloatArray, IntArray
from ...mesh import Mesh
from ...spectral import Spectrum
from .._neighbours import nearest_rows
from ._frame import Frame
from ._limbs import Limbs, limbs_of
from ._refine import orthogonal
from ._regions import FEWEST, WORST, Region, RegionMap, agreeing, region, region_maps, spectral_gap
from .mapping import continuous_symmetry, support_of, voting_pairs
from .measures import reversed_area, signature_residual
from .result import Symmetry
from .space import complexity

__all__ = ["PartialSearch", "partial_symmetries"]

# Legs of bent animals, front to hind, have differences of log eigenvalues up to .16.
_SPECTRAL = 0.3
# What a pair of limbs must keep to be accepted; the limits of the whole are not for them.
LIMITS = {"distortion": WORST, "eigenvalues": _SPECTRAL}
# Share of a region that a reflection must carry into the other one to imply the pair.
_IMPLIED = 0.6
_SEEDED = 14


@dataclass(frozen=True, eq=False)
class PartialSearch:
    """Pairs of regions that are alike, the most confident first; and why there are none, or not more.

    Attributes
    ----------
    symmetries : tuple of Symmetry
    reasons : tuple of str
    """

    symmetries: tuple[Symmetry, ...]
    reasons: tuple[str, ...]


def partial_symmetries(
    mesh: Mesh,
    spectrum: Spectrum,
    *,
    reflections: Sequence[IntArray] = (),
    samples: int = 100,
    rng: int | np.random.Generator | None = None,
) -> PartialSearch:
    """Find limbs of a surface that are alike, pair by pair: leg to leg, arm to arm.

    Parameters
    ----------
    mesh : Mesh
        In one piece, wound alike throughout.
    spectrum : Spectrum
        Of the mesh, 30 eigenpairs at least; 200 are good.
    reflections : sequence of (n,) array of int
        Point maps of reflections of the whole surface, where they are known. A pair that one of them carries
        over is reported all the same, with the place of that one in ``implied_by``.
    samples : int
        Voters, for the support.
    rng : int or numpy.random.Generator, optional
        Draws the first sample; by default it is the point farthest out.

    Returns
    -------
    PartialSearch
        One symmetry a pair, so that overlapping ones (a leg and each of the others) stay apart. None, with the
        reason, where no two limbs are alike, and on surfaces of revolution.

    Raises
    ------
    InputError
        If the mesh is in pieces, the spectrum is not of this mesh or too short, or an option is out of range.

    Notes
    -----
    Tips are the maxima of the biharmonic eccentricity that stand out. Around each a geodesic ball grows; where it is
    narrowest beside a flat disc, the limb ends. Two limbs are alike where their balls' areas agree all the way there.
    The regions of limbs that hang together by being alike are balls of one radius, nine tenths of the way to where the
    nearest two would meet: tips keep their distances when a surface bends. Each region is a surface of its own with
    its own eigenbasis. The maps between two start from turns of the rim by every twelfth, either way about, and from
    the reflections given; among the best that differ those are taken whose compositions around three limbs agree.

    Do not trust the turn about a limb's axis where the limb is round, nor the side (``reversed_area``) from front to
    hind: a leg is nearly its own mirror image. Limbs that bend at the knee lose similarity; support is low there.

    Cost: about 0.2 s of one core a limb and 0.15 s a pair.

    References
    ----------
    Dissertation, sections 4.3.9 and 4.5.2.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> figure = shapes.quadruped(2500)
    >>> found = partial_symmetries(figure.mesh, eigenbasis(figure.mesh, 100))
    >>> len(found.symmetries)
    6
    >>> leg = found.symmetries[0]
    >>> figure.part_names[np.bincount(figure.parts[leg.source]).argmax()].endswith("leg")
    True
    """
    frame = Frame(mesh, spectrum)
    reason = continuous_symmetry(frame)
    if reason:
        return PartialSearch((), (reason,))
    return search_parts(frame, voting_pairs(frame, samples, rng), reflections)


def search_parts(
    frame: Frame, voters: tuple[IntArray, IntArray], reflections: Sequence[IntArray]
) -> PartialSearch:
    """Run the search on a surface that has been seen to have no continuous symmetry."""
    limbs = limbs_of(frame)
    pairs = limbs.pairs()
    if not len(pairs):
        reason = f"no partial symmetry: of {len(limbs.tips)} tips no two have limbs that are alike"
        return PartialSearch((), (reason,))
    found: list[Symmetry] = []
    reasons: list[str] = []
    with threadpool_limits(1):  # matrices this small lose more than they gain by threads
        for family in limbs.families(pairs):
            _family(limbs, family, voters, reflections, found, reasons)
    found.sort(key=lambda one: -one.confidence)
    return PartialSearch(tuple(found), tuple(dict.fromkeys(reasons)))


def _family(
    limbs: Limbs,
    pairs: IntArray,
    voters: tuple[IntArray, IntArray],
    reflections: Sequence[IntArray],
    found: list[Symmetry],
    reasons: list[str],
) -> None:
    """Add the symmetries between limbs that hang together."""
    frame = limbs.frame
    radius = limbs.radius(pairs)
    members = np.unique(pairs).tolist()
    regions = {i: region(frame.mesh, limbs.ball(i, radius), limbs.distances[i]) for i in members}
    if any(one is None for one in regions.values()):
        reasons.append(f"limbs that are alike have fewer than {FEWEST} vertices; refine the mesh to map them")
    whole = {i: one for i, one in regions.items() if one is not None}
    kept = [(i, j) for i, j in pairs.tolist() if i in whole and j in whole]
    implied = {(i, j): _implying(frame, whole[i], whole[j], reflections) for i, j in kept}
    candidates = {
        (i, j): region_maps(whole[i], whole[j], _starts(whole[i], whole[j], reflections, implied[i, j]))
        for i, j in kept
    }
    for pair, choice in agreeing(candidates).items():
        a, b = (whole[i] for i in pair)
        chosen = candidates[pair][choice]
        gap = spectral_gap(a.frame.spectrum, b.frame.spectrum)
        if chosen.distortion > WORST or gap > _SPECTRAL:
            reasons.append(
                f"limbs at vertices {int(limbs.tips[pair[0]])} and {int(limbs.tips[pair[1]])} grow alike, but "
                f"distances differ by {chosen.distortion:.2f} (limit {WORST}) or eigenvalues by "
                f"{gap:.2f} (limit {_SPECTRAL})"
            )
            continue
        slack = float(np.mean([1 - chosen.distortion / WORST, 1 - gap / _SPECTRAL]))
        found.append(_symmetry(frame, a, b, chosen, voters, max(slack, 0.0), implied[pair]))


def _symmetry(
    frame: Frame,
    a: Region,
    b: Region,
    chosen: RegionMap,
    voters: tuple[IntArray, IntArray],
    confidence: float,
    implied_by: int,
) -> Symmetry:
    k = len(chosen.matrix)
    rows = [side.frame.spectrum.vectors[:, :k] * side.frame.spectrum.area**0.5 for side in (a, b)]
    image = np.full(frame.mesh.n_vertices, -1)
    image[a.vertices] = b.vertices[nearest_rows(rows[1], rows[0] @ chosen.matrix)]
    return Symmetry(
        _mask(frame, a),
        _mask(frame, b),
        image,
        chosen.matrix,
        support_of(frame, *voters, image),
        complexity(chosen.matrix),
        chosen.distortion,
        reversed_area(frame.mesh, image),
        signature_residual(frame, a.vertices, image[a.vertices], frame.areas[a.vertices]),
        confidence,
        "partial",
        implied_by=implied_by,
        bases=(a.frame.spectrum, b.frame.spectrum),
    )


def _mask(frame: Frame, part: Region) -> BoolArray:
    mask = np.zeros(frame.mesh.n_vertices, dtype=bool)
    mask[part.vertices] = True
    return mask


def _implying(frame: Frame, a: Region, b: Region, reflections: Sequence[IntArray]) -> int:
    """Place of the reflection that carries one region to the other, or -1."""
    inside = _mask(frame, b)
    weights = frame.areas[a.vertices]
    shares = [float(weights @ inside[image[a.vertices]] / weights.sum()) for image in reflections]
    best = int(np.argmax(shares)) if shares else -1
    return best if best >= 0 and shares[best] > _IMPLIED else -1


def _starts(a: Region, b: Region, reflections: Sequence[IntArray], implied_by: int) -> list[FloatArray]:
    """Return the reflection that implies a pair as a first guess of its map."""
    if implied_by < 0:
        return []
    image = reflections[implied_by][a.vertices]
    place = np.minimum(np.searchsorted(b.vertices, image), len(b.vertices) - 1)
    met = b.vertices[place] == image
    bases = [side.frame.spectrum.vectors[:, :_SEEDED] * side.frame.spectrum.area**0.5 for side in (a, b)]
    weighted = bases[0][met] * a.frame.areas[met, None]
    return [orthogonal(weighted.T @ bases[1][place[met]])]
