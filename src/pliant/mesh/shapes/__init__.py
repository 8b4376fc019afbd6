"""Synthetic shapes: surfaces in closed form, and posable figures with exact symmetry and correspondence."""

from .lattices import cylinder, grid, paraboloid, torus
from .spheres import bumpy_sphere, ellipsoid, icosphere, platonic

__all__ = ["bumpy_sphere", "cylinder", "ellipsoid", "grid", "icosphere", "paraboloid", "platonic", "torus"]
