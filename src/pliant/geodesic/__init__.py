"""Geodesics: edge graphs, the hierarchy and its sweeps, fields, neighbourhoods, distances."""

from .distances import geodesic_distances
from .field import FieldEstimate, estimate_gfe, gfe
from .graph import EdgeGraph, edge_graph
from .hierarchy import GeodesicHierarchy
from .histogram import gch, gch_edges
from .nearest import Neighbourhoods, nearest

__all__ = [
    "EdgeGraph",
    "FieldEstimate",
    "GeodesicHierarchy",
    "Neighbourhoods",
    "edge_graph",
    "estimate_gfe",
    "gch",
    "gch_edges",
    "geodesic_distances",
    "gfe",
    "nearest",
]
