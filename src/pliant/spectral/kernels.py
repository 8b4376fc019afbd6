"""Heat, wave, diffusion, commute-time and biharmonic kernels and distances, as functions of a spectrum."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist

from .._arrays import FloatArray, IntArray, vertex_indices
from ..errors import InputError
from .spectrum import Spectrum

__all__ = [
    "biharmonic_distances",
    "biharmonic_embedding",
    "biharmonic_kernel",
    "commute_time_distances",
    "commute_time_embedding",
    "commute_time_kernel",
    "diffusion_distances",
    "diffusion_embedding",
    "heat_kernel",
    "wave_kernel",
]


def heat_kernel(spectrum: Spectrum, time: float, sources: ArrayLike) -> FloatArray:
    """Return heat after a time at every vertex, from a unit of heat at each source.

    ``k_t(x, y) = sum_k exp(-lambda_k t) phi_k(x) phi_k(y)``. Zero eigenvalues are kept: each piece keeps its
    heat.

    Parameters
    ----------
    spectrum : Spectrum
    time : float
        0 or more, in the mesh's unit squared.
    sources : int or (s,) array_like of int
        Vertex numbers.

    Returns
    -------
    (s, n) array of float
        In one over the mesh's unit squared; its integral over the surface is 1.

    Raises
    ------
    InputError
        If a source is not a vertex, or the time is negative or not finite.

    Notes
    -----
    Truncation shows where ``exp(-lambda_k time)`` of the last eigenvalue is not small. Cost: s n k.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> spectrum = eigenbasis(shapes.icosphere(2), 30)
    >>> heat = heat_kernel(spectrum, 0.5, 0)
    >>> round(float((heat @ spectrum.mass).sum()), 9)
    1.0
    """
    return _rows(spectrum, np.exp(-spectrum.values * _positive(time, "time", zero=True)), sources)


def wave_kernel(spectrum: Spectrum, energy: float, sources: ArrayLike, *, width: float = 0.5) -> FloatArray:
    """Return the wave kernel of an energy band at every vertex, for each source.

    ``sum_k w_k phi_k(x) phi_k(y)`` with ``w_k`` log-normal in lambda_k about the energy, normalised to sum 1
    (Aubry, Schlickewei & Cremers 2011; on the diagonal it is their signature). Zero eigenvalues are left out.

    Parameters
    ----------
    spectrum : Spectrum
    energy : float
        Logarithm of the eigenvalue in the band's middle.
    sources : int or (s,) array_like of int
        Vertex numbers.
    width : float
        Standard deviation of the band in log lambda.

    Returns
    -------
    (s, n) array of float
        In one over the mesh's unit squared.

    Raises
    ------
    InputError
        If a source is not a vertex, or energy or width is not finite, the width not positive.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> import numpy as np
    >>> wave_kernel(eigenbasis(shapes.icosphere(2), 30), np.log(6), [0, 5]).shape
    (2, 162)
    """
    if not np.isfinite(energy):
        message = f"energy must be finite, got {energy}"
        raise InputError(message)
    positive = _positive_values(spectrum)
    weights = np.zeros(spectrum.k)
    exponents = -((float(energy) - np.log(positive)) ** 2) / (2 * _positive(width, "width") ** 2)
    shares = np.exp(exponents - exponents.max())
    weights[spectrum.n_zero :] = shares / shares.sum()
    return _rows(spectrum, weights, sources)


def biharmonic_kernel(spectrum: Spectrum, sources: ArrayLike) -> FloatArray:
    """Return the Green's function of the squared Laplacian: ``sum_k phi_k(x) phi_k(y) / lambda_k^2``.

    Parameters
    ----------
    spectrum : Spectrum
    sources : int or (s,) array_like of int
        Vertex numbers.

    Returns
    -------
    (s, n) array of float
        In the mesh's unit squared; 0 between pieces.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> biharmonic_kernel(eigenbasis(shapes.icosphere(2), 30), [0, 5]).shape
    (2, 162)
    """
    return _rows(spectrum, _inverse_powers(spectrum, 2.0), sources)


def commute_time_kernel(spectrum: Spectrum, sources: ArrayLike) -> FloatArray:
    """Return the Green's function of the Laplacian: ``sum_k phi_k(x) phi_k(y) / lambda_k``.

    On a surface it grows without bound at the source as k grows (logarithmically): compare only at one k.

    Parameters
    ----------
    spectrum : Spectrum
    sources : int or (s,) array_like of int
        Vertex numbers.

    Returns
    -------
    (s, n) array of float
        Without unit; 0 between pieces.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> commute_time_kernel(eigenbasis(shapes.icosphere(2), 30), 0).shape
    (1, 162)
    """
    return _rows(spectrum, _inverse_powers(spectrum, 1.0), sources)


def biharmonic_embedding(spectrum: Spectrum) -> FloatArray:
    """Return coordinates ``phi_k / lambda_k`` in which Euclidean distance is biharmonic distance.

    Parameters
    ----------
    spectrum : Spectrum

    Returns
    -------
    (n, k - z) array of float
        In the mesh's unit; the z zero eigenvalues are left out, so points of different pieces must not be
        compared.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> biharmonic_embedding(eigenbasis(shapes.icosphere(2), 30)).shape
    (162, 29)
    """
    return _embedding(spectrum, _inverse_powers(spectrum, 1.0))


def biharmonic_distances(spectrum: Spectrum, sources: ArrayLike) -> FloatArray:
    """Return biharmonic distances from sources to all vertices.

    ``d(x, y)^2 = sum_k (phi_k(x) - phi_k(y))^2 / lambda_k^2`` (Lipman, Rustamov & Funkhouser 2010; the
    dissertation's eq. 3.1).

    Parameters
    ----------
    spectrum : Spectrum
    sources : int or (s,) array_like of int
        Vertex numbers.

    Returns
    -------
    (s, n) array of float
        In the mesh's unit: twice the mesh, twice the distances. Infinite between pieces.

    Raises
    ------
    InputError
        If a source is not a vertex, or every eigenvalue of the spectrum is 0.

    Notes
    -----
    The sum falls like 1 / lambda^2: 100 pairs give three digits on most shapes. Cost: s n k.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> distances = biharmonic_distances(eigenbasis(shapes.icosphere(2), 30), [0, 7])
    >>> distances.shape, float(distances[0, 0])
    ((2, 162), 0.0)
    """
    return _distances(spectrum, biharmonic_embedding(spectrum), sources)


def commute_time_embedding(spectrum: Spectrum) -> FloatArray:
    """Return coordinates ``phi_k / sqrt(lambda_k)`` in which Euclidean distance is commute-time distance.

    Parameters
    ----------
    spectrum : Spectrum

    Returns
    -------
    (n, k - z) array of float
        Without unit; the z zero eigenvalues are left out.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> commute_time_embedding(eigenbasis(shapes.icosphere(2), 30)).shape
    (162, 29)
    """
    return _embedding(spectrum, _inverse_powers(spectrum, 0.5))


def commute_time_distances(spectrum: Spectrum, sources: ArrayLike) -> FloatArray:
    """Return commute-time distances from sources to all vertices: ``sum_k (phi_k(x) - phi_k(y))^2 / lambda_k``.

    The root of that sum (Qiu & Hancock 2007, without the graph's volume). Without a limit as k grows:
    compare only at one k.

    Parameters
    ----------
    spectrum : Spectrum
    sources : int or (s,) array_like of int
        Vertex numbers.

    Returns
    -------
    (s, n) array of float
        Without unit: scaling the mesh changes nothing. Infinite between pieces.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> commute_time_distances(eigenbasis(shapes.icosphere(2), 30), 3).shape
    (1, 162)
    """
    return _distances(spectrum, commute_time_embedding(spectrum), sources)


def diffusion_embedding(spectrum: Spectrum, time: float) -> FloatArray:
    """Return coordinates ``exp(-lambda_k t) phi_k`` in which Euclidean distance is diffusion distance.

    Parameters
    ----------
    spectrum : Spectrum
    time : float
        0 or more, in the mesh's unit squared.

    Returns
    -------
    (n, k - z) array of float
        In one over the mesh's unit; the z zero eigenvalues are left out.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> diffusion_embedding(eigenbasis(shapes.icosphere(2), 30), 0.1).shape
    (162, 29)
    """
    return _embedding(spectrum, np.exp(-spectrum.values * _positive(time, "time", zero=True)))


def diffusion_distances(spectrum: Spectrum, time: float, sources: ArrayLike) -> FloatArray:
    """Return diffusion distances from sources to all vertices.

    The L2 distance between the heat spread from x and from y: ``sum_k exp(-2 lambda_k t)
    (phi_k(x) - phi_k(y))^2``, rooted (Coifman & Lafon 2006).

    Parameters
    ----------
    spectrum : Spectrum
    time : float
        0 or more, in the mesh's unit squared.
    sources : int or (s,) array_like of int
        Vertex numbers.

    Returns
    -------
    (s, n) array of float
        In one over the mesh's unit. Infinite between pieces.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> diffusion_distances(eigenbasis(shapes.icosphere(2), 30), 0.1, 3).shape
    (1, 162)
    """
    return _distances(spectrum, diffusion_embedding(spectrum, time), sources)


def _rows(spectrum: Spectrum, weights: FloatArray, sources: ArrayLike) -> FloatArray:
    chosen = vertex_indices(sources, spectrum.n_vertices, "sources")
    rows: FloatArray = (spectrum.vectors[chosen] * weights) @ spectrum.vectors.T
    return rows


def _embedding(spectrum: Spectrum, weights: FloatArray) -> FloatArray:
    _positive_values(spectrum)
    coordinates: FloatArray = spectrum.vectors[:, spectrum.n_zero :] * weights[spectrum.n_zero :]
    return coordinates


def _distances(spectrum: Spectrum, embedding: FloatArray, sources: ArrayLike) -> FloatArray:
    chosen = vertex_indices(sources, spectrum.n_vertices, "sources")
    # Differences, not products: near a source the digits of |x|^2 + |y|^2 - 2 x.y are gone.
    distances: FloatArray = cdist(embedding[chosen], embedding)
    if spectrum.n_zero > 1:
        pieces = _pieces(spectrum)
        distances[pieces[chosen][:, None] != pieces[None, :]] = np.inf
    return distances


def _pieces(spectrum: Spectrum) -> IntArray:
    """Return the piece of each vertex, read off the constant functions of the zero eigenvalues."""
    pieces: IntArray = np.argmax(np.abs(spectrum.vectors[:, : spectrum.n_zero]) > 0, axis=1).astype(np.int64)
    return pieces


def _inverse_powers(spectrum: Spectrum, power: float) -> FloatArray:
    weights = np.zeros(spectrum.k)
    weights[spectrum.n_zero :] = _positive_values(spectrum) ** -power
    return weights


def _positive_values(spectrum: Spectrum) -> FloatArray:
    positive = spectrum.values[spectrum.n_zero :]
    if not positive.size:
        message = f"all {spectrum.k} eigenvalues are 0, one a piece of the mesh; compute more of them"
        raise InputError(message)
    return positive


def _positive(value: float, name: str, *, zero: bool = False) -> float:
    number = float(value)
    if not np.isfinite(number) or number < 0 or (number == 0 and not zero):
        message = f"{name} must be {'0 or more' if zero else 'positive'} and finite, got {value}"
        raise InputError(message)
    return number
