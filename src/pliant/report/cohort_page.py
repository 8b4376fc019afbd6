"""One self-contained HTML page of a cohort: what was found, pictures, the surface to turn, and the settings."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from string import Template
from typing import TYPE_CHECKING

from ._frame import asset, version

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..cortex import CohortResult, Variability

__all__ = ["CohortTable", "cohort_page"]


@dataclass(frozen=True)
class CohortTable:
    """A table under a heading of its own.

    Parameters
    ----------
    heading : str
        What it shows.
    columns : sequence of str
        Their heads; the first column names the row.
    rows : sequence of sequence of str
        Cells.
    note : str
        A paragraph under the heading.
    """

    heading: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]] = field(default_factory=tuple)
    note: str = ""


def cohort_page(
    found: CohortResult,
    ranking: Variability,
    *,
    title: str,
    figures: Mapping[str, Figure],
    surface: str,
    facts: Mapping[str, str],
    tables: Sequence[CohortTable] = (),
    settings: Mapping[str, object] | None = None,
    notes: str = "",
) -> str:
    """Write the page of a cohort, as HTML.

    Parameters
    ----------
    found : CohortResult
        For the names of sites, and subjects that failed.
    ranking : Variability
        The sites' deviations and intervals.
    title : str
        Heading and window title.
    figures : mapping of caption to figure
        Such as :func:`pliant.report.cohort.ranking_figure` makes.
    surface : str
        An interactive page, of :func:`pliant.report.surface_page`.
    facts : mapping of str to str
        The most important results, first in the page.
    tables : sequence of CohortTable
        What else was compared.
    settings : mapping, optional
        What made the results.
    notes : str
        A paragraph under the title.

    Returns
    -------
    str
        A whole HTML document that loads nothing; all text is escaped.

    Examples
    --------
    >>> import numpy as np
    >>> from pliant.cortex import CohortResult, variability
    >>> values = np.random.default_rng(0).random((6, 8, 3))
    >>> found = CohortResult((), (), tuple("abcdefgh"), values, np.arange(4.0), np.zeros((6, 8)), np.zeros((6, 8)))
    >>> ranking = variability(values, rng=0, resamples=20)
    >>> "<h1>Six brains</h1>" in cohort_page(found, ranking, title="Six brains", figures={}, surface="", facts={})
    True
    """
    failed = [(s.name, error) for s, error in zip(found.subjects, found.errors, strict=False) if error]
    more = [*tables]
    if failed:
        more.append(CohortTable("Subjects that failed", ("subject", "why"), failed))
    parts = {
        "title": escape(title),
        "notes": escape(notes),
        "facts": _facts(facts),
        "extremes": _extremes(found, ranking),
        "figures": "\n".join(_picture(caption, figure) for caption, figure in figures.items()),
        "more": "\n".join(_section(i, table) for i, table in enumerate(more)),
        "surface": escape(surface),
        "settings": _facts({name: _listed(value) for name, value in (settings or {}).items()}),
        "version": version(),
    }
    return Template(asset("cohort.html")).substitute(parts)


def _extremes(found: CohortResult, ranking: Variability) -> str:
    tables = []
    for kind, sites, frequency in (
        ("regular", ranking.regular, ranking.regular_frequency),
        ("variable", ranking.variable, ranking.variable_frequency),
    ):
        rows = [
            (
                found.sites[i],
                f"{ranking.mad[i]:.3g}",
                f"{ranking.low[i]:.3g} to {ranking.high[i]:.3g}",
                f"{frequency[i]:.0%}",
            )
            for i in sites
        ]
        columns = ("site", "deviation", "interval", "among them")
        tables.append(_table(columns, rows, caption=f"Most {kind}", style=f"numbers {kind}"))
    return "\n".join(tables)


def _section(place: int, table: CohortTable) -> str:
    name = f"table-{place}"
    note = f"<p>{escape(table.note)}</p>" if table.note else ""
    body = _table(table.columns, table.rows, style="numbers") if table.rows else ""
    return f'<section aria-labelledby="{name}"><h2 id="{name}">{escape(table.heading)}</h2>{note}{body}</section>'


def _table(
    columns: Sequence[str], rows: Sequence[Sequence[str]], *, caption: str = "", style: str = ""
) -> str:
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in columns)
    body = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>{"".join(f"<td>{escape(cell)}</td>" for cell in row[1:])}</tr>'
        for row in rows
    )
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    table = f'<table class="{style}">{title}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'
    return f'<div class="wide" tabindex="0" role="region" aria-label="{escape(caption or columns[0])}">{table}</div>'


def _facts(facts: Mapping[str, str]) -> str:
    rows = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td>{escape(text)}</td></tr>' for name, text in facts.items()
    )
    return f'<table class="facts"><tbody>{rows}</tbody></table>'


def _picture(caption: str, figure: Figure) -> str:
    content = io.BytesIO()
    figure.savefig(content, format="png")
    data = base64.b64encode(content.getvalue()).decode("ascii")
    text = escape(caption)
    return f'<figure><img alt="{text}" src="data:image/png;base64,{data}"><figcaption>{text}</figcaption></figure>'


def _listed(value: object) -> str:
    if isinstance(value, (tuple, list)):
        return ", ".join(f"{item:.4g}" if isinstance(item, float) else str(item) for item in value)
    return str(value)
