"""The part that two images share, as a box: eq. 6.1 over upright rectangles, solved exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats
from .._kernels import kernel
from ..errors import InputError

__all__ = ["best_rectangle", "smallest_rectangle"]

Box = tuple[int, int, int, int]

_BISECTIONS = 12
_HIGHEST_PRICE = 4.0
_LOWERINGS = 40


def best_rectangle(benefit: ArrayLike) -> tuple[Box, float]:
    """Find the upright rectangle with the greatest sum of a benefit, exactly.

    Parameters
    ----------
    benefit : (h, w) array_like of float
        Gain (positive) or price (negative) of every pixel.

    Returns
    -------
    box : tuple of int
        x0, y0, x1, y1; x1 and y1 exclusive. Empty, (0, 0, 0, 0), where no pixel has a gain.
    total : float
        Its benefit.

    Raises
    ------
    InputError
        If the array is not finite or not (h, w).

    Notes
    -----
    All pairs of rows, and for each the greatest run of columns (Kadane): h^2 w / 2 steps; 5 ms for 230 x 170.

    Examples
    --------
    >>> best_rectangle([[-1, 2, 3], [-1, 4, -1]])
    ((1, 0, 3, 2), 8.0)
    """
    x0, y0, x1, y1, total = _best_rectangle(_checked(benefit, "benefit"))
    return (int(x0), int(y0), int(x1), int(y1)), float(total)


def smallest_rectangle(evidence: ArrayLike, share: float) -> tuple[Box, float]:
    """Find a small upright rectangle that holds a share of the evidence.

    Among the rectangles that are best at some price of area (sum of evidence minus price times area, solved
    exactly) the smallest is taken that holds the share.

    Parameters
    ----------
    evidence : (h, w) array_like of float
        Not negative.
    share : float
        Between 0 and 1.

    Returns
    -------
    box : tuple of int
        x0, y0, x1, y1; x1 and y1 exclusive. Empty, (0, 0, 0, 0), where there is no evidence.
    price : float
        Of a pixel, in the evidence's unit, at which this box is the best.

    Raises
    ------
    InputError
        If evidence is negative or not finite, or the share is not between 0 and 1.

    Notes
    -----
    Bisection over the price, at half the size; then a few exact solutions at full size.

    Examples
    --------
    >>> import numpy as np
    >>> evidence = np.zeros((20, 30))
    >>> evidence[5:15, 10:25] = 1.0
    >>> evidence[0, 0] = 1.0
    >>> smallest_rectangle(evidence, 0.9)[0]
    (10, 5, 25, 15)
    """
    gains = _checked(evidence, "evidence")
    if (gains < 0).any() or not 0 < share < 1:
        message = (
            f"evidence must not be negative and share be between 0 and 1, got {gains.min():.3g} and {share}"
        )
        raise InputError(message)
    total = float(gains.sum())
    if not total > 0:
        return (0, 0, 0, 0), 0.0
    usual = total / gains.size
    low, high = 0.0, _HIGHEST_PRICE * usual
    coarse = _halved(gains)
    for _ in range(_BISECTIONS):
        price = 0.5 * (low + high)
        box, _ = best_rectangle(coarse - 4 * price)
        if _held(coarse, box) >= share * total:
            low = price
        else:
            high = price
    # At full size a little lower price may be needed; at none at all the box holds everything.
    for price in (low * 0.95**step for step in range(_LOWERINGS)):
        box, _ = best_rectangle(gains - price)
        if _held(gains, box) >= share * total:
            break
    else:
        box, price = best_rectangle(gains)[0], 0.0
    return box, price


def _checked(values: ArrayLike, name: str) -> FloatArray:
    array = as_floats(values, name)
    if array.ndim != 2 or not array.size or not np.isfinite(array).all():
        message = f"{name} must be a finite array (h, w), got shape {array.shape}"
        raise InputError(message)
    return np.ascontiguousarray(array)


def _held(gains: FloatArray, box: Box) -> float:
    return float(gains[box[1] : box[3], box[0] : box[2]].sum())


def _halved(gains: FloatArray) -> FloatArray:
    """Add up blocks of 2 x 2."""
    height, width = gains.shape
    padded = np.pad(gains, ((0, height % 2), (0, width % 2)))
    blocks: FloatArray = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2).sum(axis=(1, 3))
    return blocks


@kernel
def _best_rectangle(gains: FloatArray) -> tuple[int, int, int, int, float]:
    height, width = gains.shape
    best = 0.0
    x0, y0, x1, y1 = 0, 0, 0, 0
    for top in range(height):
        columns = np.zeros(width)
        for bottom in range(top, height):
            run, start = 0.0, 0
            for x in range(width):
                columns[x] += gains[bottom, x]
                if run <= 0:
                    run, start = 0.0, x
                run += columns[x]
                if run > best:
                    best = run
                    x0, y0, x1, y1 = start, top, x + 1, bottom + 1
    return x0, y0, x1, y1, best
