"""Laplacians, the eigenbasis, spectral kernels and distances, joint spectral embedding."""

from .basis import eigenbasis
from .joint import joint_embedding
from .kernels import (
    biharmonic_distances,
    biharmonic_embedding,
    biharmonic_kernel,
    commute_time_distances,
    commute_time_embedding,
    commute_time_kernel,
    diffusion_distances,
    diffusion_embedding,
    heat_kernel,
    wave_kernel,
)
from .laplacian import Laplacian, cotan_laplacian, laplacian
from .spectrum import Spectrum

__all__ = [
    "Laplacian",
    "Spectrum",
    "biharmonic_distances",
    "biharmonic_embedding",
    "biharmonic_kernel",
    "commute_time_distances",
    "commute_time_embedding",
    "commute_time_kernel",
    "cotan_laplacian",
    "diffusion_distances",
    "diffusion_embedding",
    "eigenbasis",
    "heat_kernel",
    "joint_embedding",
    "laplacian",
    "wave_kernel",
]
