"""Eigenbases kept on disk, opt-in: one file an operator and tolerance."""

from __future__ import annotations

import hashlib
import os
import warnings
from pathlib import Path

from ..errors import FileFormatError, PliantWarning
from .laplacian import Laplacian
from .spectrum import Spectrum


def cached_spectrum(
    folder: str | os.PathLike[str] | None, operator: Laplacian, k: int, tol: float
) -> Spectrum | None:
    """Return the stored spectrum cut to k pairs, or None where there is none that large and sound."""
    if folder is None:
        return None
    path = _path(folder, operator, tol)
    if not path.exists():
        return None
    try:
        stored = Spectrum.load(path)
    except FileFormatError as error:
        warnings.warn(f"computing the eigenbasis again: {error}", PliantWarning, stacklevel=3)
        return None
    if stored.n_vertices != operator.n_vertices or stored.k < k:
        return None
    return stored.truncated(k) if stored.k > k else stored


def store_spectrum(
    folder: str | os.PathLike[str] | None, operator: Laplacian, spectrum: Spectrum, tol: float
) -> None:
    """Write a spectrum under its operator's key; a reader sees the old file or the new one, whole."""
    if folder is None:
        return
    Path(folder).mkdir(parents=True, exist_ok=True)
    spectrum.save(_path(folder, operator, tol))


def _path(folder: str | os.PathLike[str], operator: Laplacian, tol: float) -> Path:
    from .. import __version__

    digest = hashlib.sha256(f"pliant {__version__} eigenbasis tol={tol!r}".encode())
    # The matrices are all the solver sees: geometry, kind and every option of theirs are in them.
    for matrix in (operator.stiffness, operator.mass):
        digest.update(repr(matrix.shape).encode())
        for array in (matrix.indptr, matrix.indices, matrix.data):
            digest.update(f"{array.dtype} {array.shape}".encode())
            digest.update(array.tobytes())
    return Path(folder) / f"eigenbasis-{digest.hexdigest()[:32]}.npz"
