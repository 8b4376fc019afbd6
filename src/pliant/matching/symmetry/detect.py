"""The search for the symmetries of a surface in one call."""

from __future__ import annotations

import os
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from ..._progress import progress_bar
from ...errors import InputError
from ...mesh import Mesh, vertex_components
from ...mesh.fingerprint import MeshFingerprint
from ...spectral import Spectrum, eigenbasis
from ._frame import Frame
from .mapping import Limits, Reflection, continuous_symmetry, search_reflections, voting_pairs
from .partial import LIMITS, search_parts
from .result import Symmetry, SymmetryResult
from .space import complexity, group_symmetries

__all__ = ["detect_symmetries"]

_EIGENPAIRS = 200
_FEWEST_VERTICES = 200


def detect_symmetries(
    mesh: Mesh,
    *,
    samples: int = 100,
    k: int = 120,
    parts: bool = True,
    spectrum: Spectrum | None = None,
    limits: Limits | None = None,
    cache: str | os.PathLike[str] | None = None,
    rng: int | np.random.Generator | None = None,
    progress: bool = False,
) -> SymmetryResult:
    """Find the intrinsic symmetries of a surface, those that bending leaves: reflections, and limbs that are alike.

    Parameters
    ----------
    mesh : Mesh
        Wound alike throughout; holes do no harm where they are symmetric too.
    samples : int
        Voters; the dissertation uses 20 to 100.
    k : int
        Eigenfunctions in the final maps.
    parts : bool
        Also look for symmetries of parts.
    spectrum : Spectrum, optional
        Of the mesh, where it is known; otherwise 200 eigenpairs are computed.
    limits : Limits, optional
        What a map of the whole must keep to be accepted. Pairs of limbs have limits of their own; the result's
        settings name both.
    cache : path-like, optional
        Folder to keep the eigenpairs in.
    rng : int or numpy.random.Generator, optional
        Draws the first sample; by default it is the point farthest out, and nothing is random.
    progress : bool
        Tell how far it is: a bar on a terminal, plain lines elsewhere.

    Returns
    -------
    SymmetryResult
        Symmetries, the global ones first, each kind with the most confident first; ``group`` says which are alike, and
        ``implied_by`` which pairs of limbs a global one carries over already. No global symmetry, and the reason, for a
        surface that has none; none at all for one in pieces or with arbitrarily many (a sphere, a surface of
        revolution): never one arbitrary map.

    Raises
    ------
    InputError
        If the mesh has fewer than 200 vertices, or an option is out of range.

    See Also
    --------
    pliant.matching.symmetry.symmetric_pairs : the first stage, sparse pairs by voting.
    pliant.matching.symmetry.reflections : the second stage, dense maps.
    pliant.matching.symmetry.partial_symmetries : pairs of limbs.

    Notes
    -----
    A few seconds of one core for 5,000 vertices, up to ten for 50,000, the eigenpairs apart.

    Not to be trusted: on a shape that is nearly symmetric in other ways too (a bent pose whose trunk looks alike from
    front and back may come back half turned); with few triangles on thin limbs; for translational copies, which are
    out of reach. Only reflections are reported of the whole, not rotations; and only limbs of parts.

    References
    ----------
    Dissertation, chapter 4.

    Examples
    --------
    >>> from pliant import shapes
    >>> figure = shapes.quadruped(1000)
    >>> result = detect_symmetries(figure.mesh)
    >>> len(result.symmetries), result.symmetries[0].kind
    (1, 'global')
    """
    limits = limits or Limits()
    settings: dict[str, Any] = {"samples": int(samples), "k": int(k), "parts": bool(parts)}
    settings["limits_of_the_whole"] = asdict(limits)
    if parts:
        settings["limits_of_limb_pairs"] = dict(LIMITS)
    fingerprint = MeshFingerprint.of(mesh)
    pieces, _ = vertex_components(mesh)
    if pieces > 1:
        reason = (
            f"the surface has {pieces} pieces; copies of a piece are out of reach, take "
            "pliant.largest_component(mesh)"
        )
        return SymmetryResult((), (reason,), settings, fingerprint)
    if mesh.n_vertices < _FEWEST_VERTICES:
        message = f"the search needs {_FEWEST_VERTICES} vertices at least, got {mesh.n_vertices}"
        raise InputError(message)
    if spectrum is None:
        pairs = min(_EIGENPAIRS, mesh.n_vertices // 3)
        spectrum = eigenbasis(mesh, pairs, cache=cache, progress=progress)
    frame = Frame(mesh, spectrum)
    reason = continuous_symmetry(frame)
    if reason:
        return SymmetryResult((), (reason,), settings, fingerprint)
    # Voting, the whole, and its parts, each in its turn.
    with progress_bar("symmetries", 2 + parts, show=progress) as advance:
        voters = voting_pairs(frame, samples, rng)
        advance()
        found = search_reflections(frame, voters, k, limits)
        whole = sorted((_global(r, limits) for r in found.reflections), key=lambda s: -s.confidence)
        advance()
        others = search_parts(frame, voters, [one.point_map for one in whole]) if parts else None
    every = [*whole, *(others.symmetries if others else ())]
    groups = group_symmetries(every, spectrum)
    return SymmetryResult(
        tuple(replace(one, group=int(group)) for one, group in zip(every, groups, strict=True)),
        (*found.reasons, *(others.reasons if others else ())),
        settings,
        fingerprint,
    )


def _global(reflection: Reflection, limits: Limits) -> Symmetry:
    quality = reflection.quality
    everything = np.ones(len(reflection.point_map), dtype=bool)
    slack = [
        max(0.0, 1 - value / limit) if limit > 0 else 0.0
        for value, limit in (
            (quality.distortion, limits.distortion),
            (quality.residual, limits.residual),
            (quality.involution, limits.involution),
        )
    ]
    return Symmetry(
        everything,
        everything,
        reflection.point_map,
        reflection.matrix,
        reflection.support,
        complexity(reflection.matrix),
        quality.distortion,
        quality.reversed_area,
        quality.residual,
        float(np.mean(slack)) * quality.reversed_area,
    )
