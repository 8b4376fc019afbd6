"""Parcellations: a label for each vertex and a name for each label, from FreeSurfer and GIFTI."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .._arrays import IntArray, as_indices
from ..errors import FileFormatError
from .formats import file_bytes

__all__ = ["Parcellation", "load_parcellation"]

ANNOTATIONS = (".annot", ".annot.gz")


@dataclass(frozen=True, eq=False)
class Parcellation:
    """A label for each vertex, and what labels are called.

    Parameters
    ----------
    labels : (n,) array of int
        Label of each vertex; -1 for none.
    names : dict of int to str
        Names of labels, also of some that no vertex may have.

    Examples
    --------
    >>> Parcellation(np.array([0, 1, -1]), {0: "left", 1: "right"}).names[1]
    'right'
    """

    labels: IntArray
    names: dict[int, str]


def load_parcellation(path: str | os.PathLike[str]) -> Parcellation:
    """Read a parcellation: FreeSurfer's ``.annot``, also gzipped, or GIFTI's ``.label.gii``.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    Parcellation

    Raises
    ------
    FileFormatError
        If the file is missing, cut short, or holds no labels with names.

    Examples
    --------
    >>> import tempfile
    >>> from nibabel.freesurfer import write_annot
    >>> path = Path(tempfile.mkdtemp()) / "lh.halves.annot"
    >>> colours = np.array([[200, 0, 0, 0, 0], [0, 200, 0, 0, 0]])
    >>> write_annot(path, np.array([0, 1, 1]), colours, ["front", "back"], fill_ctab=True)
    >>> found = load_parcellation(path)
    >>> found.labels.tolist(), found.names
    ([0, 1, 1], {0: 'front', 1: 'back'})
    """
    path = Path(path)
    if path.name.lower().endswith(ANNOTATIONS):
        return _annotation(path)
    return _gifti_labels(path)


def _annotation(path: Path) -> Parcellation:
    from nibabel.freesurfer import read_annot

    content = file_bytes(path)
    if len(content) < 8 or len(content) < 4 + 8 * int.from_bytes(content[:4], "big"):
        message = f"{path}: not an annotation, or cut short: {len(content)} bytes"
        raise FileFormatError(message)
    try:
        with tempfile.NamedTemporaryFile(suffix=".annot") as plain:
            plain.write(content)
            plain.flush()
            labels, _, names = read_annot(plain.name)
    except Exception as error:  # the reader's own: whatever its arrays and strings come to
        message = f"{path}: not an annotation: {type(error).__name__}: {error}"
        raise FileFormatError(message) from error
    called = {i: name.decode("utf-8", "replace") for i, name in enumerate(names)}
    return Parcellation(as_indices(labels, "labels"), called)


def _gifti_labels(path: Path) -> Parcellation:
    import nibabel

    content = file_bytes(path)
    try:
        image = nibabel.gifti.GiftiImage.from_bytes(content)
        arrays = [array.data for array in image.darrays]
        names = {int(key): str(name) for key, name in image.labeltable.get_labels_as_dict().items()}
    except Exception as error:  # the reader's own, XML's, base64's and zlib's
        message = f"{path}: not a GIFTI parcellation: {type(error).__name__}: {error}"
        raise FileFormatError(message) from error
    if not arrays or not np.issubdtype(arrays[0].dtype, np.integer) or not names:
        message = f"{path}: holds no parcellation: a label file has a table of names and whole numbers"
        raise FileFormatError(message)
    labels = np.ravel(arrays[0]).astype(np.int64)
    # A label without a name is none: GIFTI writes them as 0 or -1, and has no rule.
    return Parcellation(np.where(np.isin(labels, list(names)), labels, -1), names)
