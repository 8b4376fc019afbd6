"""Surfaces with a known spectrum."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from pliant import Mesh
from pliant.spectral import Laplacian, cotan_laplacian


def torus_laplacian(n: int, m: int, width: float, height: float) -> Laplacian:
    """Flat torus as a grid glued at its sides: it has edge lengths, and no place in space."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    dx, dy = width / n, height / m
    dz = np.hypot(dx, dy)
    faces = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    lengths = np.vstack([np.tile([dy, dz, dx], (n * m, 1)), np.tile([dx, dy, dz], (n * m, 1))])
    return cotan_laplacian(lengths, faces)


def random_sphere(n: int, seed: int) -> Mesh:
    """Convex hull of random points on the unit sphere: as irregular as a triangulation gets."""
    points = np.random.default_rng(seed).standard_normal((n, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return Mesh(points, ConvexHull(points).simplices)


def random_square(n: int, seed: int) -> Mesh:
    """Delaunay triangulation of random points in the unit square, with its border sampled evenly."""
    rng = np.random.default_rng(seed)
    side = np.linspace(0, 1, int(np.sqrt(n)))[:-1]
    zero, one = np.zeros_like(side), np.ones_like(side)
    border = np.vstack(
        [np.column_stack(p) for p in ((side, zero), (one, side), (1 - side, one), (zero, 1 - side))]
    )
    points = np.vstack([border, rng.uniform(0.02, 0.98, (n, 2))])
    return Mesh(np.column_stack([points, np.zeros(len(points))]), Delaunay(points).simplices)


@pytest.fixture
def flat_torus() -> Callable[..., Laplacian]:
    return torus_laplacian


@pytest.fixture
def irregular_sphere() -> Callable[..., Mesh]:
    return random_sphere


@pytest.fixture
def irregular_square() -> Callable[..., Mesh]:
    return random_square
