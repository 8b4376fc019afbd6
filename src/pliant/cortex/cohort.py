"""A cohort: every subject's field at every landmark, written as it is done, resumed where it stopped."""

from __future__ import annotations

import csv
import hashlib
import json
import multiprocessing
import os
import re
import threading
import time
import zipfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .. import __version__
from .._arrays import FloatArray, IntArray, frozen, vertex_values
from .._parallel import job_count
from .._progress import progress_bar
from ..errors import FileFormatError, InputError, PliantError
from ..geodesic import Neighbourhoods, gch, nearest
from ..mesh import Mesh, load_arrays, load_mesh, save_arrays
from .context import ContextSignature
from .landmarks import read_landmarks

__all__ = ["CohortResult", "Subject", "read_cohort", "study_cohort"]

FieldOf: TypeAlias = Callable[[Mesh], ArrayLike]

# Raised when what a subject's file holds changes, so that older ones are made anew.
_FORMAT = 1
_NAME = re.compile(r"[\w][\w.+-]*")


@dataclass(frozen=True)
class Subject:
    """One row of a cohort.

    Parameters
    ----------
    name : str
        Letters, digits, ``_ . + -``: it names a file.
    mesh : Path
        The surface.
    group : str
        Empty where there is none.
    landmarks : Path, optional
        The subject's own; the cohort's otherwise.
    """

    name: str
    mesh: Path
    group: str = ""
    landmarks: Path | None = None


@dataclass(frozen=True, eq=False)
class CohortResult:
    """What a cohort's landmarks look like, subject by subject.

    Parameters
    ----------
    subjects : tuple of Subject
        As they were given, with those that failed.
    errors : tuple of str
        Why a subject failed; empty where it did not.
    sites : tuple of str
        Names of the landmarks, in the order of the first subject that has them.
    histograms : (subjects, sites, bins) array of float
        Over common edges; NaN where a subject failed or lacks the site.
    edges : (bins + 1,) array of float
        The common edges.
    vertices : (subjects, sites) array of int
        Landmark vertices; -1 where missing.
    distances : (subjects, sites) array of float
        How far each landmark was snapped; NaN where missing.
    """

    subjects: tuple[Subject, ...]
    errors: tuple[str, ...]
    sites: tuple[str, ...]
    histograms: FloatArray
    edges: FloatArray
    vertices: IntArray
    distances: FloatArray

    def __post_init__(self) -> None:
        for name in ("histograms", "edges", "vertices", "distances"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def n_failed(self) -> int:
        """Number of subjects that ended with an error."""
        return sum(bool(error) for error in self.errors)


@dataclass(frozen=True)
class _Task:
    """All that decides a subject's result."""

    subject: Subject
    landmarks: Path | None
    signature: ContextSignature
    measure: FieldOf | None
    folder: Path

    @property
    def path(self) -> Path:
        return self.folder / f"{self.subject.name}.npz"

    def key(self) -> str:
        """Hash of the input files' contents and of the settings."""
        digest = hashlib.sha256()
        for path in (self.subject.mesh, self.landmarks):
            content = path.read_bytes() if path is not None else b""
            # The name's ending decides how the content is read.
            digest.update(f"{len(content)} {path.suffix if path else ''}\n".encode())
            digest.update(content)
        made_by = {"measure": _name_of(self.measure), "format": _FORMAT, "version": __version__}
        # Edges and bins come later, over the whole cohort.
        settings = {k: v for k, v in asdict(self.signature).items() if k not in ("edges", "bins")} | made_by
        digest.update(json.dumps(settings, sort_keys=True).encode())
        return digest.hexdigest()


def read_cohort(path: str | os.PathLike[str]) -> tuple[Subject, ...]:
    r"""Read a table of subjects.

    Parameters
    ----------
    path : str or path-like
        A CSV file with a header: ``subject``, ``mesh``, and optionally ``group`` and ``landmarks``. Paths are
        taken from the table's folder.

    Returns
    -------
    tuple of Subject

    Raises
    ------
    FileFormatError
        If a column is missing, there is no row, or a subject has no mesh, a name that cannot name a file, or one that
        occurs twice.

    Examples
    --------
    >>> import tempfile
    >>> table = Path(tempfile.mkdtemp()) / "cohort.csv"
    >>> _ = table.write_text("subject,mesh\ns1,s1.ply\n")
    >>> read_cohort(table)[0].name
    's1'
    """
    path = Path(path)
    with path.open(newline="", encoding="utf-8-sig") as lines:
        rows = list(csv.DictReader(lines))
    missing = {"subject", "mesh"} - set(rows[0] if rows else ())
    if missing:
        message = (
            f"{path}: needs a row and the columns subject and mesh; missing {', '.join(sorted(missing))}"
        )
        raise FileFormatError(message)
    subjects = []
    for i, row in enumerate(rows):
        cells = {
            key: (value or "").strip() for key, value in row.items() if isinstance(value, (str, type(None)))
        }
        if not cells.get("mesh"):
            message = f"{path}: row {i + 1} names no mesh"
            raise FileFormatError(message)
        own = path.parent / cells["landmarks"] if cells.get("landmarks") else None
        subjects.append(
            Subject(cells.get("subject", ""), path.parent / cells["mesh"], cells.get("group", ""), own)
        )
    try:
        _check_names(subjects)
    except InputError as error:
        message = f"{path}: {error}"
        raise FileFormatError(message) from error
    return tuple(subjects)


def study_cohort(
    subjects: Sequence[Subject],
    folder: str | os.PathLike[str],
    *,
    landmarks: str | os.PathLike[str] | None = None,
    signature: ContextSignature | None = None,
    measure: FieldOf | None = None,
    n_jobs: int | None = None,
    progress: bool = False,
) -> CohortResult:
    r"""Make the context histograms of all landmarks of all subjects, over common bins.

    Parameters
    ----------
    subjects : sequence of Subject
        See :func:`read_cohort`.
    folder : str or path-like
        Where each subject's result goes as it is done, as ``subjects/NAME.npz``; made if it is not there. A subject
        whose file was made from the same input and settings is not computed again.
    landmarks : str or path-like, optional
        Landmark file for subjects without their own; see :func:`read_landmarks`.
    signature : ContextSignature, optional
        Neighbourhoods, bins and the field's settings. Without edges, those that suit the whole cohort are taken.
    measure : callable, optional
        Another per-vertex signature instead of the geodesic field: takes a mesh, gives (n,) numbers. With several
        processes it must be a function of a module; its module and name stand for it when results are reused.
    n_jobs : int, optional
        Processes, one thread each; all processors by default. The result does not depend on it.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    CohortResult

    Raises
    ------
    InputError
        If there is no subject, a name cannot name a file or occurs twice, or no subject could be measured.

    Notes
    -----
    Two passes: fields first, then edges over all of them and the histograms. Results are written to a file of another
    name and renamed, so a run that is killed leaves whole files only, and the next run goes on from them to the same
    bytes. A subject that cannot be measured ends with its error and the others go on. Memory is one subject a process,
    and all fields: about 8 bytes a vertex.

    References
    ----------
    Dissertation, section 2.8.

    Examples
    --------
    >>> import tempfile
    >>> from pliant import save_mesh, shapes
    >>> folder = Path(tempfile.mkdtemp())
    >>> for i in range(2):
    ...     save_mesh(folder / f"s{i}.ply", shapes.bumpy_sphere(subdivisions=2, rng=i))
    >>> _ = (folder / "sites.csv").write_text("vertex\n3\n17\n")
    >>> people = [Subject(f"s{i}", folder / f"s{i}.ply") for i in range(2)]
    >>> study_cohort(people, folder, landmarks=folder / "sites.csv", n_jobs=1).histograms.shape
    (2, 2, 10)
    """
    if not subjects:
        raise InputError("a cohort needs at least one subject")
    _check_names(subjects)
    setting = ContextSignature() if signature is None else signature
    place = Path(folder) / "subjects"
    place.mkdir(parents=True, exist_ok=True)
    common = None if landmarks is None else Path(landmarks)
    tasks = [_Task(s, s.landmarks or common, setting, measure, place) for s in subjects]
    errors = _measured(tasks, job_count(n_jobs), progress=progress)
    return _gathered(tasks, errors, setting)


def _check_names(subjects: Sequence[Subject]) -> None:
    names = [subject.name for subject in subjects]
    bad = [name for name in names if not _NAME.fullmatch(name)]
    if bad:
        message = f"{len(bad)} subjects have a name that cannot name a file, first {bad[0]!r}: use letters and digits"
        raise InputError(message)
    # Some file systems do not tell cases apart.
    folded = [name.casefold() for name in names]
    twice = [name for i, name in enumerate(folded) if name in folded[:i]]
    if twice:
        message = f"{len(twice)} subjects have the name of another, first {twice[0]!r}"
        raise InputError(message)


def _measured(tasks: list[_Task], n_jobs: int, *, progress: bool) -> list[str]:
    """Measure what is not done yet; the error of each task, empty where there is none."""
    errors = [""] * len(tasks)
    with progress_bar("subjects", len(tasks), show=progress) as advance:
        for i, error in _outcomes(tasks, min(n_jobs, len(tasks))):
            errors[i] = error
            advance()
    return errors


def _outcomes(tasks: list[_Task], n_jobs: int) -> Iterator[tuple[int, str]]:
    if n_jobs == 1:
        yield from ((i, _measure(task)) for i, task in enumerate(tasks))
        return
    # A fresh interpreter: a forked one may not use the threads of compiled code.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        n_jobs, mp_context=context, initializer=_end_with_parent, initargs=(os.getpid(),)
    ) as pool:
        waiting = {pool.submit(_measure, task): i for i, task in enumerate(tasks)}
        for done in as_completed(waiting):
            problem = done.exception()
            yield waiting[done], _explained(problem) if problem else done.result()


def _end_with_parent(parent: int) -> None:
    """Let a worker end when the process that started it is killed, rather than wait for work for ever."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _measure(task: _Task) -> str:
    try:
        key = task.key()
        if _stored(task.path, key) is None:
            save_arrays(task.path, {"key": key, **_arrays(task)})
    except Exception as error:  # one bad subject, whatever ails it, must not end the others
        return _explained(error)
    return ""


def _explained(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, (PliantError, OSError)) and text else f"{type(error).__name__}: {text}"


def _arrays(task: _Task) -> dict[str, ArrayLike]:
    mesh = load_mesh(task.subject.mesh)
    if task.landmarks is None:
        raise InputError("the subject has no landmarks: give the cohort's, or a column landmarks")
    sites = read_landmarks(task.landmarks, mesh)
    setting = task.signature
    if task.measure is None:
        field = setting.field(mesh, n_jobs=1)
    else:
        field = vertex_values(task.measure(mesh), mesh.n_vertices, _name_of(task.measure))
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


def _stored(path: Path, key: str | None = None) -> dict[str, np.ndarray] | None:
    """Return what a subject's file holds, or None where it is missing, damaged, or made from something else."""
    try:
        arrays = load_arrays(path)
        fits = key is None or str(arrays["key"]) == key
    except (OSError, KeyError, InputError, zipfile.BadZipFile):
        return None
    return arrays if fits else None


def _name_of(measure: FieldOf | None) -> str:
    if measure is None:
        return "gfe"
    if isinstance(measure, partial):
        return f"{_name_of(measure.func)} {measure.args} {sorted(measure.keywords.items())}"
    return f"{measure.__module__}.{getattr(measure, '__qualname__', type(measure).__qualname__)}"


def _gathered(tasks: list[_Task], errors: list[str], setting: ContextSignature) -> CohortResult:
    stored = [None if error else _stored(task.path) for task, error in zip(tasks, errors, strict=True)]
    for i, arrays in enumerate(stored):
        if arrays is None and not errors[i]:
            errors[i] = f"{tasks[i].path}: the result was there and is gone"
    done = [arrays for arrays in stored if arrays is not None]
    if not done:
        message = f"none of {len(tasks)} subjects could be measured; the first: {errors[0]}"
        raise InputError(message)
    if setting.edges is None:
        setting = setting.with_edges_of(*(arrays["field"] for arrays in done))
    setting = replace(setting, bins=len(setting.edges or ()) - 1)
    sites = tuple(dict.fromkeys(str(name) for arrays in done for name in arrays["names"]))
    place = {name: i for i, name in enumerate(sites)}
    shape = (len(tasks), len(sites))
    histograms = np.full((*shape, setting.bins), np.nan)
    vertices, distances = np.full(shape, -1), np.full(shape, np.nan)
    for i, arrays in enumerate(stored):
        if arrays is None:
            continue
        at = [place[str(name)] for name in arrays["names"]]
        members = arrays["members"]
        near = Neighbourhoods(arrays["vertices"], arrays["offsets"], members, np.zeros(len(members)))
        histograms[i, at] = gch(arrays["field"], near, edges=setting.edges)
        vertices[i, at], distances[i, at] = arrays["vertices"], arrays["distances"]
    return CohortResult(
        tuple(task.subject for task in tasks), tuple(errors), sites, histograms,
        np.array(setting.edges), vertices, distances,
    )  # fmt: skip
