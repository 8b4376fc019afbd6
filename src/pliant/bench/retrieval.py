"""Kinds of codes by length and by pictures to learn from (Fig. 6.6), and what each stage costs.

pliant bench retrieval FOLDER --bits 32,128 --train 5,20 --cache work
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..retrieval import Vocabulary, describe_picture, evaluate_retrieval
from ..retrieval.model import CODERS

__all__ = ["BITS", "TRAIN", "costs", "curves"]

#: What the dissertation tried.
BITS = (32, 64, 128, 256, 512)
TRAIN = (5, 10, 20, 30, 40, 50)


def curves(
    folder: str | Path, *, bits: Sequence[int] = BITS, train: Sequence[int] = TRAIN, **options: Any
) -> Iterator[dict[str, Any]]:
    """Measure every kind of codes at every length and number of pictures to learn from.

    Parameters
    ----------
    folder : str or Path
        ``FOLDER/class/picture.jpg``.
    bits, train : sequence of int
    **options
        See :func:`pliant.retrieval.evaluate_retrieval`.

    Yields
    ------
    dict
        One row a setting: the precision of each kind, and by what the proposed one is above the best other, with
        its interval.
    """
    for count in train:
        for study in evaluate_retrieval(folder, bits=bits, train=count, bags=("consistent",), **options):
            means = {method: study.mean(method) for method in study.precision["consistent"]}
            best = max((m for m in means if m not in ("proposed", "classifier")), key=means.__getitem__)
            above, (low, high) = study.difference(("consistent", "proposed"), ("consistent", best))
            yield {
                "train": count,
                "bits": study.bits,
                "classes": len(study.classes),
                **means,
                "best other": best,
                "above it": above,
                "low": low,
                "high": high,
            }


def costs(*, pictures: int = 400, n_words: int = 1000, bits: int = 128) -> dict[str, float]:
    """Measure processor seconds of each stage, on noise: the numbers depend on sizes alone.

    Parameters
    ----------
    pictures : int
        To learn from, in 20 classes.
    n_words, bits : int

    Returns
    -------
    dict of str to float
        Of one thread.
    """
    rng = np.random.default_rng(0)
    scene = rng.random((200, 240))
    labels = np.arange(pictures) % 20
    centres = rng.random((20, n_words))
    rows = np.sqrt(rng.dirichlet(np.full(n_words, 0.3), size=pictures) + 0.3 * centres[labels] / n_words)
    tables = [describe_picture(scene, rng=i).descriptors for i in range(8)]
    seconds = {"describe a picture": _spent(lambda: describe_picture(scene))}
    vocabulary = Vocabulary(n_words)
    seconds["learn words"] = _spent(lambda: vocabulary.fit(tables))
    seconds["count the words of a picture"] = _spent(lambda: vocabulary.transform(tables)) / len(tables)
    for name, kind in CODERS.items():
        coder = kind(bits=bits)
        seconds[f"learn {name}"] = _spent(lambda coder=coder: coder.fit(rows, labels))
        seconds[f"encode with {name}"] = _spent(lambda coder=coder: coder.transform(rows)) / pictures
    return seconds


def _spent(work: Any) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun
