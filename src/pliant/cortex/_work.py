"""One subject's measurement: its settings, its file, and who carries it out."""

from __future__ import annotations

import hashlib
import itertools
import json
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .. import __version__
from .._arrays import FloatArray, vertex_values
from .._processes import process_map
from ..cluster import Scheduler, map_ordered
from ..errors import InputError, PliantError
from ..geodesic import nearest
from ..mesh import Mesh, load_arrays, load_mesh, principal_curvatures, save_arrays
from ..mesh.adjacency import edge_matrix
from .context import ContextSignature
from .landmarks import read_landmarks
from .subjects import Subject, read_map

__all__ = ["FieldOf", "Task", "measured", "stored"]

# A function of a mesh, "curvature", or the name of a map that the subjects have.
FieldOf: TypeAlias = Callable[[Mesh], ArrayLike] | str

# Raised when what a subject's file holds changes, so that older ones are made anew.
_FORMAT = 2
_CURVATURE = "curvature"
# Settings that come in later, over the whole cohort.
_LATER = ("edges", "bins", "percentile")


@dataclass(frozen=True)
class Task:
    """All that decides a subject's result."""

    subject: Subject
    landmarks: Path | None
    signature: ContextSignature
    measure: FieldOf | None
    folder: Path

    @property
    def path(self) -> Path:
        return self.folder / f"{self.subject.name}.npz"

    @property
    def map(self) -> Path | None:
        """File of the subject's own map, where one is asked for."""
        if not isinstance(self.measure, str) or self.measure == _CURVATURE:
            return None
        if self.measure not in self.subject.maps:
            able = ", ".join(self.subject.maps) or "none"
            message = f"the subject has no map {self.measure!r}; it has {able}"
            raise InputError(message)
        return self.subject.maps[self.measure]

    def key(self) -> str:
        """Hash of the input files' contents and of the settings."""
        digest = hashlib.sha256()
        for path in (self.subject.mesh, self.landmarks, self.map):
            content = path.read_bytes() if path is not None else b""
            # The name's ending decides how the content is read.
            digest.update(f"{len(content)} {path.suffix if path else ''}\n".encode())
            digest.update(content)
        made_by = {"measure": _name_of(self.measure), "format": _FORMAT, "version": __version__}
        settings = {k: v for k, v in asdict(self.signature).items() if k not in _LATER} | made_by
        digest.update(json.dumps(settings, sort_keys=True).encode())
        return digest.hexdigest()


def measured(
    tasks: Sequence[Task], n_jobs: int, scheduler: Scheduler | None = None, *, progress: bool = False
) -> list[str]:
    """Measure what is not done yet; the error of each task, empty where there is none."""
    if scheduler is not None:
        return list(
            map_ordered(_measure, tasks, scheduler=scheduler, description="subjects", progress=progress)
        )
    options = {"failed": _explained, "description": "subjects", "progress": progress}
    return list(process_map(_measure, tasks, n_jobs, **options))  # type: ignore[arg-type]


def stored(path: Path, key: str | None = None) -> dict[str, np.ndarray] | None:
    """Return what a subject's file holds, or None where it is missing, damaged, or made from something else."""
    try:
        arrays = load_arrays(path)
        fits = key is None or str(arrays["key"]) == key
    except (OSError, KeyError, InputError, zipfile.BadZipFile):
        return None
    return arrays if fits else None


def _measure(task: Task) -> str:
    try:
        key = task.key()
        if stored(task.path, key) is None:
            save_arrays(task.path, {"key": key, **_arrays(task)})
    except Exception as error:  # one bad subject, whatever ails it, must not end the others
        return _explained(error)
    return ""


def _explained(error: BaseException) -> str:
    if (
        isinstance(error, OSError)
        and not isinstance(error, PliantError)
        and error.filename
        and error.strerror
    ):
        return f"{error.filename}: {error.strerror}"
    text = " ".join(str(error).split())
    return text if isinstance(error, (PliantError, OSError)) and text else f"{type(error).__name__}: {text}"


def _arrays(task: Task) -> dict[str, ArrayLike]:
    mesh = load_mesh(task.subject.mesh)
    if task.landmarks is None:
        raise InputError("the subject has no landmarks: give the cohort's, or a column landmarks")
    sites = read_landmarks(task.landmarks, mesh)
    setting = task.signature
    field = _field(task, mesh)
    near = nearest(
        setting.surface(mesh),
        sites.vertices,
        count=setting.count,
        radius=setting.radius,
        graph=setting.graph,
        n_jobs=1,
    )
    return {
        "field": field, "names": np.array(sites.names), "vertices": sites.vertices,
        "distances": sites.distances, "offsets": near.offsets, "members": near.vertices,
    }  # fmt: skip


def _field(task: Task, mesh: Mesh) -> FloatArray:
    measure = task.measure
    if measure is None:
        return task.signature.field(mesh, n_jobs=1)
    if measure == _CURVATURE:
        return _mean_curvature(task.signature.surface(mesh))
    if isinstance(measure, str):
        return read_map(task.map or measure, mesh.n_vertices)
    return vertex_values(measure(mesh), mesh.n_vertices, _name_of(measure))


def _mean_curvature(mesh: Mesh) -> FloatArray:
    """(n,) mean curvature; where it cannot be found, the mean of the neighbours'."""
    values: FloatArray = principal_curvatures(mesh, n_jobs=1).mean.copy()
    missing = np.flatnonzero(~np.isfinite(values))
    if missing.size:
        links = edge_matrix(mesh)[missing]
        near = [values[links.indices[a:b]] for a, b in itertools.pairwise(links.indptr)]
        values[missing] = [x[np.isfinite(x)].mean() if np.isfinite(x).any() else np.nan for x in near]
    return vertex_values(values, mesh.n_vertices, "mean curvature")


def _name_of(measure: FieldOf | None) -> str:
    if measure is None:
        return "gfe"
    if isinstance(measure, str):
        return f"map {measure}"
    if isinstance(measure, partial):
        return f"{_name_of(measure.func)} {measure.args} {sorted(measure.keywords.items())}"
    return f"{measure.__module__}.{getattr(measure, '__qualname__', type(measure).__qualname__)}"
