"""Functional maps: how functions on one surface become functions on another, in their eigenbases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse.linalg as sla
from numpy.typing import ArrayLike

from .._arrays import FloatArray, IntArray, as_floats, frozen, vertex_indices
from ..errors import InputError, NumericalError, first_indices
from ..spectral import Spectrum
from ..spectral._sparse import product
from ._neighbours import nearest_rows

__all__ = ["FunctionalMap", "fmap_from_points", "functional_map", "point_map"]

Sizes = int | tuple[int, int] | None


@dataclass(frozen=True, eq=False, repr=False)
class FunctionalMap:
    """A linear map from functions on a to functions on b, as a matrix between eigenbases.

    Parameters
    ----------
    matrix : (k_b, k_a) array_like of float
        ``fmap_ab``: column i holds the coefficients, on b, of the image of eigenfunction i of a.
    spectrum_a, spectrum_b : Spectrum
        Eigenbases with k_a and k_b eigenpairs at least; the first ones are used.

    Raises
    ------
    InputError
        If the matrix is not finite, or larger than the eigenbases.

    Notes
    -----
    Functions go from a to b; points go from b to a (:func:`point_map`): the image of f is ``f[p_ba]``.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant import eigenbasis, shapes
    >>> spectrum = eigenbasis(shapes.ellipsoid([1, 0.8, 0.5], 2), 6)
    >>> identity = FunctionalMap(np.eye(6), spectrum, spectrum)
    >>> identity
    FunctionalMap(6 eigenfunctions of a -> 6 of b)
    >>> bool((point_map(identity) == np.arange(spectrum.n_vertices)).all())
    True
    """

    matrix: FloatArray
    spectrum_a: Spectrum
    spectrum_b: Spectrum

    def __post_init__(self) -> None:
        matrix = as_floats(self.matrix, "matrix")
        if matrix.ndim != 2 or not matrix.size:
            message = f"matrix must have shape (k_b, k_a), got {matrix.shape}"
            raise InputError(message)
        if matrix.shape[0] > self.spectrum_b.k or matrix.shape[1] > self.spectrum_a.k:
            message = (
                f"matrix has shape {matrix.shape}, but b has {self.spectrum_b.k} eigenpairs and a "
                f"{self.spectrum_a.k}; compute more, or make it smaller"
            )
            raise InputError(message)
        if not np.isfinite(matrix).all():
            raise InputError("matrix must be finite")
        object.__setattr__(self, "matrix", frozen(matrix))

    def __repr__(self) -> str:
        return f"FunctionalMap({self.matrix.shape[1]} eigenfunctions of a -> {self.matrix.shape[0]} of b)"

    def transfer(self, functions: ArrayLike) -> FloatArray:
        """Carry functions from a to b.

        Parameters
        ----------
        functions : (n_a,) or (n_a, d) array_like of float
            On the vertices of a; only their part in the first k_a eigenfunctions is carried.

        Returns
        -------
        (n_b,) or (n_b, d) array of float
        """
        coefficients = self.spectrum_a.project(functions)[: self.matrix.shape[1]]
        return self.spectrum_b.reconstruct(self.matrix @ coefficients)


def functional_map(
    spectrum_a: Spectrum,
    spectrum_b: Spectrum,
    descriptors_a: ArrayLike,
    descriptors_b: ArrayLike,
    *,
    k: Sizes = None,
    laplacian_weight: float = 0.1,
    descriptor_weight: float = 0.0,
) -> FunctionalMap:
    """Estimate the functional map from a to b that carries descriptors to descriptors.

    Minimises ``|C A - B|^2 + laplacian_weight |C La - Lb C|^2 + descriptor_weight sum_i |C Xi - Yi C|^2``:
    A and B hold the descriptors' coefficients, each function scaled to unit mean square over both surfaces, divided by
    their number; La and Lb the eigenvalues times the area, divided by the largest; Xi and Yi
    multiplication by descriptor i.

    Parameters
    ----------
    spectrum_a, spectrum_b : Spectrum
        Eigenbases of the surfaces, with n_a and n_b vertices.
    descriptors_a, descriptors_b : (n_a, d), (n_b, d) array_like of float
        The same d functions on both: signatures, indicators of landmarks or of parts.
    k : int or (int, int), optional
        Eigenfunctions to use, on both or on (a, b); by default 30, or all where there are fewer.
    laplacian_weight : float
        Weight of commuting with the Laplacians, which isometries do.
    descriptor_weight : float
        Weight of commuting with multiplication by each descriptor, which maps of points do; 0 leaves it out.

    Returns
    -------
    FunctionalMap
        ``.matrix`` is (k_b, k_a) and takes functions on a to functions on b.

    Raises
    ------
    InputError
        If shapes do not fit, a value is not finite, every descriptor is 0, k is more than there is, or a
        weight is negative.
    NumericalError
        If the iteration with ``descriptor_weight`` does not converge.

    Notes
    -----
    Cost: k solves of size k; with ``descriptor_weight`` conjugate gradients on k^2 unknowns.

    Signatures that bending leaves alone are alike at mirror images. So on a shape with an intrinsic symmetry
    they fix the symmetric functions only, and the map between the others comes out near 0:
    :func:`pliant.dense_map` is made for such shapes.

    References
    ----------
    .. [1] M. Ovsjanikov et al., Functional maps: a flexible representation of maps between shapes, ACM TOG
       31(4), 2012.
    .. [2] D. Nogneng, M. Ovsjanikov, Informative descriptor preservation via commutativity for shape
       matching, Computer Graphics Forum 36(2), 2017.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant import eigenbasis, shapes
    >>> spectrum = eigenbasis(shapes.ellipsoid([1, 0.8, 0.5], 2), 8)
    >>> positions = shapes.ellipsoid([1, 0.8, 0.5], 2).vertices
    >>> found = functional_map(spectrum, spectrum, positions, positions, laplacian_weight=0.01)
    >>> bool(np.abs(found.matrix[1:4, 1:4] - np.eye(3)).max() < 0.05)
    True
    """
    k_a, k_b = _sizes(k, spectrum_a, spectrum_b, default=30)
    for name, weight in (("laplacian_weight", laplacian_weight), ("descriptor_weight", descriptor_weight)):
        if not (np.isfinite(weight) and weight >= 0):
            message = f"{name} must be 0 or more, got {weight}"
            raise InputError(message)
    f_a, f_b = _scaled_descriptors(descriptors_a, descriptors_b, spectrum_a, spectrum_b)
    A = _unit_project(spectrum_a, f_a, k_a)  # (k_a, d)
    B = _unit_project(spectrum_b, f_b, k_b)  # (k_b, d)
    penalty = laplacian_weight * _commutation(spectrum_a, spectrum_b, k_a, k_b)
    start = _row_solves(A, B, penalty)
    if descriptor_weight:
        X = _multiplications(spectrum_a, f_a, k_a)
        Y = _multiplications(spectrum_b, f_b, k_b)
        start = _commuting_solve(A, B, penalty, X, Y, descriptor_weight, start)
    return FunctionalMap(start / _unit_factor(spectrum_a, spectrum_b), spectrum_a, spectrum_b)


def point_map(fmap: FunctionalMap) -> IntArray:
    """Read a map of points from b to a out of a functional map from a to b.

    Parameters
    ----------
    fmap : FunctionalMap
        From functions on a to functions on b.

    Returns
    -------
    (n_b,) array of int
        ``p_ba``: for each vertex of b, the vertex of a whose delta function, carried over, is nearest to its own.
        Of equally near ones the first.

    Notes
    -----
    Nearest neighbours between the rows of ``vectors_a @ matrix.T`` and of ``vectors_b``, both on surfaces scaled to
    unit area; exact, in blocks. About 2 n_a n_b k flops: some seconds for 28,000 vertices and k = 200.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant import eigenbasis, shapes
    >>> spectrum = eigenbasis(shapes.ellipsoid([1, 0.8, 0.5], 2), 6)
    >>> point_map(FunctionalMap(np.eye(6), spectrum, spectrum))[:4]
    array([0, 1, 2, 3])
    """
    k_b, k_a = fmap.matrix.shape
    unit = fmap.matrix * _unit_factor(fmap.spectrum_a, fmap.spectrum_b)
    basis_a, basis_b = unit_vectors(fmap.spectrum_a, k_a), unit_vectors(fmap.spectrum_b, k_b)
    return nearest_rows(basis_a @ unit.T, basis_b)


def fmap_from_points(
    p_ba: ArrayLike, spectrum_a: Spectrum, spectrum_b: Spectrum, *, k: Sizes = None
) -> FunctionalMap:
    """Write a map of points from b to a as a functional map from a to b: f becomes ``f[p_ba]``.

    Parameters
    ----------
    p_ba : (n_b,) array_like of int
        A vertex of a for each vertex of b.
    spectrum_a, spectrum_b : Spectrum
        The eigenbases.
    k : int or (int, int), optional
        Eigenfunctions to use, on both or on (a, b); all by default.

    Returns
    -------
    FunctionalMap
        ``.matrix`` is (k_b, k_a): ``vectors_b.T @ mass_b @ vectors_a[p_ba]``.

    Raises
    ------
    InputError
        If there is not one vertex of a for each of b, or k is more than there is.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant import eigenbasis, shapes
    >>> spectrum = eigenbasis(shapes.ellipsoid([1, 0.8, 0.5], 2), 6)
    >>> identity = fmap_from_points(np.arange(spectrum.n_vertices), spectrum, spectrum)
    >>> bool(np.allclose(identity.matrix, np.eye(6)))
    True
    """
    k_a, k_b = _sizes(k, spectrum_a, spectrum_b, default=None)
    points = vertex_indices(p_ba, spectrum_a.n_vertices, "p_ba")
    if len(points) != spectrum_b.n_vertices:
        message = (
            f"p_ba must name a vertex of a for each vertex of b, {spectrum_b.n_vertices}, got {len(points)}"
        )
        raise InputError(message)
    matrix = spectrum_b.project(spectrum_a.vectors[points, :k_a])[:k_b]
    return FunctionalMap(matrix, spectrum_a, spectrum_b)


def unit_vectors(spectrum: Spectrum, k: int) -> FloatArray:
    """Return the first k eigenvectors on the surface scaled to unit area."""
    vectors: FloatArray = spectrum.vectors[:, :k] * spectrum.area**0.5
    return vectors


def _unit_factor(spectrum_a: Spectrum, spectrum_b: Spectrum) -> float:
    """Return what turns a functional map's matrix into the one between the surfaces scaled to unit area."""
    return float((spectrum_a.area / spectrum_b.area) ** 0.5)


def _unit_project(spectrum: Spectrum, functions: FloatArray, k: int) -> FloatArray:
    coefficients: FloatArray = spectrum.truncated(k).project(functions) / spectrum.area**0.5
    return coefficients


def _sizes(k: Sizes, spectrum_a: Spectrum, spectrum_b: Spectrum, *, default: int | None) -> tuple[int, int]:
    if k is None:
        most = default or max(spectrum_a.k, spectrum_b.k)
        return min(most, spectrum_a.k), min(most, spectrum_b.k)
    k_a, k_b = k if isinstance(k, tuple) else (k, k)
    for name, wanted, spectrum in (("a", k_a, spectrum_a), ("b", k_b, spectrum_b)):
        if isinstance(wanted, bool) or int(wanted) != wanted or not 1 <= wanted <= spectrum.k:
            message = (
                f"k must be 1..{spectrum.k}, the eigenpairs of {name}; got {wanted}. Compute more of them"
            )
            raise InputError(message)
    return int(k_a), int(k_b)


def _scaled_descriptors(
    descriptors_a: ArrayLike, descriptors_b: ArrayLike, spectrum_a: Spectrum, spectrum_b: Spectrum
) -> tuple[FloatArray, FloatArray]:
    """Scale each to unit mean square over both surfaces, over the square root of their number."""
    f_a = checked_descriptors(descriptors_a, spectrum_a.n_vertices, "descriptors_a")
    f_b = checked_descriptors(descriptors_b, spectrum_b.n_vertices, "descriptors_b")
    check_widths(f_a, f_b)
    squares = (_mean_squares(f_a, spectrum_a) + _mean_squares(f_b, spectrum_b)) / 2
    used = np.flatnonzero(squares > 0)
    if not used.size:
        raise InputError("every descriptor is 0 on both surfaces; give functions that tell points apart")
    scale = 1 / np.sqrt(squares[used] * used.size)
    return f_a[:, used] * scale, f_b[:, used] * scale


def _mean_squares(functions: FloatArray, spectrum: Spectrum) -> FloatArray:
    means: FloatArray = (functions * product(spectrum.mass, functions)).sum(axis=0) / spectrum.area
    return means


def checked_descriptors(values: ArrayLike, n: int, name: str) -> FloatArray:
    """Coerce to (n, d), finite."""
    array = as_floats(values, name)
    if array.ndim != 2 or len(array) != n or not array.shape[1]:
        message = f"{name} must have shape ({n}, d), one row a vertex; got {array.shape}"
        raise InputError(message)
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        message = f"{name}: {bad.size} rows hold NaN or infinite values, first {first_indices(bad)}"
        raise InputError(message)
    return array


def check_widths(f_a: FloatArray, f_b: FloatArray) -> None:
    """Refuse descriptors that are not the same functions on both surfaces."""
    if f_a.shape[1] != f_b.shape[1]:
        message = f"a has {f_a.shape[1]} descriptors and b {f_b.shape[1]}; both need the same ones, in the same order"
        raise InputError(message)


def _commutation(spectrum_a: Spectrum, spectrum_b: Spectrum, k_a: int, k_b: int) -> FloatArray:
    values_a = spectrum_a.values[:k_a] * spectrum_a.area
    values_b = spectrum_b.values[:k_b] * spectrum_b.area
    largest = max(values_a[-1], values_b[-1]) or 1.0
    mask: FloatArray = ((values_b[:, None] - values_a[None]) / largest) ** 2
    return mask


def _row_solves(A: FloatArray, B: FloatArray, penalty: FloatArray) -> FloatArray:
    """Solve each row of C by itself: the Laplacian term is diagonal."""
    gram, right = A @ A.T, B @ A.T
    floor = 1e-12 * np.trace(gram) * np.eye(len(A))  # a singular system gets the answer of least norm
    rows = [np.linalg.solve(gram + floor + np.diag(p), r) for p, r in zip(penalty, right, strict=True)]
    return np.stack(rows)


def _multiplications(spectrum: Spectrum, functions: FloatArray, k: int) -> FloatArray:
    """(d, k, k) multiplication by each function, in the eigenbasis."""
    vectors = spectrum.vectors[:, :k]
    weighted = product(spectrum.mass, vectors)
    return np.stack([weighted.T @ (f[:, None] * vectors) for f in functions.T])


def _commuting_solve(
    A: FloatArray,
    B: FloatArray,
    penalty: FloatArray,
    X: FloatArray,
    Y: FloatArray,
    weight: float,
    start: FloatArray,
) -> FloatArray:
    """Conjugate gradients on the normal equations of all three terms."""
    gram = A @ A.T
    shape = start.shape

    def normal(flat: FloatArray) -> FloatArray:
        C = flat.reshape(shape)
        gap = C @ X - Y @ C
        pulled = (gap @ X.transpose(0, 2, 1) - Y.transpose(0, 2, 1) @ gap).sum(axis=0)
        result: FloatArray = (C @ gram + penalty * C + weight * pulled).ravel()
        return result

    operator = sla.LinearOperator((start.size, start.size), matvec=normal, dtype=np.float64)
    found, failure = sla.cg(operator, (B @ A.T).ravel(), x0=start.ravel(), rtol=1e-8, maxiter=20 * start.size)
    if failure:
        raise NumericalError(
            "the functional map did not converge; lower descriptor_weight or use fewer descriptors"
        )
    matrix: FloatArray = found.reshape(shape)
    return matrix
