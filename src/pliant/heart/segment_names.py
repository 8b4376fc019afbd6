"""What the seventeen segments are called (Cerqueira et al. 2002), apart from all that finds them."""

from __future__ import annotations

__all__ = ["SEGMENT_NAMES"]

_RING = ("anterior", "anteroseptal", "inferoseptal", "inferior", "inferolateral", "anterolateral")
#: Names of segments 1 to 17, in order.
SEGMENT_NAMES: tuple[str, ...] = (
    *(f"basal {wall}" for wall in _RING),
    *(f"mid {wall}" for wall in _RING),
    *(f"apical {wall}" for wall in ("anterior", "septal", "inferior", "lateral")),
    "apex",
)
