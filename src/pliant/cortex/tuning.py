"""What a signature answers to: known deformations of a cylinder (Tables 2.1, 2.2) and noise on a sphere (Fig. 2.9)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, as_floats, frozen, vertex_values
from ..errors import InputError, first_indices
from ..mesh import Mesh, with_noise
from .context import ContextSignature
from .cylinder import ConformalCylinder

__all__ = [
    "DeformationResponse",
    "NoiseCurve",
    "TuningTable",
    "deformation_response",
    "noise_curve",
    "tuning_table",
]


@dataclass(frozen=True, eq=False)
class DeformationResponse:
    """Delta of Tables 2.1 and 2.2.

    Parameters
    ----------
    most, least : (levels,) array of float
        Mean relative change of the signature over the most and the least deformed vertices.
    n_undefined : int
        Vertices left out because their original signature is 0 (no relative change exists).
    """

    most: FloatArray
    least: FloatArray
    n_undefined: int

    def __post_init__(self) -> None:
        for name in ("most", "least"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def delta(self) -> FloatArray:
        """(levels,) how much more the signature changes where the surface did."""
        values: FloatArray = self.most - self.least
        return values

    @property
    def normalised(self) -> FloatArray:
        """(levels,) :attr:`delta` over the largest mean change at any level: comparable between signatures."""
        largest = max(float(self.most.max()), float(self.least.max()))
        values: FloatArray = self.delta / largest if largest > 0 else np.zeros_like(self.delta)
        return values

    @property
    def mean(self) -> float:
        """Mean of :attr:`delta` over the levels."""
        return float(self.delta.mean())


@dataclass(frozen=True, eq=False)
class TuningTable:
    """Mean Delta for each number of neighbours and bins (Table 2.1).

    Parameters
    ----------
    counts : (c,) array of int
        Neighbours.
    bins : (b,) array of int
        Bins.
    delta : (c, b) array of float
        Mean Delta over the levels.
    """

    counts: IntArray
    bins: IntArray
    delta: FloatArray

    def __post_init__(self) -> None:
        for name in ("counts", "bins", "delta"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, eq=False)
class NoiseCurve:
    """How a signature changes under noise (Fig. 2.8, 2.9).

    Parameters
    ----------
    sigmas : (s,) array of float
        Standard deviations along the normals, in mean edge lengths.
    errors : (repeats, s) array of float
        Mean relative change over all vertices, one row for each draw of the noise.
    n_undefined : int
        Vertices left out because their clean signature is 0.
    """

    sigmas: FloatArray
    errors: FloatArray
    n_undefined: int

    def __post_init__(self) -> None:
        for name in ("sigmas", "errors"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def mean(self) -> FloatArray:
        """(s,) mean over the draws."""
        values: FloatArray = self.errors.mean(axis=0)
        return values


def deformation_response(
    signatures: Sequence[ArrayLike], density: ArrayLike, *, most: float = 0.1, least: float = 0.5
) -> DeformationResponse:
    """Compare how a signature changes where a surface was deformed and where it was not: Delta of Tables 2.1, 2.2.

    Parameters
    ----------
    signatures : sequence of (n,) or (n, d) array_like
        The signature at each level, the undeformed surface first.
    density : (n,) array_like of float
        How strongly each vertex was deformed.
    most, least : float
        Shares of the vertices taken as most and as least deformed.

    Returns
    -------
    DeformationResponse

    Raises
    ------
    InputError
        If shapes differ, values are not finite, or the shares do not fit.

    Examples
    --------
    >>> found = deformation_response([[1, 1, 1, 1], [2, 1, 1, 1]], [5, 0, 0, 0], most=0.25)
    >>> found.delta.tolist()
    [0.0, 1.0]
    """
    rows = [_as_rows(signature) for signature in signatures]
    if len(rows) < 2 or any(row.shape != rows[0].shape for row in rows):
        raise InputError("signatures must be two or more arrays of one shape, the undeformed surface first")
    amount = vertex_values(density, len(rows[0]), "density")
    if not (0 < most < 1 and 0 < least < 1 and most + least <= 1):
        message = f"most and least are shares of the vertices, together at most 1; got {most} and {least}"
        raise InputError(message)
    order = np.argsort(amount, kind="stable")
    n_most, n_least = max(1, round(most * len(order))), max(1, round(least * len(order)))
    change = np.stack([relative_change(rows[0], row) for row in rows])
    undefined = int(np.isnan(change[0]).sum())
    if np.isnan(change[0, order[-n_most:]]).all() or np.isnan(change[0, order[:n_least]]).all():
        raise InputError(
            "the signature is 0 at all most or all least deformed vertices: no relative change exists"
        )
    return DeformationResponse(
        np.nanmean(change[:, order[-n_most:]], axis=1),
        np.nanmean(change[:, order[:n_least]], axis=1),
        undefined,
    )


def tuning_table(
    levels: Sequence[ConformalCylinder],
    *,
    counts: Sequence[int] = (30, 50, 100),
    bins: Sequence[int] = (10, 20, 30),
    signature: ContextSignature | None = None,
) -> TuningTable:
    """Find the mean Delta of the geodesic context histogram for every number of neighbours and bins (Table 2.1).

    Parameters
    ----------
    levels : sequence of ConformalCylinder
        The undeformed one first.
    counts, bins : sequence of int
        What to try.
    signature : ContextSignature, optional
        The other settings (weights, graph, smoothing). Bin edges are those of all levels together.

    Returns
    -------
    TuningTable

    Raises
    ------
    InputError
        If fewer than two levels are given, or an argument is out of range.

    Notes
    -----
    The field of each level is computed once.

    Examples
    --------
    >>> from pliant.cortex import conformal_cylinder
    >>> levels = [conformal_cylinder(k, sides=12, height=3) for k in (1, 6)]
    >>> tuning_table(levels, counts=(10, 20), bins=(5,)).delta.shape
    (2, 1)
    """
    if len(levels) < 2:
        raise InputError("tuning needs two levels or more, the undeformed one first")
    base = ContextSignature() if signature is None else signature
    fields = [base.field(level.mesh) for level in levels]
    delta = np.empty((len(counts), len(bins)))
    for i, count in enumerate(counts):
        for j, k in enumerate(bins):
            setting = replace(base, count=count, radius=None, bins=k).with_edges_of(*fields)
            found = [setting.histograms(level.mesh, f) for level, f in zip(levels, fields, strict=True)]
            delta[i, j] = deformation_response(found, levels[0].density).mean
    return TuningTable(np.array(counts), np.array(bins), delta)


def noise_curve(
    mesh: Mesh,
    signature: Callable[[Mesh], ArrayLike],
    sigmas: ArrayLike,
    rng: np.random.Generator | int,
    *,
    repeats: int = 1,
) -> NoiseCurve:
    """Measure how a signature changes when every vertex is displaced along its normal (Fig. 2.8, 2.9).

    Parameters
    ----------
    mesh : Mesh
        The clean surface; the dissertation takes a sphere.
    signature : callable
        Takes a mesh, gives (n,) or (n, d). A :class:`ContextSignature` needs edges, or bins follow the noise.
    sigmas : (s,) array_like of float
        Standard deviations, in mean edge lengths.
    rng : numpy.random.Generator or int
        Seed.
    repeats : int
        Draws of the noise.

    Returns
    -------
    NoiseCurve

    Raises
    ------
    InputError
        If a sigma is negative, or the signature is 0 everywhere on the clean surface.

    Notes
    -----
    Relative to the norm of a vertex's clean signature, as section 2.6.4 does. A histogram over bins that are narrow
    beside the field's noise changes by about 1 whatever the field does, and over bins far wider than the field's
    spread by 0: read the curve beside that of the field itself.

    Examples
    --------
    >>> from pliant import shapes
    >>> curve = noise_curve(shapes.icosphere(2), lambda mesh: mesh.vertex_areas, [0, 0.1], 0)
    >>> float(curve.mean[0]), bool(0 < curve.mean[1] < 0.2)
    (0.0, True)
    """
    levels = np.atleast_1d(as_floats(sigmas, "sigmas"))
    if repeats < 1:
        message = f"repeats must be at least 1, got {repeats}"
        raise InputError(message)
    clean = _as_rows(signature(mesh))
    generator = np.random.default_rng(rng)
    errors = np.empty((repeats, len(levels)))
    for draw, seed in enumerate(generator.integers(0, 2**32, repeats)):
        for i, sigma in enumerate(levels):
            noisy = with_noise(mesh, float(sigma), rng=int(seed))
            change = relative_change(clean, _as_rows(signature(noisy)))
            if np.isnan(change).all():
                raise InputError(
                    "the signature of the clean surface is 0 everywhere: no relative change exists"
                )
            errors[draw, i] = np.nanmean(change)
    return NoiseCurve(levels, errors, int((~clean.any(axis=1)).sum()))


def relative_change(before: FloatArray, after: FloatArray) -> FloatArray:
    """(n,) norm of the difference of rows over the norm of the first; NaN where that is 0."""
    size = np.linalg.norm(before, axis=1)
    difference = np.linalg.norm(after - before, axis=1)
    change: FloatArray = np.divide(difference, size, out=np.full(len(size), np.nan), where=size > 0)
    return change


def _as_rows(values: ArrayLike) -> FloatArray:
    rows = as_floats(values, "signature")
    if rows.ndim not in (1, 2) or not rows.size:
        message = f"a signature must have shape (n,) or (n, d), got {rows.shape}"
        raise InputError(message)
    rows = rows.reshape(len(rows), -1)
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if bad.size:
        message = f"the signature is not finite at {bad.size} vertices, first {first_indices(bad)}"
        raise InputError(message)
    return rows
