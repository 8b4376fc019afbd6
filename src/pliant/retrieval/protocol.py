"""The protocol of section 6.5.5: kinds of codes over repeated splits, with intervals, and classes never trained on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .._arrays import FloatArray, IntArray, frozen
from ..cluster import Scheduler
from ..errors import InputError
from ..evaluate.retrieval import DEFAULT_NEIGHBOURS, RetrievalScores, crossed_interval, retrieval_scores
from ._features import Collection, FeatureStore, Tables, read_collection
from .bits import hamming_distances
from .model import CODERS
from .training import Examples, Folder, Workers, drawn_too, learned_vocabulary, opened_store, prepared
from .vocabulary import Vocabulary

__all__ = ["RetrievalStudy", "evaluate_retrieval"]

#: The bags of words of a study: of consistent features, of all features, and of half the classes only.
BAGS = ("consistent", "all", "held_out")


@dataclass(frozen=True, eq=False)
class RetrievalStudy:
    """Precision of kinds of codes on the same splits.

    Attributes
    ----------
    bits, train : int
        Length of the codes, and pictures of each class that were trained on.
    classes : tuple of str
    precision : dict of str to dict of str to (splits, classes) array of float
        ``precision[bag][method]``: share of queries of a class given the right label, averaged over numbers of
        neighbours. Bags are "consistent", "all" (every feature alike) and "held_out" (codes and words learned on
        half of the classes, scored on the others; NaN where a class was in the learning half).
    curve : dict of str to (k,) array of float
        With consistent features, the mean by number of neighbours.
    average : dict of str to float
        With consistent features, mean average precision of the whole ranking.
    left_out : dict of str to str
        Pictures that could not be used, and why.
    """

    bits: int
    train: int
    classes: tuple[str, ...]
    precision: Mapping[str, Mapping[str, FloatArray]]
    curve: Mapping[str, FloatArray]
    average: Mapping[str, float]
    left_out: Mapping[str, str]

    def mean(self, method: str = "proposed", bag: str = "consistent") -> float:
        """Return a method's precision averaged over splits and classes."""
        return float(_complete(self.precision[bag][method]).mean())

    def interval(self, method: str = "proposed", bag: str = "consistent") -> tuple[float, float]:
        """Return its 95 % interval over splits and classes."""
        return crossed_interval(_complete(self.precision[bag][method]))

    def difference(self, one: tuple[str, str], two: tuple[str, str]) -> tuple[float, tuple[float, float]]:
        """Return how much more precise one (bag, method) is than another, with a paired 95 % interval."""
        apart = _complete(self.precision[one[0]][one[1]] - self.precision[two[0]][two[1]])
        return float(apart.mean()), crossed_interval(apart)

    def summary(self) -> dict[str, Any]:
        """Return everything as plain numbers, for JSON; what was not measured is missing."""
        methods = tuple(next(iter(self.precision.values())))
        means = {bag: {m: self.mean(m, bag) for m in methods} for bag in self.precision if self._any(bag)}
        found = {
            "precision": means.get("consistent", {}),
            "intervals": {m: list(self.interval(m)) for m in methods if "consistent" in means},
            "all_features": means.get("all", {}),
            "held_out_classes": means.get("held_out", {}),
            "average_precision": dict(self.average),
            "curve": {m: values.tolist() for m, values in self.curve.items()},
            "neighbours": list(DEFAULT_NEIGHBOURS),
            "above": {},
            "bits": self.bits,
            "train": self.train,
            "classes": len(self.classes),
            "left_out": dict(self.left_out),
        }
        if "proposed" in methods and "consistent" in means:
            others = [m for m in methods if m != "proposed"]
            found["above"] = {
                m: self._compared(("consistent", "proposed"), ("consistent", m)) for m in others
            }
            if "all" in means:
                found["effect_of_selection"] = self._compared(("consistent", "proposed"), ("all", "proposed"))
                found["effect_by_method"] = {
                    m: self._compared(("consistent", m), ("all", m)) for m in methods
                }
        return found

    def _any(self, bag: str) -> bool:
        return any(not np.isnan(table).all() for table in self.precision[bag].values())

    def _compared(self, one: tuple[str, str], two: tuple[str, str]) -> dict[str, Any]:
        difference, interval = self.difference(one, two)
        return {"difference": difference, "interval": list(interval)}


def _complete(table: FloatArray) -> FloatArray:
    """Return a table as it is, or, where entries are missing, the mean over splits of each class that has any."""
    known = ~np.isnan(table)
    if known.all():
        return table
    some = known.any(axis=0)
    means: FloatArray = np.nanmean(table[:, some], axis=0, keepdims=True)
    return means


def evaluate_retrieval(
    source: Folder | Sequence[tuple[Folder, str]],
    *,
    queries: Folder | Sequence[tuple[Folder, str]] | None = None,
    bits: int | Sequence[int] = 128,
    train: int = 20,
    splits: int = 3,
    methods: Sequence[str] = tuple(CODERS),
    bags: Sequence[str] = BAGS,
    n_words: int = 1000,
    points: int = 600,
    pairs_per_class: int = 10,
    drawings: bool = True,
    cache: Folder | None = None,
    rng: int = 0,
    n_jobs: int | None = None,
    scheduler: Scheduler | None = None,
    progress: bool = False,
) -> tuple[RetrievalStudy, ...]:
    """Measure kinds of codes as the dissertation does.

    In each split ``train`` pictures of each class are drawn; words, codes and the database are theirs. All others are
    queries. The label of a query is the most frequent among its k nearest by Hamming distance; precision is averaged
    over k = 1, 6, ..., 96 and over classes. Ties: :func:`pliant.evaluate.retrieval_scores`.

    Parameters
    ----------
    source : folder, or sequence of (path, class)
        ``FOLDER/class/picture.jpg``.
    queries : the same, optional
        Queries instead of what training leaves: drawings for photographs, say. Only classes of ``source`` are used.
    bits : int or sequence of int
        Lengths of the codes.
    train : int
        Pictures of each class to train on. Classes that have no more are left out, unless queries are given;
        then smaller ones are trained on whole.
    splits : int
        Draws.
    methods : sequence of str
        Of "proposed", "lsh", "itq", "cca_itq", "spectral", "classifier".
    bags : sequence of str
        Of "consistent", "all", "held_out".
    n_words, points, pairs_per_class, drawings, cache, n_jobs, scheduler, progress
        See :func:`train_retrieval`.
    rng : int
        Seed.

    Returns
    -------
    tuple of RetrievalStudy
        One for each length.

    Raises
    ------
    InputError
        If there are fewer than two classes with pictures enough, or an option is out of range.

    Notes
    -----
    All codes see the same histograms. Pictures of training are database and material of learning at once, as
    published; for a supervised method that flatters classes it has seen, which is what "held_out" is for. Cost: 0.5 s
    a pair, 0.04 s a picture once, then about half a minute a split.

    References
    ----------
    Section 6.5.5 of the dissertation; Sablayrolles et al., *How should we evaluate supervised hashing?*, ICASSP 2017.

    Examples
    --------
    >>> evaluate_retrieval([], train=5)
    Traceback (most recent call last):
    pliant.errors.InputError: []: no pictures; lay them out as FOLDER/CLASS/picture.jpg
    """
    lengths = (bits,) if isinstance(bits, int | np.integer) else tuple(bits)
    _check_options(train, splits, methods, bags, lengths)
    workers = Workers(n_jobs, scheduler, progress)
    archive = read_collection(source)
    asked = None if queries is None else read_collection(queries)
    with opened_store(cache, points) as store:
        bench = _Bench.made(archive, asked, store, workers, train)
        tally = _Tally(bench.classes, lengths, methods, bags, splits)
        for split in range(splits):
            generator = np.random.default_rng([rng, split])
            trained, asking = bench.split(train, generator)
            settings = _Settings(n_words, pairs_per_class, drawings, int(generator.integers(2**31)))
            for bag in bags:
                part = bench.bag(bag, trained, asking, generator)
                tally.add(split, bag, _coded(bench, part, bag, settings, methods, lengths))
    return tally.studies(train, bench.left_out)


def _check_options(
    train: int, splits: int, methods: Sequence[str], bags: Sequence[str], lengths: Sequence[int]
) -> None:
    unknown = [name for name in methods if name not in CODERS] + [name for name in bags if name not in BAGS]
    if unknown or not methods or not bags:
        message = f"methods are {', '.join(CODERS)} and bags {', '.join(BAGS)}; got {unknown or 'none'}"
        raise InputError(message)
    wrong = [b for b in lengths if b < 8 or b % 8]
    if train < 1 or splits < 1 or wrong or not lengths:
        message = (
            f"train and splits must be 1 or more and bits positive multiples of 8, got train={train}, "
            f"splits={splits}, bits={list(lengths)}"
        )
        raise InputError(message)


@dataclass(frozen=True, eq=False)
class _Bench:
    """All pictures of a study, described: the archive first, then the queries if they are others."""

    collection: Collection
    usable: IntArray
    archive_size: int
    store: FeatureStore
    workers: Workers
    classes: tuple[str, ...]
    left_out: dict[str, str]

    @classmethod
    def made(
        cls, archive: Collection, asked: Collection | None, store: FeatureStore, workers: Workers, train: int
    ) -> _Bench:
        both = archive if asked is None else _joined(archive, asked)
        failed = prepared(both, np.arange(len(both.paths)), store, workers)
        usable = np.array([i for i in range(len(both.paths)) if i not in failed], dtype=np.int64)
        size = len(archive.paths)
        known, counts = np.unique(both.labels[usable[usable < size]], return_counts=True)
        asked_for = np.unique(both.labels[usable[usable >= size]])
        classes = known[counts > train] if asked is None else np.intersect1d(known, asked_for)
        if len(classes) < 2:
            need = f"more than {train} usable pictures" if asked is None else "pictures in both folders"
            message = f"two classes with {need} are needed, got {len(classes)}"
            if asked is None and len(counts) > 1:
                second = np.sort(counts)[-2]
                message += f"; the second largest of {len(counts)} classes has {second}: learn from fewer"
            raise InputError(message)
        left_out = {str(both.paths[i]): why for i, why in sorted(failed.items())}
        return cls(both, usable, size, store, workers, tuple(str(c) for c in classes), left_out)

    def split(self, train: int, rng: np.random.Generator) -> tuple[IntArray, IntArray]:
        """Draw pictures to train on; return them and the queries."""
        trained, asking = [], []
        for name in self.classes:
            members = self.usable[self.collection.labels[self.usable] == name]
            archive, others = members[members < self.archive_size], members[members >= self.archive_size]
            order = rng.permutation(archive)
            trained.append(order[:train])
            asking.append(others if len(others) else order[train:])
        return np.sort(np.concatenate(trained)), np.sort(np.concatenate(asking))

    def bag(
        self, bag: str, trained: IntArray, asking: IntArray, rng: np.random.Generator
    ) -> tuple[IntArray, IntArray, IntArray]:
        """Return what is learned from, what is searched, and what is asked."""
        if bag != "held_out":
            return trained, trained, asking
        # With fewer than two classes on either side there is nothing to tell apart.
        half = len(self.classes) // 2 if len(self.classes) > 3 else len(self.classes)
        seen = rng.permutation(self.classes)[:half]
        labels = self.collection.labels
        learned, new = np.isin(labels[trained], seen), ~np.isin(labels[trained], seen)
        return trained[learned], trained[new], asking[~np.isin(labels[asking], seen)]


def _joined(archive: Collection, asked: Collection) -> Collection:
    labels = np.concatenate([archive.labels, asked.labels])
    return Collection(archive.paths + asked.paths, frozen(labels), archive.digests + asked.digests)


class _Settings(NamedTuple):
    """What the codes of a split are made with."""

    n_words: int
    pairs_per_class: int
    drawings: bool
    seed: int


def _coded(
    bench: _Bench,
    part: tuple[IntArray, IntArray, IntArray],
    bag: str,
    settings: _Settings,
    methods: Sequence[str],
    lengths: Sequence[int],
) -> Iterator[tuple[int, str, RetrievalScores]]:
    """Yield the scores of each length and method on one split."""
    learned, database, asking = part
    if not len(database):
        return
    collection, store, seed = bench.collection, bench.store, settings.seed
    drawn = drawn_too(collection, learned, store, bench.workers) if settings.drawings else learned[:0]
    # Words, pairs and codes start from one seed whatever the bag, so that bags differ in nothing else.
    vocabulary, _ = learned_vocabulary(
        collection, learned, store, bench.workers, Vocabulary(settings.n_words, rng=seed),
        0 if bag == "all" else settings.pairs_per_class, seed,
    )  # fmt: skip
    examples = Examples.counted(collection, learned, drawn, store, vocabulary)
    archive, sought = (
        vocabulary.transform(Tables(store, [collection.digests[i] for i in rows]))
        for rows in (database, asking)
    )
    labels = collection.labels
    for length in lengths:
        for method in methods:
            coder = CODERS[method](bits=length)
            if "rng" in coder.get_params():
                coder.set_params(rng=seed)
            examples.teach(coder)
            distances = hamming_distances(coder.transform(sought), coder.transform(archive))
            yield length, method, retrieval_scores(distances, labels[asking], labels[database])


class _Tally:
    """Collects scores of splits into studies."""

    def __init__(
        self,
        classes: tuple[str, ...],
        lengths: Sequence[int],
        methods: Sequence[str],
        bags: Sequence[str],
        splits: int,
    ) -> None:
        self.classes, self.lengths = classes, tuple(lengths)
        shape = (splits, len(classes))
        self.tables = {n: {b: {m: np.full(shape, np.nan) for m in methods} for b in bags} for n in lengths}
        self.curves: dict[tuple[int, str], list[FloatArray]] = {}
        self.averages: dict[tuple[int, str], list[float]] = {}

    def add(self, split: int, bag: str, found: Iterator[tuple[int, str, RetrievalScores]]) -> None:
        place = {name: i for i, name in enumerate(self.classes)}
        for length, method, scores in found:
            row = self.tables[length][bag][method][split]
            for name, value in scores.by_class().items():
                row[place[name]] = value
            if bag == "consistent":
                self.curves.setdefault((length, method), []).append(scores.label.mean(axis=0))
                self.averages.setdefault((length, method), []).append(float(scores.average.mean()))

    def studies(self, train: int, left_out: dict[str, str]) -> tuple[RetrievalStudy, ...]:
        return tuple(
            RetrievalStudy(
                bits=length,
                train=train,
                classes=self.classes,
                precision={
                    b: {m: frozen(t) for m, t in tables.items()} for b, tables in self.tables[length].items()
                },
                curve={m: frozen(np.mean(c, axis=0)) for (n, m), c in self.curves.items() if n == length},
                average={m: float(np.mean(a)) for (n, m), a in self.averages.items() if n == length},
                left_out=left_out,
            )
            for length in self.lengths
        )
