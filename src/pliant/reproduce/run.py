"""Run experiments one after another: what is done is kept, what fails is said, the rest goes on."""

from __future__ import annotations

import hashlib
import json
import os
import time
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from .._progress import progress_bar
from ..errors import InputError, PliantError
from ..mesh.formats import write_atomically
from ._closure import closure
from .bench import Bench, Picture
from .catalogue import experiments
from .findings import Experiment, Findings

__all__ = ["Outcome", "reproduce"]

RESULTS = "results"


@dataclass(frozen=True, eq=False)
class Outcome:
    """An experiment with what it found.

    Parameters
    ----------
    experiment : Experiment
        What was asked.
    findings : Findings
        What was found.
    pictures : tuple of Picture
        Files beside the result.
    seconds : float
        How long it took when it was computed.
    reused : bool
        Whether it was taken from an earlier run on the same data, settings and code.
    """

    experiment: Experiment
    findings: Findings
    pictures: tuple[Picture, ...]
    seconds: float
    reused: bool


def reproduce(
    names: Sequence[str] = (),
    *,
    folder: str | os.PathLike[str],
    data: str | os.PathLike[str] | None = None,
    quick: bool = False,
    rng: int = 0,
    progress: bool = False,
) -> list[Outcome]:
    """Measure the dissertation's tables and figures again and write a report.

    Parameters
    ----------
    names : sequence of str
        Experiments, as ``"table-2.2"``, tables and figures that one of them covers, as ``"figure-2.9"``, or chapters,
        as ``"chapter-2"``; all by default.
    folder : str or path-like
        Where ``report.html``, ``verdicts.json``, ``verdicts.md`` and the results go; made if it is not there.
    data : str or path-like, optional
        The evaluation data (see :func:`pliant.datasets.registry`). Without it synthetic shapes and what installed
        packages ship stand in; experiments that nothing can stand in for are listed as not tested.
    quick : bool
        Fewer shapes, draws and subjects: minutes in place of hours.
    rng : int
        Seed.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    list of Outcome
        In the dissertation's order.

    Raises
    ------
    InputError
        If a name is unknown or the data folder is not there.

    Notes
    -----
    Each result is written as it is done. It is reused as long as the modules it imports, the files it may read, the
    seed and ``quick`` are the same, so a run that was stopped goes on. An experiment that fails is reported as not
    tested, with its error, and the others go on. The report holds all results of the folder that still stand, those
    asked for now and those of earlier runs.

    Examples
    --------
    >>> import tempfile
    >>> place = Path(tempfile.mkdtemp())
    >>> done = reproduce(["figure-3.4"], folder=place, quick=True)
    >>> done[0].experiment.name, (place / "report.html").is_file()
    ('figure-3.4', True)
    """
    from .page import write_report

    wanted = chosen(names)
    source = None if data is None else Path(data)
    if source is not None and not source.is_dir():
        message = f"the data folder {source} does not exist"
        raise InputError(message)
    place = Path(folder)
    (place / RESULTS).mkdir(parents=True, exist_ok=True)
    done = []
    with progress_bar("reproducing", len(wanted), show=progress) as advance:
        for experiment in wanted:
            done.append(_outcome(experiment, place / RESULTS, source, quick, rng))
            advance()
    # What an earlier run on the same code, data and settings left in the folder belongs in its report too.
    asked = {outcome.experiment.name: outcome for outcome in done}
    every = [asked.get(e.name) or _kept(e, place / RESULTS, source, quick, rng) for e in experiments()]
    write_report(place, [found for found in every if found], quick=quick, data=source is not None)
    return done


def chosen(names: Sequence[str]) -> list[Experiment]:
    """Return the experiments that these names mean, all for none."""
    known = experiments()
    wanted: set[str] = set()
    for name in names:
        matches = [e.name for e in known if name in (e.name, *e.covers, f"chapter-{e.chapter}")]
        if not matches:
            chapters = sorted({f"chapter-{e.chapter}" for e in known})
            also = [f"{other} (in {e.name})" for e in known for other in e.covers]
            message = (
                f"no experiment is called {name!r}; there are {', '.join(e.name for e in known)}, the chapters "
                f"{', '.join(chapters)}, and what others cover: {', '.join(also)}"
            )
            raise InputError(message)
        wanted.update(matches)
    return [e for e in known if not names or e.name in wanted]


def _outcome(experiment: Experiment, place: Path, data: Path | None, quick: bool, seed: int) -> Outcome:
    kept = _kept(experiment, place, data, quick, seed)
    if kept is not None:
        return kept
    file, key = place / f"{experiment.name}.json", _key(experiment, data, quick, seed)
    bench = Bench(experiment.name, place, data, quick, seed)
    start = time.perf_counter()
    findings, final = _measured(experiment, bench)
    seconds = round(time.perf_counter() - start, 1)
    record = {
        # What failed for want of memory or of a package may do better next time.
        "key": key if final else "",
        "name": experiment.name,
        "findings": findings.as_dict(),
        "pictures": [asdict(picture) for picture in bench.pictures],
        "seconds": seconds,
    }
    write_atomically(file, json.dumps(record, indent=1, allow_nan=False).encode())
    return Outcome(experiment, findings, tuple(bench.pictures), seconds, False)


def _kept(experiment: Experiment, place: Path, data: Path | None, quick: bool, seed: int) -> Outcome | None:
    kept = _stored(place / f"{experiment.name}.json", _key(experiment, data, quick, seed))
    if kept is None:
        return None
    pictures = tuple(Picture(**picture) for picture in kept["pictures"])
    return Outcome(experiment, Findings.from_dict(kept["findings"]), pictures, kept["seconds"], True)


def _measured(experiment: Experiment, bench: Bench) -> tuple[Findings, bool]:
    absent = [part for part in experiment.needs if bench.path(part) is None]
    if absent:
        reason = f"It needs {', '.join(absent)} of the evaluation data, which nothing here can stand in for."
        return Findings("not tested", reason, "none"), True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return experiment.run(bench), True
    except (PliantError, OSError, MemoryError, ImportError, ArithmeticError, ValueError) as error:
        return Findings("not tested", f"It failed: {type(error).__name__}: {error}", "none"), False


def _stored(file: Path, key: str) -> dict[str, Any] | None:
    try:
        record: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    whole = record.get("key") == key and all((file.parent / p["file"]).is_file() for p in record["pictures"])
    return record if whole else None


def _key(experiment: Experiment, data: Path | None, quick: bool, seed: int) -> str:
    digest = hashlib.sha256(f"{experiment.name} {quick} {seed} {_code(experiment.run.__module__)}".encode())
    for part in (*experiment.needs, *experiment.uses):
        place = None if data is None else data / part
        for path in _files(place):
            facts = path.stat()
            # Names, sizes and times stand for content: the whole data take a minute to read.
            digest.update(f"{path.relative_to(data or path)} {facts.st_size} {facts.st_mtime_ns}".encode())
    return digest.hexdigest()


def _files(place: Path | None) -> Iterable[Path]:
    if place is None or not place.exists():
        return []
    return [place] if place.is_file() else sorted(p for p in place.rglob("*") if p.is_file())


@cache
def _code(module: str) -> str:
    digest = hashlib.sha256()
    for path in closure(module):
        digest.update(path.read_bytes())
    return digest.hexdigest()
