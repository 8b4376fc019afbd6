"""The left ventricle, from a CT volume to a bull's-eye with evidence (dissertation, chapter 5)."""

from .phantom import Change, HeartPhantom
from .volume import Volume, load_volume, save_mask

__all__ = [
    "Change",
    "HeartPhantom",
    "Volume",
    "load_volume",
    "save_mask",
]
