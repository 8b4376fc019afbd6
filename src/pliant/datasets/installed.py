"""What installed packages ship. Nothing here touches a network."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Literal, TypeAlias

from ..errors import InputError, MissingExtraError
from ..mesh import Mesh, load_mesh

__all__ = ["CorticalSurface", "Hemisphere", "fsaverage5"]

CorticalSurface: TypeAlias = Literal["pial", "white", "infl", "sphere"]
Hemisphere: TypeAlias = Literal["left", "right"]
_SURFACES = ("pial", "white", "infl", "sphere")
_HEMISPHERES = ("left", "right")


def fsaverage5(surface: CorticalSurface = "pial", *, hemisphere: Hemisphere = "left") -> Mesh:
    """Load a hemisphere of FreeSurfer's average brain, as nilearn ships it.

    Parameters
    ----------
    surface : {"pial", "white", "infl", "sphere"}
        The outer or inner boundary of grey matter, inflated, or on a sphere. All have the same triangles.
    hemisphere : {"left", "right"}
        Which half.

    Returns
    -------
    Mesh
        10,242 vertices and 20,480 faces, closed, in millimetres, x right, y front, z up.

    Raises
    ------
    InputError
        If the surface or the hemisphere has another name.
    MissingExtraError
        If nilearn is not installed, or does not ship the file.

    Notes
    -----
    An average of 40 brains: smoother than any one brain, and of a sixteenth of the resolution of fsaverage.
    Source: Fischl, Sereno, Tootell & Dale 1999, High-resolution intersubject averaging and a coordinate system
    for the cortical surface.

    Examples
    --------
    >>> fsaverage5("white", hemisphere="right")
    Mesh(10242 vertices, 20480 faces)
    """
    if surface not in _SURFACES:
        message = f"surface must be one of {', '.join(_SURFACES)}; got {surface!r}"
        raise InputError(message)
    if hemisphere not in _HEMISPHERES:
        message = f"hemisphere must be one of {', '.join(_HEMISPHERES)}; got {hemisphere!r}"
        raise InputError(message)
    return load_mesh(_nilearn_file(f"{surface}_{hemisphere}.gii.gz"))


def _nilearn_file(name: str) -> Path:
    # The package is located, not imported: importing nilearn takes seconds.
    found = find_spec("nilearn")
    if found is None or not found.submodule_search_locations:
        raise MissingExtraError("nilearn, which ships fsaverage5, is not installed; pip install nilearn")
    path = Path(found.submodule_search_locations[0]) / "datasets" / "data" / "fsaverage5" / name
    if not path.is_file():
        message = f"this version of nilearn does not ship fsaverage5/{name}; pip install --upgrade nilearn"
        raise MissingExtraError(message)
    return path
