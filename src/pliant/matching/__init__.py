"""Functional maps, point maps, sparse correspondence, key components, symmetry."""

from .components import KeyComponents, key_components
from .dense import PointMap, dense_map
from .functional_map import FunctionalMap, fmap_from_points, functional_map, point_map
from .refine import icp_refine, zoomout
from .sampling import farthest_points
from .sparse import Correspondence, correspond

__all__ = [
    "Correspondence",
    "FunctionalMap",
    "KeyComponents",
    "PointMap",
    "correspond",
    "dense_map",
    "farthest_points",
    "fmap_from_points",
    "functional_map",
    "icp_refine",
    "key_components",
    "point_map",
    "zoomout",
]
