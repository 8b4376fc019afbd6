"""A picture at the size that matching works on, with its edges and the points drawn from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import BoolArray, FloatArray, IntArray
from ..errors import InputError
from ._opencv import resized
from .blur import EdgeChannels, edge_channels, edge_points
from .picture import Picture
from .registration import carried, inverse

__all__ = ["WORKING_SIZE", "View", "view"]

#: Square root of the number of picture pixels that matching works on.
WORKING_SIZE = 170


@dataclass(frozen=True, eq=False)
class View:
    """A picture at working size, with its edges and the points drawn from them.

    Attributes
    ----------
    picture : Picture
    grey : (h, w) array of float
    edges : EdgeChannels
    points : (n, 2) array of int
    to_working : (3, 3) array of float
        Takes pixels of the source to working pixels.
    """

    picture: Picture
    grey: FloatArray
    edges: EdgeChannels
    points: IntArray
    to_working: FloatArray

    def box_in_source(self, box: tuple[int, int, int, int]) -> FloatArray:
        """Return a box of working pixels in pixels of the source."""
        factors = np.array([self.to_working[0, 0], self.to_working[1, 1]])
        scaled: FloatArray = np.array(box, dtype=np.float64) / np.tile(factors, 2)
        return scaled

    def points_in_source(self, points: FloatArray) -> FloatArray:
        """Return points of the working image in pixels of the source."""
        return carried(inverse(self.to_working), points)

    def region_in_picture(self, region: BoolArray) -> BoolArray:
        """Return a region of working pixels at the picture's size."""
        height, width = self.picture.grey.shape
        return np.asarray(resized(region, width, height) > 0.5)


def view(picture: Picture, features: int, rng: np.random.Generator) -> View:
    """Bring a picture to working size, find its edges and draw points from them.

    Parameters
    ----------
    picture : Picture
    features : int
        Points wanted.
    rng : Generator

    Returns
    -------
    View
    """
    height, width = picture.grey.shape
    factor = WORKING_SIZE / max(1.0, float(np.count_nonzero(picture.mask))) ** 0.5
    shape = (max(1, round(height * factor)), max(1, round(width * factor)))
    if shape[0] * shape[1] > 20 * WORKING_SIZE**2:
        raise InputError("under a twentieth of the image is inside its mask; crop the image to the mask")
    grey = resized(picture.grey, shape[1], shape[0]).astype(np.float64)
    mask = resized(picture.mask, shape[1], shape[0]) > 0.99
    edges = edge_channels(grey, mask=mask)
    points = edge_points(edges.strength, features, rng=rng)
    across, down = shape[1] / picture.size[0], shape[0] / picture.size[1]
    to_working = np.array([[across, 0, (across - 1) / 2], [0, down, (down - 1) / 2], [0, 0, 1.0]])
    return View(picture, grey, edges, points, to_working)
