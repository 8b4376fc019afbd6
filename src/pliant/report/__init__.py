"""Reports: figures without a display, and self-contained interactive pages."""

from .figures import hemisphere_views, histogram_figure, surface_figure

__all__ = ["hemisphere_views", "histogram_figure", "surface_figure"]
