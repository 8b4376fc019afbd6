"""Download public data, when asked to: pinned revisions, checked digests, whole files or none."""

from __future__ import annotations

import gzip
import hashlib
import os
import urllib.error
import urllib.request
import zlib
from collections.abc import Callable
from pathlib import Path

from .._progress import progress_bar
from ..errors import InputError
from ..mesh.formats import write_atomically
from .registry import Dataset, RemoteFile
from .verifying import chosen, digest_of

__all__ = ["fetch"]

LIMIT = 64 * 2**20
_SECONDS = 60


def fetch(name: str, folder: str | os.PathLike[str], *, progress: bool = False) -> list[Path]:
    """Download the files of a data set that can be had as they are.

    Parameters
    ----------
    name : str
        As in :func:`pliant.datasets.registry`.
    folder : str or path-like
        The data folder; made if it is not there.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    list of Path
        All files of the data set that are there now. Those that were there with the right digest are left alone.

    Raises
    ------
    InputError
        If the name is unknown, nothing of the data set can be downloaded, a server does not answer, or a file is not
        the one that is known: nothing of it is kept then.

    Notes
    -----
    The only function of the library besides the retrieval service that touches a network. A file is at most 64 MB,
    before and after unpacking.

    Examples
    --------
    >>> fetch("images/pacs", "data")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    pliant.errors.InputError: images/pacs cannot be downloaded as it is...
    """
    dataset = chosen([name])[0]
    if not dataset.remote:
        message = (
            f"{name} cannot be downloaded as it is; get it from {dataset.source} ({dataset.terms}), then: "
            f"{dataset.preparation}"
        )
        raise InputError(message)
    place = Path(folder) / name
    place.mkdir(parents=True, exist_ok=True)
    kept = []
    with progress_bar(f"fetching {name}", len(dataset.remote), show=progress) as advance:
        for part in dataset.remote:
            kept.append(_fetched(dataset, part, place))
            advance()
    return kept


def _fetched(
    dataset: Dataset, part: RemoteFile, place: Path, read: Callable[[str], bytes] | None = None
) -> Path:
    target = place / part.path
    if target.is_file() and digest_of(target) == part.sha256:
        return target
    content = (read or _download)(part.url)
    if part.unpack:
        content = _unpacked(content, part.url)
    if hashlib.sha256(content).hexdigest() != part.sha256:
        message = f"{part.url} is not the file that {dataset.name} is known by; nothing of it was kept"
        raise InputError(message)
    write_atomically(target, content)
    return target


def _download(url: str) -> bytes:
    if not url.startswith("https://"):
        message = f"{url} is not an https address"
        raise InputError(message)
    try:
        with urllib.request.urlopen(url, timeout=_SECONDS) as answer:
            content: bytes = answer.read(LIMIT + 1)
    except (urllib.error.URLError, OSError) as error:
        message = f"{url} cannot be downloaded: {getattr(error, 'reason', error)}"
        raise InputError(message) from error
    if len(content) > LIMIT:
        message = f"{url} is larger than {LIMIT} bytes"
        raise InputError(message)
    return content


def _unpacked(content: bytes, url: str) -> bytes:
    """Unpack gzip, but not without end."""
    unpacker = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
    try:
        plain = unpacker.decompress(content, LIMIT + 1)
    except (zlib.error, gzip.BadGzipFile) as error:
        message = f"{url} is not a gzip file: {error}"
        raise InputError(message) from error
    if len(plain) > LIMIT or not unpacker.eof:
        message = f"{url} unpacks to more than {LIMIT} bytes, or is cut off"
        raise InputError(message)
    return plain
