"""Retrieval of images by shape: visual words, binary codes, a model to keep, an index to search."""

from .bits import hamming_distances, pack_bits, unpack_bits
from .codes import IterativeQuantization, LocalitySensitiveHashing, SpectralHashing
from .discriminative import DiscriminativeBinaryCodes
from .index import Item, Neighbours, ShapeIndex
from .model import RetrievalModel
from .querying import AddReport, QueryMatch, QueryResult, add_folder, query_index
from .service import ServiceLimits, create_app, serve
from .supervised import CCAIterativeQuantization, ClassifierCodes
from .vocabulary import Description, Vocabulary, describe_picture

__all__ = [
    "AddReport",
    "CCAIterativeQuantization",
    "ClassifierCodes",
    "Description",
    "DiscriminativeBinaryCodes",
    "Item",
    "IterativeQuantization",
    "LocalitySensitiveHashing",
    "Neighbours",
    "QueryMatch",
    "QueryResult",
    "RetrievalModel",
    "ServiceLimits",
    "ShapeIndex",
    "SpectralHashing",
    "Vocabulary",
    "add_folder",
    "create_app",
    "describe_picture",
    "hamming_distances",
    "pack_bits",
    "query_index",
    "serve",
    "unpack_bits",
]
