"""The left ventricle, from a CT volume to a bull's-eye with evidence (dissertation, chapter 5)."""

from .phantom import Change, HeartPhantom, heart_phantom
from .phantom_cohort import PhantomCohort, phantom_cohort
from .volume import Volume, load_volume, save_mask

__all__ = [
    "Change",
    "HeartPhantom",
    "PhantomCohort",
    "Volume",
    "heart_phantom",
    "load_volume",
    "phantom_cohort",
    "save_mask",
]
