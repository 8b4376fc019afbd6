"""What the statistics over sites share: checked histograms, ranks, extremes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from .._arrays import BoolArray, FloatArray, IntArray, as_floats
from ..errors import InputError, first_indices

__all__ = ["FEWEST", "checked_histograms", "extreme", "nan_percentiles", "spearman"]

# Subjects below which a site's spread is not given.
FEWEST = 3


def checked_histograms(histograms: ArrayLike) -> tuple[FloatArray, BoolArray]:
    values = as_floats(histograms, "histograms")
    if values.ndim != 3 or not values.size:
        message = f"histograms must have shape (subjects, sites, bins), got {values.shape}"
        raise InputError(message)
    if len(values) < FEWEST:
        message = f"variability over subjects needs {FEWEST} of them or more, got {len(values)}"
        raise InputError(message)
    known = np.isfinite(values)
    partly = np.flatnonzero((known.any(axis=2) & ~known.all(axis=2)).ravel())
    if partly.size:
        message = f"{partly.size} histograms are not finite in part, first {first_indices(partly)} (subject by subject)"
        raise InputError(message)
    present: BoolArray = np.asarray(known.all(axis=2))
    return values, present


def spearman(a: FloatArray, b: FloatArray) -> float:
    x, y = stats.rankdata(a), stats.rankdata(b)
    x, y = x - x.mean(), y - y.mean()
    size = np.sqrt((x @ x) * (y @ y))
    return float(np.clip(x @ y / size, -1, 1)) if size > 0 else float("nan")


def extreme(values: FloatArray, count: int) -> IntArray:
    """Return the sites of the smallest values, never NaN."""
    order = np.argsort(values, kind="stable")
    return order[: min(count, int(np.isfinite(values).sum()))]


def nan_percentiles(rows: FloatArray, levels: list[float]) -> FloatArray:
    found = np.full((len(levels), rows.shape[1]), np.nan)
    known = np.isfinite(rows).any(axis=0)
    if known.any():
        found[:, known] = np.nanpercentile(rows[:, known], levels, axis=0)
    return found
