"""Perturbations: the nine classes of SHREC 2010 at five strengths, each with the map back to the null shape."""

from .bend import edge_strain, isometry
from .cut import holes, micro_holes
from .dispatch import perturbed
from .displace import local_scale, noise, scale, shot_noise, with_noise
from .result import Kind, Perturbed
from .sample import sampling
from .weld import topology_change

__all__ = [
    "Kind",
    "Perturbed",
    "edge_strain",
    "holes",
    "isometry",
    "local_scale",
    "micro_holes",
    "noise",
    "perturbed",
    "sampling",
    "scale",
    "shot_noise",
    "topology_change",
    "with_noise",
]
