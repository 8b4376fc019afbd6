"""The left ventricle, from a CT volume to a bull's-eye with evidence (dissertation, chapter 5)."""

from .features import FEATURE_BLOCKS, FEATURE_NAMES, SegmentFeatures, endocardial_features
from .phantom import Change, HeartPhantom, heart_phantom
from .phantom_cohort import PhantomCohort, phantom_cohort
from .segments import SEGMENT_NAMES, TERRITORIES, VentricleFrame, aha_segments, ventricle_frame
from .surface import EndocardialSurface, endocardial_surface, mean_face_normal_filter, vertex_diffusion
from .volume import Volume, load_volume, save_mask

__all__ = [
    "FEATURE_BLOCKS",
    "FEATURE_NAMES",
    "SEGMENT_NAMES",
    "TERRITORIES",
    "Change",
    "EndocardialSurface",
    "HeartPhantom",
    "PhantomCohort",
    "SegmentFeatures",
    "VentricleFrame",
    "Volume",
    "aha_segments",
    "endocardial_features",
    "endocardial_surface",
    "heart_phantom",
    "load_volume",
    "mean_face_normal_filter",
    "phantom_cohort",
    "save_mask",
    "ventricle_frame",
    "vertex_diffusion",
]
