"""Settings of the documentation."""

from __future__ import annotations

import warnings
from importlib import metadata

project = "Pliant"
author = "The Pliant developers"
copyright = "2026, The Pliant developers"  # noqa: A001
release = metadata.version("pliant")

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "examples/README.rst", "gallery/*.ipynb", "gallery/*.py"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = "Pliant"
html_static_path: list[str] = []

autosummary_generate = True
numpydoc_show_class_members = False
autodoc_typehints = "none"

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "filename_pattern": "plot_",
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "abort_on_example_error": True,
}

# Sphinx-gallery draws with pyplot, which has no window here.
warnings.filterwarnings("ignore", message="FigureCanvasAgg is non-interactive")
