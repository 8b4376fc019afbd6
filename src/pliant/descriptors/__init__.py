"""Signatures: a row of numbers for every vertex, to be compared by L2; and a metric learned for them."""

from .balls import ball_sums
from .density import DEFAULT_RADII, Average, bde, rms_biharmonic_distance
from .geometry import curvature_signature, geodesic_context
from .signatures import bdk, hks, wks
from .whitener import Whitener, perturbed_differences

__all__ = [
    "DEFAULT_RADII",
    "Average",
    "Whitener",
    "ball_sums",
    "bde",
    "bdk",
    "curvature_signature",
    "geodesic_context",
    "hks",
    "perturbed_differences",
    "rms_biharmonic_distance",
    "wks",
]
