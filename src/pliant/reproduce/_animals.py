"""Shapes with a known mirror and known legs, and what is asked of symmetries found on them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._arrays import IntArray
from ..evaluate import map_error
from ..matching.symmetry import Symmetry
from ..mesh import Mesh
from ..mesh.shapes import Figure

LEGS = ("left front leg", "right front leg", "left hind leg", "right hind leg")


def mirror_error(mesh: Mesh, truth: IntArray, found: Sequence[Symmetry]) -> float:
    """Mean geodesic error of the first global symmetry, over the root of the area; NaN without one."""
    whole = [one for one in found if one.kind == "global"]
    if not whole:
        return float("nan")
    return map_error(whole[0].point_map, truth, mesh, samples=min(200, mesh.n_vertices)).mean


def parts_of(figure: Figure, one: Symmetry) -> tuple[str, str]:
    """Parts that most of source and target belong to, in order."""
    names = [
        figure.part_names[int(np.bincount(figure.parts[mask]).argmax())] for mask in (one.source, one.target)
    ]
    return min(names), max(names)


def leg_pairs(figure: Figure, found: Sequence[Symmetry]) -> set[tuple[str, str]]:
    """Pairs of legs, of six, that are found as symmetries of their own."""
    pairs = {parts_of(figure, one) for one in found if one.kind == "partial"}
    return {pair for pair in pairs if set(pair) <= set(LEGS)}
