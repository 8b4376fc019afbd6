"""Intrinsic symmetry: pairs by voting, reflections as dense maps, their complexity."""

from .detect import detect_symmetries
from .mapping import Limits, Reflection, reflections
from .measures import MapQuality, map_quality, reversed_area
from .result import Symmetry, SymmetryResult
from .space import complexity
from .voting import SymmetricPairs, symmetric_pairs

__all__ = [
    "Limits",
    "MapQuality",
    "Reflection",
    "SymmetricPairs",
    "Symmetry",
    "SymmetryResult",
    "complexity",
    "detect_symmetries",
    "map_quality",
    "reflections",
    "reversed_area",
    "symmetric_pairs",
]
