"""A cohort: every subject's field at every landmark, written as it is done, resumed where it stopped."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .._arrays import FloatArray, IntArray, frozen
from .._parallel import job_count
from ..cluster import Scheduler
from ..errors import InputError
from ..geodesic import Neighbourhoods, gch
from ._work import FieldOf, Task, measured, stored
from .context import ContextSignature
from .subjects import Subject, check_names

__all__ = ["CohortResult", "study_cohort"]


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


def study_cohort(
    subjects: Sequence[Subject],
    folder: str | os.PathLike[str],
    *,
    landmarks: str | os.PathLike[str] | None = None,
    signature: ContextSignature | None = None,
    measure: FieldOf | None = None,
    n_jobs: int | None = None,
    scheduler: Scheduler | None = None,
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
    measure : callable or str, optional
        Another per-vertex signature instead of the geodesic field: takes a mesh, gives (n,) numbers. With several
        processes it must be a function of a module; its module and name stand for it when results are reused. Or
        ``"curvature"``, the surface's mean curvature, or the name of one of the subjects' maps, such as ``"sulc"``.
    n_jobs : int, optional
        Processes, one thread each; all processors by default. The result does not depend on it.
    scheduler : str or distributed.Client, optional
        A Dask cluster that measures the subjects instead, see :func:`pliant.cluster.map_ordered`; its workers must
        see the same files under the same names.
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
    check_names(subjects)
    setting = ContextSignature() if signature is None else signature
    place = Path(folder) / "subjects"
    place.mkdir(parents=True, exist_ok=True)
    common = None if landmarks is None else Path(landmarks)
    tasks = [Task(s, s.landmarks or common, setting, measure, place) for s in subjects]
    errors = measured(tasks, job_count(n_jobs), scheduler, progress=progress)
    return _gathered(tasks, errors, setting)


def _gathered(tasks: list[Task], errors: list[str], setting: ContextSignature) -> CohortResult:
    results = [None if error else stored(task.path) for task, error in zip(tasks, errors, strict=True)]
    for i, arrays in enumerate(results):
        if arrays is None and not errors[i]:
            errors[i] = f"{tasks[i].path}: the result was there and is gone"
    done = [arrays for arrays in results if arrays is not None]
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
    for i, arrays in enumerate(results):
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
