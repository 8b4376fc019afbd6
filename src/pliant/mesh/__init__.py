"""Meshes: the value itself, files, check-up and repair, geometry, synthetic shapes, perturbations."""

from . import shapes
from .arrays import load_arrays, save_arrays
from .check import CheckUp, Finding, check_up
from .curvature import Curvatures, principal_curvatures
from .files import load_mesh, save_mesh
from .formats import triangulated
from .parcellation import Parcellation, load_parcellation
from .perturb import Perturbed, perturbed, with_noise
from .repair import (
    Repair,
    largest_component,
    merged,
    orient,
    repaired,
    without_degenerate_faces,
    without_duplicate_faces,
    without_unreferenced,
)
from .spin import quasi_conformal_error, spin_transform
from .surface import Mesh
from .topology import boundary_edges, boundary_loops, edge_faces, vertex_components

__all__ = [
    "CheckUp",
    "Curvatures",
    "Finding",
    "Mesh",
    "Parcellation",
    "Perturbed",
    "Repair",
    "boundary_edges",
    "boundary_loops",
    "check_up",
    "edge_faces",
    "largest_component",
    "load_arrays",
    "load_mesh",
    "load_parcellation",
    "merged",
    "orient",
    "perturbed",
    "principal_curvatures",
    "quasi_conformal_error",
    "repaired",
    "save_arrays",
    "save_mesh",
    "shapes",
    "spin_transform",
    "triangulated",
    "vertex_components",
    "with_noise",
    "without_degenerate_faces",
    "without_duplicate_faces",
    "without_unreferenced",
]
