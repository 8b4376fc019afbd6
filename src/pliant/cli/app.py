"""The application: its commands, and the options of the program itself."""

from __future__ import annotations

from typing import Annotated

import typer

from .bench import bench
from .bench_cortex import cortex as bench_cortex
from .bench_heart import heart as bench_heart
from .bench_retrieval import retrieval as bench_retrieval
from .bench_scale import cluster, scaling
from .bench_segmentation import segmentation
from .bench_service import service
from .bench_shapes import descriptors, maps
from .bench_shapes import symmetry as bench_symmetry
from .components import components
from .correspond import correspond
from .cortex import cortex
from .data import data
from .demo import demo
from .describe import describe
from .field import field
from .heart_study import heart
from .image import image
from .inspect import inspect
from .mend import mend
from .path import path
from .reproduce import reproduce
from .retrieval import retrieval
from .retrieval_index import add, query, remove, serve
from .symmetry import symmetry
from .view import view


def _today(token: str) -> str:
    """Take the older name of an option for the one it has now."""
    return "output" if token == "out" else token


app = typer.Typer(
    name="pliant",
    help="Geometry of shapes that bend. Each command is one function of the library.",
    epilog="Exit codes: 0 done, 2 bad usage, 3 bad input or something missing, 130 interrupted.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "token_normalize_func": _today},
)
app.command()(demo)
app.command()(inspect)
app.command()(mend)
app.command()(field)
app.command()(path)
app.command()(describe)
app.command()(symmetry)
app.command()(cortex)
app.command()(components)
app.command()(correspond)
app.command()(reproduce)
app.command()(view)
bench.command()(descriptors)
bench.command()(maps)
bench.command("symmetry")(bench_symmetry)
bench.command()(cluster)
bench.command()(scaling)
bench.command()(service)
bench.command("cortex")(bench_cortex)
bench.command("heart")(bench_heart)
bench.command()(segmentation)
bench.command("retrieval")(bench_retrieval)
app.add_typer(bench)
app.add_typer(data)
app.add_typer(heart)
app.add_typer(image)
for command in (add, remove, query, serve):
    retrieval.command()(command)
app.add_typer(retrieval)


def _print_version(wanted: bool) -> None:
    if wanted:
        from .. import __version__

        typer.echo(f"pliant {__version__}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Geometry of shapes that bend. Each command is one function of the library."""
