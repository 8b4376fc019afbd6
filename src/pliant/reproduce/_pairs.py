"""Image pairs with true boxes: the data's where they are there, synthetic ones of shipped photographs otherwise."""

from __future__ import annotations

from itertools import islice

from ..images import ImagePair, read_pairs, synthetic_pairs
from .bench import Bench

NEEDS = "images/symd"


def image_pairs(bench: Bench) -> tuple[list[ImagePair], str]:
    """Return the pairs and what to say of them."""
    listed = bench.path("images/symd/pairs.json")
    if listed is None:
        pairs = list(islice(synthetic_pairs(rng=bench.seed), 0, None, 3 if bench.quick else 1))
        return pairs, (
            f"{len(pairs)} synthetic pairs made of scikit-image's photographs, with exact boxes; the "
            "dissertation's own pairs and boxes are not public."
        )
    records = read_pairs(listed)
    chosen = records[:: 3 if bench.quick else 1]
    return [record.load() for record in chosen], (
        f"{len(chosen)} pairs of SYMD (Hauagge & Snavely 2012) with boxes drawn by hand for this purpose, not the "
        "dissertation's."
    )
