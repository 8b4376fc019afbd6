"""The left ventricle, from a CT volume to a bull's-eye with evidence (dissertation, chapter 5)."""

from .bag import BagOfFeatures, ColumnHistograms
from .cohort import HeartCohort, HeartSubject, describe_cohort, read_heart_cohort, read_heart_landmarks
from .features import FEATURE_BLOCKS, FEATURE_NAMES, SegmentFeatures, endocardial_features
from .levelset import LevelSet, distance_regularized_level_set
from .patient import HeartDescription, describe_heart
from .phantom import Change, HeartPhantom, heart_phantom
from .phantom_cohort import PhantomCohort, phantom_cohort
from .segment_names import SEGMENT_NAMES
from .segmentation import BloodPool, segment_blood_pool, volume_overlap
from .segments import TERRITORIES, VentricleFrame, aha_segments, ventricle_frame
from .study import HeartStudy, StudyRow, heart_study
from .surface import EndocardialSurface, endocardial_surface, mean_face_normal_filter, vertex_diffusion
from .volume import Volume, load_volume, save_mask

__all__ = [
    "FEATURE_BLOCKS",
    "FEATURE_NAMES",
    "SEGMENT_NAMES",
    "TERRITORIES",
    "BagOfFeatures",
    "BloodPool",
    "Change",
    "ColumnHistograms",
    "EndocardialSurface",
    "HeartCohort",
    "HeartDescription",
    "HeartPhantom",
    "HeartStudy",
    "HeartSubject",
    "LevelSet",
    "PhantomCohort",
    "SegmentFeatures",
    "StudyRow",
    "VentricleFrame",
    "Volume",
    "aha_segments",
    "describe_cohort",
    "describe_heart",
    "distance_regularized_level_set",
    "endocardial_features",
    "endocardial_surface",
    "heart_phantom",
    "heart_study",
    "load_volume",
    "mean_face_normal_filter",
    "phantom_cohort",
    "read_heart_cohort",
    "read_heart_landmarks",
    "save_mask",
    "segment_blood_pool",
    "ventricle_frame",
    "vertex_diffusion",
    "volume_overlap",
]
