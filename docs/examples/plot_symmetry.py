"""
The mirror of an animal that moves, and its legs
================================================

Bending a leg does not end a symmetry that lives on the surface. Left and right correspond in every pose; and each
leg is like each of the others, which no mirror says.
"""

# %%
# An animal in a random pose, and what is found on it.
import pliant
from pliant.report import correspondence_figure

figure = pliant.shapes.quadruped(2500)
figure = figure.posed(figure.random_pose(rng=2))
result = pliant.detect_symmetries(figure.mesh)
for found in result.symmetries:
    print(found)


# %%
# The reflection of the whole: lines join points to their mirror images.
def drawn(found, title):
    """Draw forty points of the source with their images."""
    source = found.source.nonzero()[0]
    some = source[pliant.farthest_points(figure.mesh.vertices[source], 40)]
    return correspondence_figure(figure.mesh, figure.mesh, some, found.point_map[some], up="y", title=title)


drawn(result.symmetries[0], "The whole")

# %%
# A pair of legs that the reflection does not imply.
other = next(found for found in result.symmetries if found.kind == "partial" and found.implied_by < 0)
drawn(other, "Front to hind")
