"""Plain charts in the house's style."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = ("#2a6f97", "#bc4b51", "#8a6fae", "#7a8450", "#c98a2b", "#555b66")


def lines(
    x: ArrayLike,
    curves: Mapping[str, ArrayLike],
    *,
    x_label: str,
    y_label: str,
    printed: Mapping[str, ArrayLike] | None = None,
    level: tuple[float, str] | None = None,
    log_x: bool = False,
    log_y: bool = False,
) -> Figure:
    """Draw curves over one axis; printed ones dashed in the same colour, a printed level as a grey line."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.2, 3.6), layout="constrained")
    axes = figure.subplots()
    for i, (name, values) in enumerate(curves.items()):
        colour = COLOURS[i % len(COLOURS)]
        axes.plot(x, values, "o-", color=colour, label=name, ms=4)
        if printed and name in printed:
            axes.plot(x, printed[name], "--", color=colour, lw=1, label=f"{name}, printed")
    if level is not None:
        axes.axhline(level[0], color="#9aa3ad", lw=1, ls=":", label=level[1])
    axes.set(xlabel=x_label, ylabel=y_label)
    if log_x:
        axes.set_xscale("log")
    if log_y:
        axes.set_yscale("log")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
    return figure
