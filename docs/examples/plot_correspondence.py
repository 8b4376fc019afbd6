"""
Correspondence of two poses
===========================

Two poses of one animal are matched twice: a few points by their signatures alone, and every vertex by a functional map.
The poses share vertices, so that the truth is known to both.
"""

# %%
# Sparse: multi-scale biharmonic densities of farthest points, joint spectral embedding, mutual nearest neighbours.
import numpy as np

import pliant
from pliant.report import surface_figure

animal = pliant.shapes.quadruped(5000)
a, b = animal.mesh, animal.posed("gallop").mesh
pairs = pliant.correspond(a, b, samples=120)
distances = pliant.GeodesicHierarchy(a).distances(pairs.points_b)
error = np.minimum(
    distances[np.arange(len(pairs)), pairs.points_a],
    distances[np.arange(len(pairs)), animal.symmetry[pairs.points_a]],
) / np.sqrt(a.area)
print(
    f"{len(pairs)} pairs; median distance from the truth or its mirror image {np.median(error):.3f} of the size"
)

# %%
# The surest of them, drawn.
pliant.correspondence_figure(a, b, pairs.points_a, pairs.points_b, up="y", title="Sparse correspondence")

# %%
# Dense: signs of the first eigenfunctions enumerated, maps grown and refined, the best kept without knowing the truth.
found = pliant.dense_map(a, b)
truth = np.arange(a.n_vertices)
print(pliant.map_error(found.p_ba, truth, a, symmetry=animal.symmetry))

# %%
# The map carries any function: here the height of the resting animal, drawn on both.
height = a.vertices[:, 1]
look = {"views": ["left", "front"], "up": "y", "colour_bar_label": "height at rest", "colour_map": "plasma"}
surface_figure(a, height, title="A function on the resting animal", **look)

# %%
surface_figure(b, height[found.p_ba], title="Carried to the galloping one", **look)
