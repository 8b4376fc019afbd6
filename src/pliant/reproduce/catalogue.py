"""Which experiments there are, in the dissertation's order. Each module holds one, as ``EXPERIMENT``."""

from __future__ import annotations

from functools import cache
from importlib import import_module

from .findings import Experiment

__all__ = ["experiments"]

_MODULES = (
    "figure_2_7",
    "table_2_1",
    "table_2_2",
    "figure_2_8",
    "figure_2_10",
    "figure_2_12",
    "table_3_1",
    "figure_3_1",
    "figure_3_2",
    "figure_3_3",
    "figure_3_4",
    "figure_3_5",
    "figure_3_7",
    "figure_3_8",
    "figure_3_9",
    "figure_3_10",
    "figure_4_3",
    "figure_4_5",
    "figure_4_6",
    "table_4_1",
    "figure_4_8",
    "figure_4_9",
    "figure_4_10",
    "table_5_2",
    "figure_5_3",
    "figure_5_4",
    "figure_5_6",
    "table_5_3",
    "table_5_7",
    "table_5_8",
    "table_5_9",
    "figure_6_1",
    "figure_6_2",
    "table_6_1",
    "table_6_2",
    "figure_6_5",
    "figure_6_6",
)


@cache
def experiments() -> tuple[Experiment, ...]:
    """Return every experiment, in the dissertation's order.

    Returns
    -------
    tuple of Experiment

    Examples
    --------
    >>> experiments()[0].name
    'figure-2.7'
    """
    return tuple(import_module(f".{name}", __package__).EXPERIMENT for name in _MODULES)
