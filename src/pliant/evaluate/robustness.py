"""How much a signature changes when the shape is noisy or partly missing (Fig. 2.8, 3.4, 3.8)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, IntArray, as_floats, as_indices, frozen
from ..errors import InputError, first_indices
from ..mesh import Mesh, with_noise

__all__ = ["NoiseCurve", "noise_curve", "part_of", "relative_errors"]

DEFAULT_SIGMAS = tuple(round(0.1 * i, 1) for i in range(1, 11))


@dataclass(frozen=True, eq=False, repr=False)
class NoiseCurve:
    """Relative error of a signature against noise.

    Parameters
    ----------
    sigmas : (s,) array of float
        Standard deviation of the normal displacement, in mean edge lengths.
    errors : (s, r) array of float
        Mean over all vertices of ``|f - f'| / |f|``, for each sigma and each of r draws of the noise.
    n_skipped : int
        Vertices left out because their signature is 0 on the clean shape.

    Examples
    --------
    >>> NoiseCurve([0.1, 0.2], [[0.01, 0.03], [0.05, 0.07]])
    NoiseCurve(2 draws: 0.02 at sigma 0.1, 0.06 at sigma 0.2)
    """

    sigmas: FloatArray
    errors: FloatArray
    n_skipped: int = 0

    def __post_init__(self) -> None:
        sigmas, errors = as_floats(self.sigmas, "sigmas"), as_floats(self.errors, "errors")
        if sigmas.ndim != 1 or errors.ndim != 2 or len(errors) != len(sigmas) or not errors.size:
            message = f"errors must be (s, r) for s sigmas, got {errors.shape} and {sigmas.shape}"
            raise InputError(message)
        object.__setattr__(self, "sigmas", frozen(sigmas))
        object.__setattr__(self, "errors", frozen(errors))

    def __repr__(self) -> str:
        ends = ", ".join(f"{self.mean[i]:.3g} at sigma {self.sigmas[i]:g}" for i in (0, -1))
        return f"NoiseCurve({self.errors.shape[1]} draws: {ends})"

    @property
    def mean(self) -> FloatArray:
        """(s,) error for each sigma, averaged over the draws."""
        mean: FloatArray = self.errors.mean(axis=1)
        return mean

    @property
    def spread(self) -> FloatArray:
        """(s,) standard deviation over the draws; NaN where there was one."""
        draws = self.errors.shape[1]
        return self.errors.std(axis=1, ddof=1) if draws > 1 else np.full(len(self.sigmas), np.nan)


def relative_errors(reference: ArrayLike, other: ArrayLike, *, source: ArrayLike | None = None) -> FloatArray:
    """Return how far each point's signature moved, as a share of its own length: ``|f - f'| / |f|``.

    Parameters
    ----------
    reference : (n, d) array_like of float
        Signature on the intact shape.
    other : (m, d) array_like of float
        On the changed shape.
    source : (m,) array_like of int, optional
        The intact shape's row for each row of ``other``; the same numbering by default.

    Returns
    -------
    (m,) array of float
        NaN where the reference is 0.

    Raises
    ------
    InputError
        If shapes do not fit or a row is named that is not there.

    Examples
    --------
    >>> relative_errors([[3.0, 4.0]], [[3.0, 4.5]])
    array([0.1])
    """
    intact, changed = as_floats(reference, "reference"), as_floats(other, "other")
    if intact.ndim != 2 or changed.ndim != 2 or intact.shape[1] != changed.shape[1]:
        message = f"signatures must be (n, d) of one width, got {intact.shape} and {changed.shape}"
        raise InputError(message)
    rows = np.arange(len(changed)) if source is None else as_indices(source, "source")
    bad = np.flatnonzero((rows < 0) | (rows >= len(intact)))
    if rows.shape != (len(changed),) or bad.size:
        message = (
            f"source must name one of {len(intact)} rows for each of {len(changed)}; {bad.size} are out of "
            f"range, first at {first_indices(bad)}"
        )
        raise InputError(message)
    lengths = np.linalg.norm(intact[rows], axis=1)
    moved = np.linalg.norm(changed - intact[rows], axis=1)
    errors: FloatArray = np.divide(moved, lengths, out=np.full(len(moved), np.nan), where=lengths > 0)
    return errors


def noise_curve(
    mesh: Mesh,
    describe: Callable[[Mesh], ArrayLike],
    *,
    sigmas: Sequence[float] = DEFAULT_SIGMAS,
    repeats: int = 1,
    rng: np.random.Generator | int = 0,
) -> NoiseCurve:
    """Measure a signature's relative error under normal displacement of growing size (Fig. 2.8, 3.8).

    Parameters
    ----------
    mesh : Mesh
    describe : callable
        Takes a mesh and returns its (n, d) signature.
    sigmas : sequence of float
        In mean edge lengths: the dissertation names no unit. 0.1 to 1 by default.
    repeats : int
        Draws of the noise for each sigma.
    rng : int or numpy.random.Generator
        Seed; the same one gives the same bytes.

    Returns
    -------
    NoiseCurve

    Raises
    ------
    InputError
        If there is no sigma or repeat, or a signature does not fit the mesh.

    Notes
    -----
    Cost: one ``describe`` for each sigma and draw. A signature with bins over a range of its own must have them
    fixed beforehand, or the bins move with the noise.

    Examples
    --------
    >>> from pliant import eigenbasis, hks, shapes
    >>> curve = noise_curve(
    ...     shapes.icosphere(2), lambda mesh: hks(eigenbasis(mesh, 16), n_times=8), sigmas=[0.1, 0.3]
    ... )
    >>> bool(0 < curve.mean[0] < curve.mean[1] < 0.5)
    True
    """
    if not len(sigmas) or repeats < 1:
        raise InputError("noise_curve needs at least one sigma and one repeat")
    generator = np.random.default_rng(rng)
    clean = as_floats(describe(mesh), "signature")
    errors = np.empty((len(sigmas), repeats))
    skipped = 0
    for i, sigma in enumerate(sigmas):
        for j in range(repeats):
            moved = relative_errors(clean, describe(with_noise(mesh, sigma, rng=generator)))
            known = np.isfinite(moved)
            skipped = int((~known).sum())
            if not known.any():
                raise InputError("the signature is 0 everywhere on the clean shape: it has no relative error")
            errors[i, j] = moved[known].mean()
    return NoiseCurve(np.asarray(sigmas, dtype=float), errors, skipped)


def part_of(mesh: Mesh, keep: ArrayLike) -> tuple[Mesh, IntArray]:
    """Cut a part off: the triangles whose three corners are kept (Fig. 3.4).

    Parameters
    ----------
    mesh : Mesh
    keep : (n,) array_like of bool
        The vertices that stay.

    Returns
    -------
    Mesh, (m,) array of int
        The part, and the vertex of the whole that each of its vertices is. Kept vertices of no kept triangle
        are dropped.

    Raises
    ------
    InputError
        If ``keep`` does not fit the mesh or no triangle is left.

    Notes
    -----
    Signatures of whole and part then compare row by row: ``relative_errors(whole, part, source=source)``.
    Those normalised by something global, as relative radii are, need it taken from the whole.

    Examples
    --------
    >>> from pliant import shapes
    >>> ball = shapes.icosphere(2)
    >>> cap, source = part_of(ball, ball.vertices[:, 2] > 0)
    >>> bool((cap.vertices == ball.vertices[source]).all())
    True
    """
    chosen: BoolArray = np.asarray(keep)
    if chosen.shape != (mesh.n_vertices,) or chosen.dtype != np.bool_:
        message = f"keep must be {mesh.n_vertices} booleans, one a vertex; got {chosen.dtype} {chosen.shape}"
        raise InputError(message)
    faces = mesh.faces[chosen[mesh.faces].all(axis=1)]
    if not len(faces):
        raise InputError("no triangle has all three corners kept: nothing is left")
    source = np.unique(faces)
    number = np.full(mesh.n_vertices, -1)
    number[source] = np.arange(len(source))
    return Mesh(mesh.vertices[source], number[faces]), source
