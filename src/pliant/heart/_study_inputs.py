"""What models are given of each subject: its rows, the two baselines, and its size."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._arrays import FloatArray
from .features import SegmentFeatures

#: What every method has to beat: one number a subject.
BASELINES = ("roughness", "cavity volume")
#: Globally a line of its own, where all axes are known.
SIZE = "volume and sphericity"
#: What is added to a method's name where size goes in with it.
WITH_SIZE = " and size"
# Points a subject that go into a bag: section 5.4 takes 500 a segment and 2,000 a territory.
POINTS = {"segment": 500, "territory": 2000, "global": 4000}


def bags_of(
    features: Sequence[SegmentFeatures], segments: Sequence[int], points: int, seed: int
) -> list[FloatArray]:
    """Return each subject's rows of some segments, so many of them at random where there are more."""
    bags = []
    for i, subject in enumerate(features):
        rows = subject.of(segments)
        if len(rows) > points:
            rows = rows[np.sort(np.random.default_rng([seed, i]).choice(len(rows), points, replace=False))]
        bags.append(rows)
    return bags


def baselines_of(features: Sequence[SegmentFeatures], segments: Sequence[int]) -> dict[str, FloatArray]:
    """Return (n, 1) for each baseline."""
    rough = np.array([[subject.mean_roughness(segments)] for subject in features])
    return dict(zip(BASELINES, (rough, np.array([[subject.cavity_ml] for subject in features])), strict=True))


def size_of(features: Sequence[SegmentFeatures]) -> FloatArray | None:
    """(n, 1 or 2) logarithms of the cavity's volume and, where all axes are known, of its sphericity; None without."""
    size = np.array([[subject.cavity_ml, subject.sphericity] for subject in features])
    known = (np.isfinite(size) & (size > 0)).all(axis=0)
    return np.log(size[:, known]) if known[0] else None
