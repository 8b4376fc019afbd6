"""Regularity and variability of cortical folding over a cohort (dissertation, chapter 2)."""

from .comparison import GroupComparison, RankAgreement, compare_groups, false_discovery_rates, rank_agreement
from .context import ContextSignature
from .cylinder import ConformalCylinder, conformal_cylinder
from .tuning import (
    DeformationResponse,
    NoiseCurve,
    TuningTable,
    deformation_response,
    noise_curve,
    tuning_table,
)
from .variability import Variability, mean_absolute_deviation, variability

__all__ = [
    "ConformalCylinder",
    "ContextSignature",
    "DeformationResponse",
    "GroupComparison",
    "NoiseCurve",
    "RankAgreement",
    "TuningTable",
    "Variability",
    "compare_groups",
    "conformal_cylinder",
    "deformation_response",
    "false_discovery_rates",
    "mean_absolute_deviation",
    "noise_curve",
    "rank_agreement",
    "tuning_table",
    "variability",
]
