"""Meshes: the value itself, files, check-up and repair, geometry, synthetic shapes, perturbations."""

from . import shapes
from .surface import Mesh

__all__ = ["Mesh", "shapes"]
