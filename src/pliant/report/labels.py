"""Labels: which per-vertex values are names rather than sizes, and colours that keep them apart."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import FloatArray
from ..heart import SEGMENT_NAMES
from .colours import MISSING

#: Names of the labels of a layer, by label.
LabelNames: TypeAlias = Mapping[int, str]

# fmt: off
#: The seven of Okabe and Ito without black, then colours chosen one after the other to lie farthest from all before
#: them and from the grey of missing values, in OKLab as seen with usual sight, protanopia, deuteranopia, tritanopia
#: (Machado 2009).
LABEL_COLOURS: tuple[str, ...] = (
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442", "#881040",
    "#4028ac", "#94f4b8", "#887cf4", "#944c28", "#64407c", "#58dc7c", "#94587c", "#dcc4f4",
    "#4c4cd0", "#7cb87c", "#e8c434", "#1c704c", "#7094dc", "#c42858", "#f47040", "#d07064",
    "#4c4ca0", "#704010", "#a0dcc4", "#1070e8", "#b8a0c4", "#c4e888", "#a07094", "#705894",
    "#707cc4", "#701088", "#7cf4e8", "#ac5810", "#941c64", "#c4d0a0", "#f488f4", "#d094a0",
)
# fmt: on

#: Names of AHA segments; 0 is what the division of the ventricle leaves out.
AHA_NAMES: dict[int, str] = {0: "0 no segment"} | {
    i: f"{i} {name}" for i, name in enumerate(SEGMENT_NAMES, start=1)
}

#: Colour of what is in no segment: that of a missing value.
NO_SEGMENT = "#" + "".join(f"{round(255 * part):02x}" for part in MISSING)

_REPEATS_WHOLE, _REPEATS_FLOAT = 2, 10


def label_values(values: ArrayLike) -> tuple[int, ...] | None:
    """Return the labels that an array holds, ascending, or None where its values are sizes.

    Labels are whole numbers, at most as many as there are :data:`LABEL_COLOURS`, and each is there for several
    vertices: twice on average in an array of integers, ten times in one of floats, where NaN has no label.

    Examples
    --------
    >>> label_values([3, 3, 0, 0, 3, 0])
    (0, 3)
    >>> label_values([0.5, 0.5, 1.0]) is None
    True
    """
    numbers = np.asarray(values)
    if numbers.ndim != 1 or numbers.dtype.kind not in "biuf":
        return None
    known = numbers[np.isfinite(numbers)]
    if not known.size:
        return None
    whole = numbers.dtype.kind != "f"
    if not whole and (np.any(known != np.rint(known)) or np.abs(known).max() > 2**24):
        return None
    found = np.unique(known)
    repeats = _REPEATS_WHOLE if whole else _REPEATS_FLOAT
    least = 1 if whole else 2
    if not least <= found.size <= min(len(LABEL_COLOURS), numbers.size // repeats):
        return None
    return tuple(int(value) for value in found)


def is_aha(labels: Iterable[int] | None) -> bool:
    """Whether labels are AHA segments: all of 1 to 17, perhaps 0 for what is in none, and nothing else."""
    return labels is not None and set(labels) - {0} == set(range(1, 18))


def label_facts(field: FloatArray, labels: tuple[int, ...], names: LabelNames | None) -> dict[str, object]:
    """Return what a page needs to show labels: values, names, counts and colours."""
    counts = [int((field == value).sum()) for value in labels]
    # Labels may be those of several surfaces: what they mean here is told by those that are here.
    aha = is_aha(value for value, count in zip(labels, counts, strict=True) if count)
    if names is None:
        names = AHA_NAMES if aha else {}
    # A segment has the same colour whether or not what is in none, grey, has a label too.
    places = [value - 1 for value in labels] if aha else range(len(labels))
    return {
        "values": list(labels),
        "names": [names.get(value, str(value).replace("-", "−")) for value in labels],
        "counts": counts,
        "colours": [LABEL_COLOURS[place] if place >= 0 else NO_SEGMENT for place in places],
    }
