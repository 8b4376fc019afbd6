"""Images: geometric blur, joint embedding of two images, partial matching, synthetic pairs, baselines."""

from .blur import EdgeChannels, edge_channels, edge_points, geometric_blur
from .embedding import embed_pair, mutual_matches
from .matching import PairMatch, match_pair
from .picture import Picture, as_picture, load_picture
from .region import best_rectangle, smallest_rectangle
from .registration import Registration, registrations

__all__ = [
    "EdgeChannels",
    "PairMatch",
    "Picture",
    "Registration",
    "as_picture",
    "best_rectangle",
    "edge_channels",
    "edge_points",
    "embed_pair",
    "geometric_blur",
    "load_picture",
    "match_pair",
    "mutual_matches",
    "registrations",
    "smallest_rectangle",
]
