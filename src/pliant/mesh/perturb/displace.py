"""Perturbations that move vertices one by one: noise, shot noise, scale and local scale."""

from __future__ import annotations

import numpy as np

from ..._arrays import FloatArray
from ...errors import InputError
from ..surface import Mesh
from .result import Perturbed, Seed, checked_strength, mean_edge_length, moved

__all__ = ["local_scale", "noise", "scale", "shot_noise", "with_noise"]


def with_noise(mesh: Mesh, sigma: float, *, rng: Seed) -> Mesh:
    """Displace every vertex along its normal by independent Gaussian noise.

    Parameters
    ----------
    mesh : Mesh
        The shape.
    sigma : float
        Standard deviation in mean edge lengths, at least 0. Figures 2.8, 3.8 and 4.9 go up to 0.9 or 1.
    rng : int or numpy.random.Generator
        Seed; the same one gives the same bytes, and the same noise in units of sigma.

    Returns
    -------
    Mesh
        The same triangles, displaced. Vertices that no triangle uses stay.

    Raises
    ------
    InputError
        If sigma is negative or not finite.
    MeshError
        If no edge has a length.

    Notes
    -----
    Linear in the number of vertices. Past sigma of about 0.3 triangles fold over.

    References
    ----------
    Dissertation, sections 2.5 (Fig. 2.8), 3.5 (Fig. 3.8), 4.5 (Fig. 4.9).

    Examples
    --------
    >>> from pliant import shapes
    >>> ball = shapes.icosphere(4)
    >>> rough = with_noise(ball, 0.2, rng=0)
    >>> shift = np.linalg.norm(rough.vertices, axis=1) - 1
    >>> round(float(shift.std() / ball.edge_lengths.mean()), 2)
    0.2
    """
    if not (np.isfinite(sigma) and sigma >= 0):
        message = f"sigma must be at least 0, in mean edge lengths, got {sigma!r}"
        raise InputError(message)
    draws = np.random.default_rng(rng).standard_normal(mesh.n_vertices)
    return _displaced(mesh, float(sigma) * mean_edge_length(mesh) * draws)


def noise(mesh: Mesh, *, strength: int, rng: Seed) -> Perturbed:
    """Displace every vertex along its normal, sigma = 0.1 mean edge lengths times the strength.

    Parameters, errors and result as for :func:`perturbed`; see :func:`with_noise` for any other sigma.

    Examples
    --------
    >>> from pliant import shapes
    >>> noise(shapes.icosphere(2), strength=3, rng=0)
    Perturbed(noise 3: 162 vertices, normal noise of 0.3 mean edge lengths)
    """
    strength = checked_strength(strength)
    sigma = strength / 10
    result = with_noise(mesh, sigma, rng=rng) if strength else mesh
    return moved(mesh, result, "noise", strength, f"normal noise of {sigma:.1f} mean edge lengths")


def shot_noise(mesh: Mesh, *, strength: int, rng: Seed) -> Perturbed:
    """Move 0.2 % of the vertices times the strength far along their normals, outwards or inwards.

    Displacements are uniform between 2 and 6 mean edge lengths; at least one vertex moves. Parameters, errors
    and result as for :func:`perturbed`.

    Examples
    --------
    >>> from pliant import shapes
    >>> shot_noise(shapes.icosphere(3), strength=5, rng=0)
    Perturbed(shot_noise 5: 642 vertices, 6 vertices moved by 2 to 6 mean edge lengths)
    """
    strength = checked_strength(strength)
    if not strength:
        return moved(mesh, mesh, "shot_noise", 0, "unchanged")
    rng = np.random.default_rng(rng)
    unit = mean_edge_length(mesh)
    able = np.flatnonzero(mesh.vertex_normals.any(axis=1))
    count = min(len(able), max(1, round(0.002 * strength * len(able))))
    hit = rng.choice(able, size=count, replace=False)
    shift = np.zeros(mesh.n_vertices)
    shift[hit] = unit * rng.uniform(2, 6, size=count) * rng.choice([-1.0, 1.0], size=count)
    text = f"{count} vertices moved by 2 to 6 mean edge lengths"
    return moved(mesh, _displaced(mesh, shift), "shot_noise", strength, text)


def scale(mesh: Mesh, *, strength: int) -> Perturbed:
    """Scale the shape about the origin by 1.25 to the power of the strength: up to 3.05.

    Parameters, errors and result as for :func:`perturbed`; there is no chance in it.

    Examples
    --------
    >>> from pliant import shapes
    >>> scale(shapes.icosphere(1), strength=2)
    Perturbed(scale 2: 42 vertices, scaled by 1.5625)
    """
    strength = checked_strength(strength)
    factor = 1.25**strength
    return moved(
        mesh, mesh.scaled(factor) if strength else mesh, "scale", strength, f"scaled by {factor:.5g}"
    )


def local_scale(mesh: Mesh, *, strength: int, rng: Seed) -> Perturbed:
    """Inflate three balls of space around random surface points, smoothly, by 1.25 times and up to 2.25 times.

    Inside a ball of radius R (a quarter of the root of the surface's area) a point at distance r from the
    centre moves to ``r (1 + (s - 1) (1 - (r / R)^2)^3)``, s = 1 + strength / 4: by s at the centre, by
    nothing at R. The map of space is smooth and one-to-one, so a surface that does not cut itself still does
    not. Parameters, errors and result as for :func:`perturbed`.

    Examples
    --------
    >>> from pliant import shapes
    >>> local_scale(shapes.icosphere(3), strength=2, rng=0)
    Perturbed(local_scale 2: 642 vertices, 3 balls of radius 0.884 inflated 1.5 times)
    """
    strength = checked_strength(strength)
    if not strength:
        return moved(mesh, mesh, "local_scale", 0, "unchanged")
    rng = np.random.default_rng(rng)
    mean_edge_length(mesh)
    factor = 1 + strength / 4
    radius = 0.25 * float(np.sqrt(mesh.area))
    chance = mesh.vertex_areas / mesh.vertex_areas.sum() if mesh.area > 0 else None
    vertices = mesh.vertices
    for centre in rng.choice(mesh.n_vertices, size=3, p=chance):
        vertices = _inflated(vertices, vertices[centre], radius, factor)
    text = f"3 balls of radius {radius:.3g} inflated {factor:g} times"
    return moved(mesh, mesh.with_vertices(vertices), "local_scale", strength, text)


def _inflated(points: FloatArray, centre: FloatArray, radius: float, factor: float) -> FloatArray:
    offset = points - centre
    depth = np.maximum(1 - (offset**2).sum(axis=1, keepdims=True) / radius**2, 0) if radius > 0 else 0.0
    inflated: FloatArray = points + offset * ((factor - 1) * depth**3)
    return inflated


def _displaced(mesh: Mesh, shift: FloatArray) -> Mesh:
    return mesh.with_vertices(mesh.vertices + shift[:, None] * mesh.vertex_normals)
