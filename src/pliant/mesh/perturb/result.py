"""What every perturbation returns, and the checks they share."""

from __future__ import annotations

import numbers
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from ..._arrays import BoolArray, IntArray, as_indices, frozen
from ...errors import InputError, MeshError
from ..surface import Mesh

Kind = Literal[
    "isometry",
    "topology",
    "micro_holes",
    "holes",
    "scale",
    "local_scale",
    "noise",
    "shot_noise",
    "sampling",
]
Seed: TypeAlias = int | np.random.Generator


@dataclass(frozen=True, eq=False, repr=False)
class Perturbed:
    """A perturbed shape and the way back to the shape it was made from, the null shape.

    Parameters
    ----------
    mesh : Mesh
        The perturbed shape.
    source : (n_new,) array of int
        For each vertex of :attr:`mesh` the vertex of the null shape it comes from.
    kind : str
        Class of the perturbation.
    strength : int
        0 (nothing changed) to 5.
    description : str
        What was done, with the numbers that came out.

    Examples
    --------
    >>> from pliant import shapes
    >>> perturbed = Perturbed(shapes.icosphere(0), np.arange(12), "scale", 0, "unchanged")
    >>> perturbed
    Perturbed(scale 0: 12 vertices, unchanged)
    """

    mesh: Mesh
    source: IntArray
    kind: Kind
    strength: int
    description: str

    def __post_init__(self) -> None:
        source = as_indices(self.source, "source")
        if source.shape != (self.mesh.n_vertices,):
            message = (
                f"source must name one vertex for each of {self.mesh.n_vertices}, got shape {source.shape}"
            )
            raise InputError(message)
        object.__setattr__(self, "source", frozen(source))

    def __repr__(self) -> str:
        return f"Perturbed({self.kind} {self.strength}: {self.mesh.n_vertices} vertices, {self.description})"


def moved(mesh: Mesh, moved_mesh: Mesh, kind: Kind, strength: int, description: str) -> Perturbed:
    """Return a result whose vertices are those of the null shape in the same order."""
    return Perturbed(moved_mesh, np.arange(mesh.n_vertices), kind, strength, description)


def without_faces(mesh: Mesh, dropped: BoolArray) -> tuple[Mesh, IntArray]:
    """Return the mesh without some faces and the vertices that only they used, and each vertex's old number."""
    used_before = np.zeros(mesh.n_vertices, dtype=bool)
    used_before[mesh.faces] = True
    used_after = np.zeros(mesh.n_vertices, dtype=bool)
    used_after[mesh.faces[~dropped]] = True
    source = np.flatnonzero(used_after | ~used_before)
    number = np.full(mesh.n_vertices, -1)
    number[source] = np.arange(len(source))
    return Mesh(mesh.vertices[source], number[mesh.faces[~dropped]]), source


def checked_strength(strength: int) -> int:
    """Return the strength if it is a whole number from 0 to 5."""
    whole = isinstance(strength, numbers.Integral) and not isinstance(strength, bool)
    if not whole or not 0 <= strength <= 5:
        message = f"strength must be a whole number from 0 (nothing) to 5 (most), got {strength!r}"
        raise InputError(message)
    return int(strength)


def mean_edge_length(mesh: Mesh) -> float:
    """Return the unit of most perturbations, or say that the mesh has none."""
    mean = float(mesh.edge_lengths.mean()) if len(mesh.edge_lengths) else 0.0
    if not mean > 0:
        raise MeshError("no edge of the mesh has a length: there is no surface to perturb")
    return mean
