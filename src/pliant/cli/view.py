"""``pliant view``: surfaces and per-vertex results on a local page."""

from __future__ import annotations

import tempfile
import webbrowser
from dataclasses import dataclass, field
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

_COLUMNS = 12
_NAMED = 3
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


def _surfaces(files: Sequence[Path], up: Up, unit: str) -> list[ShownSurface]:
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


@dataclass
class _Found:
    """What the results of one mesh hold."""

    arrays: list[tuple[Path, str, Any]] = field(default_factory=list)
    layers: dict[str, np.ndarray] = field(default_factory=dict)
    charts: dict[str, np.ndarray] = field(default_factory=dict)
    maps: dict[str, Any] = field(default_factory=dict)
    matching: dict[str, np.ndarray] = field(default_factory=dict)
    cameras: dict[str, Any] = field(default_factory=dict)
    label_names: dict[str, dict[int, str]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def _surface(name: str, path: Path, results: Sequence[Path], up: Up, unit: str) -> ShownSurface:
    from ..report import ShownSurface
    from ..report.labels import is_aha, label_values

    mesh, _ = load_examined(path)
    own = path.suffix.lower() in (".ply", ".vtk", ".vtp", ".vtu", ".gii")
    found = _read(results or ([path] if own else []), mesh, up)
    misfits = _take(found, mesh)
    if results and misfits and not found.layers:
        count = f"{path} has {mesh.n_vertices} vertices"
        message = f"none of the results fits their mesh: {count}; {'; '.join(misfits[:_NAMED])}"
        raise InputError(message + ("; …" if len(misfits) > _NAMED else ""))
    found.notes += [
        f"left out for having no row for each of the {mesh.n_vertices} vertices: {text}" for text in misfits
    ]
    if not found.layers:
        upwards = mesh.vertices[:, "xyz".index(up)]
        found.layers[f"height of vertices ({unit})" if unit else "height of vertices"] = upwards.copy()
    for kind, texts in (("warning", found.warnings), ("note", found.notes)):
        for text in texts:
            complain(kind, f"{name}: {text}")
    segments = next((values for values in found.layers.values() if is_aha(label_values(values))), None)
    return ShownSurface(
        name,
        mesh,
        found.layers,
        found.charts,
        found.maps,
        None if segments is None else np.nan_to_num(segments).astype(np.int64),
        found.label_names,
        found.warnings + found.notes,
        found.cameras,
    )


def _read(results: Sequence[Path], mesh: Mesh, up: Up) -> _Found:
    from .. import load_arrays
    from ..mesh import load_parcellation

    found = _Found()
    for result in results:
        if result.is_dir():
            _add_symmetries(found, result, mesh, up)
        elif result.name.lower().endswith(_PARCELLATIONS):
            parcels = load_parcellation(result)
            labels = np.where(parcels.labels < 0, np.nan, parcels.labels)
            found.arrays.append((result, result.name, labels))
            found.label_names[result.name] = parcels.names
        else:
            found.arrays += [(result, key, values) for key, values in load_arrays(result).items()]
    return found


def _take(found: _Found, mesh: Mesh) -> list[str]:
    """Take columns to colour by and rows to draw as histograms; return what does not fit the mesh, in words."""
    misfits = []
    for path, key, values in found.arrays:
        numbers = np.asarray(values)
        if numbers.ndim == 0:  # what made the arrays
            continue
        if numbers.dtype.kind not in "biuf" or numbers.ndim > 2 or not numbers.size:
            misfits.append(f"{path.name}: {key}, shape {numbers.shape}, {numbers.dtype}")
        elif len(numbers) != mesh.n_vertices:
            misfits.append(f"{path.name}: {key} has length {len(numbers)}")
        elif numbers.ndim == 1:
            found.layers[key] = numbers  # whole numbers may be labels
        else:
            _take_columns(found, key, numbers.astype(np.float64))
    found.layers |= found.matching  # after what was given: the first is shown
    return misfits


def _take_columns(found: _Found, key: str, rows: np.ndarray) -> None:
    width = rows.shape[1]
    columns = np.unique(np.linspace(0, width - 1, _COLUMNS).astype(int))
    for column in columns:
        found.layers[f"{key}, column {column}"] = rows[:, column]
    if len(columns) < width:
        numbers = ", ".join(str(column) for column in columns)
        found.notes.append(
            f"{key} has {width} columns, counted from 0; {len(columns)} of them can be shown: {numbers}"
        )
    if width <= _WIDEST and np.isfinite(rows).all():
        found.charts[key] = rows


def _add_symmetries(found: _Found, folder: Path, mesh: Mesh, up: Up) -> None:
    """Read maps by name, from where and in which colours they are seen, and what to know of them."""
    from ..matching.symmetry import SymmetryResult
    from ..report.symmetry import matching_colours, symmetry_camera, symmetry_names

    result = SymmetryResult.load(folder)
    try:
        result.check_mesh(mesh)
    except InputError as error:
        message = f"{folder}: {error}; name the mesh that it was made from"
        raise InputError(message) from error
    if result.mesh is None:
        found.warnings.append(
            f"{folder.name} does not say which mesh its symmetries are of, only that it has "
            f"{mesh.n_vertices} vertices. Run pliant symmetry again to be sure."
        )
    for name, symmetry in zip(symmetry_names(result), result.symmetries, strict=True):
        found.maps[name] = symmetry.point_map
        found.cameras[name] = symmetry_camera(mesh, symmetry, up=up)
        found.matching[name] = matching_colours(mesh, symmetry)
