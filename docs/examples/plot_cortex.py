"""
Where folding varies over a cohort
==================================

A cohort with a truth: an inflated hemisphere is folded anew for each subject, more deeply in some places than in
others. How much the geodesic field around a landmark varies over subjects is compared with how much it was made to.
"""

# %%
# Six subjects and 60 landmarks keep this page quick; a study has more of both.
import numpy as np
from matplotlib.figure import Figure

from pliant.cortex import ContextSignature, rank_agreement, synthetic_cohort, variability
from pliant.report import hemisphere_views, surface_figure

cohort = synthetic_cohort(6, n_sites=60, rng=0)
meshes = [cohort.subject(i) for i in range(len(cohort))]
surface_figure(
    meshes[0], cohort.amplitude, views=hemisphere_views("left"), title="One subject, and the truth",
    colour_bar_label="depth of folds (mm)",
)  # fmt: skip

# %%
# One field a subject, histograms over bins common to all, and their spread over subjects at each landmark. With the
# bins' edges the spread is how far the values move, which does not saturate where folds are deep.
setting = ContextSignature(radius=8.0, scale="log", bins=30, percentile=99.9)
fields = [setting.field(mesh) for mesh in meshes]
setting = setting.with_edges_of(*fields)
histograms = np.stack(
    [setting.histograms(mesh, field, cohort.sites) for mesh, field in zip(meshes, fields, strict=True)]
)
ranking = variability(histograms, edges=setting.edges, resamples=200, rng=0)
agreement = rank_agreement(ranking.mad, cohort.truth, rng=0, resamples=200)
print(
    f"rank correlation with the truth {agreement.spearman:.2f} ({agreement.low:.2f} to {agreement.high:.2f})"
)

# %%
# Intervals are over subjects: six of them say little about one landmark, and more about the order of all.
figure = Figure(figsize=(5, 3.5), layout="constrained")
axes = figure.subplots()
spread = np.abs(np.stack([ranking.low, ranking.high]) - ranking.mad)
axes.errorbar(cohort.truth, ranking.mad, spread, fmt="o", ms=3, lw=0.6, color="#2a6f97")
axes.set(xlabel="true depth of folds (mm)", ylabel="cumulative MAD (log field)", xscale="log")
figure  # noqa: B018
