"""Meshes: the value itself, files, check-up and repair, geometry, synthetic shapes, perturbations."""

from . import shapes
from .curvature import Curvatures, principal_curvatures
from .surface import Mesh

__all__ = ["Curvatures", "Mesh", "principal_curvatures", "shapes"]
