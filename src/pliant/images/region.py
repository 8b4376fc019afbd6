"""The rectangle of greatest benefit: eq. 6.1 over boxes, solved exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats
from .._kernels import kernel
from ..errors import InputError

__all__ = ["best_rectangle"]


def best_rectangle(benefit: ArrayLike) -> tuple[tuple[int, int, int, int], float]:
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
    All pairs of rows, and for each the greatest run of columns (Kadane): h^2 w / 2 steps; 4 ms for 230 x 170.

    Examples
    --------
    >>> best_rectangle([[-1, 2, 3], [-1, 4, -1]])
    ((1, 0, 3, 2), 8.0)
    """
    gains = as_floats(benefit, "benefit")
    if gains.ndim != 2 or not np.isfinite(gains).all():
        message = f"benefit must be a finite array (h, w), got shape {gains.shape}"
        raise InputError(message)
    x0, y0, x1, y1, total = _best_rectangle(np.ascontiguousarray(gains))
    return (int(x0), int(y0), int(x1), int(y1)), float(total)


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
