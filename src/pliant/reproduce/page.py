"""The report: verdicts first, then a section an experiment, in one self-contained file; verdicts as JSON and table."""

from __future__ import annotations

import base64
import json
import platform
import struct
from collections import Counter
from collections.abc import Callable, Sequence
from html import escape
from importlib import resources
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from ..mesh.formats import write_atomically
from ..report.page import version
from .bench import Picture
from .findings import VERDICTS, Experiment, Row

if TYPE_CHECKING:
    from .run import Outcome

__all__ = ["write_report"]

TITLE = "The dissertation, measured again"
_PLURALS = {
    "holds": "hold",
    "holds partly": "hold partly",
    "does not hold": "do not hold",
    "not tested": "not tested",
}
_CLASSES = {"holds": "holds", "holds partly": "partly", "does not hold": "fails", "not tested": "none"}


def write_report(folder: Path, outcomes: Sequence[Outcome], *, quick: bool, data: bool) -> None:
    """Write ``report.html``, ``verdicts.json`` and ``verdicts.md`` into a folder, each whole or not at all.

    Parameters
    ----------
    folder : Path
        With the pictures in its folder ``results``.
    outcomes : sequence of Outcome
        What was found.
    quick : bool
        Whether it was the quick run.
    data : bool
        Whether there were evaluation data.
    """
    verdicts = [_verdict(outcome) for outcome in outcomes]
    text = json.dumps(verdicts, indent=1, allow_nan=False, ensure_ascii=False)
    write_atomically(folder / "verdicts.json", text.encode())
    write_atomically(folder / "verdicts.md", _markdown(outcomes).encode())
    write_atomically(folder / "report.html", _html(folder / "results", outcomes, quick, data).encode())


def _verdict(outcome: Outcome) -> dict[str, Any]:
    findings = outcome.findings
    rows = [
        {
            "name": row.name,
            "printed": row.printed,
            "ours": row.ours,
            "interval": None if row.low is None else [row.low, row.high],
            "note": row.note,
        }
        for row in findings.rows
    ]
    first = rows[0] if rows else {"printed": None, "ours": None, "interval": None}
    return {
        "name": outcome.experiment.name,
        "title": outcome.experiment.title,
        "covers": list(outcome.experiment.covers),
        "printed": first["printed"],
        "ours": first["ours"],
        "interval": first["interval"],
        "data": findings.data,
        "verdict": findings.verdict,
        "summary": findings.summary,
        "rows": rows,
        "seconds": outcome.seconds,
    }


def _markdown(outcomes: Sequence[Outcome]) -> str:
    """Table of verdicts as it stands in the documentation."""
    lines = ["| what | the dissertation says | verdict | found |", "|---|---|---|---|"]
    for outcome in outcomes:
        about, findings = outcome.experiment, outcome.findings
        cells = (_names(about), about.claim, f"**{findings.verdict}**", findings.summary)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _html(place: Path, outcomes: Sequence[Outcome], quick: bool, data: bool) -> str:
    notes = (
        "Every result of A. Mukhopadhyay, Geometric Analysis of Shapes and Its Application to Medical "
        "Image Analysis (University of Georgia, 2014), recomputed by Pliant and put beside the printed "
        "value. Criteria were fixed before measuring. "
        + ("A quick run: fewer shapes, draws and subjects. " if quick else "")
        + ("" if data else "No evaluation data: synthetic shapes stand in, or the row is missing.")
    )
    counts = Counter(outcome.findings.verdict for outcome in outcomes)
    settings = {
        "Pliant": version(),
        "Python": platform.python_version(),
        "run": "quick" if quick else "full",
        "seconds, all experiments": f"{sum(outcome.seconds for outcome in outcomes):.0f}",
        "intervals": "95 %, over the units each section names; ratios are ours over printed",
    }
    sections = []
    for chapter in sorted({outcome.experiment.chapter for outcome in outcomes}):
        inside = [outcome for outcome in outcomes if outcome.experiment.chapter == chapter]
        sections.append(f"<h2>Chapter {chapter}</h2>" + "".join(_section(place, o) for o in inside))
    parts = {
        "title": TITLE,
        "notes": escape(notes),
        "tally": "".join(
            f"<li>{_badge(v, f'{counts[v]} {v if counts[v] == 1 else _PLURALS[v]}')}</li>"
            for v in VERDICTS
            if counts[v]
        ),
        "verdicts": "\n".join(_verdict_line(outcome) for outcome in outcomes),
        "sections": "\n".join(sections),
        "settings": "".join(_fact(name, value) for name, value in settings.items()),
        "version": version(),
        "css": _asset("report.css"),
        "script": _asset("report.js"),
    }
    return Template(_asset("report.html")).substitute(parts)


def _verdict_line(outcome: Outcome) -> str:
    about, findings = outcome.experiment, outcome.findings
    return (
        f'<tr><th scope="row"><a href="#{about.name}">{_names(about)}</a>'
        f"<small>{escape(about.title)}</small></th><td>{escape(about.claim)}</td><td>{_badge(findings.verdict)}</td><td>{escape(findings.summary)}</td></tr>"
    )


def _section(place: Path, outcome: Outcome) -> str:
    about, findings = outcome.experiment, outcome.findings
    facts = {"Claim": about.claim, "Holds if": about.criterion, "Measured on": findings.data}
    settings = ", ".join(f"{name} {_listed(value)}" for name, value in findings.settings.items())
    if settings:
        facts["Settings"] = settings
    listed = "".join(f"<dt>{name}</dt><dd>{escape(text)}</dd>" for name, text in facts.items())
    pictures = "".join(_picture(place, picture) for picture in outcome.pictures)
    also = "".join(f'<span id="{name}"></span>' for name in about.covers)
    return (
        f'<section class="experiment" id="{about.name}" aria-labelledby="{about.name}-title"><header>'
        f'<h3 id="{about.name}-title">{also}{_names(about)}: {escape(about.title)}</h3>'
        f"{_badge(findings.verdict)}</header>"
        f'<p class="found">{escape(findings.summary)}</p><dl>{listed}</dl>'
        f"{_rows(findings.rows)}"
        + (f'<div class="figures">{pictures}</div>' if pictures else "")
        + f'<p class="quiet">Took {outcome.seconds:.0f} s.</p></section>'
    )


def _rows(rows: Sequence[Row]) -> str:
    if not rows:
        return ""
    columns = {name: [cell(row) for row in rows] for name, cell in _CELLS.items()}
    # A column that nothing was printed or measured for says nothing.
    columns = {name: cells for name, cells in columns.items() if name == "ours" or any(cells)}
    notes = [row.note for row in rows]
    head = "".join(f'<th scope="col">{name}</th>' for name in ("", *columns))
    head += '<th scope="col" class="text">note</th>' if any(notes) else ""
    body = ""
    for i, row in enumerate(rows):
        cells = "".join(
            f'<td data-label="{name}">{values[i] or _NONE}</td>' for name, values in columns.items()
        )
        note = f'<td class="text">{escape(row.note)}</td>' if any(notes) else ""
        body += f'<tr><th scope="row">{escape(row.name)}</th>{cells}{note}</tr>'
    table = f'<table class="numbers"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'
    wrapped = f'<div class="wide" tabindex="0" role="region" aria-label="Printed and recomputed values">{table}</div>'
    if len(rows) <= 12:
        return wrapped
    return f"<details><summary>All {len(rows)} values</summary>{wrapped}</details>"


def _interval(row: Row) -> str:
    return "" if row.low is None or row.high is None else f"{_number(row.low)} to {_number(row.high)}"


def _difference(row: Row) -> str:
    if row.ours is None or row.printed is None:
        return ""
    found = row.ours - row.printed
    return ("+" if found > 0 else "") + _number(found)


def _picture(place: Path, picture: Picture) -> str:
    content = (place / picture.file).read_bytes()
    caption = escape(picture.caption)
    if picture.kind == "figure":
        data = base64.b64encode(content).decode("ascii")
        # As wide as it was drawn at 90 dots an inch, so that text in all figures has one size.
        width, height = (round(side / 1.6) for side in struct.unpack(">II", content[16:24]))
        return (
            f'<figure style="width:{width}px"><img alt="{caption}" width="{width}" height="{height}" '
            f'src="data:image/png;base64,{data}">'
            f"<figcaption>{caption}</figcaption></figure>"
        )
    name = f"surface-{Path(picture.file).stem}"
    page = json.dumps(content.decode()).replace("<", "\\u003c")
    return (
        f'<figure class="surface"><button type="button" data-surface="{name}" data-title="{caption}">'
        "Turn the surface</button>"
        f'<script type="application/json" id="{name}">{page}</script><figcaption>{caption}</figcaption></figure>'
    )


def _badge(verdict: str, text: str = "") -> str:
    return f'<span class="badge {_CLASSES[verdict]}">{escape(text or verdict)}</span>'


def _names(about: Experiment) -> str:
    """Name it and what else it covers, the word Table or Figure not said twice."""
    kind = about.name.partition("-")[0]
    others = [
        name.partition("-")[2] if name.startswith(f"{kind}-") else _spoken(name) for name in about.covers
    ]
    return ", ".join([_spoken(about.name), *others])


def _spoken(name: str) -> str:
    kind, _, number = name.partition("-")
    return f"{kind.capitalize()} {number}"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}".replace("-", "−")


_NONE = "<span class=none>–</span>"
_CELLS: dict[str, Callable[[Row], str]] = {
    "printed": lambda row: _number(row.printed),
    "ours": lambda row: _number(row.ours),
    "interval": _interval,
    "difference": _difference,
    "ratio": lambda row: _number(row.ratio),
}


def _listed(value: object) -> str:
    return ", ".join(str(item) for item in value) if isinstance(value, (tuple, list)) else str(value)


def _fact(name: str, value: str) -> str:
    return f'<tr><th scope="row">{escape(name)}</th><td>{escape(value)}</td></tr>'


def _asset(name: str) -> str:
    return (resources.files(__package__) / "assets" / name).read_text(encoding="utf-8")
