"""Real hearts, normal against heart failure: what shape says beside the cavity's volume.

pliant bench heart --tables sunnybrook --data FOLDER
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..heart import (
    BagOfFeatures,
    SegmentFeatures,
    aha_segments,
    endocardial_features,
    heart_study,
    ventricle_frame,
)
from ..mesh import Mesh, load_mesh

__all__ = ["measured_hearts", "sunnybrook_rows"]

# Slices are 8 to 10 mm apart: curvature over 6 mm, waves of 25 mm and longer.
_RADIUS, _WAVELENGTHS = 6.0, (60.0, 45.0, 34.0, 25.0)
# Part of the stack whose width tells base from apex.
_END = 0.15
_NORMAL, _FAILURE = "0", ("1", "2")


def sunnybrook_rows(folder: str | Path, *, repeats: int = 10) -> list[dict[str, Any]]:
    """Measure normal hearts against heart failure; ``folder`` is the evaluation data's heart/sunnybrook.

    Returns
    -------
    list of dict
        The area under the receiver operating characteristic of each method (five folds, drawn ``repeats`` times), and
        its difference from the volume's with the 95 % interval of a paired bootstrap over subjects.
    """
    features, diseased = measured_hearts(folder)
    return compared(features, diseased, repeats)


def measured_hearts(folder: str | Path) -> tuple[list[SegmentFeatures], np.ndarray]:
    """Measure the surfaces of normal and failing hearts of a folder with ``cases.csv`` and ``lv_endo_ply``."""
    place = Path(folder)
    table = place / "cases.csv"
    if not table.is_file():
        message = f"{place} holds no cases.csv; give the folder of the Sunnybrook hearts (--data)"
        raise InputError(message)
    with table.open(newline="", encoding="utf-8") as lines:
        cases = [row for row in csv.DictReader(lines) if row["cat"] in (_NORMAL, *_FAILURE)]
    features = []
    for row in cases:
        mesh = load_mesh(place / "lv_endo_ply" / f"case{int(row['case']):02d}_cat{row['cat']}.ply")
        frame = ventricle_frame(mesh, **_ends(mesh))
        features.append(
            endocardial_features(
                mesh, aha_segments(mesh, frame), frame, points=100, radius=_RADIUS, wavelengths=_WAVELENGTHS,
                rng=0, n_jobs=1,
            )
        )  # fmt: skip
    return features, np.array([row["cat"] != _NORMAL for row in cases])


def _ends(mesh: Mesh) -> dict[str, np.ndarray]:
    """Return apex and base: slices are stacked along the first coordinate, and the wider end is the base.

    The acquisition fixes the long axis; from surfaces with steps of 8 to 10 mm alone it is not found.
    """
    along, weights = mesh.vertices[:, 0], mesh.vertex_areas
    reach = _END * np.ptp(along)
    found = []
    for end, inside in (
        (along.min(), along <= along.min() + reach),
        (along.max(), along >= along.max() - reach),
    ):
        middle = np.average(mesh.vertices[inside], axis=0, weights=weights[inside])
        spread = ((mesh.vertices[inside] - middle)[:, 1:] ** 2).sum(axis=1)
        middle[0] = end
        found.append((float(np.average(spread, weights=weights[inside])), middle))
    (_, apex), (_, base) = sorted(found, key=lambda pair: pair[0])
    return {"apex": apex, "base": base}


def compared(features: Sequence[SegmentFeatures], diseased: np.ndarray, repeats: int) -> list[dict[str, Any]]:
    """Return a row for each method: its area, and how far above or below the volume's."""
    bag = BagOfFeatures(10, blocks=features[0].blocks)
    found = heart_study(
        features, diseased=diseased, scenario="global", methods={"bag": bag}, classifiers=("logistic",),
        folds=5, repeats=repeats, permutations=0, n_jobs=1,
    )  # fmt: skip
    rows = []
    for row in found.rows:
        difference, low, high = found.above(
            row.method, "cavity volume", model=row.model, baseline_model="logistic", measure="auc"
        )
        rows.append(
            {
                "method": row.method, "subjects": len(diseased), "diseased": int(diseased.sum()),
                "auc": round(row.auc, 3), "balanced accuracy": round(row.score.value, 3),
                "above volume": round(difference, 3), "low": round(low, 3), "high": round(high, 3),
            }
        )  # fmt: skip
    return rows
