"""What the protocols check alike."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import IntArray, as_indices
from ..errors import InputError, first_indices


def point_map_of(values: ArrayLike, n: int, n_target: int, name: str) -> IntArray:
    """Coerce to one target number an entry, -1 where there is none."""
    array = as_indices(values, name)
    if array.shape != (n,):
        message = f"{name} must have one entry a point, shape ({n},), got {array.shape}"
        raise InputError(message)
    bad = np.flatnonzero((array < -1) | (array >= n_target))
    if bad.size:
        message = f"{name}: {bad.size} entries are outside -1..{n_target - 1}, first at {first_indices(bad)}"
        raise InputError(message)
    return array
