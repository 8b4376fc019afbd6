"""The frame that pages share: their head, the stage of a surface, a vertex by its number, data, buttons, tables."""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape
from importlib import resources
from string import Template
from typing import Any

from ._payload import SIDES

_PIECES = ("head", "surface", "vertex")
#: What draws a surface, in the order in which the parts need one another.
VIEWER = ("shaders.js", "geometry.js", "motion.js", "viewer.js")


def framed(name: str, parts: Mapping[str, str], *, style: str = "") -> str:
    """Fill a page's template, with the pieces that several pages have in common."""
    whole = {
        "overlay": "",
        "told": "",
        "alt": "",
        "last": "",
        "notes": "",
        **parts,
        "version": version(),
        "css": asset("page.css") + (asset(style) if style else ""),
        "sides": "\n".join(f'<button type="button" data-side="{s}">{s.capitalize()}</button>' for s in SIDES),
    }
    pieces = {piece: Template(asset(f"{piece}.html")).substitute(whole) for piece in _PIECES}
    return Template(asset(name)).substitute(whole | pieces)


def embedded(data: object) -> str:
    """Write data as JSON that a script element can carry: "<" in text could end the element."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def setting_rows(table: Mapping[Any, Any]) -> str:
    """Rows of a table of settings."""
    return "\n".join(
        f'<tr><th scope="row">{escape(str(name).replace("_", " "))}</th><td>{escape(_shown(value))}</td></tr>'
        for name, value in table.items()
    )


def _shown(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{str(name).replace('_', ' ')} {number}" for name, number in value.items())
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)


def scripts(*names: str) -> str:
    """Scripts one after the other."""
    return "".join(asset(name) for name in names)


def asset(name: str) -> str:
    """Text of a file that pages are made of."""
    return (resources.files(__package__) / "assets" / name).read_text(encoding="utf-8")


def version() -> str:
    """Version of the package, for pages to name."""
    from .. import __version__

    return str(__version__)
