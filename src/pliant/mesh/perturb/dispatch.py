"""One door to the nine classes of perturbation."""

from __future__ import annotations

from collections.abc import Callable
from typing import get_args

from ...errors import InputError
from ..shapes import Figure
from ..surface import Mesh
from .bend import isometry
from .cut import holes, micro_holes
from .displace import local_scale, noise, scale, shot_noise
from .result import Kind, Perturbed, Seed
from .sample import sampling
from .weld import topology_change

__all__ = ["perturbed"]

_BY_CHANCE: dict[str, Callable[..., Perturbed]] = {
    "topology": topology_change,
    "micro_holes": micro_holes,
    "holes": holes,
    "local_scale": local_scale,
    "noise": noise,
    "shot_noise": shot_noise,
    "sampling": sampling,
}


def perturbed(shape: Mesh | Figure, kind: Kind, *, strength: int, rng: Seed) -> Perturbed:
    """Perturb a shape as one of the nine classes of the SHREC 2010 benchmark does.

    ========================= ================================================ ==================
    kind                      what changes                                     strength 1 to 5
    ========================= ================================================ ==================
    ``"isometry"``            pose                                             14 to 70 degrees
    ``"topology"``            places near in space are joined                  1 to 5 handles
    ``"micro_holes"``         one-ring holes                                   0.5 to 2.5 % of the vertices
    ``"holes"``               big holes, 2 % of the area each                  1 to 5 holes
    ``"scale"``               size                                             1.25 to 3.05 times
    ``"local_scale"``         three balls of space are inflated                1.25 to 2.25 times
    ``"noise"``               every vertex moves along its normal              0.1 to 0.5 mean edge lengths
    ``"shot_noise"``          a few vertices move far                          0.2 to 1 % of the vertices
    ``"sampling"``            vertices are taken away                          16 to 80 %
    ========================= ================================================ ==================

    The benchmark's own files are not published with their parameters; these are Pliant's, chosen to cover the
    same range.

    Parameters
    ----------
    shape : Mesh or Figure
        The null shape. A posable figure takes a random pose under ``"isometry"`` and is its mesh otherwise.
    kind : str
        One of the nine classes.
    strength : int
        0 returns the null shape itself; 1 to 5 change more and more.
    rng : int or numpy.random.Generator
        Seed; the same one gives the same bytes.

    Returns
    -------
    Perturbed
        With the map back to the null shape.

    Raises
    ------
    InputError
        If the kind is unknown or the strength is out of range.
    MeshError
        If the mesh is too small or too broken for the class: no edge with a length, no place for a hole.

    Notes
    -----
    Under a second for 28 thousand vertices, isometry two. All but ``"topology"`` and the holes keep topology;
    these two keep the surface manifold where it was.

    References
    ----------
    A. M. Bronstein et al., "SHREC 2010: robust correspondence benchmark", 3DOR 2010; dissertation,
    sections 3.5 and 4.5.

    Examples
    --------
    >>> from pliant import shapes
    >>> rough = perturbed(shapes.icosphere(3), "sampling", strength=2, rng=0)
    >>> rough.mesh.n_vertices, rough.source.shape
    (437, (437,))
    """
    if kind not in get_args(Kind):
        message = f"kind must be one of {', '.join(get_args(Kind))}; got {kind!r}"
        raise InputError(message)
    if kind == "isometry":
        return isometry(shape, strength=strength, rng=rng)
    mesh = shape if isinstance(shape, Mesh) else shape.mesh
    if kind == "scale":
        return scale(mesh, strength=strength)
    return _BY_CHANCE[kind](mesh, strength=strength, rng=rng)
