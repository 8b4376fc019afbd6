"""Regularity and variability of cortical folding over a cohort (dissertation, chapter 2)."""

from .cohort import CohortResult, study_cohort
from .comparison import GroupComparison, RankAgreement, compare_groups, false_discovery_rates, rank_agreement
from .context import ContextSignature
from .cylinder import ConformalCylinder, conformal_cylinder
from .landmarks import Landmarks, landmarks_at, parcel_centres, read_landmarks, snapped_landmarks
from .subjects import Subject, read_cohort, read_map
from .synthetic import SyntheticCohort, synthetic_cohort
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
    "CohortResult",
    "ConformalCylinder",
    "ContextSignature",
    "DeformationResponse",
    "GroupComparison",
    "Landmarks",
    "NoiseCurve",
    "RankAgreement",
    "Subject",
    "SyntheticCohort",
    "TuningTable",
    "Variability",
    "compare_groups",
    "conformal_cylinder",
    "deformation_response",
    "false_discovery_rates",
    "landmarks_at",
    "mean_absolute_deviation",
    "noise_curve",
    "parcel_centres",
    "rank_agreement",
    "read_cohort",
    "read_landmarks",
    "read_map",
    "snapped_landmarks",
    "study_cohort",
    "synthetic_cohort",
    "tuning_table",
    "variability",
]
