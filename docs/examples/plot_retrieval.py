"""
Pictures by shape
=================

Pairs of pictures of one class say which features belong to what they show; codes of a few bytes then find more of
it. The pictures are drawn here: a shape at a random place and size, on clutter.
"""

# %%
# Four kinds of shape, ten pictures of each.
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image, ImageDraw

from pliant.retrieval import evaluate_retrieval, hamming_distances, train_retrieval

KINDS = ("disc", "ladder", "star", "waves")


def drawn(kind, seed, negative=False):
    """Draw a shape on random lines; negative: light on dark."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    image = Image.new("L", (120, 100), 150)
    pen = ImageDraw.Draw(image)
    for _ in range(8):
        pen.line(rng.uniform(0, 120, 4).tolist(), fill=int(rng.integers(90, 200)), width=1)
    x, y, r = rng.uniform(45, 75), rng.uniform(40, 60), rng.uniform(26, 36)
    dark = int(rng.integers(0, 70))
    t = np.linspace(-1, 1, 40)
    if kind == "disc":
        for share in (1, 0.7, 0.4):
            pen.ellipse((x - share * r, y - share * r, x + share * r, y + share * r), outline=dark, width=3)
    elif kind == "ladder":
        for step in np.linspace(-1, 1, 6):
            pen.rectangle((x - r, y + step * r, x + r, y + step * r + 4), fill=dark)
    elif kind == "star":
        for angle in np.arange(0, np.pi, np.pi / 5):
            dx, dy = r * np.cos(angle), r * np.sin(angle)
            pen.line((x - dx, y - dy, x + dx, y + dy), fill=dark, width=3)
    else:
        for shift in (-0.6, 0, 0.6):
            curve = np.column_stack([x + r * t, y + r * (shift + 0.2 * np.sin(7 * t))])
            pen.line([tuple(point) for point in curve], fill=dark, width=3)
    return Image.eval(image, lambda value: 255 - value) if negative else image


folder = Path(tempfile.mkdtemp())
for kind in KINDS:
    (folder / kind).mkdir()
    for i in range(10):
        drawn(kind, i).save(folder / kind / f"{i}.png")

# %%
# Train on all of them, with three pairs a class.
settings = {"n_words": 60, "points": 150, "pairs_per_class": 3, "n_jobs": 1, "cache": folder / ".cache"}
model = train_retrieval(folder, bits=64, **settings)
print(model.settings["pictures"], "pictures,", model.bits, "bits")

# %%
# Ask with new pictures, as negatives: what is dark there is light here. Each row is a query and its four nearest, with
# the number of bits that differ.
paths = [path for kind in KINDS for path in sorted((folder / kind).iterdir())]
archive = model.encode(paths)
figure, axes = plt.subplots(4, 5, figsize=(8, 6), layout="constrained")
for row, kind in zip(axes, KINDS, strict=True):
    query = drawn(kind, 77, negative=True)
    distances = hamming_distances(model.encode([np.asarray(query)]), archive)[0]
    nearest = np.argsort(distances, kind="stable")[:4]
    shown = [(query, "query")] + [(Image.open(paths[i]), str(distances[i])) for i in nearest]
    for axis, (picture, title) in zip(row, shown, strict=True):
        axis.imshow(picture, cmap="gray", vmin=0, vmax=255)
        axis.set_title(title, fontsize=9)
        axis.set_axis_off()

# %%
# Which codes of two bytes find the right kind? Precision of the label that the nearest give, for classes that were
# learned and for classes that were not.
(study,) = evaluate_retrieval(folder, bits=16, train=6, splits=1, **settings)
methods = list(study.precision["consistent"])
names = {
    "proposed": "DBC",
    "lsh": "random",
    "itq": "ITQ",
    "cca_itq": "CCA-ITQ",
    "spectral": "spectral",
    "classifier": "classifier",
}
figure, axis = plt.subplots(figsize=(7, 3), layout="constrained")
places = np.arange(len(methods))
for shift, bag, label, colour in (
    (-0.2, "consistent", "learned", "#30638e"),
    (0.2, "held_out", "new", "#d1a054"),
):
    axis.bar(places + shift, [study.mean(m, bag) for m in methods], 0.4, label=label, color=colour)
axis.set_xticks(places, [names[m] for m in methods])
axis.set_ylim(0, 1)
axis.set_ylabel("precision")
axis.legend(title="classes", loc="upper left", bbox_to_anchor=(1, 1), frameon=False)
axis.spines[["top", "right"]].set_visible(False)
