"""Compilation settings of the Numba kernels, in one place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Compile a function with Numba: no Python objects, no GIL, kept on disk between processes."""
    compiled: F = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    return compiled


def summing_kernel(function: F) -> F:
    """Compile like :func:`kernel`, letting the compiler reorder sums so that they use vector registers.

    The order is fixed at compile time: the same machine gives the same bytes; another may differ in the last bits.
    """
    compiled: F = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})(
        function
    )
    return compiled


def inlined_kernel(function: F) -> F:
    """Compile into its callers: for the small steps of an inner loop, where passing arrays costs more than the step."""
    compiled: F = numba.njit(inline="always", error_model="numpy")(function)
    return compiled
