"""Reports: figures without a display, and self-contained interactive pages."""

from .comparison import ShownSurface, comparison_page
from .figures import hemisphere_views, histogram_figure, surface_figure
from .heart import bulls_eye_figure, contour_figure, segment_figure
from .heart_page import heart_page
from .page import surface_page, write_page
from .pairs import correspondence_figure

__all__ = [
    "ShownSurface",
    "bulls_eye_figure",
    "comparison_page",
    "contour_figure",
    "correspondence_figure",
    "heart_page",
    "hemisphere_views",
    "histogram_figure",
    "segment_figure",
    "surface_figure",
    "surface_page",
    "write_page",
]
