"""Partial matches of the image pairs by several methods, computed once for all that ask."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from ..images import ImagePair, PairStudy, evaluate_pairs
from ._pairs import image_pairs
from .bench import Bench

METHODS = ("proposed", "sift", "orb", "akaze", "fast", "gb", "whole", "centre", "saliency")


def studied(bench: Bench) -> tuple[list[ImagePair], PairStudy, str]:
    """Return the pairs, how every method does on them, and what to say of them."""
    return _studied(bench.data, bench.quick, bench.seed)


@cache
def _studied(data: Path | None, quick: bool, seed: int) -> tuple[list[ImagePair], PairStudy, str]:
    # Names and folders of pictures belong to who asks; only what is matched matters here.
    pairs, said = image_pairs(Bench("pairs", Path(), data, quick, seed))
    return pairs, evaluate_pairs(pairs, methods=METHODS, rng=seed, n_jobs=None), said
