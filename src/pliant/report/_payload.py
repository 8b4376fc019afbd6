"""Surfaces and values as pages carry them: deflated, single precision, in JSON."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import FloatArray
from ..mesh import Mesh
from .colours import COLOUR_MAPS, MISSING, colour_table, robust_limits
from .labels import LabelNames, label_facts
from .render import Axis, Direction, camera

PERCENTILES = (2.0, 98.0)
SIDES: tuple[Direction, ...] = ("left", "right", "front", "back", "top", "bottom")


def surface_payload(
    mesh: Mesh,
    fields: Mapping[str, FloatArray],
    charts: Mapping[str, FloatArray],
    edges: FloatArray,
    up: Axis,
    unit: str,
    *,
    labels: Mapping[str, tuple[int, ...] | None] | None = None,
    names: Mapping[str, LabelNames] | None = None,
) -> dict[str, Any]:
    """Return a surface with its layers and histograms, and what a page needs to show them, ready for JSON.

    ``labels`` says which labels a layer's values are, ``names`` what they are called.
    """
    labels, names = labels or {}, names or {}
    extent = float(np.ptp(mesh.vertices, axis=0).max())
    differences = np.diff(mesh.faces.ravel(), prepend=0)
    return {
        "positions": packed(mesh.vertices.astype(np.float32)),
        "faces": packed(np.where(differences < 0, -2 * differences - 1, 2 * differences).astype(np.uint32)),
        "layers": [_layer(name, field, labels.get(name), names.get(name)) for name, field in fields.items()],
        "histograms": list(charts),
        "histogramArrays": [packed(chart.astype(np.float32)) for chart in charts.values()],
        "edges": edges.tolist(),
        "cameras": {side: camera(side, up=up).tolist() for side in SIDES},
        "first": "left" if up == "z" else "front",
        "tables": {name: packed(colour_table(name)) for name in COLOUR_MAPS},
        "missing": list(MISSING),
        "unit": unit,
        # Enough decimals to tell a ten-thousandth of the shape's size.
        "decimals": int(np.clip(np.ceil(4 - np.log10(extent)) if extent > 0 else 2, 0, 9)),
    }


def _layer(
    name: str, field: FloatArray, labels: tuple[int, ...] | None, names: LabelNames | None
) -> dict[str, Any]:
    low, high = robust_limits(field, percentiles=PERCENTILES)
    known = field[np.isfinite(field)]
    positive = known[known > 0]
    # A logarithmic scale can hold zeros back at its first colour, but not half of a signed field.
    logarithmic = positive.size > 0 and bool((known >= 0).all())
    low_positive = robust_limits(positive, percentiles=PERCENTILES)[0] if logarithmic else 0.0
    return {
        "name": name,
        "values": packed(field.astype(np.float32)),
        "low": low,
        "high": high,
        "low_positive": low_positive,
        "single": known.size > 0 and bool((known == known[0]).all()),
        "missing": field.size - known.size,
        "labels": None if labels is None else label_facts(field, labels, names),
    }


def packed(array: NDArray[Any]) -> dict[str, Any]:
    """Deflate an array, least significant bytes of all elements first: similar numbers share high bytes."""
    little = array.ravel().astype(array.dtype.newbyteorder("<"))
    planes = little.view(np.uint8).reshape(-1, array.dtype.itemsize).T
    data = base64.b64encode(zlib.compress(planes.tobytes(), 6)).decode("ascii")
    return {"kind": array.dtype.name, "length": array.size, "data": data}
