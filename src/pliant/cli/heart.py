"""``pliant heart``: the left ventricle, from a CT volume to a bull's-eye."""

from __future__ import annotations

import typer

heart = typer.Typer(
    name="heart",
    help="The left ventricle, from a CT volume to a bull's-eye. Research software, not a medical device.",
    no_args_is_help=True,
)
