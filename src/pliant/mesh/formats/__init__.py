"""The file formats Pliant reads and writes, and how each is recognised."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from ...errors import FileFormatError, InputError
from ..surface import Mesh
from . import freesurfer, gifti, obj, off, ply, stl, vtk_legacy, vtk_xml
from .contents import Contents, checked_arrays, fan, triangulated
from .raw import file_bytes, write_atomically

__all__ = [
    "FORMATS",
    "Contents",
    "Format",
    "checked_arrays",
    "fan",
    "file_bytes",
    "for_writing",
    "recognised",
    "triangulated",
    "write_atomically",
]


@dataclass(frozen=True)
class Format:
    """One file format: its name, its endings, how to read and write it, whether it holds arrays."""

    name: str
    endings: tuple[str, ...]
    read: Callable[[bytes], Contents]
    write: Callable[[Mesh, Mapping[str, NDArray[Any]]], bytes]
    holds_arrays: bool = False


OFF = Format("OFF", (".off",), off.read, off.write)
OBJ = Format("OBJ", (".obj",), obj.read, obj.write)
PLY = Format("PLY", (".ply",), ply.read, ply.write, holds_arrays=True)
STL = Format("STL", (".stl",), stl.read, stl.write)
VTK = Format("legacy VTK", (".vtk",), vtk_legacy.read, vtk_legacy.write, holds_arrays=True)
VTP = Format("VTK XML", (".vtp",), vtk_xml.read, vtk_xml.write_polydata, holds_arrays=True)
VTU = Format("VTK XML", (".vtu",), vtk_xml.read, vtk_xml.write_grid, holds_arrays=True)
GIFTI = Format("GIFTI", (".gii",), gifti.read, gifti.write)
FREESURFER = Format(
    "FreeSurfer geometry",
    (".white", ".pial", ".inflated", ".sphere", ".reg", ".orig", ".smoothwm", ".midthickness", ".surf"),
    freesurfer.read,
    freesurfer.write,
)
FORMATS = (OFF, OBJ, PLY, STL, VTK, VTP, VTU, GIFTI, FREESURFER)


def for_writing(name: str) -> Format:
    """Choose the format by a file name's ending."""
    chosen = _by_ending(name)
    if chosen is None:
        message = f"{name}: no format has this ending; use one of {_endings()}"
        raise InputError(message)
    return chosen


def recognised(name: str, data: bytes) -> tuple[Format, tuple[str, ...]]:
    """Tell a file's format by its first bytes, and where these say nothing, by its ending.

    Returns the format and notes to report: an ending that belongs to another format.
    """
    named = _by_ending(name)
    found = _by_content(data)
    if found is None:
        # OBJ has no magic; OFF may lack its keyword; a binary STL is known only by its length.
        if named in (OBJ, OFF, STL):
            return named, ()
        if named is not None and named is not FREESURFER:
            message = f"named like {named.name}, but it does not start like one: {_opening(data)}"
            raise FileFormatError(message)
        message = f"unknown format, it starts with {_opening(data)}; endings read: {_endings()}"
        raise FileFormatError(message)
    if named is not None and named.name != found.name:
        return found, (f"named like {named.name}, but it is {found.name} and is read as that",)
    return found, ()


def _by_ending(name: str) -> Format | None:
    lowered = name.lower().removesuffix(".gz")
    return next((chosen for chosen in FORMATS if lowered.endswith(chosen.endings)), None)


def _by_content(data: bytes) -> Format | None:
    if data[:3] == b"ply" and data[3:4] in (b"\n", b"\r"):
        return PLY
    if data[:3] in freesurfer.MAGICS:
        return FREESURFER
    if data.startswith(vtk_legacy.MAGIC):
        return VTK
    if stl.is_binary_stl(data):
        return STL
    start = data[:4096].lstrip(b"\xef\xbb\xbf \t\r\n")
    if start.startswith(b"<"):
        return GIFTI if b"<GIFTI" in start else VTP if b"<VTKFile" in start else None
    if start[:5].lower() == b"solid" and b"facet" in data[:4096].lower():
        return STL
    return OFF if off.is_off(data) else None


def _opening(data: bytes) -> str:
    return repr(data[:16].decode("latin-1"))


def _endings() -> str:
    return ", ".join(ending for chosen in FORMATS for ending in chosen.endings) + ", each also with .gz"
