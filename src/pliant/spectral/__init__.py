"""Laplacians, the eigenbasis, spectral kernels and distances, joint spectral embedding."""

from .basis import eigenbasis
from .laplacian import Laplacian, cotan_laplacian, laplacian
from .spectrum import Spectrum

__all__ = ["Laplacian", "Spectrum", "cotan_laplacian", "eigenbasis", "laplacian"]
