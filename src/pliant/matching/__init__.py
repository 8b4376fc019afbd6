"""Functional maps, point maps, sparse correspondence, key components, symmetry."""

from .functional_map import FunctionalMap, fmap_from_points, functional_map, point_map
from .refine import icp_refine, zoomout
from .sampling import farthest_points

__all__ = [
    "FunctionalMap",
    "farthest_points",
    "fmap_from_points",
    "functional_map",
    "icp_refine",
    "point_map",
    "zoomout",
]
