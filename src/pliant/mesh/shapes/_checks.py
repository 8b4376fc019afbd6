"""Checks of the arguments that every shape shares."""

from __future__ import annotations

import math
import numbers

from ..._arrays import FloatArray, as_floats
from ...errors import InputError


def checked_count(value: object, name: str, least: int, most: int | None = None) -> int:
    """Return a whole number within its range, or say what the range is."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        message = f"{name} must be a whole number, got {value!r}"
        raise InputError(message)
    count = int(value)
    if count < least or (most is not None and count > most):
        allowed = f"at least {least}" if most is None else f"between {least} and {most}"
        message = f"{name} must be {allowed}, got {count}"
        raise InputError(message)
    return count


def checked_number(value: object, name: str) -> float:
    """Return a finite number."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real) or not math.isfinite(value):
        message = f"{name} must be a finite number, got {value!r}"
        raise InputError(message)
    return float(value)


def checked_length(value: object, name: str) -> float:
    """Return a positive finite number."""
    length = checked_number(value, name)
    if length <= 0:
        message = f"{name} must be positive, got {length:g}"
        raise InputError(message)
    return length


def checked_triple(values: object, name: str) -> FloatArray:
    """Return three finite numbers, (3,)."""
    triple = as_floats(values, name)  # type: ignore[arg-type]
    if triple.shape != (3,):
        message = f"{name} must be three numbers, got shape {triple.shape}"
        raise InputError(message)
    for number, axis in zip(triple, "xyz", strict=True):
        checked_number(float(number), f"{name} ({axis})")
    return triple
