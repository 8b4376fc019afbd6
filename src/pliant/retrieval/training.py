"""From folders of pictures to a model: pairs, consistent features, words, codes (section 6.4.1)."""

from __future__ import annotations

import os
import tempfile
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np
from sklearn.base import clone

from .._arrays import BoolArray, FloatArray, IntArray
from .._processes import process_map
from ..cluster import Scheduler, map_ordered
from ..errors import InputError, PliantWarning
from ._coder import Coder
from ._features import Collection, FeatureStore, Tables, read_collection, shared_tables
from .discriminative import DiscriminativeBinaryCodes
from .model import RetrievalModel
from .vocabulary import Vocabulary

__all__ = [
    "Examples",
    "Workers",
    "chosen_pairs",
    "drawn_too",
    "learned_vocabulary",
    "opened_store",
    "prepared",
    "train_retrieval",
]

Folder: TypeAlias = str | os.PathLike[str]
T = TypeVar("T")

# Share of the features found again that words are learned from, the likest.
_CLOSEST = 0.6
# Every picture's points are drawn from this seed, in training and afterwards.
_POINT_SEED = 0


@dataclass(frozen=True)
class Workers:
    """Who does the work: processes of this machine, or a cluster."""

    n_jobs: int | None = None
    scheduler: Scheduler | None = None
    progress: bool = False

    def map(self, work: Callable[[T], str], items: Sequence[T], description: str) -> list[str]:
        """Do each item's work; return what each says."""
        if self.scheduler is not None:
            return list(
                map_ordered(
                    work, items, scheduler=self.scheduler, description=description, progress=self.progress
                )
            )
        return list(process_map(work, items, self.n_jobs, description=description, progress=self.progress))


def train_retrieval(
    source: Folder | Sequence[tuple[Folder, str]],
    *,
    bits: int = 128,
    codes: Coder | None = None,
    n_words: int = 1000,
    points: int = 600,
    train_per_class: int | None = None,
    pairs_per_class: int = 10,
    drawings: bool = True,
    cache: Folder | None = None,
    rng: int | np.random.Generator = 0,
    n_jobs: int | None = None,
    scheduler: Scheduler | None = None,
    progress: bool = False,
) -> RetrievalModel:
    """Learn words and codes from pictures sorted into classes.

    In each class random pairs are matched (:func:`pliant.match_pair`). Points that lie in the part that both pictures
    of a pair share are consistent. Where the match takes a point of one picture to a point of the other that looks
    alike, the two are one feature seen twice: words are learned from the means of such twos, the closer
    three fifths of them. Each word weighs as much as the share of its points that are consistent. Histograms of the
    words, with the classes, give the codes.

    Parameters
    ----------
    source : folder, or sequence of (path, class)
        ``FOLDER/class/picture.jpg``.
    bits : int
        Length of the codes; not used where ``codes`` is given.
    codes : estimator, optional
        Kind of codes, not fitted. Default: :class:`DiscriminativeBinaryCodes`.
    n_words : int
        Size of the vocabulary.
    points : int
        Points described in each picture at most.
    train_per_class : int, optional
        Pictures drawn from each class at most; all by default.
    pairs_per_class : int
        Pairs matched in each class, about 0.5 s each. 0 uses all points alike.
    drawings : bool
        Give codes that learn from labels an outline drawing of each picture as one more example of its class
        (:func:`pliant.retrieval.outline_drawing`), so that drawings find photographs. 0.05 s a picture.
    cache : folder, optional
        Where descriptors and matches are kept, by content; with one, training that was interrupted goes on. A
        cluster's workers must see it, and the pictures, under the same path. Default: a temporary folder.
    rng : int or Generator
        Seed of the draw of pictures, pairs, words and codes.
    n_jobs : int, optional
        Processes; all processors by default. The result does not depend on it.
    scheduler : str or distributed.Client, optional
        A Dask cluster to do the work instead.
    progress : bool
        Show a bar on a terminal.

    Returns
    -------
    RetrievalModel
        ``settings["left_out"]`` says which pictures could not be used, and why.

    Raises
    ------
    InputError
        If the folder is missing or empty, there are fewer than two classes with a usable picture, or an option
        is out of range.

    Warns
    -----
    PliantWarning
        If no pair could be matched, so that all points count alike.

    Notes
    -----
    About 0.04 s a picture, 0.5 s a pair, a few seconds for the words, and 0.02 s a bit for 1,000 pictures. Memory: the
    histograms, 8 n_words bytes a picture, and 100,000 descriptors.

    References
    ----------
    Section 6.4.1 of the dissertation.

    Examples
    --------
    >>> import tempfile
    >>> from PIL import Image
    >>> root = Path(tempfile.mkdtemp())
    >>> for kind, period in (("fine", 6), ("coarse", 17)):
    ...     (root / kind).mkdir()
    ...     for i in range(3):
    ...         stripes = 127 * (1 + np.sin(2 * np.pi * (np.arange(64) + 2 * i) / period))
    ...         Image.fromarray(np.tile(stripes, (48, 1)).astype(np.uint8)).save(root / kind / f"{i}.png")
    >>> model = train_retrieval(root, bits=16, n_words=20, pairs_per_class=1, n_jobs=1)
    >>> model.encode([root / "fine" / "0.png"]).shape
    (1, 2)
    """
    generator = np.random.default_rng(rng)
    collection = read_collection(source)
    workers = Workers(n_jobs, scheduler, progress)
    with opened_store(cache, points) as store:
        chosen = _drawn(collection.labels, train_per_class, generator)
        left_out = prepared(collection, chosen, store, workers, drawings=drawings)
        kept = np.array([i for i in chosen if i not in left_out], dtype=np.int64)
        _check_classes(collection.labels[kept], left_out, collection)
        seed = _seed(generator)
        drawn = drawn_too(collection, kept, store, workers) if drawings else kept[:0]
        vocabulary, failed = learned_vocabulary(
            collection, kept, store, workers, Vocabulary(n_words, rng=seed), pairs_per_class, seed
        )
        examples = Examples.counted(collection, kept, drawn, store, vocabulary)
    coder = clone(DiscriminativeBinaryCodes(bits, rng=_seed(generator)) if codes is None else codes)
    examples.teach(coder)
    settings = {
        "points": points,
        "seed": _POINT_SEED,
        "classes": sorted({str(label) for label in collection.labels[kept]}),
        "pictures": len(kept),
        "pairs_per_class": pairs_per_class,
        "drawings": len(drawn),
        "left_out": {str(collection.paths[i]): why for i, why in sorted(left_out.items())} | failed,
    }
    return RetrievalModel(vocabulary, coder, settings)


@contextmanager
def opened_store(cache: Folder | None, points: int) -> Iterator[FeatureStore]:
    """Yield a store in the folder, or in a temporary one."""
    if cache is not None:
        place = Path(cache)
        place.mkdir(parents=True, exist_ok=True)
        yield FeatureStore(place, points, _POINT_SEED)
        return
    with tempfile.TemporaryDirectory(prefix="pliant-") as place_name:
        yield FeatureStore(Path(place_name), points, _POINT_SEED)


def prepared(
    collection: Collection, chosen: IntArray, store: FeatureStore, workers: Workers, *, drawings: bool = False
) -> dict[int, str]:
    """Describe the chosen pictures, and drawings of them; return why some cannot be, by their number."""
    items = [(collection.paths[i], collection.digests[i]) for i in chosen]
    work = store.describe_and_draw if drawings else store.describe
    said = workers.map(work, items, "describing pictures")
    return {int(i): why for i, why in zip(chosen, said, strict=True) if why}


def drawn_too(collection: Collection, kept: IntArray, store: FeatureStore, workers: Workers) -> IntArray:
    """Describe an outline drawing of each picture; return those of which one can be drawn."""
    waiting = [i for i in kept if not store.is_drawn(collection.digests[i])]
    items = [(collection.paths[i], collection.digests[i]) for i in waiting]
    said = workers.map(store.draw, items, "drawing outlines") if items else []
    blank = {i for i, why in zip(waiting, said, strict=True) if why}
    return np.array([i for i in kept if i not in blank], dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Examples:
    """Histograms to learn codes from.

    Attributes
    ----------
    pictures, drawings : (n, d), (m, d) array of float
    labels, drawn_labels : (n,), (m,) array of str
    """

    pictures: FloatArray
    labels: np.ndarray[Any, Any]
    drawings: FloatArray
    drawn_labels: np.ndarray[Any, Any]

    @classmethod
    def counted(
        cls,
        collection: Collection,
        kept: IntArray,
        drawn: IntArray,
        store: FeatureStore,
        vocabulary: Vocabulary,
    ) -> Examples:
        """Count the words of pictures, and of their drawings."""
        own, others = ([collection.digests[i] for i in rows] for rows in (kept, drawn))
        return cls(
            vocabulary.transform(Tables(store, own)),
            collection.labels[kept],
            vocabulary.transform(Tables(store, others, "drawing")),
            collection.labels[drawn],
        )

    def teach(self, coder: Coder) -> None:
        """Fit codes; those that use labels to drawings too, the others to what will be searched, the pictures."""
        if coder.learns_from_labels and len(self.drawings):
            coder.fit(
                np.concatenate([self.pictures, self.drawings]),
                np.concatenate([self.labels, self.drawn_labels]),
            )
        else:
            coder.fit(self.pictures, self.labels)


def learned_vocabulary(
    collection: Collection,
    kept: IntArray,
    store: FeatureStore,
    workers: Workers,
    vocabulary: Vocabulary,
    pairs_per_class: int,
    seed: int,
) -> tuple[Vocabulary, dict[str, str]]:
    """Fit a vocabulary on what pairs of the kept pictures share; return also which pairs failed, and why."""
    pairs = chosen_pairs(collection.labels[kept], pairs_per_class, seed)
    numbers = [(int(kept[i]), int(kept[j])) for i, j in pairs]
    items = [tuple((collection.paths[i], collection.digests[i]) for i in pair) for pair in numbers]
    said = workers.map(store.compare, items, "matching pairs")  # type: ignore[arg-type]
    failed, matched = {}, []
    for (i, j), why in zip(numbers, said, strict=True):
        if why:
            failed[f"{collection.paths[i]} with {collection.paths[j]}"] = why
        else:
            matched.append((i, j))
    flags = _consistent(collection, matched, store)
    digests = [(collection.digests[i], collection.digests[j]) for i, j in matched]
    if not any(len(store.found_again(*pair)[0]) for pair in digests):
        if pairs_per_class:
            message = "no pair of pictures shares anything: all points count alike"
            warnings.warn(message, PliantWarning, stacklevel=3)
        return vocabulary.fit(Tables(store, [collection.digests[i] for i in kept])), failed
    consistent = sorted(flags)
    tables = Tables(store, [collection.digests[i] for i in consistent])
    shared = shared_tables(store, digests, _CLOSEST)
    return vocabulary.fit(tables, consistent=[flags[i] for i in consistent], shared=shared), failed


def _consistent(
    collection: Collection, pairs: Sequence[tuple[int, int]], store: FeatureStore
) -> dict[int, BoolArray]:
    """Return for each picture of the pairs which of its points lie in a part shared with any other."""
    flags: dict[int, BoolArray] = {}
    for pair in pairs:
        found = store.shared(*(collection.digests[i] for i in pair))
        for number, own in zip(pair, found, strict=True):
            flags[number] = own | flags.get(number, np.zeros(len(own), dtype=bool))
    return flags


def chosen_pairs(labels: Sequence[str] | np.ndarray[Any, Any], count: int, seed: int) -> IntArray:
    """Return up to ``count`` different random pairs of rows of each class, using rows as evenly as may be.

    A class's pairs do not depend on which other classes there are.
    """
    if count < 0:
        message = f"pairs_per_class must not be negative, got {count}"
        raise InputError(message)
    chosen: list[tuple[int, int]] = []
    for label in np.unique(labels):
        members = np.flatnonzero(np.asarray(labels) == label)
        rng = np.random.default_rng([seed, zlib.crc32(str(label).encode())])
        possible = len(members) * (len(members) - 1) // 2
        taken: dict[tuple[int, int], None] = {}
        if count >= possible:
            taken = dict.fromkeys(combinations(members.tolist(), 2))
        while len(taken) < min(count, possible):
            order = rng.permutation(members).tolist()
            for one, two in zip(order[::2], order[1::2], strict=False):
                if len(taken) < count:
                    taken[(min(one, two), max(one, two))] = None
        chosen.extend(taken)
    return np.array(chosen, dtype=np.int64).reshape(-1, 2)


def _drawn(labels: np.ndarray[Any, Any], most: int | None, rng: np.random.Generator) -> IntArray:
    if most is not None and most < 1:
        message = f"train_per_class must be 1 or more, got {most}"
        raise InputError(message)
    chosen = []
    for label in np.unique(labels):
        members = np.flatnonzero(labels == label)
        chosen.append(members if most is None else np.sort(rng.permutation(members)[:most]))
    return np.concatenate(chosen)


def _check_classes(labels: np.ndarray[Any, Any], left_out: dict[int, str], collection: Collection) -> None:
    if len(np.unique(labels)) < 2:
        why = "".join(f"; {collection.paths[i]}: {text}" for i, text in list(left_out.items())[:1])
        message = f"two classes with a usable picture are needed, got {len(np.unique(labels))}{why}"
        raise InputError(message)


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(2**31))
