"""Regularity and variability of cortical folding over a cohort (dissertation, chapter 2)."""

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

__all__ = [
    "ConformalCylinder",
    "ContextSignature",
    "DeformationResponse",
    "NoiseCurve",
    "TuningTable",
    "conformal_cylinder",
    "deformation_response",
    "noise_curve",
    "tuning_table",
]
