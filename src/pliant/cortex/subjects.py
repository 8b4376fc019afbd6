"""Who is in a cohort: a table, FreeSurfer's subjects folder, or BIDS derivatives."""

from __future__ import annotations

import gzip
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .._arrays import FloatArray, vertex_values
from .._tables import table_rows
from ..datasets import Hemisphere
from ..errors import FileFormatError, InputError
from ..mesh import load_arrays

__all__ = ["Subject", "check_names", "read_cohort", "read_map"]

_NAME = re.compile(r"[\w][\w.+-]*")
# Columns and files of per-vertex maps.
_MAP = "map_"
_MAPS = ("sulc", "curv", "thickness")


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
    maps : dict of str to Path
        Files of per-vertex values on the surface, such as FreeSurfer's ``sulc`` and ``curv``; see :func:`read_map`.
    """

    name: str
    mesh: Path
    group: str = ""
    landmarks: Path | None = None
    maps: dict[str, Path] = field(default_factory=dict, hash=False)


def read_cohort(
    path: str | os.PathLike[str],
    *,
    surface: str = "white",
    hemisphere: Hemisphere = "left",
    annotation: str | None = None,
) -> tuple[Subject, ...]:
    r"""Read who is in a cohort from a table, or find them in FreeSurfer's subjects folder or BIDS derivatives.

    Parameters
    ----------
    path : str or path-like
        A CSV file with a header: ``subject``, ``mesh``, and optionally ``group``, ``landmarks`` and per-vertex maps
        as ``map_NAME``; paths are taken from the table's folder. Or a folder with ``NAME/surf/lh.white``
        (FreeSurfer), or with ``sub-NAME/anat/*_hemi-L_*white.surf.gii`` (BIDS, also with sessions).
    surface : str
        Which surface of a folder: white, pial, midthickness, ...
    hemisphere : {"left", "right"}
        Which side of a folder.
    annotation : str, optional
        FreeSurfer parcellation of a folder whose parcels' centres are the landmarks, such as ``aparc``.

    Returns
    -------
    tuple of Subject
        In the table's order; by name from a folder. ``participants.tsv`` with a column ``group`` in or above a folder
        gives the groups.

    Raises
    ------
    FileFormatError
        If a column is missing, there is no row or no surface, or a subject has no mesh, several of them, a name that
        cannot name a file, or one that occurs twice.

    Notes
    -----
    A FreeSurfer subject without the surface is left in, and ends with that error when it is measured; fsaverage and its
    kin are left out. Of BIDS surfaces, those resampled to a template's vertices (``space-``, ``den-``) are not taken.

    Examples
    --------
    >>> import tempfile
    >>> table = Path(tempfile.mkdtemp()) / "cohort.csv"
    >>> _ = table.write_text("subject,mesh,map_sulc\ns1,s1.ply,s1.sulc\n")
    >>> read_cohort(table)[0].name, read_cohort(table)[0].maps["sulc"].name
    ('s1', 's1.sulc')
    """
    path = Path(path)
    subjects = _from_folder(path, surface, hemisphere, annotation) if path.is_dir() else _from_table(path)
    try:
        check_names(subjects)
    except InputError as error:
        message = f"{path}: {error}"
        raise FileFormatError(message) from error
    return tuple(subjects)


def check_names(subjects: Sequence[Subject]) -> None:
    """Raise :class:`InputError` unless every name can name a file of its own."""
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


def read_map(path: str | os.PathLike[str], n_vertices: int) -> FloatArray:
    r"""Read one value a vertex from a file.

    Parameters
    ----------
    path : str or path-like
        FreeSurfer's per-vertex data (``lh.sulc``, also gzipped), or the first array of an ``.npz`` or ``.gii`` file.
    n_vertices : int
        How many the surface has.

    Returns
    -------
    (n_vertices,) array of float

    Raises
    ------
    FileFormatError
        If the file is not of these kinds, or cut short.
    InputError
        If it does not have one finite value a vertex.

    Examples
    --------
    >>> import tempfile
    >>> from pliant import save_arrays
    >>> path = Path(tempfile.mkdtemp()) / "depth.shape.gii"
    >>> save_arrays(path, {"depth": [1.0, 2.5]})
    >>> read_map(path, 2).tolist()
    [1.0, 2.5]
    """
    path = Path(path)
    if path.suffix.lower() in (".npz", ".gii"):
        arrays = load_arrays(path)
        if not arrays:
            message = f"{path}: holds no array"
            raise FileFormatError(message)
        values = next(iter(arrays.values()))
    else:
        values = _freesurfer_map(path)
    return vertex_values(values, n_vertices, path.name)


def _freesurfer_map(path: Path) -> FloatArray:
    data = path.read_bytes()
    try:
        data = gzip.decompress(data) if path.suffix == ".gz" else data
    except (gzip.BadGzipFile, EOFError) as error:
        message = f"{path}: not a gzip file, or cut short: {error}"
        raise FileFormatError(message) from error
    # The new curvature format: magic, vertices, faces, values a vertex, then floats.
    head = np.frombuffer(data[3:15], dtype=">i4") if len(data) >= 15 else np.zeros(3, dtype=">i4")
    if data[:3] != b"\xff\xff\xff" or head[0] < 0 or head[2] != 1 or len(data) < 15 + 4 * int(head[0]):
        message = f"{path}: not FreeSurfer's per-vertex data, or cut short: {len(data)} bytes"
        raise FileFormatError(message)
    return np.frombuffer(data, dtype=">f4", count=int(head[0]), offset=15).astype(np.float64)


def _from_table(path: Path) -> list[Subject]:
    rows = table_rows(path)
    missing = {"subject", "mesh"} - set(rows[0] if rows else ())
    if missing:
        message = (
            f"{path}: needs a row and the columns subject and mesh; missing {', '.join(sorted(missing))}"
        )
        raise FileFormatError(message)
    return [_from_row(path, i, row) for i, row in enumerate(rows)]


def _from_row(path: Path, i: int, cells: dict[str, str]) -> Subject:
    if not cells.get("mesh"):
        message = f"{path}: row {i + 1} names no mesh"
        raise FileFormatError(message)
    own = path.parent / cells["landmarks"] if cells.get("landmarks") else None
    maps = {
        key.removeprefix(_MAP): path.parent / value
        for key, value in cells.items()
        if key.startswith(_MAP) and value
    }
    return Subject(cells.get("subject", ""), path.parent / cells["mesh"], cells.get("group", ""), own, maps)


def _from_folder(folder: Path, surface: str, hemisphere: str, annotation: str | None) -> list[Subject]:
    people = sorted(place for place in folder.iterdir() if (place / "surf").is_dir())
    # FreeSurfer puts links to its templates among the subjects.
    people = [place for place in people if not re.match(r"fsaverage|[lr]h\.EC_average", place.name)]
    groups = _groups(folder)
    if people:
        side = {"left": "lh", "right": "rh"}[hemisphere]
        return [_freesurfer(place, side, surface, annotation, groups) for place in people]
    letter = {"left": "L", "right": "R"}[hemisphere]
    found = sorted(folder.glob(f"sub-*/**/anat/sub-*_hemi-{letter}_*.surf.gii"))
    found = [path for path in found if _is_native(path, surface)]
    if not found:
        wanted = f"sub-NAME/anat/sub-*_hemi-{letter}_*{surface}.surf.gii"
        message = f"{folder}: holds neither NAME/surf (FreeSurfer) nor {wanted}"
        raise FileFormatError(message)
    names = [_bids_name(path) for path in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        message = (
            f"{folder}: {len(twice)} subjects have several {surface} surfaces, first {twice[0]}; use a table"
        )
        raise FileFormatError(message)
    return [_bids(path, name, surface, groups) for path, name in zip(found, names, strict=True)]


def _freesurfer(
    place: Path, side: str, surface: str, annotation: str | None, groups: dict[str, str]
) -> Subject:
    maps = {name: place / "surf" / f"{side}.{name}" for name in _MAPS}
    own = place / "label" / f"{side}.{annotation}.annot" if annotation else None
    return Subject(
        place.name,
        place / "surf" / f"{side}.{surface}",
        groups.get(place.name, ""),
        own,
        {name: path for name, path in maps.items() if path.is_file()},
    )


def _is_native(path: Path, surface: str) -> bool:
    parts = path.name.removesuffix(".surf.gii").split("_")
    return parts[-1] in (surface, f"desc-{surface}") and not any(
        part.startswith(("space-", "den-")) for part in parts
    )


def _bids_name(path: Path) -> str:
    return "_".join(part for part in path.name.split("_") if part.startswith(("sub-", "ses-")))


def _bids(path: Path, name: str, surface: str, groups: dict[str, str]) -> Subject:
    stem = path.name.removesuffix(f"{surface}.surf.gii")
    maps = {key: path.with_name(f"{stem}{key}.shape.gii") for key in _MAPS}
    group = groups.get(name.split("_")[0], "")
    return Subject(name, path, group, None, {key: file for key, file in maps.items() if file.is_file()})


def _groups(folder: Path) -> dict[str, str]:
    for table in (folder / "participants.tsv", folder.parent / "participants.tsv"):
        if table.is_file():
            rows = table_rows(table, delimiter="\t")
            return {row.get("participant_id", ""): row.get("group", "").replace("n/a", "") for row in rows}
    return {}
