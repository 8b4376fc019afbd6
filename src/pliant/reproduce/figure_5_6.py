"""Figures 5.5 and 5.6: histograms of visual words of normal and of diseased ventricles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._arrays import BoolArray, FloatArray
from ..heart import BagOfFeatures
from ._hearts import hearts
from ._plots import COLOURS
from .bench import Bench
from .findings import Experiment, Findings, graded, row_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORDS, THRESHOLD = 20, 70.0
_SHUFFLES = 500


def _run(bench: Bench) -> Findings:
    features, stenosis, said = hearts(bench)
    diseased = stenosis.max(axis=1) >= THRESHOLD
    bags = [one.of(range(1, 18)) for one in features]
    table = BagOfFeatures(WORDS, rng=bench.seed).fit_transform(bags)
    gaps = _gaps(table, diseased)
    generator = np.random.default_rng(bench.seed)
    null = np.array([_gaps(table, generator.permutation(diseased)).max() for _ in range(_SHUFFLES)])
    limit = float(np.quantile(null, 0.95))
    telling = int((gaps > limit).sum())
    p = float((1 + (null >= gaps.max()).sum()) / (1 + _SHUFFLES))
    bench.figure(
        _drawn(table, diseased, gaps > limit),
        "Shares of the words in normal and diseased ventricles; marked: beyond chance",
    )
    groups = {"normal": table[~diseased], "diseased": table[diseased]}
    best = int(gaps.argmax())
    return Findings(
        graded(telling >= 3, telling >= 1),
        f"{telling} of {WORDS} words occur more or less often in diseased ventricles than shuffled labels "
        f"allow for the most "
        f"telling of all words (gap over {limit:.1f} standard errors); the largest gap is {gaps[best]:.1f} "
        f"(p = {p:.3f}).",
        f"{said} {int(diseased.sum())} of {len(diseased)} are diseased. The vocabulary is learned from all "
        f"subjects, without "
        "labels.",
        (
            row_of("words that differ beyond chance, of 20", None, [float(telling)]),
            row_of(
                "largest gap, standard errors",
                None,
                [float(gaps[best])],
                note=f"95 % of shuffles stay below {limit:.1f}",
            ),
            *(
                row_of(f"share of the most telling word, {name}", None, rows[:, best])
                for name, rows in groups.items()
            ),
        ),
        {"words": WORDS, "shuffles": _SHUFFLES},
    )


def _gaps(table: FloatArray, diseased: BoolArray) -> FloatArray:
    """Welch's statistic of every word, as an absolute value."""
    one, two = table[diseased], table[~diseased]
    spread = np.sqrt(one.var(axis=0, ddof=1) / len(one) + two.var(axis=0, ddof=1) / len(two))
    gaps: FloatArray = np.abs(one.mean(axis=0) - two.mean(axis=0)) / np.maximum(spread, 1e-12)
    return gaps


def _drawn(table: FloatArray, diseased: BoolArray, marked: BoolArray) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    axes = figure.subplots()
    at = np.arange(WORDS)
    for shift, chosen, name, colour in (
        (-0.2, ~diseased, "normal", COLOURS[0]),
        (0.2, diseased, "diseased", COLOURS[1]),
    ):
        rows = table[chosen]
        error = rows.std(axis=0, ddof=1) / np.sqrt(len(rows))
        axes.bar(
            at + shift, rows.mean(axis=0), 0.38, yerr=error, color=colour, label=name, error_kw={"lw": 0.8}
        )
    top = 1.18 * max(float(table[diseased].mean(axis=0).max()), float(table[~diseased].mean(axis=0).max()))
    axes.plot(at[marked], np.full(int(marked.sum()), top), "v", color="#1b1f24", ms=5, label="beyond chance")
    axes.set(xlabel="word", ylabel="share of the points", xticks=at, ylim=(0, top * 1.15))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8, ncols=3)
    return figure


EXPERIMENT = Experiment(
    "figure-5.6",
    "Histograms of visual words, normal and diseased",
    "Normal subjects have a pattern of words very distinct from that of diseased ones.",
    "Three words or more differ by more than 95 % of shuffled labels allow for the most different word; in "
    "part if one "
    "does.",
    _run,
    covers=("figure-5.5",),
)
