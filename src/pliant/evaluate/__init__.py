"""Protocols: arrays in, frozen results out."""

from .hits import DEFAULT_FRACTIONS, HitRates, hit_rate, mean_hit_rates
from .maps import MapError, map_error
from .relevance import RelevanceScores, relevance_scores
from .retrieval import RetrievalScores, crossed_interval, retrieval_scores
from .robustness import NoiseCurve, noise_curve, part_of, relative_errors
from .symmetry import SymmetryRepeatability, region_overlap, symmetry_noise, symmetry_repeatability

__all__ = [
    "DEFAULT_FRACTIONS",
    "HitRates",
    "MapError",
    "NoiseCurve",
    "RelevanceScores",
    "RetrievalScores",
    "SymmetryRepeatability",
    "crossed_interval",
    "hit_rate",
    "map_error",
    "mean_hit_rates",
    "noise_curve",
    "part_of",
    "region_overlap",
    "relative_errors",
    "relevance_scores",
    "retrieval_scores",
    "symmetry_noise",
    "symmetry_repeatability",
]
