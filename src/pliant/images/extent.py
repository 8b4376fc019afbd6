"""How far the thing that two images share reaches: a box that holds most of the evidence, grown along what agrees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import BoolArray, FloatArray
from .agreement import Agreement, EvenEdges, agreement
from .region import Box, smallest_rectangle

__all__ = ["Shared", "grown", "shared_part"]

_COARSE, _FINE = 6.0, 3.0
# A box grows sideways and down past lines where shared edges agree as strongly as this, in parts of their 95th
# percentile, and up past lines where any edges are as much correlated as this: roofs end in thin spires before a
# sky, which two pictures seldom share, while the ground in front of a thing is often shared.
_GOES_ON = 0.75
_SPIRE = 0.6
_FARTHEST = 0.4


@dataclass(frozen=True, eq=False)
class Shared:
    """What one of two registered images shares with the other, in its own frame.

    Attributes
    ----------
    evidence : (h, w) array of float
        What each pixel earns, none of it negative: shared edge strength times local correlation.
    lines : (h, w) array of float
        Correlation in a small window, less where edges are weak; about 1 where edges are strong and agree.
    correlation : (h, w) array of float
        In a small window, 0 to 1, whatever the strength.
    """

    evidence: FloatArray
    lines: FloatArray
    correlation: FloatArray


def shared_part(
    one: EvenEdges, two: EvenEdges, transform: FloatArray, charge: FloatArray | None = None
) -> Shared:
    """Weigh what the first of two registered images shares with the second.

    Parameters
    ----------
    one, two : EvenEdges
    transform : (3, 3) array of float
        Affine; takes pixels of the first image to the second.
    charge : (h, w) array of float, optional
        What each pixel of the first image costs, in units of the mean evidence in the overlap.

    Returns
    -------
    Shared
    """
    coarse, fine = (agreement(one, two, transform, window=w) for w in (_COARSE, _FINE))
    gain = np.where(coarse.overlap, coarse.shared * np.maximum(coarse.correlation, 0), 0.0)
    if charge is not None and coarse.overlap.any():
        gain = np.where(coarse.overlap, np.maximum(gain - gain[coarse.overlap].mean() * charge, 0), 0.0)
    correlation = np.where(fine.overlap, np.maximum(fine.correlation, 0), 0.0)
    return Shared(gain, _lines(fine, correlation), correlation)


def _lines(fine: Agreement, correlation: FloatArray) -> FloatArray:
    if not fine.overlap.any():
        return np.zeros_like(correlation)
    usual = float(fine.shared[fine.overlap].mean()) + 1e-9
    lines = correlation * fine.shared / (fine.shared + usual)
    strong = float(np.quantile(lines[fine.overlap], 0.95))
    result: FloatArray = lines / strong if strong > 0 else np.zeros_like(lines)
    return result


def grown(shared: Shared, share: float) -> tuple[Box, BoolArray]:
    """Find the box of what is shared: the smallest that holds a share of the evidence, grown along what goes on.

    Parameters
    ----------
    shared : Shared
    share : float
        Between 0 and 1.

    Returns
    -------
    box : tuple of int
        x0, y0, x1, y1; x1 and y1 exclusive. Empty where there is no evidence.
    region : (h, w) array of bool
        The pixels in it that are worth their price of area.
    """
    core, price = smallest_rectangle(shared.evidence, share)
    region = np.zeros(shared.evidence.shape, dtype=bool)
    if core[2] <= core[0]:
        return core, region
    x0, y0, x1, y1 = core
    wide, tall = _FARTHEST * (x1 - x0), _FARTHEST * (y1 - y0)
    y1 += _steps(shared.lines[y1:, x0:x1].max(axis=1, initial=0.0), _GOES_ON, tall)
    beside = shared.lines[y0:y1].max(axis=0, initial=0.0)
    x0 -= _steps(beside[:x0][::-1], _GOES_ON, wide)
    x1 += _steps(beside[x1:], _GOES_ON, wide)
    y0 -= _steps(shared.correlation[:y0, x0:x1].max(axis=1, initial=0.0)[::-1], _SPIRE, tall)
    part = (slice(y0, y1), slice(x0, x1))
    region[part] = shared.evidence[part] > price
    return (x0, y0, x1, y1), region


def _steps(profile: FloatArray, least: float, most: float) -> int:
    """Return how many lines from the first on reach a value, at most so many."""
    short = np.flatnonzero(profile <= least)
    return min(int(short[0]) if short.size else len(profile), int(np.ceil(most)))
