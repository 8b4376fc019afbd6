"""Colour for per-vertex values: which maps, which limits, and what a missing value looks like."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import as_floats
from ..errors import InputError

#: Perceptually even maps: the first six run dark to light, the last two have a light middle.
ColourMap: TypeAlias = Literal["viridis", "cividis", "magma", "inferno", "plasma", "bone", "RdBu_r", "PuOr_r"]
COLOUR_MAPS: tuple[ColourMap, ...] = get_args(ColourMap)

#: Colour of a vertex that has no value.
MISSING = (0.72, 0.72, 0.72)


def colour_table(name: ColourMap) -> NDArray[np.uint8]:
    """Return a colour map as a (256, 3) table of red, green and blue.

    Raises
    ------
    InputError
        If the name is none of :data:`COLOUR_MAPS`.

    Examples
    --------
    >>> colour_table("viridis")[0]
    array([68,  1, 84], dtype=uint8)
    """
    from matplotlib import colormaps

    if name not in COLOUR_MAPS:
        message = f"a colour map is one of {', '.join(COLOUR_MAPS)}; got {name!r}"
        raise InputError(message)
    table: NDArray[np.uint8] = colormaps[name](np.arange(256), bytes=True)[:, :3]
    return table


def robust_limits(
    values: ArrayLike, *, percentiles: tuple[float, float] = (2.0, 98.0)
) -> tuple[float, float]:
    """Choose colour limits that a few extreme vertices cannot move.

    Parameters
    ----------
    values : array_like of float
        NaN and infinities are left out.
    percentiles : (float, float)
        The share of values below the lower and the upper limit, in percent.

    Returns
    -------
    (float, float)
        The two percentiles; the whole range where they are equal; (v, v + 1) where every value is v;
        (0, 1) where there is none.

    Raises
    ------
    InputError
        If the percentiles do not ascend within 0 to 100.

    Examples
    --------
    >>> robust_limits([0, 1, 2, 3, 1000], percentiles=(0, 75))
    (0.0, 3.0)
    """
    if not 0 <= percentiles[0] < percentiles[1] <= 100:
        message = f"percentiles must ascend within 0 to 100, got {percentiles}"
        raise InputError(message)
    known = as_floats(values, "values").ravel()
    known = known[np.isfinite(known)]
    if not known.size:
        return 0.0, 1.0
    low, high = (float(limit) for limit in np.percentile(known, percentiles))
    if low == high:
        low, high = float(known.min()), float(known.max())
    return (low, high) if low < high else (low, low + 1.0)


def colours_of(values: ArrayLike, low: float, high: float, table: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Look values up in a colour table between two limits.

    Parameters
    ----------
    values : (...) array_like of float
        Clipped to the limits; NaN and infinities become :data:`MISSING` grey.
    low, high : float
        Values of the first and the last colour.
    table : (256, 3) array of uint8
        See :func:`colour_table`.

    Returns
    -------
    (..., 3) array of float
        Red, green and blue, 0 to 1.

    Examples
    --------
    >>> colours_of([0.0, 1.0], 0.0, 1.0, colour_table("bone")).round(2).tolist()
    [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]
    """
    known = np.asarray(values, dtype=np.float32)
    palette = np.vstack([table, np.rint(np.multiply(MISSING, 255)).astype(np.uint8)]).astype(np.float32) / 255
    with np.errstate(invalid="ignore"):
        place = np.clip((known - low) / (high - low), 0, 1) * 255
        place += 0.5
    place[~np.isfinite(known)] = 256
    picked: NDArray[np.float32] = palette.take(place.astype(np.uint16), axis=0)
    return picked
