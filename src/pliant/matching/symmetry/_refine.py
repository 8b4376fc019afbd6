"""Self-maps of a surface between few samples: first guess, growth, and the step to every vertex."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from ..._arrays import FloatArray, IntArray
from ..._kernels import summing_kernel
from ...spectral import Spectrum
from ...spectral.kernels import heat_kernel
from ..functional_map import functional_map
from ._frame import Coarse

# Heat that has spread over a few to some ten per cent of the surface.
_TIMES = (0.02, 0.06, 0.2)
_CELLS = 12
# Eigenfunctions that tell on which side a map leaves a face.
_SMOOTH = 20


def first_map(coarse: Coarse, sources: IntArray, targets: IntArray, k: int) -> FloatArray:
    """Least squares from heat around the pairs, both ways, and signatures; made orthogonal.

    Sources and targets are vertices. Landmarks that change places keep the answer from the identity, which
    signatures alone allow.
    """
    frame = coarse.frame
    spectrum = frame.spectrum
    both = np.concatenate([sources, targets])
    vertices = np.concatenate([coarse.samples, both])
    reduced = Spectrum(
        spectrum.values[:k],
        spectrum.vectors[vertices, :k],
        sp.diags_array(np.concatenate([coarse.weights, np.zeros(len(both))]) * spectrum.area).tocsr(),
    )
    numbers = np.arange(len(coarse.samples), len(vertices))
    swapped = np.concatenate([numbers[len(sources) :], numbers[: len(sources)]])
    times = [time / spectrum.values[1] for time in _TIMES]
    heat_a = np.concatenate([heat_kernel(reduced, time, numbers) for time in times])
    heat_b = np.concatenate([heat_kernel(reduced, time, swapped) for time in times])
    signature = frame.signature[vertices][:, ::4].T
    # Landmarks decide; all signatures together weigh as much as a quarter of them.
    signature = signature * (len(heat_a) / (4 * len(signature))) ** 0.5 / _size(signature)
    scale = _size(heat_a)
    fmap = functional_map(
        reduced,
        reduced,
        np.concatenate([heat_a / scale, signature]).T,
        np.concatenate([heat_b / scale, signature]).T,
        k=k,
    )
    return orthogonal(fmap.matrix)


def grown(coarse: Coarse, matrix: FloatArray, k: int, step: int, *, symmetric: bool = False) -> FloatArray:
    """ZoomOut with an orthogonal map: to points and back, with more eigenfunctions each time.

    A reflection is its own inverse; ``symmetric`` lets the map and its inverse share their errors.
    """
    basis, weighted = coarse.basis, coarse.basis * coarse.weights[:, None]
    size = len(matrix)
    while True:
        points = coarse_points(coarse, matrix)
        size = min(size + step, k)
        matrix = weighted[:, :size].T @ basis[points, :size]
        matrix = orthogonal(matrix + matrix.T if symmetric else matrix)
        if size == k:
            return matrix


def grown_between(a: Coarse, b: Coarse, matrix: FloatArray, k: int, step: int) -> FloatArray:
    """:func:`grown` for a map from a to b, whose matrix takes functions on b to functions on a, both ways at once."""
    weighted = [side.basis * side.weights[:, None] for side in (a, b)]
    size = len(matrix)
    while True:
        there = nearest_images(a.basis[:, :size], matrix, b.basis[:, :size])
        back = nearest_images(b.basis[:, :size], matrix.T, a.basis[:, :size])
        size = min(size + step, k)
        forth = weighted[0][:, :size].T @ b.basis[there, :size]
        matrix = orthogonal(forth + (weighted[1][:, :size].T @ a.basis[back, :size]).T)
        if size == k:
            return matrix


def coarse_points(coarse: Coarse, matrix: FloatArray) -> IntArray:
    """(s,) the sample nearest to the image of each sample, by place among the samples."""
    basis = coarse.basis[:, : len(matrix)]
    return nearest_images(basis, matrix, basis)


def reversed_share(a: Coarse, b: Coarse, matrix: FloatArray, points: IntArray) -> float:
    """Reversed area of a map from a to b as smooth functions see it, at one face of each sample."""
    few = min(_SMOOTH, len(matrix))
    scales = 1 / b.frame.spectrum.values[1:few]
    carried = (a.frame.spectrum.vectors[a.faces][:, :, : len(matrix)] @ matrix)[:, :, 1:few] * scales
    there = b.frame.spectrum.vectors[b.faces[points]][:, :, 1:few] * scales
    u, v = carried[:, 1] - carried[:, 0], carried[:, 2] - carried[:, 0]
    c, d = there[:, 1] - there[:, 0], there[:, 2] - there[:, 0]
    side = (u * c).sum(axis=1) * (v * d).sum(axis=1) - (u * d).sum(axis=1) * (v * c).sum(axis=1)
    return float(a.weights[side < 0].sum())


def orthogonal(matrix: FloatArray) -> FloatArray:
    """Return the nearest orthogonal matrix."""
    left, _values, right = np.linalg.svd(matrix)
    product: FloatArray = left @ right
    return product


def dense_points(coarse: Coarse, matrix: FloatArray) -> IntArray:
    """(n,) image of every vertex, sought in the cells nearest to the image of its sample.

    Nearly always what a search of all vertices finds, at a small part of its cost.
    """
    k = len(matrix)
    frame = coarse.frame
    basis = coarse.basis[:, :k]
    images = basis @ matrix
    near = _nearest_few(basis, images, min(_CELLS, len(basis)))
    order = np.argsort(coarse.cells, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(coarse.cells, minlength=len(basis)))])
    vectors = np.ascontiguousarray(frame.spectrum.vectors[:, :k] * frame.spectrum.area**0.5, dtype=np.float32)
    turned = vectors @ matrix.astype(np.float32)
    found: IntArray = _search_cells(vectors, turned, coarse.cells, order, starts, near)
    return found


def _nearest_few(points: FloatArray, queries: FloatArray, count: int) -> IntArray:
    gaps = (points**2).sum(axis=1) - 2 * queries @ points.T
    return np.argpartition(gaps, count - 1, axis=1)[:, :count]


def nearest_images(basis: FloatArray, matrix: FloatArray, targets: FloatArray) -> IntArray:
    """For each row's image, the nearest target."""
    return nearest_points(basis @ matrix, targets)


def nearest_points(places: FloatArray, targets: FloatArray) -> IntArray:
    """For each place, the nearest target; rounding to single precision decides no map."""
    rows, there = places.astype(np.float32), targets.astype(np.float32)
    squares = np.einsum("ij,ij->i", there, there)
    found: IntArray = (squares - 2 * rows @ there.T).argmin(axis=1)
    return found


def _size(rows: FloatArray) -> float:
    return float(np.sqrt((rows**2).mean())) or 1.0


@summing_kernel
def _search_cells(vectors: Any, turned: Any, cells: Any, order: Any, starts: Any, near: Any) -> Any:
    n, k = vectors.shape
    found = np.zeros(n, np.int64)
    for v in range(n):
        best = np.float32(np.inf)
        for c in near[cells[v]]:
            for i in range(starts[c], starts[c + 1]):
                u = order[i]
                # Without a way out early, so that the sum runs in vector registers.
                total = np.float32(0.0)
                for j in range(k):
                    step = vectors[u, j] - turned[v, j]
                    total += step * step
                if total < best or (total == best and u < found[v]):
                    best = total
                    found[v] = u
    return found
