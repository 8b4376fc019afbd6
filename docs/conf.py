"""Settings of the documentation."""

from __future__ import annotations

import importlib
import importlib.util
import pathlib
from importlib import metadata

project = "Pliant"
author = "The Pliant developers"
copyright = "2026, The Pliant developers"
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

# The scraper above is a function, and so the configuration cannot be kept between builds; nothing else is lost.
suppress_warnings = ["config.cache"]

autosummary_generate = True
numpydoc_show_class_members = False
autodoc_typehints = "none"


def figure_scraper(block: tuple, block_vars: dict, gallery_conf: dict) -> str:
    """Show the figure that a block of a gallery script ends with; Pliant's figures never touch pyplot."""
    from matplotlib.figure import Figure
    from sphinx_gallery.scrapers import figure_rst

    names = block_vars["example_globals"]
    shown = names.get("___")
    if not isinstance(shown, Figure) or shown is names.get("__last_shown"):
        return ""
    names["__last_shown"] = shown
    path = next(block_vars["image_path_iterator"])
    shown.savefig(path, dpi=130)
    return figure_rst([path], gallery_conf["src_dir"])


sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "image_scrapers": ("matplotlib", figure_scraper),
    # Without "__repr__" the value of a block's last line is not kept, and its figure not found.
    "capture_repr": ("__repr__",),
    "ignore_repr_types": r"matplotlib\.figure",
    "gallery_dirs": "gallery",
    "filename_pattern": "plot_",
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "abort_on_example_error": True,
}


ROOMS = {
    "mesh": "Meshes",
    "mesh.shapes": "Synthetic shapes",
    "geodesic": "Geodesics",
    "spectral": "Spectra",
    "descriptors": "Descriptors",
    "matching": "Matching",
    "matching.symmetry": "Symmetry",
    "evaluate": "Evaluation",
    "images": "Images",
    "retrieval": "Retrieval",
    "cortex": "Cortex",
    "heart": "Heart",
    "report": "Figures and pages",
    "errors": "Errors",
}


def write_reference() -> None:
    """Write the API page from what each room exports, so that it cannot fall behind."""
    import pliant

    everything = set(dir(pliant))
    lines = ["# API", "", "Names marked * are also `pliant.<name>`.", "", "```{eval-rst}"]
    for room, title in ROOMS.items():
        if importlib.util.find_spec(f"pliant.{room}") is None:
            continue
        names = importlib.import_module(f"pliant.{room}").__all__
        starred = ", ".join(f"``{name}``" for name in names if name in everything)
        lines += [title, "-" * len(title), f".. currentmodule:: pliant.{room}", ""]
        lines += [f"\\* {starred}", ""] if starred else []
        lines += [".. autosummary::", "   :toctree: api/generated", ""]
        lines += [f"   {name}" for name in names] + [""]
    page = pathlib.Path(__file__).parent / "api.md"
    page.write_text("\n".join([*lines, "```", ""]))


write_reference()
