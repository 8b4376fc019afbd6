"""From point matches to the transform between two images: every pair of matches is a vote."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, as_floats
from .._kernels import kernel
from ..errors import InputError

__all__ = ["Registration", "agreeing", "carried", "inverse", "registrations"]

# Matches beyond these, farthest first, are not used to make hypotheses.
_MOST_MATCHES = 200
_MOST_CHANGE = 3.0
_MOST_TURN = np.pi / 4
# The affine part may leave the similarity only where the matches insist: weight of an isotropic prior, in matches.
_STIFFNESS = 10.0
_ROUNDS = 5


@dataclass(frozen=True, eq=False)
class Registration:
    """A transform and the matches that agree with it.

    Attributes
    ----------
    transform : (3, 3) array of float
        Affine; takes points of the first image to the second.
    consensus : float
        Sum over the matches of 1 - (residual / tolerance)^2, where positive.
    inliers : (m,) array of bool
        Which matches agree within the tolerance.
    """

    transform: FloatArray
    consensus: float
    inliers: BoolArray


def registrations(
    points1: ArrayLike, points2: ArrayLike, tolerance: float, *, count: int = 10
) -> list[Registration]:
    """Find the transforms that most matches agree with, the best first, no two alike.

    A similarity is tried for every pair of matches (changes of size up to 3, turns up to 45 degrees), so there is no
    chance in it; the best ones are then fitted to their inliers, as similarity and, with a prior against it, as affine.

    Parameters
    ----------
    points1, points2 : (m, 2) array_like of float
        Matched points, the most trusted first.
    tolerance : float
        Residual up to which a match agrees, in pixels, measured halfway between the two images' sizes.
    count : int
        Most results.

    Returns
    -------
    list of Registration
        Empty where fewer than three matches agree on anything.

    Raises
    ------
    InputError
        If the points do not pair up or the tolerance is not positive.

    Notes
    -----
    Cost: m^3 / 2, with m capped at 200: 20 ms.

    Examples
    --------
    >>> import numpy as np
    >>> points = np.random.default_rng(0).uniform(0, 100, (20, 2))
    >>> best = registrations(points, 1.5 * points + [5, -3], 2.0)[0]
    >>> bool(np.allclose(best.transform, [[1.5, 0, 5], [0, 1.5, -3], [0, 0, 1]])), int(best.inliers.sum())
    (True, 20)
    """
    one, two = as_floats(points1, "points1"), as_floats(points2, "points2")
    if one.shape != two.shape or one.ndim != 2 or one.shape[1] != 2:
        message = f"points1 and points2 must both have shape (m, 2), got {one.shape} and {two.shape}"
        raise InputError(message)
    if not tolerance > 0 or count < 1:
        message = f"tolerance must be positive and count 1 or more, got {tolerance} and {count}"
        raise InputError(message)
    if len(one) < 3:
        return []
    a, b = one[:, 0] + 1j * one[:, 1], two[:, 0] + 1j * two[:, 1]
    factors, shifts = _hypotheses(a[:_MOST_MATCHES], b[:_MOST_MATCHES], tolerance)
    if not len(factors):
        return []
    votes = _votes(a, b, factors, shifts, tolerance)
    found = []
    for h in _distinct(one, factors, shifts, votes, tolerance, count):
        factor, shift = _similarity_fit(a, b, complex(factors[h]), complex(shifts[h]), tolerance)
        result = _affine_fit(one, two, _as_matrix(factor, shift), tolerance)
        if result is not None:
            found.append(result)
    return sorted(found, key=lambda r: -r.consensus)


def carried(transform: FloatArray, points: ArrayLike) -> FloatArray:
    """Take points through a 3 x 3 transform.

    Parameters
    ----------
    transform : (3, 3) array of float
    points : (n, 2) array_like of float

    Returns
    -------
    (n, 2) array of float

    Examples
    --------
    >>> import numpy as np
    >>> carried(np.diag([2.0, 3.0, 1.0]), [[1, 1]])
    array([[2., 3.]])
    """
    flat = as_floats(points, "points").reshape(-1, 2)
    homogeneous = np.column_stack([flat, np.ones(len(flat))]) @ transform.T
    result: FloatArray = homogeneous[:, :2] / homogeneous[:, 2:]
    return result


def inverse(transform: FloatArray) -> FloatArray:
    """Return the inverse of a 3 x 3 transform."""
    result: FloatArray = np.asarray(np.linalg.inv(transform), dtype=np.float64)
    return result


def agreeing(
    points1: FloatArray, points2: FloatArray, transform: FloatArray, tolerance: float
) -> tuple[float, BoolArray]:
    """Tell which matches agree with a transform, and how well.

    Parameters
    ----------
    points1, points2 : (m, 2) array of float
        Matched points.
    transform : (3, 3) array of float
        Affine.
    tolerance : float
        See :func:`registrations`.

    Returns
    -------
    consensus : float
        Sum over the matches of 1 - (residual / tolerance)^2, where positive.
    inliers : (m,) array of bool
    """
    shares = 1 - (_residuals(points1, points2, transform) / tolerance) ** 2
    inliers: BoolArray = shares > 0
    return float(shares[inliers].sum()), inliers


def _hypotheses(a: FloatArray, b: FloatArray, tolerance: float) -> tuple[FloatArray, FloatArray]:
    """Return the similarities z -> factor z + shift given by all pairs of matches."""
    i, j = np.triu_indices(len(a), 1)
    apart = a[i] - a[j]
    far = np.abs(apart) > 2 * tolerance
    i, j = i[far], j[far]
    factors = (b[i] - b[j]) / apart[far]
    size = np.abs(factors)
    fit = (size > 1 / _MOST_CHANGE) & (size < _MOST_CHANGE) & (np.abs(np.angle(factors)) < _MOST_TURN)
    return factors[fit], b[i[fit]] - factors[fit] * a[i[fit]]


@kernel
def _votes(
    a: FloatArray, b: FloatArray, factors: FloatArray, shifts: FloatArray, tolerance: float
) -> FloatArray:
    votes = np.zeros(len(factors))
    for h in range(len(factors)):
        bound = tolerance**2 * abs(factors[h])
        for m in range(len(a)):
            miss = factors[h] * a[m] + shifts[h] - b[m]
            squared = miss.real**2 + miss.imag**2
            if squared < bound:
                votes[h] += 1 - squared / bound
    return votes


def _distinct(
    points: FloatArray,
    factors: FloatArray,
    shifts: FloatArray,
    votes: FloatArray,
    tolerance: float,
    count: int,
) -> list[int]:
    """Return the best hypotheses that take the corners of the matched points to different places."""
    low, high = np.quantile(points, [0.1, 0.9], axis=0)
    corners = np.array(
        [low[0] + 1j * low[1], high[0] + 1j * low[1], low[0] + 1j * high[1], high[0] + 1j * high[1]]
    )
    kept: list[int] = []
    best = np.argsort(-votes, kind="stable")[:1000]
    images = factors[best, None] * corners + shifts[best, None]
    allowed = tolerance * np.sqrt(np.abs(factors[best]))
    left = np.ones(len(best), dtype=bool)
    while left.any() and len(kept) < count:
        first = int(left.argmax())
        kept.append(int(best[first]))
        left &= np.abs(images - images[first]).mean(axis=1) > allowed
    return kept


def _similarity_fit(
    a: FloatArray, b: FloatArray, factor: complex, shift: complex, tolerance: float
) -> tuple[complex, complex]:
    for _ in range(_ROUNDS):
        weights = np.maximum(0, 1 - np.abs(factor * a + shift - b) ** 2 / (tolerance**2 * abs(factor)))
        total = weights.sum()
        if np.count_nonzero(weights) < 3:
            break
        centre_a, centre_b = (weights @ a) / total, (weights @ b) / total
        spread = weights @ np.abs(a - centre_a) ** 2
        fitted = (weights * np.conj(a - centre_a)) @ (b - centre_b) / spread if spread > 0 else 0.0
        if not 1 / _MOST_CHANGE < abs(fitted) < _MOST_CHANGE:
            break
        factor, shift = complex(fitted), complex(centre_b - fitted * centre_a)
    return factor, shift


def _as_matrix(factor: complex, shift: complex) -> FloatArray:
    return np.array(
        [[factor.real, -factor.imag, shift.real], [factor.imag, factor.real, shift.imag], [0.0, 0.0, 1.0]]
    )


def _residuals(one: FloatArray, two: FloatArray, transform: FloatArray) -> FloatArray:
    size = np.sqrt(abs(np.linalg.det(transform[:2, :2])))
    misses: FloatArray = np.linalg.norm(carried(transform, one) - two, axis=1) / np.sqrt(size)
    return misses


def _affine_fit(
    one: FloatArray, two: FloatArray, transform: FloatArray, tolerance: float
) -> Registration | None:
    """Fit the departure from a similarity, held back by a prior, to the matches near it."""
    for _ in range(_ROUNDS):
        weights = np.maximum(0, 1 - (_residuals(one, two, transform) / (1.5 * tolerance)) ** 2)
        if np.count_nonzero(weights) < 6:
            break
        centre = weights @ one / weights.sum()
        spread = np.sqrt(weights @ ((one - centre) ** 2).sum(axis=1) / weights.sum())
        if not spread > 0:
            break
        basis = np.column_stack([(one - centre) / spread, np.ones(len(one))])
        normal = basis.T @ (weights[:, None] * basis) + _STIFFNESS * np.diag([1.0, 1.0, 0.0])
        change = np.linalg.solve(normal, basis.T @ (weights[:, None] * (two - carried(transform, one))))
        candidate = transform.copy()
        candidate[:2, :2] += change[:2].T / spread
        candidate[:2, 2] += change[2] - change[:2].T @ centre / spread
        if not 1 / _MOST_CHANGE**2 < np.linalg.det(candidate[:2, :2]) < _MOST_CHANGE**2:
            break
        transform = candidate
    consensus, inliers = agreeing(one, two, transform, tolerance)
    return Registration(transform, consensus, inliers) if np.count_nonzero(inliers) >= 3 else None
