"""Hit rates of HKS, WKS and the density estimate in its readings, shared by Figures 3.5 to 3.7."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .._arrays import FloatArray
from ..bench.descriptors import Pair, Workbench
from ..evaluate import hit_rate
from .bench import Bench

if TYPE_CHECKING:
    from numpy.random import Generator

NAMES = {
    "HKS": "HKS",
    "WKS": "WKS",
    "BDE as printed, simple": "BDE mean, simple",
    "BDE as printed, Gaussian": "BDE mean, Gaussian",
    "BDE, Pliant's default": "BDE growth, patches (default)",
}
FRACTIONS = (0.001, 0.002, 0.005, 0.01)
_POINTS = 300


def hit_rates(bench: Bench, pairs: Sequence[Pair]) -> dict[str, FloatArray]:
    """(pairs, fractions) hit rates of every signature, from the same random points."""
    workbench = Workbench(bench.folder / "signatures")
    found: dict[str, FloatArray] = {}
    for label, name in NAMES.items():
        rows = []
        for a, b, truth in pairs:
            generator: Generator = np.random.default_rng(bench.seed)
            known = np.flatnonzero(truth >= 0)
            points = generator.choice(known, min(_POINTS, len(known)), replace=False)
            described = workbench.signature(a, name), workbench.signature(b, name)
            rows.append(hit_rate(*described, truth, points=points, fractions=FRACTIONS).rates)
        found[label] = np.stack(rows)
    return found
