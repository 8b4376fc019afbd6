"""Images: geometric blur, joint embedding of two images, partial matching, synthetic pairs, baselines."""

from .baselines import match_blur, match_centre, match_keypoints, match_saliency, match_whole
from .blur import EdgeChannels, edge_channels, edge_points, geometric_blur
from .embedding import embed_pair, mutual_matches
from .matching import PairMatch, match_pair
from .pairs import ImagePair, moved, shipped_photographs, synthetic_pair, synthetic_pairs
from .picture import Picture, as_picture, decode_picture, load_picture
from .records import PairRecord, read_pairs
from .region import best_rectangle, smallest_rectangle
from .registration import Registration, registrations
from .study import PairStudy, evaluate_pairs, repeated_matches, unrelated_scores

__all__ = [
    "EdgeChannels",
    "ImagePair",
    "PairMatch",
    "PairRecord",
    "PairStudy",
    "Picture",
    "Registration",
    "as_picture",
    "best_rectangle",
    "decode_picture",
    "edge_channels",
    "edge_points",
    "embed_pair",
    "evaluate_pairs",
    "geometric_blur",
    "load_picture",
    "match_blur",
    "match_centre",
    "match_keypoints",
    "match_pair",
    "match_saliency",
    "match_whole",
    "moved",
    "mutual_matches",
    "read_pairs",
    "registrations",
    "repeated_matches",
    "shipped_photographs",
    "smallest_rectangle",
    "synthetic_pair",
    "synthetic_pairs",
    "unrelated_scores",
]
