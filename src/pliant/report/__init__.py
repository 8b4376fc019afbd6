"""Reports: figures without a display, and self-contained interactive pages."""

from .comparison import ShownSurface, comparison_page
from .figures import hemisphere_views, histogram_figure, surface_figure
from .page import surface_page, write_page
from .pairs import correspondence_figure

__all__ = [
    "ShownSurface",
    "comparison_page",
    "correspondence_figure",
    "hemisphere_views",
    "histogram_figure",
    "surface_figure",
    "surface_page",
    "write_page",
]
