"""Table 6.1: mean relevance by number of points and of eigenvectors."""

from __future__ import annotations

import numpy as np

from ..bench.images import PRINTED, settings_table
from ._pairs import NEEDS, image_pairs
from .bench import Bench
from .findings import Experiment, Findings, Row


def _run(bench: Bench) -> Findings:
    pairs, said = image_pairs(bench)
    table = {(row["points"], row["eigenvectors"]): row["mrs"] for row in settings_table(pairs)}
    rows = [
        Row(f"{points} points, m = {dim}: mean relevance", PRINTED[points, dim][0], table[points, dim])
        for points, dim in PRINTED
    ]
    ours = np.array([table[setting] for setting in PRINTED]).reshape(3, 4)
    order = np.corrcoef(ours.ravel(), [mrs for mrs, _ in PRINTED.values()])[0, 1]
    few, many = float(ours[:, 0].mean()), float(ours[:, 2:].mean())
    verdict = "holds" if many > few and order > 0.5 else "holds partly" if many > few else "does not hold"
    return Findings(
        verdict,  # type: ignore[arg-type]
        f"Twenty eigenvectors or more give a mean relevance of {many:.2f}, five {few:.2f}; over the twelve "
        f"settings ours and the printed values correlate by {order:.2f}. The level is not comparable, since "
        "pairs and boxes are others.",
        said,
        tuple(rows),
        {"pairs": len(pairs)},
    )


EXPERIMENT = Experiment(
    "table-6.1",
    "Points and eigenvectors of the joint embedding",
    "Relevance grows with the number of eigenvectors up to about 20 and little with the number of points.",
    "Twenty eigenvectors or more are better than five and the twelve settings correlate with the printed "
    "ones by .5; in part if only the first.",
    _run,
    uses=(NEEDS,),
)
