"""How good a self-map is: what tells a reflection from the identity, a partial flip or an arbitrary map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._arrays import FloatArray, IntArray, vertex_indices
from ...errors import InputError
from ...mesh import Mesh
from ...spectral import Spectrum
from ._frame import Frame

__all__ = ["MapQuality", "map_quality", "reversed_area"]

_POINTS = 400


@dataclass(frozen=True)
class MapQuality:
    """Measures of a map of a surface onto itself, all from the surface's inside but the orientation.

    Attributes
    ----------
    reversed_area : float
        Share of the area whose image is wound the other way: near 1 for a reflection, near 0 for a rotation.
    distortion : float
        Mean change of the biharmonic distance between two points, over its root mean square.
    residual : float
        Median squared distance between the wave kernel signatures of a point and its image, over the mean of
        two random points.
    involution : float
        Mean biharmonic distance from a point to the image of its image, over the root mean square.
    displacement : float
        Mean biharmonic distance from a point to its image, over the root mean square; 0 for the identity.

    Examples
    --------
    >>> MapQuality(0.9, 0.02, 0.01, 0.03, 0.7).reversed_area
    0.9
    """

    reversed_area: float
    distortion: float
    residual: float
    involution: float
    displacement: float


def map_quality(mesh: Mesh, spectrum: Spectrum, point_map: IntArray) -> MapQuality:
    """Measure how good a map of a surface onto itself is.

    Parameters
    ----------
    mesh : Mesh
        In one piece.
    spectrum : Spectrum
        Of the mesh; 200 eigenpairs are good.
    point_map : (n,) array_like of int
        The image of each vertex.

    Returns
    -------
    MapQuality

    Raises
    ------
    InputError
        If the map has another length or names vertices that are not there.

    Notes
    -----
    Low distortion alone proves nothing: the identity has none. Distances are taken between 400 farthest
    points.

    Examples
    --------
    >>> from pliant import eigenbasis, shapes
    >>> figure = shapes.human(1000)
    >>> quality = map_quality(figure.mesh, eigenbasis(figure.mesh, 40), figure.symmetry)
    >>> round(quality.reversed_area, 6), quality.distortion < 1e-6, quality.involution
    (1.0, True, 0.0)
    """
    image = vertex_indices(point_map, mesh.n_vertices, "point_map")
    if len(image) != mesh.n_vertices:
        message = f"point_map must have one image a vertex, {mesh.n_vertices}; got {len(image)}"
        raise InputError(message)
    frame = Frame(mesh, spectrum)
    return quality_of(frame, image)


def quality_of(frame: Frame, image: IntArray) -> MapQuality:
    """Measure a map that has been checked."""
    samples = frame.samples(_POINTS)
    weights = frame.areas[samples] / frame.areas[samples].sum()
    moved = np.linalg.norm(frame.embedding - frame.embedding[image], axis=1)
    back = np.linalg.norm(frame.embedding - frame.embedding[image[image]], axis=1)
    change = np.abs(frame.distances(samples, samples) - frame.distances(image[samples], image[samples]))
    return MapQuality(
        reversed_area(frame.mesh, image),
        float(weights @ change @ weights),
        signature_residual(frame, np.arange(len(image)), image, frame.areas),
        float(frame.areas @ back),
        float(frame.areas @ moved),
    )


def reversed_area(mesh: Mesh, point_map: IntArray) -> float:
    """Return the share of the area whose image is wound the other way.

    Parameters
    ----------
    mesh : Mesh
        Wound alike throughout.
    point_map : (n,) array of int
        The image of each vertex; -1 where it has none.

    Returns
    -------
    float
        From 0 to 1, of the area whose image is a triangle at all: three vertices, not one line.

    Examples
    --------
    >>> from pliant import shapes
    >>> figure = shapes.human(1000)
    >>> round(reversed_area(figure.mesh, figure.symmetry), 6)
    1.0
    """
    image = np.asarray(point_map)[mesh.faces]
    whole = (image >= 0).all(axis=1)
    image = image[whole]
    corners = mesh.vertices[image]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    there = mesh.vertex_normals[image].sum(axis=1)
    side = (normals * there).sum(axis=1)
    areas = mesh.face_areas[whole]
    known = areas[side != 0].sum()
    return float(areas[side < 0].sum() / known) if known > 0 else 0.0


def signature_residual(frame: Frame, vertices: IntArray, image: IntArray, weights: FloatArray) -> float:
    """Weighted median of the distance of signatures between vertices and their images, over that at random."""
    gaps = frame.signature_gaps(vertices, image)
    order = np.argsort(gaps, kind="stable")
    total = np.cumsum(weights[order])
    return float(gaps[order[np.searchsorted(total, total[-1] / 2)]]) / max(frame.variation, 1e-300)
