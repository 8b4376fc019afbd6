"""A cohort of hearts from a table: each subject's features kept as they are made, bad subjects listed."""

from __future__ import annotations

import hashlib
import json
import os
import re
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from .._arrays import FloatArray, as_floats
from .._processes import process_map
from .._tables import table_rows
from ..cluster import Scheduler, map_ordered
from ..errors import FileFormatError, InputError, PliantError
from ..mesh import load_arrays, load_mesh, save_arrays
from .features import SegmentFeatures
from .patient import describe_heart
from .volume import load_volume

__all__ = ["HeartCohort", "HeartSubject", "describe_cohort", "read_heart_cohort", "read_heart_landmarks"]

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_FORMAT = 2
_TERRITORIES = ("LAD", "LCX", "RCA")


@dataclass(frozen=True)
class HeartSubject:
    """One row of a cohort's table.

    Parameters
    ----------
    name : str
        Letters and digits; names the subject's result.
    mesh, volume : Path, optional
        The endocardial surface, or the CT it is made from; the mesh is taken where both are there.
    landmarks : Path, optional
        See :func:`read_heart_landmarks`.
    mask : Path, optional
        Blood pool on the volume's grid, instead of finding it.
    stenosis : tuple of float
        Per cent, LAD, LCX, RCA; empty where the table has none, NaN where a number is missing.
    diseased : float
        1 or 0; NaN where the table does not say.
    """

    name: str
    mesh: Path | None = None
    volume: Path | None = None
    landmarks: Path | None = None
    mask: Path | None = None
    stenosis: tuple[float, ...] = ()
    diseased: float = float("nan")


@dataclass(frozen=True, eq=False, repr=False)
class HeartCohort:
    """Subjects and what was measured of them.

    Parameters
    ----------
    subjects : tuple of HeartSubject
        All, in the table's order.
    features : tuple of SegmentFeatures or None
        None where a subject failed.
    errors : tuple of str
        Why; empty where it did not.
    settings : mapping
        What made the features.
    """

    subjects: tuple[HeartSubject, ...]
    features: tuple[SegmentFeatures | None, ...]
    errors: tuple[str, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"HeartCohort({len(self.subjects)} subjects, {len(self.failed)} failed)"

    @property
    def failed(self) -> dict[str, str]:
        """Name and error of each subject without features."""
        return {s.name: e for s, e in zip(self.subjects, self.errors, strict=True) if e}

    def for_stenosis(self) -> tuple[list[SegmentFeatures], FloatArray, dict[str, str]]:
        """Return features and (n, 3) stenosis of subjects that have both, and why the others have not.

        Raises
        ------
        InputError
            If none has both.
        """
        kept: list[SegmentFeatures] = []
        rows: list[tuple[float, ...]] = []
        out = dict(self.failed)
        for subject, found in zip(self.subjects, self.features, strict=True):
            known = len(subject.stenosis) == len(_TERRITORIES) and bool(np.isfinite(subject.stenosis).all())
            if found is not None and known:
                kept.append(found)
                rows.append(subject.stenosis)
            elif found is not None:
                out[subject.name] = "the stenosis of a territory is missing"
        if not kept:
            first = next(iter(out.items()))
            message = f"none of {len(self.subjects)} subjects has features and stenosis; the first: {first}"
            raise InputError(message)
        return kept, np.array(rows), out

    def for_disease(self) -> tuple[list[SegmentFeatures], FloatArray, dict[str, str]]:
        """Return features and (n,) labels 0 or 1 of subjects that have both, and why the others have not."""
        out = dict(self.failed)
        kept = [(f, s.diseased) for f, s in zip(self.features, self.subjects, strict=True) if f is not None]
        for subject, found in zip(self.subjects, self.features, strict=True):
            if found is not None and subject.diseased not in (0, 1):
                out[subject.name] = "diseased is missing, or neither 0 nor 1"
        kept = [(f, label) for f, label in kept if label in (0, 1)]
        if not kept:
            message = (
                f"none of {len(self.subjects)} subjects has features and a label: the table needs stenosis_LAD, "
                "stenosis_LCX and stenosis_RCA, or diseased (0 or 1)"
            )
            raise InputError(message)
        return [f for f, _ in kept], np.array([label for _, label in kept]), out


def read_heart_landmarks(path: str | os.PathLike[str]) -> dict[str, FloatArray]:
    """Read landmarks: a JSON object with any of ``apex``, ``base`` (three numbers) and ``septum`` (three times three).

    Parameters
    ----------
    path : path-like
        Positions in RAS mm. Other entries are left alone, but for ``space`` and ``unit``, which must be RAS and mm.

    Returns
    -------
    dict of str to array

    Raises
    ------
    FileFormatError
        If it is not such an object.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "marks.json"
    >>> _ = path.write_text('{"apex": [1, 2, 3]}')
    >>> read_heart_landmarks(path)
    {'apex': array([1., 2., 3.])}
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, OSError) as error:
        message = f"{path}: landmarks must be a JSON file: {error}"
        raise FileFormatError(message) from error
    shapes = {"apex": (3,), "base": (3,), "septum": (3, 3)}
    if not isinstance(content, dict) or not set(content) & set(shapes):
        message = f"{path}: landmarks must be an object with any of {', '.join(shapes)}"
        raise FileFormatError(message)
    if content.get("space", "RAS") != "RAS" or content.get("unit", "mm") != "mm":
        said = f"{content.get('space', 'RAS')}, {content.get('unit', 'mm')}"
        message = f"{path}: landmarks must be in RAS mm, this file says {said}"
        raise FileFormatError(message)
    found = {}
    for name, values in ((name, content[name]) for name in shapes if name in content):
        try:
            found[name] = as_floats(values, name)
        except InputError as error:
            message = f"{path}: {error}"
            raise FileFormatError(message) from error
        if found[name].shape != shapes[name] or not np.isfinite(found[name]).all():
            message = (
                f"{path}: {name} must have shape {shapes[name]} and finite numbers, got {found[name].shape}"
            )
            raise FileFormatError(message)
    return found


def read_heart_cohort(path: str | os.PathLike[str]) -> tuple[HeartSubject, ...]:
    r"""Read a table of subjects.

    Parameters
    ----------
    path : path-like
        A CSV file with a header: ``subject``, ``mesh`` or ``volume`` (or both), and optionally ``landmarks``, ``mask``,
        ``stenosis_LAD``, ``stenosis_LCX``, ``stenosis_RCA`` (per cent) and ``diseased`` (0 or 1). Paths are taken from
        the table's folder. A cell may be empty.

    Returns
    -------
    tuple of HeartSubject

    Raises
    ------
    FileFormatError
        If a column is missing, there is no row, a number is not one, or names repeat or cannot name a file.

    Examples
    --------
    >>> import tempfile
    >>> table = Path(tempfile.mkdtemp()) / "cohort.csv"
    >>> _ = table.write_text("subject,mesh,diseased\ns1,s1.ply,1\n")
    >>> read_heart_cohort(table)[0].diseased
    1.0
    """
    path = Path(path)
    rows = table_rows(path)
    if not rows or "subject" not in rows[0] or not {"mesh", "volume"} & set(rows[0]):
        message = f"{path}: needs a row and the columns subject and mesh or volume"
        raise FileFormatError(message)
    subjects = tuple(_subject(path, i, row) for i, row in enumerate(rows))
    names = [s.name.casefold() for s in subjects]
    bad = [s.name for s in subjects if not _NAME.fullmatch(s.name)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if bad or twice:
        message = (
            f"{path}: names must be letters and digits, each once: {', '.join(map(repr, (bad + twice)[:5]))}"
        )
        raise FileFormatError(message)
    return subjects


def describe_cohort(
    subjects: Sequence[HeartSubject],
    folder: str | os.PathLike[str],
    *,
    points: int = 500,
    radius: float = 3.0,
    rng: int = 0,
    n_jobs: int | None = None,
    scheduler: Scheduler | None = None,
    progress: bool = False,
) -> HeartCohort:
    """Measure every subject's features, resuming where an earlier run stopped.

    Parameters
    ----------
    subjects : sequence of HeartSubject
        See :func:`read_heart_cohort`.
    folder : path-like
        Where each subject's features go as they are made, as ``subjects/NAME.npz``. A subject whose file was made from
        the same input, settings and version is not computed again.
    points, radius, rng
        As for :func:`endocardial_features`.
    n_jobs : int, optional
        Processes.
    scheduler : str or distributed.Client, optional
        Address of a Dask scheduler to compute on instead; workers read the same input paths.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    HeartCohort
        A subject that cannot be measured keeps its error, and the others go on.

    Raises
    ------
    InputError
        If there is no subject.

    Examples
    --------
    >>> import tempfile
    >>> from pliant import save_mesh
    >>> from pliant.heart import heart_phantom
    >>> folder = Path(tempfile.mkdtemp())
    >>> save_mesh(folder / "a.ply", heart_phantom(spacing=4.0, mesh_step=2.0, rng=1).mesh)
    >>> people = [HeartSubject("a", folder / "a.ply"), HeartSubject("b", folder / "none.ply")]
    >>> describe_cohort(people, folder, points=40, n_jobs=1)
    HeartCohort(2 subjects, 1 failed)
    """
    if not subjects:
        raise InputError("a cohort needs at least one subject")
    place = Path(folder) / "subjects"
    place.mkdir(parents=True, exist_ok=True)
    settings = {"points": points, "radius": radius, "rng": rng}
    keys = [_key(subject, settings) for subject in subjects]
    found: list[SegmentFeatures | None] = [
        _stored(place / f"{s.name}.npz", key) for s, key in zip(subjects, keys, strict=True)
    ]
    errors = [""] * len(subjects)
    missing = [i for i, features in enumerate(found) if features is None]
    work = partial(_measured, settings)
    todo = [subjects[i] for i in missing]
    options = {"description": "subjects", "progress": progress}
    results = (
        process_map(work, todo, n_jobs, **options)  # type: ignore[arg-type]
        if scheduler is None
        else map_ordered(work, todo, scheduler=scheduler, **options)  # type: ignore[arg-type]
    )
    for i, (features, error) in zip(missing, results, strict=True):
        found[i], errors[i] = features, error
        if features is not None:
            save_arrays(place / f"{subjects[i].name}.npz", _arrays(features, keys[i]))
    return HeartCohort(tuple(subjects), tuple(found), tuple(errors), {**settings, "version": __version__})


def _subject(path: Path, i: int, row: Mapping[str, str]) -> HeartSubject:
    def number(column: str) -> float:
        text = row.get(column, "")
        try:
            return float(text) if text else float("nan")
        except ValueError as error:
            message = f"{path}: row {i + 1}: {column} must be a number, got {text!r}"
            raise FileFormatError(message) from error

    files = {c: path.parent / row[c] for c in ("mesh", "volume", "landmarks", "mask") if row.get(c)}
    columns = [f"stenosis_{t}" for t in _TERRITORIES]
    stenosis = tuple(number(c) for c in columns) if set(columns) <= set(row) else ()
    return HeartSubject(row["subject"], stenosis=stenosis, diseased=number("diseased"), **files)


def _key(subject: HeartSubject, settings: Mapping[str, Any]) -> str:
    """Hash of the input files' contents, the settings and the version; empty where a file cannot be read."""
    digest = hashlib.sha256()
    used = (subject.mesh,) if subject.mesh else (subject.volume, subject.mask)
    try:
        for path in (*used, subject.landmarks):
            files = sorted(path.iterdir()) if path is not None and path.is_dir() else [path] if path else []
            for file in files:
                digest.update(f"{file.name} {file.stat().st_size}\n".encode() + file.read_bytes())
            digest.update(b"|")
    except OSError:
        return ""
    digest.update(
        json.dumps({**settings, "format": _FORMAT, "version": __version__}, sort_keys=True).encode()
    )
    return digest.hexdigest()


def _measured(settings: Mapping[str, Any], subject: HeartSubject) -> tuple[SegmentFeatures | None, str]:
    try:
        marks = read_heart_landmarks(subject.landmarks) if subject.landmarks else None
        options = {"landmarks": marks, "n_jobs": 1, **settings}
        if subject.mesh is not None:
            return describe_heart(load_mesh(subject.mesh), **options).features, ""
        if subject.volume is None:
            raise InputError("the subject has neither a mesh nor a volume")
        mask = None if subject.mask is None else load_volume(subject.mask).values > 0.5
        return describe_heart(load_volume(subject.volume), mask=mask, **options).features, ""
    except Exception as error:  # one bad subject, whatever ails it, must not end the others
        text = " ".join(str(error).split())
        return None, text if isinstance(
            error, (PliantError, OSError)
        ) and text else f"{type(error).__name__}: {text}"


def _arrays(features: SegmentFeatures, key: str) -> dict[str, Any]:
    return {
        "key": key, "values": features.values, "segments": features.segments, "vertices": features.vertices,
        "roughness": features.roughness, "areas": features.areas, "cavity_ml": np.array(features.cavity_ml),
        "axis_mm": np.array(features.axis_mm),
        "settings": json.dumps(dict(features.settings)),
    }  # fmt: skip


def _stored(path: Path, key: str) -> SegmentFeatures | None:
    """Return what a subject's file holds, or None where it is missing, damaged, or made from something else."""
    try:
        kept = load_arrays(path)
        if not key or str(kept["key"]) != key:
            return None
        return SegmentFeatures(
            kept["values"], kept["segments"], kept["vertices"], kept["roughness"], kept["areas"],
            float(kept["cavity_ml"]), json.loads(str(kept["settings"])), float(kept["axis_mm"]),
        )  # fmt: skip
    except (OSError, KeyError, ValueError, zipfile.BadZipFile):
        return None
