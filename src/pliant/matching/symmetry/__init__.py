"""Intrinsic symmetry: pairs by voting, reflections as dense maps, limbs that are alike, their complexity and groups."""

from .detect import detect_symmetries
from .mapping import Limits, Reflection, reflections
from .measures import MapQuality, map_quality, reversed_area
from .partial import PartialSearch, partial_symmetries
from .result import Symmetry, SymmetryResult
from .space import complexity, group_symmetries, symmetry_space
from .voting import SymmetricPairs, symmetric_pairs

__all__ = [
    "Limits",
    "MapQuality",
    "PartialSearch",
    "Reflection",
    "SymmetricPairs",
    "Symmetry",
    "SymmetryResult",
    "complexity",
    "detect_symmetries",
    "group_symmetries",
    "map_quality",
    "partial_symmetries",
    "reflections",
    "reversed_area",
    "symmetric_pairs",
    "symmetry_space",
]
