"""
The geodesic field of a cortex
==============================

How likely does a shortest path between two random points of the surface pass here? All 52 million pairs of vertices of
a hemisphere are counted, in about a second.
"""

# %%
# The mesh ships with nilearn; any file that :func:`pliant.load_mesh` reads will do.
import pliant
from pliant.datasets import fsaverage5
from pliant.report import hemisphere_views, surface_figure

mesh = fsaverage5("pial")
field = pliant.gfe(mesh)
look = {
    "views": hemisphere_views("left"),
    "colour_bar_label": "GFE (per mm²)",
    "scale": "log",
    "length_unit": "mm",
}
surface_figure(mesh, field, title="Geodesic field estimate", **look)

# %%
# The traffic concentrates where the surface leaves few ways round. A sample of sources estimates the
# same field, and says how far to trust each value.
estimate = pliant.estimate_gfe(mesh, 1024, rng=0)
covered = (abs(estimate.values - field) <= estimate.half_widths).mean()
print(f"{covered:.1%} of the 95 % intervals hold the exact value")

# %%
# Paths along edges are a tenth too long on this mesh, more in some directions than in others. Paths that may
# also cross pairs of triangles come closer to the surface, and the field changes with them.
refined = pliant.gfe(mesh, graph="refined")
surface_figure(mesh, refined, title="The same over refined paths", **look)
