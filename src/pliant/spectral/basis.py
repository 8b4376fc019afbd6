"""The eigenbasis of a Laplacian: choice of solver, checks, order and signs."""

from __future__ import annotations

import os
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._arrays import FloatArray, IntArray
from .._kernels import kernel
from .._progress import progress_bar
from ..errors import InputError, NumericalError, first_indices
from ..mesh import Mesh
from ._cache import cached_spectrum, store_spectrum
from ._factor import Pencil
from ._panels import Panels
from ._plain import dense_pairs, factorless_pairs
from ._polish import polish
from ._signs import fix_signs
from ._sparse import CsrArray, product
from ._windows import WindowSolver
from .laplacian import Laplacian, LaplacianKind, laplacian
from .spectrum import Spectrum

__all__ = ["eigenbasis"]

PathLike: TypeAlias = "str | os.PathLike[str]"

# Up to here LAPACK on the full matrices is as fast as anything.
_DENSE = 500
# Past this many entries a row the factor of the matrix fills in beyond use.
_WIDEST_ROWS = 64
# A value this far below the next piece's first one is a zero that has no piece of its own.
_NOTHING = 1e-13


def eigenbasis(
    surface: Mesh | Laplacian | ArrayLike,
    k: int = 200,
    *,
    kind: LaplacianKind = "cotan",
    tol: float = 1e-8,
    cache: PathLike | None = None,
    n_jobs: int | None = None,
    progress: bool = False,
) -> Spectrum:
    """Compute the first k eigenpairs of the Laplace-Beltrami operator.

    Parameters
    ----------
    surface : Mesh, Laplacian or (n, 3) array_like of float
        The surface, its operator, or points (with ``kind="robust"`` or ``"mesh"``).
    k : int
        Number of eigenpairs, from 1 to n - 1.
    kind : {"cotan", "robust", "mesh"}
        Which :func:`laplacian` to build, where ``surface`` is not one already.
    tol : float
        Largest relative residual ``|L phi - lambda M phi| / (lambda |M phi|)`` (Euclidean norms; the first
        positive eigenvalue stands in for 0) of any pair. Every pair is measured. Rounding ends near 1e-10.
    cache : path-like, optional
        Folder to keep the result in. A stored basis with k pairs or more is cut to size; a smaller or a
        damaged one is computed again. The key holds the matrices, the tolerance and the version.
    n_jobs : int, optional
        Threads; None or -1 for all.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    Spectrum
        Values ascending; each connected piece has the eigenvalue 0 and its own constant function, exactly.
        Vectors are orthonormal in the mass, and the sign makes the first of the largest entries positive.

    Raises
    ------
    InputError
        If k or tol is out of range, and what :func:`laplacian` raises.
    NumericalError
        If a pair does not reach ``tol``, or the matrix cannot be factored; the message says where in the
        mesh the numbers are out of proportion.

    Notes
    -----
    Block Lanczos on (L - s M)^-1 M with the shift s in the middle of the wanted values, in windows of up to
    320 pairs, on a nested-dissection factor [1]_. The number of eigenvalues below a cut is counted from the
    factor's inertia at the cut, so that no pair can be missing, copies of repeated ones included. Pieces
    of a surface are solved one by one.

    Same input, same bytes on one machine, whatever ``n_jobs``; another BLAS rounds differently. Cost: one to
    two seconds for 200 pairs of 30,000 vertices on two cores, and about 4 n k numbers of memory. Operators with
    more than 64 entries a row (``kind="mesh"``) cannot be factored and take far longer.

    Repeated eigenvalues fix only the subspace of their vectors.

    References
    ----------
    .. [1] R. Grimes, J. Lewis, H. Simon, A shifted block Lanczos algorithm for solving sparse symmetric
       generalized eigenproblems, SIAM J. Matrix Anal. Appl. 15, 1994.
    .. [2] B. Vallet, B. Levy, Spectral geometry processing with manifold harmonics, Eurographics 2008.

    Examples
    --------
    >>> from pliant import shapes
    >>> spectrum = eigenbasis(shapes.icosphere(3), 9)
    >>> (spectrum.values / 2).round(1)
    array([0., 1., 1., 1., 3., 3., 3., 3., 3.])
    """
    operator = surface if isinstance(surface, Laplacian) else laplacian(surface, kind)
    n = operator.n_vertices
    if isinstance(k, bool) or int(k) != k or not 1 <= k < n:
        message = f"k must be a whole number 1..{n - 1}, fewer than the {n} vertices; got {k}"
        raise InputError(message)
    if not 0 < tol < 1:
        message = f"tol must lie between 0 and 1, got {tol}"
        raise InputError(message)
    stored = cached_spectrum(cache, operator, int(k), tol)
    if stored is not None:
        return stored
    spectrum = _computed(operator, int(k), tol, n_jobs, progress=progress)
    store_spectrum(cache, operator, spectrum, tol)
    return spectrum


def _computed(operator: Laplacian, k: int, tol: float, n_jobs: int | None, *, progress: bool) -> Spectrum:
    pieces, labels = operator.components()
    with Panels(operator.n_vertices, n_jobs) as panels, np.errstate(all="ignore"):
        constants = _indicators(labels, pieces, operator.mass)
        try:
            if pieces == 1:
                values, vectors = _pairs(operator, constants, k, tol, panels, progress=progress)
            else:
                values, vectors = _pairs_by_piece(operator, constants, labels, k, tol, panels)
        except (NumericalError, np.linalg.LinAlgError) as error:
            message = f"{error}. {_out_of_proportion(operator)}"
            raise NumericalError(message) from error
        residuals = _residuals(operator, values, vectors, panels)
        if (residuals[pieces:] > tol).any():
            last = int(np.flatnonzero(residuals > 0.3 * tol)[-1])
            values, vectors = polish(operator, values, vectors, pieces, last, panels)
            residuals = _residuals(operator, values, vectors, panels)
        fix_signs(vectors)
    _check(operator, values, residuals, pieces, tol)
    for array in (values, vectors, residuals):
        array.setflags(write=False)
    return Spectrum(values, vectors, operator.mass, residuals)


def _pairs(
    operator: Laplacian, constants: FloatArray, k: int, tol: float, panels: Panels, *, progress: bool
) -> tuple[FloatArray, FloatArray]:
    """Return k eigenpairs of one connected piece, the constant first, by the solver that suits the operator."""
    n = operator.n_vertices
    stiffness, mass = operator.stiffness, operator.mass
    if k == 1:
        return np.zeros(1), constants
    if n <= _DENSE or 4 * k > n:
        values, vectors = dense_pairs(stiffness, mass, k)
    elif stiffness.nnz > _WIDEST_ROWS * n and operator.lumped:
        values, vectors = factorless_pairs(stiffness, mass, k)
    else:
        pencil = Pencil(operator)
        solver = WindowSolver(pencil, constants[pencil.order], operator.area, tol, panels)
        with progress_bar("eigenpairs", k, show=progress) as advance:
            values, inner = solver.solve(k, advance)
        vectors = np.empty_like(inner)
        vectors[pencil.order] = inner
        return values, vectors
    values[0] = 0
    vectors = np.ascontiguousarray(vectors)
    vectors[:, :1] = constants
    return values, vectors


def _pairs_by_piece(
    operator: Laplacian, constants: FloatArray, labels: IntArray, k: int, tol: float, panels: Panels
) -> tuple[FloatArray, FloatArray]:
    """Return k eigenpairs of a surface in several pieces, each piece solved by itself.

    Identical pieces repeat every eigenvalue, more often than a block method can tell apart.
    """
    n, pieces = constants.shape
    if k <= pieces:
        return np.zeros(k), np.ascontiguousarray(constants[:, :k])
    counts = _counts_by_piece(operator, labels, pieces, k)
    every_value: list[FloatArray] = []
    columns: list[tuple[IntArray, FloatArray]] = []
    for piece, count in enumerate(counts):
        rows = np.flatnonzero(labels == piece)
        part = Laplacian(operator.stiffness[rows][:, rows], operator.mass[rows][:, rows])
        values, vectors = _pairs(part, constants[rows, piece : piece + 1], count, tol, panels, progress=False)
        every_value.append(values)
        columns.extend((rows, column) for column in vectors.T)
    values = np.concatenate(every_value)
    order = np.argsort(values, kind="stable")[:k]
    result = np.zeros((n, k))
    for place, which in enumerate(order):
        rows, column = columns[which]
        result[rows, place] = column
    return values[order], result


def _counts_by_piece(operator: Laplacian, labels: IntArray, pieces: int, k: int) -> list[int]:
    """Return how many pairs of each piece are below a cut that has k pairs below it in all, or a few more."""
    if operator.stiffness.nnz > _WIDEST_ROWS * operator.n_vertices:
        # No factor to count with: k of each piece are enough.
        return [int(min(k, size)) for size in np.bincount(labels, minlength=pieces)]
    pencil = Pencil(operator)
    low, high = 0.0, np.inf
    cut = 4 * np.pi * k / operator.area
    for _ in range(40):
        factor = pencil.factor(cut)
        if factor.below >= k:
            high, best = cut, factor
            if factor.below <= 1.2 * k + pieces or high < 1.01 * low:
                break
        else:
            low = cut
        cut = 2 * cut if np.isinf(high) else 0.5 * (low + high)
    return [int(c) for c in np.bincount(labels[pencil.order[best.negative]], minlength=pieces)]


def _indicators(labels: IntArray, pieces: int, mass: CsrArray) -> FloatArray:
    """Return the constant function of each piece, (n, pieces), of norm 1 in the mass."""
    indicators = np.zeros((len(labels), pieces))
    indicators[np.arange(len(labels)), labels] = 1
    normalised: FloatArray = indicators / np.sqrt((indicators * product(mass, indicators)).sum(axis=0))
    return normalised


def _residuals(operator: Laplacian, values: FloatArray, vectors: FloatArray, panels: Panels) -> FloatArray:
    stiffness, mass = operator.stiffness, operator.mass
    arrays = (stiffness.indptr, stiffness.indices, stiffness.data, mass.indptr, mass.indices, mass.data)
    squares = panels.total(lambda rows: _residual_squares(*arrays, vectors, values, rows.start, rows.stop))
    positive = values[values > 0]
    scale = np.where(values > 0, values, positive[0] if positive.size else 1.0)
    residuals: FloatArray = np.sqrt(squares[0] / squares[1]) / scale
    return residuals


def _check(operator: Laplacian, values: FloatArray, residuals: FloatArray, pieces: int, tol: float) -> None:
    worst = int(residuals.argmax()) if np.isfinite(residuals).all() else int(np.isnan(residuals).argmax())
    if not residuals[worst] <= tol:
        message = (
            f"{np.count_nonzero(~(residuals <= tol))} of {len(values)} eigenpairs miss tol={tol:.1e}, the worst, "
            f"{worst}, with {residuals[worst]:.1e}; raise tol. {_out_of_proportion(operator)}"
        )
        raise NumericalError(message)
    if len(values) > pieces and values[pieces] <= _NOTHING * values[-1]:
        message = (
            f"more eigenvalues are zero than the mesh has pieces ({pieces}): some part hangs on by a stiffness "
            f"of nearly nothing. {_out_of_proportion(operator)}"
        )
        raise NumericalError(message)


def _out_of_proportion(operator: Laplacian) -> str:
    """Say where stiffness or mass is far from what is usual in the mesh."""
    stiffness, mass = operator.stiffness.diagonal(), operator.mass.diagonal()
    found = []
    for name, values, cause in (
        ("stiffness", stiffness, "sliver triangles"),
        ("mass", 1 / np.maximum(mass, np.finfo(float).tiny), "triangles of nearly no area"),
    ):
        bad = np.flatnonzero(values > 1e6 * np.median(values))
        if bad.size:
            which = "more" if name == "stiffness" else "less"
            found.append(
                f"{bad.size} vertices have a million times {which} {name} than the median ({cause}), first "
                f"{first_indices(bad)}; mend them or use kind='robust'"
            )
    return "; ".join(found) or "No vertex stands out by its stiffness or mass"


@kernel
def _residual_squares(
    start: NDArray[np.int32],
    index: NDArray[np.int32],
    stiffness: FloatArray,
    mass_start: NDArray[np.int32],
    mass_index: NDArray[np.int32],
    mass: FloatArray,
    vectors: FloatArray,
    values: FloatArray,
    first: int,
    last: int,
) -> FloatArray:
    """Sum the squares of L x - lambda M x and of M x over some rows, (2, k)."""
    k = len(values)
    squares = np.zeros((2, k))
    weighed, gap = np.empty(k), np.empty(k)
    for i in range(first, last):
        weighed[:] = 0
        gap[:] = 0
        for p in range(mass_start[i], mass_start[i + 1]):
            row, weight = vectors[mass_index[p]], mass[p]
            for c in range(k):
                weighed[c] += weight * row[c]
        for p in range(start[i], start[i + 1]):
            row, weight = vectors[index[p]], stiffness[p]
            for c in range(k):
                gap[c] += weight * row[c]
        for c in range(k):
            squares[0, c] += (gap[c] - values[c] * weighed[c]) ** 2
            squares[1, c] += weighed[c] ** 2
    return squares
