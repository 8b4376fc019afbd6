"""Symmetries as values, kept as numbers and JSON."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from ..._arrays import BoolArray, FloatArray, IntArray, frozen
from ...errors import FileFormatError, InputError
from ...mesh.arrays import load_arrays, save_arrays
from ...mesh.formats import write_atomically
from ...spectral import Spectrum

__all__ = ["Symmetry", "SymmetryResult"]

_FORMAT = "pliant-symmetries-2"
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

    Examples
    --------
    >>> result = SymmetryResult((), ("asymmetric",), {"samples": 100})
    >>> result
    SymmetryResult(0 symmetries; asymmetric)
    """

    symmetries: tuple[Symmetry, ...]
    reasons: tuple[str, ...]
    settings: Mapping[str, Any]

    def __repr__(self) -> str:
        found = f"SymmetryResult({len(self.symmetries)} symmetries"
        return f"{found}; {'; '.join(self.reasons)})" if self.reasons else f"{found})"

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
        """Return everything but the arrays, ready for :func:`json.dumps`."""
        rows = [
            {"kind": s.kind}
            | {name: float(getattr(s, name)) for name in _NUMBERS}
            | {name: int(getattr(s, name)) for name in _LABELS}
            for s in self.symmetries
        ]
        return {
            "format": _FORMAT,
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
            if stored["format"] != _FORMAT:
                message = f"{path}: written by another version ({stored['format']}), not {_FORMAT}"
                raise FileFormatError(message)
            symmetries = tuple(_stored(arrays, i, row) for i, row in enumerate(stored["symmetries"]))
            return cls(symmetries, tuple(stored["reasons"]), dict(stored["settings"]))
        except FileFormatError:
            raise
        except (OSError, KeyError, TypeError, ValueError) as error:
            message = f"{path} does not hold stored symmetries, or they are damaged: {error}"
            raise FileFormatError(message) from error


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
    return Symmetry(**fields, **row)
