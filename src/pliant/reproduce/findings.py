"""What an experiment says: rows of printed and recomputed values, and a verdict on the claim."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError

if TYPE_CHECKING:
    from .bench import Bench

__all__ = ["Experiment", "Findings", "Row", "Verdict", "row_of"]

Verdict: TypeAlias = Literal["holds", "holds partly", "does not hold", "not tested"]
VERDICTS: tuple[Verdict, ...] = ("holds", "holds partly", "does not hold", "not tested")


@dataclass(frozen=True)
class Row:
    """One value: what was printed, what is found here, and how sure that is.

    Parameters
    ----------
    name : str
        What is measured, with its unit.
    printed : float, optional
        The dissertation's value; None where it printed none.
    ours : float, optional
        Ours; None where it could not be computed, with the reason in ``note``.
    low, high : float, optional
        The 95 per cent interval of ``ours``; over what is said by the experiment's data.
    note : str
        What to know about this row.

    Examples
    --------
    >>> Row("mean", printed=0.43, ours=0.51).ratio
    1.186046511627907
    """

    name: str
    printed: float | None = None
    ours: float | None = None
    low: float | None = None
    high: float | None = None
    note: str = ""

    def __post_init__(self) -> None:
        for name in ("printed", "ours", "low", "high"):
            value = getattr(self, name)
            # A number that is not there is missing; NaN would end up in JSON, where it does not belong.
            kept = None if value is None or not math.isfinite(value) else float(value)
            object.__setattr__(self, name, kept)

    @property
    def ratio(self) -> float | None:
        """Ours over the printed value, where both are there and the printed one is not 0."""
        return None if self.ours is None or not self.printed else self.ours / self.printed


@dataclass(frozen=True)
class Findings:
    """What an experiment found.

    Parameters
    ----------
    verdict : {"holds", "holds partly", "does not hold", "not tested"}
        On the claim, by the experiment's own criterion.
    summary : str
        Two or three sentences: what holds, what does not, what was found in its place.
    data : str
        What it was measured on, and over what the intervals are.
    rows : sequence of Row
        Printed and recomputed values.
    settings : dict
        What made them.
    """

    verdict: Verdict
    summary: str
    data: str
    rows: tuple[Row, ...] = ()
    settings: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            message = f"verdict must be one of {', '.join(VERDICTS)}, got {self.verdict!r}"
            raise InputError(message)

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values for JSON."""
        return {**asdict(self), "rows": [asdict(row) for row in self.rows]}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Findings:
        """Take it back from what :meth:`as_dict` gave."""
        rows = tuple(Row(**row) for row in values["rows"])
        return cls(**{**values, "rows": rows})


@dataclass(frozen=True)
class Experiment:
    """A table or figure of the dissertation that carries a result, and how to measure it again.

    Parameters
    ----------
    name : str
        As it is asked for: ``"table-2.2"``.
    title : str
        One line.
    claim : str
        What the dissertation says.
    criterion : str
        When the claim is said to hold, fixed before anything is measured.
    run : callable
        Takes the :class:`~pliant.reproduce.bench.Bench` and gives :class:`Findings`.
    needs : tuple of str
        Folders of the data without which nothing is measured.
    uses : tuple of str
        Folders that are used where they are there; synthetic shapes stand in for them otherwise.
    covers : tuple of str
        Other tables and figures that it answers as well; it can be asked for by these names too.
    """

    name: str
    title: str
    claim: str
    criterion: str
    run: Callable[[Bench], Findings]
    needs: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()
    covers: tuple[str, ...] = ()

    @property
    def chapter(self) -> int:
        """Chapter of the dissertation."""
        return int(self.name.split("-")[1].split(".")[0])


def row_of(name: str, printed: float | None, values: ArrayLike, *, note: str = "") -> Row:
    """Make a row of the mean over independent units, with Student's 95 per cent interval of it.

    Parameters
    ----------
    name : str
        What is measured.
    printed : float, optional
        The dissertation's value.
    values : (m,) array_like of float
        One value a unit (shape, draw, subject). One alone has no interval.
    note : str
        What to know about it.

    Returns
    -------
    Row

    Examples
    --------
    >>> row = row_of("error", 0.3, [0.2, 0.3, 0.4])
    >>> row.ours, round(row.low, 2), round(row.high, 2)
    (0.3, 0.05, 0.55)
    """
    found = np.asarray(values, dtype=float).ravel()
    if not found.size:
        raise InputError("a row needs at least one value")
    mean = float(found.mean())
    if found.size == 1:
        return Row(name, printed, mean, note=note)
    from scipy.stats import t

    half = float(t.ppf(0.975, found.size - 1) * found.std(ddof=1) / math.sqrt(found.size))
    return Row(name, printed, round(mean, 12), mean - half, mean + half, note)


def graded(whole: bool, part: bool) -> Verdict:
    """Say that a claim holds, holds in part, or does not."""
    return "holds" if whole else "holds partly" if part else "does not hold"


def share(verdicts: Sequence[bool]) -> Verdict:
    """Say that a claim holds where all of it does, in part where some does."""
    return "holds" if all(verdicts) else "holds partly" if any(verdicts) else "does not hold"
