"""Heat and wave kernel signatures and the biharmonic density kernel, from an eigenbasis."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats
from ..errors import InputError
from ..spectral import Spectrum

__all__ = ["bdk", "hks", "wks"]

# Sun et al. 2009 take times, and Aubry et al. 2011 energies, this many.
STEPS = 100
# Aubry et al. 2011: the width of an energy band, in steps between energies.
BAND = 7.0


def hks(spectrum: Spectrum, *, times: ArrayLike | None = None, n_times: int = STEPS) -> FloatArray:
    """Heat kernel signature: the heat that stays at each vertex, over a range of times.

    Parameters
    ----------
    spectrum : Spectrum
        The first eigenpairs; the published setting is 300.
    times : (d,) array_like of float, optional
        Positive diffusion times, in the mesh's unit squared. By default ``n_times`` of them, spaced evenly in
        logarithm from ``4 ln 10 / lambda_max`` to ``4 ln 10 / lambda_1``, as published.
    n_times : int
        How many, where ``times`` is not given.

    Returns
    -------
    (n, d) array of float
        ``k_t(x, x)``, each column divided by the heat trace ``sum exp(-t lambda)``: columns compare, and
        the unit is one over area.

    Raises
    ------
    InputError
        If a time is not positive, or the spectrum has no positive eigenvalue.

    Notes
    -----
    Cost: one product of (n, k) with (k, d). Symmetric points have the same signature. Small times see only what
    the last eigenpairs resolve.

    References
    ----------
    Sun, Ovsjanikov and Guibas, A concise and provably informative multi-scale signature, 2009.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> hks(eigenbasis(shapes.icosphere(2), 25), n_times=16).shape
    (162, 16)
    """
    positive = _positive_values(spectrum)
    if times is None:
        span = 4 * np.log(10)
        chosen = np.geomspace(span / positive[-1], span / positive[0], _count(n_times, "n_times"))
    else:
        chosen = _ladder(times, "times")
        if not (chosen > 0).all():
            raise InputError("times must be positive")
    return _weighted(spectrum, np.exp(-np.outer(spectrum.values, chosen)))


def wks(
    spectrum: Spectrum,
    *,
    energies: ArrayLike | None = None,
    n_energies: int = STEPS,
    width: float | None = None,
) -> FloatArray:
    """Wave kernel signature: the presence of a quantum particle at each vertex, over a range of energies.

    Parameters
    ----------
    spectrum : Spectrum
        The first eigenpairs; the published setting is 300. With fewer the range of energies, and so their spacing
        and the width, shrink with it.
    energies : (d,) array_like of float, optional
        Logarithms of eigenvalues. By default ``n_energies`` of them, spaced evenly between ``ln lambda_1`` and
        ``ln lambda_max``, two widths inside either end.
    n_energies : int
        How many, where ``energies`` is not given.
    width : float, optional
        Standard deviation of the log-normal bands; by default 7 times the range over ``n_energies``, as published.

    Returns
    -------
    (n, d) array of float
        Each column divided by the sum of its weights; in one over area.

    Raises
    ------
    InputError
        If ``width`` is not positive, an energy is not finite, or the spectrum has no positive eigenvalue.

    Notes
    -----
    Zero eigenvalues are left out: their logarithm is not defined. Cost: one product of (n, k) with (k, d).

    References
    ----------
    Aubry, Schlickewei and Cremers, The wave kernel signature, 2011.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> wks(eigenbasis(shapes.icosphere(2), 25), n_energies=16).shape
    (162, 16)
    """
    levels = np.log(_positive_values(spectrum))
    low, high = float(levels[0]), float(levels[-1])
    if width is None:
        width = BAND * (high - low) / _count(n_energies, "n_energies")
        # All eigenvalues alike, as on a tiny mesh: one band holds them.
        width = width if width > 0 else 1.0
    if not (np.isfinite(width) and width > 0):
        message = f"width must be positive, got {width}"
        raise InputError(message)
    if energies is None:
        chosen = np.linspace(low + 2 * width, high - 2 * width, _count(n_energies, "n_energies"))
    else:
        chosen = _ladder(energies, "energies")
    weights = np.zeros((spectrum.k, len(chosen)))
    weights[spectrum.n_zero :] = np.exp(-((chosen - levels[:, None]) ** 2) / (2 * width**2))
    return _weighted(spectrum, weights)


def bdk(spectrum: Spectrum) -> FloatArray:
    """Biharmonic density kernel (eq. 3.2): the squared length of each vertex's biharmonic embedding.

    Parameters
    ----------
    spectrum : Spectrum
        The first eigenpairs; 200 fix it to well under a per cent except at sharp tips.

    Returns
    -------
    (n,) array of float
        ``sum phi(x)^2 / lambda^2`` over positive eigenvalues, in the mesh's unit squared. Large where
        the surface is remote.

    Raises
    ------
    InputError
        If the spectrum has no positive eigenvalue.

    References
    ----------
    Mukhopadhyay, Geometric Analysis of Shapes, 2014, section 3.3.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> bdk(eigenbasis(shapes.icosphere(2), 25)).shape
    (162,)
    """
    positive = _positive_values(spectrum)
    kernel: FloatArray = spectrum.vectors[:, spectrum.n_zero :] ** 2 @ positive**-2
    return kernel


def _weighted(spectrum: Spectrum, weights: FloatArray) -> FloatArray:
    """Sum squared eigenvectors by weights (k, d), each column of which is made to sum to 1."""
    totals = weights.sum(axis=0)
    if not (totals > 0).all():
        message = (
            f"{int((totals <= 0).sum())} of {len(totals)} columns lie outside the spectrum and would be empty"
        )
        raise InputError(message)
    signature: FloatArray = spectrum.vectors**2 @ (weights / totals)
    return signature


def _positive_values(spectrum: Spectrum) -> FloatArray:
    positive = spectrum.values[spectrum.n_zero :]
    if not len(positive):
        message = (
            f"the spectrum has {spectrum.k} eigenvalues and none is positive; ask for more than the pieces"
        )
        raise InputError(message)
    return positive


def _ladder(values: ArrayLike, name: str) -> FloatArray:
    chosen = np.atleast_1d(as_floats(values, name))
    if chosen.ndim != 1 or not chosen.size or not np.isfinite(chosen).all():
        message = f"{name} must be a list of finite numbers, got shape {chosen.shape}"
        raise InputError(message)
    return chosen


def _count(number: int, name: str) -> int:
    if number < 1:
        message = f"{name} must be at least 1, got {number}"
        raise InputError(message)
    return int(number)
