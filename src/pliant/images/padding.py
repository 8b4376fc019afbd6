"""Fill around a picture: constant black or white that a warp or a scan left at the border."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation, label
from scipy.spatial import ConvexHull

from .._arrays import BoolArray, FloatArray, as_floats
from ..errors import InputError

__all__ = ["inside_of_padding"]

_BLACK, _WHITE = 4 / 255, 251 / 255
# Fill is a sheet without texture; a night sky or a white wall of real pixels is not quite constant.
_LEAST_SHARE = 0.005
_CONSTANT = 0.97
_CONVEX = 0.97
_LEAST_INSIDE = 0.05


def inside_of_padding(grey: FloatArray) -> BoolArray:
    """Tell picture from fill of constant black or white that touches the border.

    Parameters
    ----------
    grey : (h, w) array_like of float
        Luminance from 0 to 1.

    Returns
    -------
    (h, w) array of bool
        True inside the picture.

    Raises
    ------
    InputError
        If the array is not (h, w).

    Notes
    -----
    A connected piece counts as fill if it is of one end of the range, touches a corner or covers most of a side,
    and holds almost only one value to half a grey level. What is left must be convex, as a warped frame is: the paper
    around a drawing and a black night sky above roofs are not fill. Two pixels along the fill are left out too,
    where warping blends it with the picture. A clipped sky with a straight lower edge cannot be told
    from fill: give a mask where it matters.

    Examples
    --------
    >>> import numpy as np
    >>> grey = np.random.default_rng(0).uniform(0.2, 0.8, (40, 60))
    >>> grey[:, :15] = 0.0
    >>> int(inside_of_padding(grey).sum(axis=1).max())
    43
    """
    values = as_floats(grey, "grey")
    if values.ndim != 2:
        message = f"grey must have shape (h, w), got {values.shape}"
        raise InputError(message)
    fill = np.zeros(values.shape, dtype=bool)
    for extreme in (values <= _BLACK, values >= _WHITE):
        fill |= _border_pieces(values, extreme)
    if not fill.any():
        return ~fill
    inside = np.asarray(~binary_dilation(fill, iterations=2))
    return inside if _is_convex(inside) else np.ones(values.shape, dtype=bool)


def _is_convex(inside: BoolArray) -> bool:
    """Say whether a region of some size nearly fills its convex hull."""
    rows = np.flatnonzero(inside.any(axis=1))
    if inside.mean() < _LEAST_INSIDE or len(rows) < 2:
        return False
    first = inside[rows].argmax(axis=1)
    last = inside.shape[1] - inside[rows][:, ::-1].argmax(axis=1)
    # Corners of the outermost pixels, so that the hull's area counts whole pixels.
    x = np.concatenate([first, last, first, last])
    y = np.concatenate([rows, rows, rows + 1, rows + 1])
    return bool(np.count_nonzero(inside) >= _CONVEX * ConvexHull(np.column_stack([x, y])).volume)


def _border_pieces(values: FloatArray, extreme: BoolArray) -> BoolArray:
    pieces, count = label(extreme)
    fill = np.zeros(values.shape, dtype=bool)
    corners = {int(pieces[y, x]) for y in (0, -1) for x in (0, -1)}
    sides = (pieces[0], pieces[-1], pieces[:, 0], pieces[:, -1])
    for piece in range(1, count + 1):
        if piece not in corners and not any((side == piece).mean() > 0.5 for side in sides):
            continue
        found = pieces == piece
        inner = values[found]
        constant = np.mean(np.abs(inner - np.median(inner)) < 0.5 / 255)
        if found.mean() >= _LEAST_SHARE and constant >= _CONSTANT:
            fill |= found
    return fill
