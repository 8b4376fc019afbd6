"""Signatures of two surfaces, brought to one scale."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray
from ..spectral import Spectrum
from .functional_map import check_widths, checked_descriptors


def standardised(
    spectrum_a: Spectrum,
    spectrum_b: Spectrum,
    given: tuple[ArrayLike, ArrayLike] | None,
    default: Callable[[Spectrum], FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Return descriptors of both, each column with mean 0 and spread 1 over both, so that no unit outweighs another."""
    if given is None:
        given = (default(spectrum_a), default(spectrum_b))
    f_a = checked_descriptors(given[0], spectrum_a.n_vertices, "descriptors of a")
    f_b = checked_descriptors(given[1], spectrum_b.n_vertices, "descriptors of b")
    check_widths(f_a, f_b)
    both = np.vstack([f_a, f_b])
    mean, spread = both.mean(axis=0), both.std(axis=0)
    spread[spread <= 1e-12 * np.abs(both).max(axis=0)] = np.inf
    return (f_a - mean) / spread, (f_b - mean) / spread
