"""Reports: figures without a display, and self-contained interactive pages."""

from .cohort import extremes_figure, ranking_figure, sites_figure
from .cohort_page import CohortTable, cohort_page
from .comparison import ShownSurface, comparison_page
from .figures import hemisphere_views, histogram_figure, surface_figure
from .heart import bulls_eye_figure, contour_figure, segment_figure
from .heart_page import heart_page
from .page import surface_page, write_page
from .pairs import correspondence_figure
from .symmetry import correspondence_sources, symmetry_page

__all__ = [
    "CohortTable",
    "ShownSurface",
    "bulls_eye_figure",
    "cohort_page",
    "comparison_page",
    "contour_figure",
    "correspondence_figure",
    "correspondence_sources",
    "extremes_figure",
    "heart_page",
    "hemisphere_views",
    "histogram_figure",
    "ranking_figure",
    "segment_figure",
    "sites_figure",
    "surface_figure",
    "surface_page",
    "symmetry_page",
    "write_page",
]
