"""The eigenbasis of a Laplacian as a value."""

from __future__ import annotations

import os
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from .._arrays import FloatArray, as_floats, frozen
from ..errors import FileFormatError, InputError
from ._sparse import CsrArray, as_csr, product

__all__ = ["Spectrum"]

_FORMAT = "pliant-spectrum-1"


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum:
    """The first eigenpairs of ``L phi = lambda M phi``.

    Repeated eigenvalues fix only the subspace their eigenvectors span, and a sign rule cannot help that:
    use nothing that depends on more.

    Parameters
    ----------
    values : (k,) array_like of float
        Eigenvalues, ascending, in one over the mesh's unit squared. Exactly 0 for each connected piece;
        negative ones are set to 0.
    vectors : (n, k) array_like of float
        Eigenvectors as columns, orthonormal in the mass, in one over the mesh's unit.
    mass : (n, n) sparse
        The mass matrix.
    residuals : (k,) array_like of float, optional
        ``|L phi - lambda M phi| / (lambda |M phi|)`` of each pair in Euclidean norms, with the first
        eigenvalue above 0 in place of 0. NaN where it was not measured.

    Raises
    ------
    InputError
        If shapes do not fit, values descend or something is not finite.

    Examples
    --------
    >>> import numpy as np, scipy.sparse
    >>> spectrum = Spectrum([0, 2], np.array([[1, 1], [1, -1]]) / 2**0.5, scipy.sparse.eye_array(2))
    >>> spectrum
    Spectrum(2 eigenpairs, 2 vertices, 1 zero)
    >>> spectrum.reconstruct(spectrum.project([3, 5])).round(12)
    array([3., 5.])
    """

    values: FloatArray
    vectors: FloatArray
    mass: CsrArray
    residuals: FloatArray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        values = as_floats(self.values, "values")
        vectors = as_floats(self.vectors, "vectors")
        mass = as_csr(self.mass)
        missing = np.full(values.shape, np.nan)
        residuals = missing if self.residuals is None else as_floats(self.residuals, "residuals")
        _check(values, vectors, mass, residuals)
        object.__setattr__(self, "values", frozen(np.maximum(values, 0)))
        object.__setattr__(self, "vectors", frozen(vectors))
        object.__setattr__(self, "mass", mass)
        object.__setattr__(self, "residuals", frozen(residuals))

    def __repr__(self) -> str:
        return f"Spectrum({self.k} eigenpairs, {self.n_vertices} vertices, {self.n_zero} zero)"

    @property
    def k(self) -> int:
        """Number of eigenpairs."""
        return len(self.values)

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.vectors)

    @property
    def n_zero(self) -> int:
        """Number of eigenvalues that are 0: connected pieces, as far as k reaches."""
        return int(np.count_nonzero(self.values == 0))

    @property
    def area(self) -> float:
        """Total mass, the surface's area."""
        return float(self.mass.sum())

    def truncated(self, k: int) -> Spectrum:
        """Return the first k eigenpairs.

        Parameters
        ----------
        k : int
            From 1 to :attr:`k`.

        Raises
        ------
        InputError
            If there are not that many.
        """
        if not 1 <= k <= self.k:
            message = f"k must be 1..{self.k}, the eigenpairs this spectrum has; got {k}"
            raise InputError(message)
        return Spectrum(self.values[:k], self.vectors[:, :k], self.mass, self.residuals[:k])

    def project(self, functions: ArrayLike) -> FloatArray:
        """Return the coefficients of functions in the basis.

        Parameters
        ----------
        functions : (n,) or (n, d) array_like of float
            One value a vertex, or one function a column.

        Returns
        -------
        (k,) or (k, d) array of float
        """
        array = as_floats(functions, "functions")
        if array.ndim not in (1, 2) or len(array) != self.n_vertices:
            message = f"functions must have {self.n_vertices} rows, one a vertex; got shape {array.shape}"
            raise InputError(message)
        coefficients: FloatArray = self.vectors.T @ product(self.mass, array)
        return coefficients

    def reconstruct(self, coefficients: ArrayLike) -> FloatArray:
        """Return the functions that have the given coefficients.

        Parameters
        ----------
        coefficients : (j,) or (j, d) array_like of float
            Of the first j eigenvectors, j up to k.

        Returns
        -------
        (n,) or (n, d) array of float
        """
        array = as_floats(coefficients, "coefficients")
        if array.ndim not in (1, 2) or len(array) > self.k:
            message = f"coefficients must have at most {self.k} rows, got shape {array.shape}"
            raise InputError(message)
        functions: FloatArray = self.vectors[:, : len(array)] @ array
        return functions

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the spectrum to an ``.npz`` file, whole or not at all.

        Parameters
        ----------
        path : path-like
            Any name; it is used as given.
        """
        target = Path(path)
        arrays = {
            "format": np.array(_FORMAT),
            "values": self.values,
            "vectors": self.vectors,
            "residuals": self.residuals,
            "mass_data": self.mass.data,
            "mass_indices": self.mass.indices,
            "mass_indptr": self.mass.indptr,
        }
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez(file, **arrays)  # type: ignore[arg-type]
            Path(name).replace(target)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Spectrum:
        """Read a spectrum that :meth:`save` wrote.

        Parameters
        ----------
        path : path-like

        Returns
        -------
        Spectrum

        Raises
        ------
        FileFormatError
            If the file is not such a file, or damaged.
        FileNotFoundError
            If there is none.
        """
        try:
            with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as stored:
                if str(stored["format"]) != _FORMAT:
                    message = f"{path}: written by another version ({stored['format']}), not {_FORMAT}"
                    raise FileFormatError(message)
                n = len(stored["mass_indptr"]) - 1
                parts: Any = (stored["mass_data"], stored["mass_indices"], stored["mass_indptr"])
                mass = as_csr(sp.csr_array(parts, shape=(n, n)))
                return cls(stored["values"], stored["vectors"], mass, stored["residuals"])
        except FileNotFoundError:
            raise
        except (KeyError, ValueError, EOFError, OSError, zipfile.BadZipFile) as error:
            message = f"{path} is not a stored spectrum, or damaged: {error}"
            raise FileFormatError(message) from error


def _check(values: FloatArray, vectors: FloatArray, mass: CsrArray, residuals: FloatArray) -> None:
    if values.ndim != 1 or not values.size or vectors.ndim != 2 or vectors.shape[1] != len(values):
        message = (
            f"values must be (k,) and vectors (n, k) with k of 1 at least, got {values.shape} and "
            f"{vectors.shape}"
        )
        raise InputError(message)
    if mass.shape != (len(vectors), len(vectors)):
        message = f"mass must be ({len(vectors)}, {len(vectors)}), got {mass.shape}"
        raise InputError(message)
    if residuals.shape != values.shape:
        message = f"residuals must have one value an eigenpair, {values.shape}, got {residuals.shape}"
        raise InputError(message)
    if not (np.isfinite(values).all() and np.isfinite(vectors).all()):
        raise InputError("values and vectors must be finite")
    if (np.diff(values) < 0).any():
        raise InputError("values must ascend")
