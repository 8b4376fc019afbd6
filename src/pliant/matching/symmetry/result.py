"""Symmetries as values, kept as numbers and JSON."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from ..._arrays import BoolArray, FloatArray, IntArray, frozen
from ...errors import FileFormatError, InputError
from ...mesh import Mesh
from ...mesh.arrays import load_arrays, save_arrays
from ...mesh.fingerprint import MeshFingerprint
from ...mesh.formats import write_atomically
from ...spectral import Spectrum

__all__ = ["Symmetry", "SymmetryResult"]

_FORMAT = "pliant-symmetries-3"
# Counted places from 0, and named no mesh.
_EARLIER = "pliant-symmetries-2"
_ARRAYS = ("source", "target", "point_map", "fmap")
_SIDES = ("source", "target")
_LABELS = ("group", "implied_by")
_NUMBERS = ("support", "complexity", "distortion", "reversed_area", "residual", "confidence")

Kind = Literal["global", "partial"]


@dataclass(frozen=True, eq=False, repr=False)
class Symmetry:
    """One symmetry of a surface: what it carries where.

    Attributes
    ----------
    source, target : (n,) array of bool
        The vertices it carries, and the region it carries them to; everything where it is global.
    point_map : (n,) array of int
        The image of each vertex of the source, -1 elsewhere.
    fmap : (k, k) array of float
        The functional map, orthogonal: it takes functions on the target to functions on the source, f to f o T.
        In the eigenbasis of the surface where it is global, else in the regions' own (:attr:`bases`), each
        region scaled to unit area.
    support : float
        Share of the voters with a partner where the map takes them.
    complexity : float
        Eq. 4.6, squared form, of the first 20 eigenfunctions: 0 where the map is diagonal.
    distortion : float
        Mean change of the biharmonic distance between two points, over its root mean square.
    reversed_area : float
        Share of the source's area whose image is wound the other way.
    residual : float
        Median squared distance of wave kernel signatures of point and image, over that of two random points.
    confidence : float
        From 0 to 1: how far the map stays within the limits it was accepted by. It orders; it is no probability.
    kind : {"global", "partial"}
        A reflection of the whole surface, or a region that is carried to another one.
    group : int
        Number of its group among those of its kind, see :func:`group_symmetries`; -1 where it was not sought.
    implied_by : int
        Of a partial symmetry: place, in the result, of the global one that carries the source to the target
        already; -1 where there is none.
    bases : pair of Spectrum or None
        Eigenbases of source and target as surfaces of their own, on their vertices in ascending order.
    """

    source: BoolArray
    target: BoolArray
    point_map: IntArray
    fmap: FloatArray
    support: float
    complexity: float
    distortion: float
    reversed_area: float
    residual: float
    confidence: float
    kind: Kind = "global"
    group: int = -1
    implied_by: int = -1
    bases: tuple[Spectrum, Spectrum] | None = None

    def __post_init__(self) -> None:
        n = len(self.point_map)
        if self.source.shape != (n,) or self.target.shape != (n,):
            message = f"source, target and point_map must have one entry a vertex, got {self.source.shape}"
            raise InputError(message)
        if not np.array_equal(self.point_map >= 0, self.source) or (n and self.point_map.max() >= n):
            raise InputError("point_map must name a vertex where source is true, and be -1 elsewhere")
        if not self.target[self.point_map[self.source]].all():
            raise InputError("point_map must lead into the target")
        for name in _ARRAYS:
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __repr__(self) -> str:
        return (
            f"Symmetry({self.kind}, confidence {self.confidence:.2f}, distortion {self.distortion:.3f}, "
            f"complexity {self.complexity:.3f})"
        )


@dataclass(frozen=True, eq=False, repr=False)
class SymmetryResult:
    """The symmetries of a surface, and why there are none, or not more.

    Attributes
    ----------
    symmetries : tuple of Symmetry
        The most confident first.
    reasons : tuple of str
        Why nothing was accepted.
    settings : mapping
        What the search was run with, JSON-ready.
    mesh : MeshFingerprint or None
        The mesh that was searched; None where it is not known.

    Examples
    --------
    >>> result = SymmetryResult((), ("asymmetric",), {"samples": 100})
    >>> result
    SymmetryResult(0 symmetries; asymmetric)
    """

    symmetries: tuple[Symmetry, ...]
    reasons: tuple[str, ...]
    settings: Mapping[str, Any]
    mesh: MeshFingerprint | None = None

    def __repr__(self) -> str:
        found = f"SymmetryResult({len(self.symmetries)} symmetries"
        return f"{found}; {'; '.join(self.reasons)})" if self.reasons else f"{found})"

    def check_mesh(self, mesh: Mesh) -> None:
        """Raise unless a mesh is the one that was searched; where that is not known, only vertices are counted.

        Parameters
        ----------
        mesh : Mesh

        Raises
        ------
        InputError
            If it is another one, saying what differs.
        """
        own, other = self.mesh, MeshFingerprint.of(mesh)
        n = own.vertices if own else next((len(s.point_map) for s in self.symmetries), other.vertices)
        if n != other.vertices or (own and own.faces != other.faces):
            has = f"{n} vertices" + (f" and {own.faces} faces" if own else "")
            message = f"made on another mesh, of {has}; this one has {other.vertices} and {other.faces}"
            raise InputError(message)
        if own and own.sha256 != other.sha256:
            message = (
                f"made on another mesh of as many vertices ({n}) and faces ({other.faces}): positions or triangles "
                f"differ (SHA-256 {own.sha256[:12]}… there, {other.sha256[:12]}… here)"
            )
            raise InputError(message)

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write ``symmetries.npz`` and ``symmetries.json`` into a folder, which is made where it is missing.

        Parameters
        ----------
        folder : path-like
        """
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        arrays: dict[str, Any] = {"n_symmetries": np.array(len(self.symmetries))}
        for i, found in enumerate(self.symmetries):
            for name in _ARRAYS:
                arrays[f"{name}_{i}"] = getattr(found, name)
            for side, basis in zip(_SIDES, found.bases or (), strict=False):
                arrays[f"{side}_values_{i}"] = basis.values
                arrays[f"{side}_vectors_{i}"] = basis.vectors
                arrays[f"{side}_mass_{i}"] = basis.mass.diagonal()
        save_arrays(path / "symmetries.npz", arrays)
        text = json.dumps(self.as_json(), indent=2, allow_nan=False)
        write_atomically(path / "symmetries.json", text.encode())

    def as_json(self) -> dict[str, Any]:
        """Return everything but the arrays, ready for :func:`json.dumps`.

        Symmetries and groups are numbered from 1, as in what the commands print and draw.
        """
        rows = [
            {"number": i, "kind": s.kind}
            | {name: float(getattr(s, name)) for name in _NUMBERS}
            | {name: _counted(getattr(s, name)) for name in _LABELS}
            for i, s in enumerate(self.symmetries, start=1)
        ]
        return {
            "format": _FORMAT,
            "mesh": None if self.mesh is None else asdict(self.mesh),
            "settings": dict(self.settings),
            "reasons": list(self.reasons),
            "symmetries": rows,
        }

    @classmethod
    def load(cls, folder: str | os.PathLike[str]) -> SymmetryResult:
        """Read what :meth:`save` wrote.

        Parameters
        ----------
        folder : path-like

        Returns
        -------
        SymmetryResult

        Raises
        ------
        FileFormatError
            If a file is missing, damaged or of another version.
        """
        path = Path(folder)
        arrays = load_arrays(path / "symmetries.npz")
        try:
            stored = json.loads((path / "symmetries.json").read_text(encoding="utf-8"))
            if stored["format"] == _EARLIER:
                stored["symmetries"] = [_renumbered(row) for row in stored["symmetries"]]
            elif stored["format"] != _FORMAT:
                message = f"{path}: written by another version ({stored['format']}), not {_FORMAT}"
                raise FileFormatError(message)
            symmetries = tuple(_stored(arrays, i, row) for i, row in enumerate(stored["symmetries"]))
            known = stored.get("mesh")
            mesh = None if known is None else MeshFingerprint.from_json(known)
            return cls(symmetries, tuple(stored["reasons"]), dict(stored["settings"]), mesh)
        except FileFormatError:
            raise
        except (OSError, KeyError, TypeError, ValueError) as error:
            message = f"{path} does not hold stored symmetries, or they are damaged: {error}"
            raise FileFormatError(message) from error


def _counted(place: int) -> int | None:
    """Return a place counted from 1; None for none."""
    return int(place) + 1 if place >= 0 else None


def _renumbered(row: Mapping[str, Any]) -> dict[str, Any]:
    return {**row, **{name: _counted(row[name]) for name in _LABELS}}


def _stored(arrays: Mapping[str, Any], number: int, row: Mapping[str, Any]) -> Symmetry:
    fields: dict[str, Any] = {name: arrays[f"{name}_{number}"] for name in _ARRAYS}
    if f"source_values_{number}" in arrays:
        fields["bases"] = tuple(
            Spectrum(
                arrays[f"{side}_values_{number}"],
                arrays[f"{side}_vectors_{number}"],
                sp.diags_array(arrays[f"{side}_mass_{number}"]).tocsr(),
            )
            for side in _SIDES
        )
    given: dict[str, Any] = {name: row[name] for name in ("kind", *_NUMBERS)}
    given |= {name: -1 if row[name] is None else row[name] - 1 for name in _LABELS}
    return Symmetry(**fields, **given)
