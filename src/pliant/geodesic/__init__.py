"""Geodesics: edge graphs, the hierarchy and its sweeps, fields, neighbourhoods, distances, paths."""

from .distances import distance_to_set, geodesic_distances
from .field import FieldEstimate, estimate_gfe, gfe
from .graph import EdgeGraph, edge_graph
from .hierarchy import GeodesicHierarchy
from .histogram import gch, gch_edges
from .nearest import Neighbourhoods, nearest
from .paths import GeodesicPath, geodesic_path, geodesic_paths

__all__ = [
    "EdgeGraph",
    "FieldEstimate",
    "GeodesicHierarchy",
    "GeodesicPath",
    "Neighbourhoods",
    "distance_to_set",
    "edge_graph",
    "estimate_gfe",
    "gch",
    "gch_edges",
    "geodesic_distances",
    "geodesic_path",
    "geodesic_paths",
    "gfe",
    "nearest",
]
