"""``pliant view``: surfaces and per-vertex results on a local page."""

from __future__ import annotations

import tempfile
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from ..errors import FileFormatError, InputError
from .ending import complain
from .field import Up
from .output import load_examined, named, say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .. import Mesh
    from ..report import ShownSurface

_COLUMNS = 6
_PARCELLATIONS = (".annot", ".annot.gz", ".label.gii")
_WIDEST = 64


def view(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Meshes, each followed by its results: arrays of one row a vertex (NPZ, NPY, CSV, GIFTI, FreeSurfer's "
            "morphometry and annotations), or a folder that pliant symmetry wrote.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="HTML",
            callback=named(".html", ".htm"),
            help="Keep the page here; do not open it.",
        ),
    ] = None,
    up: Up = "z",
    unit: Annotated[str, typer.Option(help="The meshes' unit of length.")] = "",
) -> None:
    """Show meshes and any per-vertex result in the browser: choose, compare, pick, step through symmetries."""
    from ..report import comparison_page, write_page

    shown = _surfaces(files, up, unit)
    title = ", ".join(surface.name for surface in shown[:3]) + (" …" if len(shown) > 3 else "")
    page = comparison_page(shown, title=title, up=up, length_unit=unit)
    place = output or Path(tempfile.mkdtemp(prefix="pliant-")) / "view.html"
    say(str(write_page(place, page)))
    if output is None and not webbrowser.open(place.as_uri()):
        complain("note", f"no browser could be opened; open {place} yourself")


def _surfaces(files: Sequence[Path], up: str, unit: str) -> list[ShownSurface]:
    from ..mesh.arrays import holds_arrays_only

    groups: list[tuple[Path, list[Path]]] = []
    for path in files:
        if not path.exists():
            message = f"{path}: no such file"
            raise FileFormatError(message)
        if not path.is_dir() and not holds_arrays_only(path):
            groups.append((path, []))
        elif groups:
            groups[-1][1].append(path)
        else:
            message = f"{path} holds results; name the mesh that they belong to before it"
            raise InputError(message)
    names = _names([mesh for mesh, _ in groups])
    return [
        _surface(name, mesh, results, up, unit) for name, (mesh, results) in zip(names, groups, strict=True)
    ]


def _names(paths: Sequence[Path]) -> list[str]:
    """File names, told apart by number where they repeat."""
    names: list[str] = []
    for path in paths:
        count = sum(name.split(" (")[0] == path.name for name in names)
        names.append(f"{path.name} ({count + 1})" if count else path.name)
    return names


def _surface(name: str, path: Path, results: Sequence[Path], up: str, unit: str) -> ShownSurface:
    from .. import load_arrays
    from ..mesh import load_parcellation
    from ..report import ShownSurface
    from ..report.labels import is_aha, label_values

    mesh, _ = load_examined(path)
    arrays: dict[str, Any] = {}
    maps: dict[str, Any] = {}
    label_names: dict[str, dict[int, str]] = {}
    notes: list[str] = []
    for result in results:
        if result.is_dir():
            found, told = _maps(result, mesh)
            maps.update(found)
            notes += told
        elif result.name.lower().endswith(_PARCELLATIONS):
            parcels = load_parcellation(result)
            arrays[result.name] = np.where(parcels.labels < 0, np.nan, parcels.labels)
            label_names[result.name] = parcels.names
        else:
            arrays.update(load_arrays(result))
    if not results and path.suffix.lower() in (".ply", ".vtk", ".vtp", ".vtu", ".gii"):
        arrays.update(load_arrays(path))
    layers, charts = _layers(arrays, mesh, name)
    if not layers:
        upwards = mesh.vertices[:, "xyz".index(up)]
        layers = {f"height ({unit})" if unit else "height": upwards.copy()}
    for note in notes:
        complain("warning", f"{name}: {note}")
    segments = next((values for values in layers.values() if is_aha(label_values(values))), None)
    return ShownSurface(
        name,
        mesh,
        layers,
        charts,
        maps,
        None if segments is None else np.nan_to_num(segments).astype(np.int64),
        label_names,
        notes,
    )


def _layers(
    arrays: dict[str, Any], mesh: Mesh, name: str
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Columns to colour by, and rows to draw as histograms; what does not fit the mesh is named and left out."""
    layers: dict[str, np.ndarray] = {}
    charts: dict[str, np.ndarray] = {}
    for key, values in arrays.items():
        numbers = np.asarray(values)
        fits = numbers.dtype.kind in "biuf" and numbers.ndim in (1, 2) and len(numbers) == mesh.n_vertices
        if numbers.ndim == 0:  # what made the arrays
            continue
        if not fits or not numbers.size:
            complain("note", f"{name}: {key}, shape {numbers.shape}, has no row a vertex and is left out")
            continue
        if numbers.ndim == 1:
            layers[key] = numbers  # whole numbers may be labels
            continue
        rows = numbers.reshape(len(numbers), -1).astype(np.float64)
        for column in np.unique(np.linspace(0, rows.shape[1] - 1, _COLUMNS).astype(int)):
            layers[f"{key}, column {column}"] = rows[:, column]
        if rows.shape[1] <= _WIDEST and np.isfinite(rows).all():
            charts[key] = rows
    return layers, charts


def _maps(folder: Path, mesh: Mesh) -> tuple[dict[str, Any], list[str]]:
    """Read maps by name, and what to know of them."""
    from ..matching.symmetry import SymmetryResult
    from ..report.symmetry import symmetry_names

    result = SymmetryResult.load(folder)
    try:
        result.check_mesh(mesh)
    except InputError as error:
        message = f"{folder}: {error}; name the mesh that it was made from"
        raise InputError(message) from error
    notes = []
    if result.mesh is None:
        notes.append(
            f"{folder.name} does not say which mesh its symmetries are of, only that it has "
            f"{mesh.n_vertices} vertices. Run pliant symmetry again to be sure."
        )
    maps = {
        name: found.point_map for name, found in zip(symmetry_names(result), result.symmetries, strict=True)
    }
    return maps, notes
