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
from .output import folder_checked, say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .. import Mesh
    from ..report import ShownSurface

_COLUMNS = 6
_RESULTS = (".npz", ".shape.gii", ".func.gii", ".label.gii")
_WIDEST = 64


def view(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Meshes, each followed by its results: arrays of one row a vertex (NPZ, GIFTI), or a folder that "
            "pliant symmetry wrote.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="HTML", help="Keep the page here; do not open it."),
    ] = None,
    up: Up = "z",
    unit: Annotated[str, typer.Option(help="The meshes' unit of length.")] = "",
) -> None:
    """Show meshes and any per-vertex result in the browser: choose, compare, pick, step through symmetries."""
    from ..report import comparison_page, write_page

    folder_checked(output)
    shown = _surfaces(files)
    title = ", ".join(surface.name for surface in shown[:3]) + (" …" if len(shown) > 3 else "")
    page = comparison_page(shown, title=title, up=up, length_unit=unit)
    place = output or Path(tempfile.mkdtemp(prefix="pliant-")) / "view.html"
    say(str(write_page(place, page)))
    if output is None and not webbrowser.open(place.as_uri()):
        complain("note", f"no browser could be opened; open {place} yourself")


def _surfaces(files: Sequence[Path]) -> list[ShownSurface]:
    groups: list[tuple[Path, list[Path]]] = []
    for path in files:
        if not path.exists():
            message = f"{path}: no such file"
            raise FileFormatError(message)
        if not path.is_dir() and not path.name.lower().endswith(_RESULTS):
            groups.append((path, []))
        elif groups:
            groups[-1][1].append(path)
        else:
            message = f"{path} holds results; name the mesh that they belong to before it"
            raise InputError(message)
    names = _names([mesh for mesh, _ in groups])
    return [_surface(name, mesh, results) for name, (mesh, results) in zip(names, groups, strict=True)]


def _names(paths: Sequence[Path]) -> list[str]:
    """File names, told apart by number where they repeat."""
    names: list[str] = []
    for path in paths:
        count = sum(name.split(" (")[0] == path.name for name in names)
        names.append(f"{path.name} ({count + 1})" if count else path.name)
    return names


def _surface(name: str, path: Path, results: Sequence[Path]) -> ShownSurface:
    from .. import load_arrays, load_mesh
    from ..report import ShownSurface

    mesh = load_mesh(path)
    arrays: dict[str, Any] = {}
    maps: dict[str, Any] = {}
    for result in results:
        if result.is_dir():
            maps.update(_maps(result, mesh))
        else:
            arrays.update(load_arrays(result))
    if not results and path.suffix.lower() in (".ply", ".vtk", ".vtp", ".vtu", ".gii"):
        arrays.update(load_arrays(path))
    layers, charts = _layers(arrays, mesh, name)
    if not layers:
        layers = {"height": mesh.vertices[:, 2].copy()}
    segments = next((values for values in layers.values() if _is_segments(values)), None)
    return ShownSurface(
        name, mesh, layers, charts, maps, None if segments is None else segments.astype(np.int64)
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
        rows = numbers.reshape(len(numbers), -1).astype(np.float64)
        if numbers.ndim == 1:
            layers[key] = rows[:, 0]
            continue
        for column in np.unique(np.linspace(0, rows.shape[1] - 1, _COLUMNS).astype(int)):
            layers[f"{key}, column {column}"] = rows[:, column]
        if rows.shape[1] <= _WIDEST and np.isfinite(rows).all():
            charts[key] = rows
    return layers, charts


def _is_segments(values: np.ndarray) -> bool:
    """Whether values are AHA segments: all of 1 to 17, perhaps 0 for the cut base, and nothing else."""
    found = set(np.unique(values).tolist())
    return found - {0.0} == set(range(1, 18))


def _maps(folder: Path, mesh: Mesh) -> dict[str, Any]:
    from ..matching.symmetry import SymmetryResult

    found = {}
    for i, symmetry in enumerate(SymmetryResult.load(folder).symmetries, start=1):
        if len(symmetry.point_map) != mesh.n_vertices:
            message = f"{folder}: made for {len(symmetry.point_map)} vertices, the mesh has {mesh.n_vertices}"
            raise InputError(message)
        found[f"symmetry {i} ({symmetry.kind})"] = symmetry.point_map
    return found
