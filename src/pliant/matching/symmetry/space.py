"""The complexity of a symmetry: how far its functional map is from the diagonal."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..._arrays import as_floats
from ...errors import InputError

__all__ = ["ComplexityForm", "complexity"]

ComplexityForm = Literal["literal", "absolute", "squared"]


def complexity(matrix: ArrayLike, *, form: ComplexityForm = "squared", k: int | None = 20) -> float:
    """Return how far a functional map is from a diagonal one: the coordinate in the symmetry space (eq. 4.6).

    ``sum_ij w_ij g(c_ij) / k`` with ``w_ij = 1 - exp(-d_ij^2)`` and d_ij the distance of the entry (i, j) from the
    diagonal, ``|i - j| / sqrt(2)``. An exact symmetry of a surface without repeated eigenvalues has 0.

    Parameters
    ----------
    matrix : (m, m) array_like of float
        A functional map.
    form : {"squared", "absolute", "literal"}
        g(c): c squared, which for an orthogonal map gives the share of it off the diagonal, from 0 to 1;
        the absolute value; or c itself, as eq. 4.6 is printed, where entries of opposite sign cancel and which orders
        nothing.
    k : int, optional
        Eigenfunctions used, at most; all for None. Higher ones measure the mesh rather than the shape.

    Returns
    -------
    float
        Eq. 4.6 over the number of eigenfunctions used.

    Raises
    ------
    InputError
        If the matrix is not square and finite, the form is unknown or k is not positive.

    Notes
    -----
    Within a repeated eigenvalue the basis is arbitrary, and so is this number.

    References
    ----------
    Dissertation, section 4.3, eq. 4.6.

    Examples
    --------
    >>> complexity([[1, 0], [0, -1]])
    0.0
    >>> round(complexity([[0, 1], [1, 0]]), 4)
    0.3935
    >>> complexity([[0, 1], [-1, 0]], form="literal")
    0.0
    """
    array = as_floats(matrix, "matrix")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not array.size:
        message = f"matrix must be square, (m, m), got shape {array.shape}"
        raise InputError(message)
    if not np.isfinite(array).all():
        raise InputError("matrix must be finite")
    if k is not None and (isinstance(k, bool) or int(k) != k or k < 1):
        message = f"k must be a whole number of 1 or more, or None; got {k}"
        raise InputError(message)
    size = len(array) if k is None else min(int(k), len(array))
    entries = array[:size, :size]
    if form == "squared":
        entries = entries**2
    elif form == "absolute":
        entries = np.abs(entries)
    elif form != "literal":
        message = f"form must be 'squared', 'absolute' or 'literal', got {form!r}"
        raise InputError(message)
    rows, columns = np.indices(entries.shape)
    weights = -np.expm1(-((rows - columns) ** 2) / 2)
    return float((weights * entries).sum() / size)
