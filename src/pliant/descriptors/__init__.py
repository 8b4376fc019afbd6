"""Per-vertex signatures of a surface."""

from .signatures import bdk, hks, wks

__all__ = ["bdk", "hks", "wks"]
