"""Public data by name: what installed packages ship, and what can be had elsewhere, pinned and checked."""

from .fetching import fetch
from .installed import CorticalSurface, Hemisphere, fsaverage5
from .loaders import kids_symmetry, load_pose, pose_symmetry, remeshed_pose
from .registry import Dataset, RemoteFile, registry
from .verifying import Verification, verify

__all__ = [
    "CorticalSurface",
    "Dataset",
    "Hemisphere",
    "RemoteFile",
    "Verification",
    "fetch",
    "fsaverage5",
    "kids_symmetry",
    "load_pose",
    "pose_symmetry",
    "registry",
    "remeshed_pose",
    "verify",
]
