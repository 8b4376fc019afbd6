"""``pliant retrieval``: find pictures by shape."""

from __future__ import annotations

import typer

retrieval = typer.Typer(
    name="retrieval", help="Find pictures by shape: train, index, query, serve.", no_args_is_help=True
)
