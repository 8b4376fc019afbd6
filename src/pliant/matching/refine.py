"""Refinement of functional maps: iterative closest points, and ZoomOut."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .._arrays import FloatArray, IntArray
from .._progress import Advance, progress_bar
from ..errors import InputError
from ..spectral import Spectrum
from ..spectral.kernels import biharmonic_embedding
from ._neighbours import nearest_rows
from .functional_map import FunctionalMap, fmap_from_points, point_map, unit_vectors
from .sampling import farthest_points

__all__ = ["icp_refine", "zoomout"]

# Higher pairs change biharmonic distances by less than the spacing of samples.
_SAMPLING_PAIRS = 50


def icp_refine(fmap: FunctionalMap, *, steps: int = 10) -> FunctionalMap:
    """Make a functional map orthogonal and pointwise, in turns, at its own size.

    Parameters
    ----------
    fmap : FunctionalMap
        From functions on a to functions on b.
    steps : int
        How many times; ends early where the point map repeats itself.

    Returns
    -------
    FunctionalMap
        From a to b; orthogonal on the surfaces scaled to unit area.

    Raises
    ------
    InputError
        If ``steps`` is less than 1.

    Notes
    -----
    Each step costs one :func:`point_map` and one singular value decomposition.

    References
    ----------
    .. [1] M. Ovsjanikov et al., Functional maps: a flexible representation of maps between shapes, ACM TOG
       31(4), 2012, section 6.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant import eigenbasis, shapes
    >>> spectrum = eigenbasis(shapes.ellipsoid([1, 0.8, 0.5], 2), 6)
    >>> near = FunctionalMap(np.eye(6) + 0.02, spectrum, spectrum)
    >>> bool(np.allclose(icp_refine(near).matrix, np.eye(6)))
    True
    """
    _check_positive(steps, "steps")
    k_b, k_a = fmap.matrix.shape
    scale = (fmap.spectrum_b.area / fmap.spectrum_a.area) ** 0.5
    before: IntArray | None = None
    for _ in range(steps):
        points = point_map(fmap)
        if before is not None and np.array_equal(points, before):
            break
        raw = fmap_from_points(points, fmap.spectrum_a, fmap.spectrum_b, k=(k_a, k_b)).matrix
        left, _values, right = np.linalg.svd(raw, full_matrices=False)
        fmap = FunctionalMap(scale * (left @ right), fmap.spectrum_a, fmap.spectrum_b)
        before = points
    return fmap


def zoomout(
    fmap: FunctionalMap,
    *,
    k: int | None = None,
    step: int = 1,
    samples: int | None = None,
    progress: bool = False,
) -> FunctionalMap:
    """Refine a functional map by growing it: to points and back, with more eigenfunctions each time.

    Parameters
    ----------
    fmap : FunctionalMap
        From functions on a to functions on b; small: 4 to 30 eigenfunctions.
    k : int, optional
        Final size, on the larger side; all eigenpairs there are by default.
    step : int
        Eigenfunctions added a time.
    samples : int, optional
        Vertices of each surface used on the way, farthest points by biharmonic distance; the last step
        always uses all. By default all. About five times ``k`` is enough.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    FunctionalMap
        From a to b, with min(k, eigenpairs) on each side.

    Raises
    ------
    InputError
        If ``k`` is smaller than the map or more than there is, ``step`` is less than 1, or there are fewer
        samples than eigenfunctions.

    Notes
    -----
    Each step costs one :func:`point_map` between the samples. 28,000 vertices to k = 200 with 1,000 samples:
    some seconds, most of it the last step.

    It follows the map it is given: from a mixture of a map and its mirror image it does not recover.

    References
    ----------
    .. [1] S. Melzi et al., ZoomOut: spectral upsampling for efficient shape correspondence, ACM TOG 38(6), 2019.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant import eigenbasis, shapes
    >>> spectrum = eigenbasis(shapes.ellipsoid([1, 0.8, 0.5], 2), 20)
    >>> large = zoomout(FunctionalMap(np.eye(4), spectrum, spectrum))
    >>> bool(np.allclose(large.matrix, np.eye(20)))
    True
    """
    _check_positive(step, "step")
    a, b = fmap.spectrum_a, fmap.spectrum_b
    target = max(a.k, b.k) if k is None else k
    largest = max(fmap.matrix.shape)
    if isinstance(target, bool) or int(target) != target or not largest <= target <= max(a.k, b.k):
        message = f"k must be {largest}..{max(a.k, b.k)}: the map's size to the eigenpairs there are; got {k}"
        raise InputError(message)
    sizes = list(_growth(fmap.matrix.shape, int(target), step, (b.k, a.k)))
    with progress_bar("zoomout", len(sizes) + 1, show=progress) as advance:
        if samples is not None and len(sizes) > 1:
            fmap = _sampled(fmap, sizes[:-1], samples, advance)
            sizes = sizes[-1:]
        for k_b, k_a in sizes:
            fmap = fmap_from_points(point_map(fmap), a, b, k=(k_a, k_b))
            advance()
    return fmap


def biharmonic_samples(spectrum: Spectrum, count: int) -> IntArray:
    """Return farthest points by biharmonic distance, the point farthest out first."""
    embedding = biharmonic_embedding(spectrum.truncated(min(spectrum.k, _SAMPLING_PAIRS)))
    return farthest_points(embedding, min(count, spectrum.n_vertices))


def _sampled(
    fmap: FunctionalMap, sizes: list[tuple[int, int]], samples: int, advance: Advance
) -> FunctionalMap:
    a, b = fmap.spectrum_a, fmap.spectrum_b
    most = max(sizes[-1])
    if samples < most:
        message = f"samples must be at least {most}, the eigenfunctions on the way; got {samples}"
        raise InputError(message)
    at_a, at_b = biharmonic_samples(a, samples), biharmonic_samples(b, samples)
    basis_a, basis_b = unit_vectors(a, sizes[-1][1])[at_a], unit_vectors(b, sizes[-1][0])[at_b]
    factor = (a.area / b.area) ** 0.5
    matrix = fmap.matrix * factor
    for k_b, k_a in sizes:
        matrix = _grown(matrix, basis_a, basis_b, k_b, k_a)
        advance()
    return FunctionalMap(matrix / factor, a, b)


def _grown(matrix: FloatArray, basis_a: FloatArray, basis_b: FloatArray, k_b: int, k_a: int) -> FloatArray:
    """One step between samples: points by nearest rows, then least squares over the samples."""
    old_b, old_a = matrix.shape
    points = nearest_rows(basis_a[:, :old_a] @ matrix.T, basis_b[:, :old_b])
    grown = np.linalg.lstsq(basis_b[:, :k_b], basis_a[points, :k_a], rcond=None)[0]
    return np.asarray(grown, dtype=np.float64)


def _growth(
    shape: tuple[int, int], target: int, step: int, most: tuple[int, int]
) -> Iterator[tuple[int, int]]:
    """Sizes after each step; a map that has its final size still takes one step."""
    k_b, k_a = shape
    while True:
        k_b, k_a = min(k_b + step, target, most[0]), min(k_a + step, target, most[1])
        yield k_b, k_a
        if (k_b, k_a) == (min(target, most[0]), min(target, most[1])):
            return


def _check_positive(value: int, name: str) -> None:
    if isinstance(value, bool) or int(value) != value or value < 1:
        message = f"{name} must be a whole number of 1 or more, got {value}"
        raise InputError(message)
