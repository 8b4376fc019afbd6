"""Many small maps at once: starts that an intrinsic symmetry cannot mix, grown on few samples, and judged."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product as combinations

import numpy as np
from scipy.spatial.distance import pdist, squareform

from .._arrays import FloatArray, IntArray
from ._side import TURNING, Side

# Two neighbouring eigenvalues closer than this may change places from one pose to another.
_CLOSE = 0.12
_MOST_SWAPS = 3


@dataclass(frozen=True, eq=False)
class Candidates:
    """Maps that compete.

    Parameters
    ----------
    matrices : (h, k, k) array of float
        Functional maps from a to b on unit-area surfaces.
    points : (h, s) array of int
        For each sample of b the sample of a it goes to.
    """

    matrices: FloatArray
    points: IntArray

    def chosen(self, which: IntArray) -> Candidates:
        """Return some of them."""
        return Candidates(self.matrices[which], self.points[which])


def sign_starts(a: Side, b: Side, size: int) -> FloatArray:
    """(h, size, size): every choice of signs of the eigenfunctions past the constant.

    An isometry carries simple eigenfunctions to themselves up to sign, so that one of these is right
    and another one is its mirror image; mixtures do not start. Where neighbouring eigenvalues are close
    their functions are also tried in exchanged order.
    """
    signs = np.array(list(combinations((1.0, -1.0), repeat=size - 1)))
    signs = np.column_stack([np.ones(len(signs)), signs])
    orders = [np.arange(size), *_swapped_orders(a, b, size)]
    starts = np.zeros((len(orders), len(signs), size, size))
    for i, order in enumerate(orders):
        starts[i][:, order, np.arange(size)] = signs
    return starts.reshape(-1, size, size)


def _swapped_orders(a: Side, b: Side, size: int) -> list[IntArray]:
    ratios = np.minimum(*(side.values[2:size] / side.values[1 : size - 1] for side in (a, b)))
    closest = [i + 1 for i in np.argsort(ratios) if ratios[i] < 1 + _CLOSE][:_MOST_SWAPS]
    orders = []
    for i in closest:
        order = np.arange(size)
        order[[i, i + 1]] = order[[i + 1, i]]
        orders.append(order)
    return orders


def grow(starts: FloatArray, a: Side, b: Side, size: int, step: int = 1) -> Candidates:
    """Run ZoomOut on all starts at once, between samples, up to a size."""
    matrices = starts
    while True:
        k = matrices.shape[1]
        points = _sample_points(matrices, a, b)
        if k >= size:
            return Candidates(matrices, points)
        matrices = _fitted(points, a, b, min(k + step, size))


def branch(starts: FloatArray, a: Side, b: Side, size: int, width: int, orientation: int) -> Candidates:
    """Grow maps one eigenfunction at a time, both signs of each new one tried, the best ``width`` kept.

    A limb that is mirrored against the body shows only once the eigenfunctions reach it; ZoomOut
    alone would have settled the matter by then (Ren et al. 2020 explore the same tree). Best first.
    """
    matrices = starts
    while True:
        k = matrices.shape[1]
        matrices = _fitted(_sample_points(matrices, a, b), a, b, k)
        points = _sample_points(matrices, a, b)
        distinct = np.sort(np.unique(points, axis=0, return_index=True)[1])
        found = Candidates(matrices[distinct], points[distinct])
        found = found.chosen(ranked(found, a, b, orientation)[:width])
        if k >= size:
            return found
        matrices = np.concatenate([_fitted(found.points, a, b, k + 1), *_extended(found.matrices)])


def _extended(matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the matrices one larger, the new eigenfunction going to itself or to its negative."""
    larger = np.pad(matrices, ((0, 0), (0, 1), (0, 1)))
    smaller = larger.copy()
    larger[:, -1, -1], smaller[:, -1, -1] = 1.0, -1.0
    return larger, smaller


def _fitted(points: IntArray, a: Side, b: Side, k: int) -> FloatArray:
    """(h, k, k) functional maps that fit the samples' images best."""
    fitted: FloatArray = np.linalg.pinv(b.basis[:, :k]) @ a.basis[:, :k][points]
    return fitted


def at_samples(matrices: FloatArray, a: Side, b: Side) -> Candidates:
    """Return functional maps with the samples they send samples to."""
    return Candidates(matrices, _sample_points(matrices, a, b))


def _sample_points(matrices: FloatArray, a: Side, b: Side) -> IntArray:
    """(h, s) nearest sample of a for every sample of b. Ties matter to nobody here, so float32 will do."""
    k = matrices.shape[1]
    carried = (a.basis[:, :k] @ matrices.transpose(0, 2, 1)).astype(np.float32)
    squares = np.einsum("hsk,hsk->hs", carried, carried)
    products = b.basis[:, :k].astype(np.float32) @ carried.transpose(0, 2, 1)
    nearest: IntArray = (squares[:, None, :] - 2 * products).argmin(axis=2)
    return nearest


def measures(candidates: Candidates, a: Side, b: Side, orientation: int = 0) -> dict[str, FloatArray]:
    """Return what an isometry has small, each as (h,): nothing here knows the truth.

    ``orthogonality`` and ``commutativity`` of the functional map, distortion of biharmonic ``distances``
    between samples, difference of ``descriptors``, and ``folding``: 0 where the whole surface keeps its
    orientation (``orientation`` 1), turns over (-1), or does either (0); 1 where half of it does.
    """
    C, points = candidates.matrices, candidates.points
    k = C.shape[1]
    values_a, values_b = a.values[:k], b.values[:k]
    gram = C.transpose(0, 2, 1) @ C - np.eye(k)
    found = {
        "orthogonality": _norms(gram) / k**0.5,
        "commutativity": _norms(C * values_a - values_b[:, None] * C) / np.linalg.norm(values_b),
        "distances": _distance_distortion(points, a, b),
        "descriptors": np.abs(a.descriptors[points] - b.descriptors).mean(axis=(1, 2)),
    }
    turning = orientations(candidates, a, b)
    if turning is not None:
        found["folding"] = 1 - (orientation * turning if orientation else np.abs(turning))
    return found


def scores(found: dict[str, FloatArray]) -> FloatArray:
    """(h,) sum of the measures, which have no unit and are 0 for a perfect isometry."""
    total: FloatArray = np.sum(list(found.values()), axis=0)
    return total


def ranked(candidates: Candidates, a: Side, b: Side, orientation: int) -> IntArray:
    """Return the order of the candidates, best first; of those that turn the wrong way none while others last."""
    total = scores(measures(candidates, a, b, orientation))
    turning = orientations(candidates, a, b) if orientation else None
    wrong = np.zeros(len(total), dtype=bool) if turning is None else orientation * turning <= 0
    allowed = np.flatnonzero(~wrong) if not wrong.all() else np.arange(len(total))
    order: IntArray = allowed[np.argsort(total[allowed], kind="stable")]
    return order


def orientations(candidates: Candidates, a: Side, b: Side) -> FloatArray | None:
    """(h,) from 1 (orientation kept everywhere) to -1 (turned over everywhere); None without oriented meshes."""
    if a.turns is None or b.turns is None:
        return None
    k = min(TURNING, candidates.matrices.shape[1])
    C = candidates.matrices[:, None, :k, :k]
    carried = C.transpose(0, 1, 3, 2) @ b.turns[:, :k, :k] @ C  # (h, s, k, k)
    there = a.turns[candidates.points][..., :k, :k]
    lengths = np.sqrt((carried**2).sum(axis=(1, 2, 3)) * (there**2).sum(axis=(1, 2, 3)))
    result: FloatArray = (carried * there).sum(axis=(1, 2, 3)) / np.maximum(lengths, 1e-300)
    return result


def _norms(matrices: FloatArray) -> FloatArray:
    norms: FloatArray = np.sqrt((matrices**2).sum(axis=(1, 2)))
    return norms


def _distance_distortion(points: IntArray, a: Side, b: Side) -> FloatArray:
    between_a, between_b = _between(a.places), _between(b.places)
    gaps = [np.abs(between_a[np.ix_(p, p)] - between_b).mean() for p in points]
    distortion: FloatArray = np.array(gaps, dtype=np.float64) / between_b.mean()
    return distortion


def _between(places: FloatArray) -> FloatArray:
    distances: FloatArray = squareform(pdist(places))
    return distances
