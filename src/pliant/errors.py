"""The exceptions Pliant raises.

::

    PliantError
    ├── InputError (ValueError)        an argument or a file that cannot be used
    │   ├── MeshError                  a mesh that is broken, or not fit for the call
    │   └── FileFormatError            a file that is not what it claims to be
    ├── NumericalError (ArithmeticError)   a computation that did not reach its stated accuracy
    ├── UnavailableError (RuntimeError)    a device or a cluster that is not there, or went away
    └── MissingExtraError (ImportError)    an optional dependency that is not installed

    PliantWarning (UserWarning)        a reported repair, or a result to take with care

Every message says what is wrong, how many, the first few indices, and the remedy. At the shell an
:class:`InputError` ends the command with exit code 3 and that one message; bad usage ends with 2.
"""

from __future__ import annotations

import importlib
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

__all__ = [
    "FileFormatError",
    "InputError",
    "MeshError",
    "MissingExtraError",
    "NumericalError",
    "PliantError",
    "PliantWarning",
    "UnavailableError",
    "first_indices",
    "require",
]


class PliantError(Exception):
    """Base of everything Pliant raises on purpose."""


class InputError(PliantError, ValueError):
    """An argument or a file that cannot be used."""


class MeshError(InputError):
    """A mesh that is broken, or not fit for what is asked of it."""


class FileFormatError(MeshError):
    """A file that is not what its name or its header claims."""


class NumericalError(PliantError, ArithmeticError):
    """A computation that did not reach its stated accuracy."""


class UnavailableError(PliantError, RuntimeError):
    """A device or a cluster that is not there, or went away; the message says what starts it."""


class MissingExtraError(PliantError, ImportError):
    """An optional dependency that is not installed; the message names the extra."""


class PliantWarning(UserWarning):
    """A reported repair, or a result to be taken with care."""


def first_indices(indices: ArrayLike, limit: int = 5) -> str:
    """Write the first few indices for a message: ``[3, 8, 21, ...]``.

    Parameters
    ----------
    indices : (k,) array of int
        What went wrong, where.
    limit : int
        How many to spell out.

    Returns
    -------
    str

    Examples
    --------
    >>> first_indices([4, 8, 15, 16], limit=2)
    '[4, 8, ...]'
    """
    flat = np.asarray(indices).ravel()
    head = ", ".join(str(int(i)) for i in flat[:limit])
    return f"[{head}, ...]" if flat.size > limit else f"[{head}]"


def require(module: str, extra: str) -> ModuleType:
    """Import an optional dependency, or say which extra brings it.

    Parameters
    ----------
    module : str
        Name of the module to import.
    extra : str
        The extra of Pliant that installs it.

    Returns
    -------
    module

    Raises
    ------
    MissingExtraError
        If the module is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        message = f"{module} is not installed. Install it with: pip install 'pliant[{extra}]'"
        raise MissingExtraError(message) from error
