"""``pliant describe``: signatures of every vertex."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from .field import AsJson, Figure, Jobs, MeshFile, Up
from .files import write_figure
from .measure import BINS, NEIGHBOURS
from .output import load_examined, named, say, say_json, show_facts, show_table

if TYPE_CHECKING:
    from .. import Mesh, Spectrum
    from .._arrays import FloatArray


@dataclass(frozen=True, eq=False)
class _Shape:
    """A mesh with what several signatures need, computed when the first one asks."""

    mesh: Mesh
    k: int
    jobs: int | None
    progress: bool

    @cached_property
    def spectrum(self) -> Spectrum:
        from .. import eigenbasis

        return eigenbasis(self.mesh, self.k, progress=self.progress)

    @cached_property
    def gfe(self) -> FloatArray:
        from .. import gfe

        return gfe(self.mesh, n_jobs=self.jobs, progress=self.progress)


def _hks(shape: _Shape) -> FloatArray:
    from .. import hks

    return hks(shape.spectrum)


def _wks(shape: _Shape) -> FloatArray:
    from .. import wks

    return wks(shape.spectrum)


def _bdk(shape: _Shape) -> FloatArray:
    from .. import bdk

    return bdk(shape.spectrum)[:, None]


def _bde(shape: _Shape) -> FloatArray:
    from .. import bde

    return bde(shape.spectrum, n_jobs=shape.jobs, progress=shape.progress)


def _gfe(shape: _Shape) -> FloatArray:
    return shape.gfe[:, None]


def _gch(shape: _Shape) -> FloatArray:
    from .. import gch, gch_edges, nearest

    near = nearest(shape.mesh, count=min(NEIGHBOURS, shape.mesh.n_vertices), progress=shape.progress)
    return gch(shape.gfe, near, edges=gch_edges(shape.gfe, bins=BINS))


def _curvature(shape: _Shape) -> FloatArray:
    from .. import curvature_signature

    return curvature_signature(shape.mesh, n_jobs=shape.jobs)


_SIGNATURES: dict[str, Callable[[_Shape], FloatArray]] = {
    "hks": _hks,
    "wks": _wks,
    "bdk": _bdk,
    "bde": _bde,
    "gfe": _gfe,
    "gch": _gch,
    "curvature": _curvature,
}


def _names(text: str) -> str:
    unknown = [name for name in text.split(",") if name not in _SIGNATURES]
    if unknown:
        message = f"{', '.join(unknown) or 'nothing'}: the signatures are {', '.join(_SIGNATURES)}"
        raise typer.BadParameter(message)
    return text


def describe(
    mesh: MeshFile,
    signatures: Annotated[
        str,
        typer.Option("--with", metavar="NAME,...", callback=_names, help=f"Of {', '.join(_SIGNATURES)}."),
    ] = "hks,wks,bdk,bde",
    k: Annotated[int, typer.Option("-k", min=2, help="Eigenpairs.")] = 200,
    out: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="OUT", callback=named(".npz"), help="Write the tables: .npz."),
    ] = None,
    figure: Figure = None,
    jobs: Jobs = None,
    up: Up = "z",
    as_json: AsJson = False,
) -> None:
    """Describe every vertex by signatures: a row of numbers each, to be compared by L2."""
    from .. import __version__, save_arrays

    surface, _ = load_examined(mesh)
    shape = _Shape(surface, min(k, surface.n_vertices - 1), jobs, progress=not as_json)
    tables, rows = {}, []
    for name in dict.fromkeys(signatures.split(",")):
        start = time.perf_counter()
        tables[name] = _SIGNATURES[name](shape)
        rows.append(_row(name, tables[name], time.perf_counter() - start))
    settings = {"mesh": mesh.name, "k": shape.k, "signatures": signatures, "pliant": __version__}
    if out is not None:
        save_arrays(out, {**tables, "settings": json.dumps(settings)})
    if figure is not None:
        _draw(figure, surface, tables, f"Signatures of {mesh.name}", up)
    written = [str(path) for path in (out, figure) if path is not None]
    if as_json:
        say_json({**settings, "vertices": surface.n_vertices, "tables": rows, "written": written})
        return
    show_facts(
        f"Signatures of {mesh.name}", {"vertices": str(surface.n_vertices), "eigenpairs": str(shape.k)}
    )
    columns = ("signature", "columns", "least", "median", "greatest", "seconds")
    show_table("Values", columns, [[_text(value) for value in row.values()] for row in rows])
    for path in written:
        say(f"wrote {path}")


def _row(name: str, table: FloatArray, seconds: float) -> dict[str, Any]:
    low, middle, high = (float(value) for value in np.quantile(table, [0, 0.5, 1]))
    return {
        "signature": name,
        "columns": table.shape[1],
        "least": low,
        "median": middle,
        "greatest": high,
        "seconds": round(seconds, 3),
    }


def _text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _draw(path: Path, surface: Mesh, tables: dict[str, FloatArray], title: str, up: Any) -> None:
    """Draw the middle column of the first signature."""
    from ..report import surface_figure

    name, table = next(iter(tables.items()))
    column = table.shape[1] // 2
    label = f"{name}, column {column + 1} of {table.shape[1]}" if table.shape[1] > 1 else name
    drawn = surface_figure(
        surface, table[:, column], up=up, title=title, colour_bar_label=label, length_unit=""
    )
    write_figure(path, drawn)
