"""Retrieval of images by shape: visual words, binary codes, a model to keep, an index to search."""

from .bits import hamming_distances, pack_bits, unpack_bits
from .codes import IterativeQuantization, LocalitySensitiveHashing, SpectralHashing
from .discriminative import DiscriminativeBinaryCodes
from .index import Item, Neighbours, ShapeIndex
from .model import RetrievalModel
from .outlines import outline_drawing
from .protocol import RetrievalStudy, evaluate_retrieval
from .querying import AddReport, QueryMatch, QueryResult, add_folder, query_index
from .service import ServiceLimits, create_app, serve
from .supervised import CCAIterativeQuantization, ClassifierCodes
from .training import train_retrieval
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
    "RetrievalStudy",
    "ServiceLimits",
    "ShapeIndex",
    "SpectralHashing",
    "Vocabulary",
    "add_folder",
    "create_app",
    "describe_picture",
    "evaluate_retrieval",
    "hamming_distances",
    "outline_drawing",
    "pack_bits",
    "query_index",
    "serve",
    "train_retrieval",
    "unpack_bits",
]
