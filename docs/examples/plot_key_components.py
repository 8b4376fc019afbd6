"""
Key components of two people and of an animal that moves
========================================================

Where is a shape locally distinctive? Hands, feet and heads stand out of the biharmonic density of their own shape;
nobody says so. The same parts stand out in people of different build and in different poses.
"""

# %%
# Two people, of different build and in different poses.
import pliant
from pliant.report import surface_figure

slim = pliant.shapes.human(6000, pose="walk", proportions={"legs": 1.15, "girth": 0.85}).mesh
stout = pliant.shapes.human(6000, pose="reach", proportions={"legs": 0.85, "girth": 1.3}).mesh
for name, person in (("slim", slim), ("stout", stout)):
    parts = pliant.key_components(person)
    print(f"{name}: {parts}")

# %%
# Colours are the number of the component; grey is everywhere else.


def drawn(mesh, title):
    """Draw a mesh with its key components, largest first."""
    labels = pliant.key_components(mesh).labels.astype(float)
    labels[labels < 0] = float("nan")
    return surface_figure(
        mesh,
        labels,
        views=["front", "left"],
        up="y",
        title=title,
        colour_bar_label="key component",
        colour_map="plasma",
    )


drawn(slim, "Slim, walking")

# %%
drawn(stout, "Stout, reaching")

# %%
# An animal at rest and in a gallop: the same tips stand out, though in the gallop hind legs and tail touch and
# count as one.
animal = pliant.shapes.quadruped(6000)
drawn(animal.mesh, "At rest")

# %%
drawn(animal.posed("gallop").mesh, "Galloping")
