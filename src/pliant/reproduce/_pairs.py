"""Image pairs with true boxes: the data's where they are there, synthetic ones of shipped photographs otherwise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..images import ImagePair, read_pairs, synthetic_pair
from ..images.pairs import ChangeKind, shipped_photographs
from .bench import Bench

NEEDS = "images/symd"
LOOKS: tuple[ChangeKind, ...] = ("occlusion", "night", "haze", "drawing", "engraving", "painting")
# Least share of either picture that the other shows too.
_SHARED = 0.3


def image_pairs(bench: Bench) -> tuple[list[ImagePair], str]:
    """Return the pairs and what to say of them."""
    listed = bench.path("images/symd/pairs.json")
    if listed is None:
        # A third of them in the quick run, other looks of each photograph.
        every = enumerate(_overlapping(bench.seed))
        pairs = [pair for i, pair in every if not bench.quick or (i + i // len(LOOKS)) % 3 == 0]
        return pairs, (
            f"{len(pairs)} synthetic pairs: two overlapping parts of each of scikit-image's photographs, one "
            "changed in its looks, with exact boxes; the dissertation's own pairs and boxes are not public."
        )
    records = read_pairs(listed)
    chosen = records[:: 3 if bench.quick else 1]
    return [record.load() for record in chosen], (
        f"{len(chosen)} pairs of SYMD (Hauagge & Snavely 2012) with boxes drawn by hand for this purpose, not the "
        "dissertation's."
    )


def _overlapping(seed: int) -> Iterator[ImagePair]:
    """Yield pairs that share a part of each: where both show the whole, the whole is the answer."""
    rng = np.random.default_rng(seed)
    for name, photograph in shipped_photographs().items():
        for look in LOOKS:
            yield _pair(name, photograph, look, rng)


def _pair(name: str, photograph: object, look: ChangeKind, rng: np.random.Generator) -> ImagePair:
    while True:
        one, two = (synthetic_pair(photograph, "crop", name=name, rng=rng) for _ in range(2))
        # A crop's box in the photograph, and the part of it that the other crop shows too.
        low = np.maximum(one.box1[:2], two.box1[:2])
        high = np.minimum(one.box1[2:], two.box1[2:])
        shared = float(np.prod(np.maximum(high - low, 0)))
        if shared > _SHARED * max(np.prod(crop.box1[2:] - crop.box1[:2]) for crop in (one, two)):
            break
    boxes = [np.r_[low - crop.box1[:2], high - crop.box1[:2]] for crop in (one, two)]
    changed = synthetic_pair(two.picture2, look, name=name, rng=rng).picture2
    motion = two.homography @ np.linalg.inv(one.homography)
    return ImagePair(f"{name}-{look}", look, one.picture2, changed, boxes[0], boxes[1], motion, name)
