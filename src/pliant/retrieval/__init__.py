"""Retrieval of images by shape: visual words, binary codes, a model to keep, an index to search."""

from .bits import hamming_distances, pack_bits, unpack_bits
from .codes import IterativeQuantization, LocalitySensitiveHashing, SpectralHashing
from .discriminative import DiscriminativeBinaryCodes
from .model import RetrievalModel
from .supervised import CCAIterativeQuantization, ClassifierCodes
from .vocabulary import Description, Vocabulary, describe_picture

__all__ = [
    "CCAIterativeQuantization",
    "ClassifierCodes",
    "Description",
    "DiscriminativeBinaryCodes",
    "IterativeQuantization",
    "LocalitySensitiveHashing",
    "RetrievalModel",
    "SpectralHashing",
    "Vocabulary",
    "describe_picture",
    "hamming_distances",
    "pack_bits",
    "unpack_bits",
]
