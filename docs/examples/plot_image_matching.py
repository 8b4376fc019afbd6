"""
The same thing by day and by night
==================================

Two pictures of one thing that look nothing alike: which part of each shows it? Photographs that scikit-image ships
are changed in known ways, so the truth is exact.
"""

# %%
# A photograph, and the same turned to night with lamps of its own, then turned and resized.
from pliant.evaluate.relevance import transform_error
from pliant.images import match_pair, moved, shipped_photographs, synthetic_pair
from pliant.report.matches import match_figure

photograph = shipped_photographs()["coffee"]
night = moved(synthetic_pair(photograph, "night", name="coffee", rng=1), rng=4)
match = match_pair(night.picture1, night.picture2)
print(match)
match_figure(night.picture1, night.picture2, match, title="By day and by night")

# %%
# How far is the transform found from the true one, over the picture?
error = transform_error(match.transform, night.homography, night.box1, night.picture2.size)
print(f"{error:.2%} of the diagonal")

# %%
# A drawing keeps only lines, an engraving only hatching.
for kind in ("drawing", "engraving"):
    pair = synthetic_pair(photograph, kind, name="coffee", rng=2)
    drawn = match_pair(pair.picture1, pair.picture2)
    print(kind, drawn.score)
    match_figure(pair.picture1, pair.picture2, drawn, title=f"Photograph and {kind}")

# %%
# The score is the evidence that two pictures show the same thing at all. Here they do not.
other = match_pair(photograph, shipped_photographs()["rocket"])
print("unrelated pictures:", other.score)
