"""Synthetic shapes: surfaces in closed form, and posable figures with exact symmetry and correspondence."""

from .figures import Figure, human, quadruped
from .lattices import cylinder, grid, paraboloid, torus
from .posing import Pose
from .spheres import bumpy_sphere, ellipsoid, icosphere, platonic

__all__ = [
    "Figure",
    "Pose",
    "bumpy_sphere",
    "cylinder",
    "ellipsoid",
    "grid",
    "human",
    "icosphere",
    "paraboloid",
    "platonic",
    "quadruped",
    "torus",
]
