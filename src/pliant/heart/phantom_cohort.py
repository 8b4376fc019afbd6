"""Cohorts of phantoms: stenoses drawn at random, one heart a subject, and the files a study reads."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import FloatArray, IntArray, frozen
from .._progress import progress_bar
from ..errors import InputError
from ..mesh import save_mesh
from ..mesh.formats import write_atomically
from ._volume_files import write_image
from .phantom import Change, HeartPhantom, heart_phantom
from .volume import save_mask

__all__ = ["PhantomCohort", "phantom_cohort"]

_TERRITORIES = ("LAD", "LCX", "RCA")
# A territory narrowed this much or more counts as diseased.
_DISEASED = 70.0


@dataclass(frozen=True, eq=False)
class PhantomCohort:
    """How to make each subject, and the truth; iterate over it for the phantoms.

    Parameters
    ----------
    stenosis : (count, 3) array of float
        Per cent, of the territories LAD, LCX and RCA.
    seeds : (count,) array of int
        Of each subject's heart.
    change : str or mapping
        What stenosis does; see :func:`heart_phantom`.
    options : mapping
        Further arguments of :func:`heart_phantom`.
    """

    stenosis: FloatArray
    seeds: IntArray
    change: Change | Mapping[str, float]
    options: Mapping[str, Any]

    def __post_init__(self) -> None:
        object.__setattr__(self, "stenosis", frozen(self.stenosis))
        object.__setattr__(self, "seeds", frozen(self.seeds))

    def __len__(self) -> int:
        return len(self.seeds)

    def __iter__(self) -> Iterator[HeartPhantom]:
        return (self.subject(i) for i in range(len(self)))

    @property
    def names(self) -> list[str]:
        """Name of each subject, as its files have it."""
        return [f"p{i:03d}" for i in range(len(self))]

    @property
    def diseased(self) -> IntArray:
        """(count,) 1 where a territory is narrowed by 70 % or more, else 0."""
        return np.asarray((self.stenosis >= _DISEASED).any(axis=1), dtype=np.int64)

    def subject(self, i: int) -> HeartPhantom:
        """Make one subject, the same whatever was made before."""
        return heart_phantom(
            stenosis=self.stenosis[i], change=self.change, rng=int(self.seeds[i]), **dict(self.options)
        )

    def save(self, folder: str | Path, *, volumes: bool = True, progress: bool = False) -> Path:
        """Write every subject and the table of subjects; return the table's path.

        Parameters
        ----------
        folder : path-like
            Made if it is not there. A subject whose landmarks are there already is left as it is.
        volumes : bool
            Whether to write CT volumes and masks, 10 MB a subject at 1 mm, and not only meshes.
        progress : bool
            Whether to show a bar.

        Returns
        -------
        Path
            ``cohort.csv``: subject, volume, mesh, landmarks, segments, mask (file names), the stenosis of each
            territory in per cent, and whether it is diseased.
        """
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        with progress_bar("phantoms", len(self), show=progress) as advance:
            for i, name in enumerate(self.names):
                if not (place / f"{name}.landmarks.json").exists():
                    _save_subject(place, name, self.subject(i), volumes)
                advance()
        table = place / "cohort.csv"
        write_atomically(table, self._table(volumes).encode())
        return table

    def _table(self, volumes: bool) -> str:
        text = io.StringIO(newline="")
        writer = csv.writer(text, lineterminator="\n")
        files = {"volume": ".nii.gz", "mask": ".mask.nii.gz"} if volumes else {}
        files |= {"mesh": ".ply", "landmarks": ".landmarks.json", "segments": ".segments.csv"}
        stenoses = [f"stenosis_{t}" for t in _TERRITORIES]
        writer.writerow(["subject", *files, *stenoses, "diseased", *(f"diseased_{t}" for t in _TERRITORIES)])
        for name, row, ill in zip(self.names, self.stenosis, self.diseased, strict=True):
            parts = (row >= _DISEASED).astype(int).tolist()
            writer.writerow([name, *(name + e for e in files.values()), *row.round(1).tolist(), ill, *parts])
        return text.getvalue()


def phantom_cohort(
    count: int = 32,
    *,
    change: Change | Mapping[str, float] = "mixed",
    rng: np.random.Generator | int | None = None,
    **options: Any,
) -> PhantomCohort:
    """Draw a cohort: half without disease, half with one to three diseased territories.

    Parameters
    ----------
    count : int
        Subjects, at least 2.
    change : str or mapping
        What stenosis does to trabeculae; ``"none"`` makes a cohort in which nothing is to be found.
    rng : numpy.random.Generator or int, optional
        Seed of the stenoses and of every heart.
    **options
        Further arguments of :func:`heart_phantom`, as ``spacing`` or ``mesh_step``.

    Returns
    -------
    PhantomCohort
        Nothing is made until it is iterated over or saved.

    Raises
    ------
    InputError
        If the count is below 2 or an option is the cohort's own.

    Notes
    -----
    Without disease every territory is narrowed by 0 to 30 %; with it, diseased territories by 70 to 100 % (70 % is
    the limit of the dissertation, section 5.5) and the others by 0 to 50 %.

    Examples
    --------
    >>> cohort = phantom_cohort(4, rng=0, spacing=8.0, mesh_step=4.0)
    >>> cohort.diseased.tolist()
    [0, 1, 0, 1]
    >>> len([phantom.mesh for phantom in cohort])
    4
    """
    own = sorted({"stenosis", "rng"} & set(options))
    if count < 2 or own:
        what = f"options {own} are drawn by the cohort itself" if own else f"needs 2 subjects, got {count}"
        raise InputError(what)
    generator = np.random.default_rng(rng)
    stenosis = generator.uniform(0, 30, (count, 3))
    for i in range(1, count, 2):
        ill = generator.permutation(3)[: generator.integers(1, 4)]
        stenosis[i] = generator.uniform(0, 50, 3)
        stenosis[i, ill] = generator.uniform(70, 100, len(ill))
    seeds = generator.integers(0, 2**32, count)
    return PhantomCohort(stenosis, seeds, change, dict(options))


def _save_subject(place: Path, name: str, phantom: HeartPhantom, volumes: bool) -> None:
    if volumes:
        write_image(place / f"{name}.nii.gz", phantom.volume.values.astype(np.int16), phantom.volume.affine)
        save_mask(phantom.mask, phantom.volume, place / f"{name}.mask.nii.gz")
    save_mesh(place / f"{name}.ply", phantom.mesh)
    rows = "vertex,segment\n" + "".join(f"{i},{s}\n" for i, s in enumerate(phantom.labels.tolist()))
    write_atomically(place / f"{name}.segments.csv", rows.encode())
    marks = {key: points.round(6).tolist() for key, points in phantom.landmarks.items()}
    record = {**marks, "unit": "mm", "space": "RAS", "phantom": dict(phantom.settings)}
    # Written last: its presence says that the subject is whole.
    write_atomically(place / f"{name}.landmarks.json", json.dumps(record, indent=1).encode())
