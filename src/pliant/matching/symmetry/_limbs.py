"""Limbs: tips far from everything, the balls around them, and which of them grow alike."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csgraph

from ..._arrays import BoolArray, FloatArray, IntArray, frozen
from ..._kernels import kernel
from ...geodesic.graph import edge_graph
from ...mesh.topology import grouped
from ._frame import Frame

# Radii of balls, in square roots of the surface's area.
_STEP, _FARTHEST = 0.02, 1.2
_SMALLEST = 2
# Tips of limbs stand out by .15 and more of the RMS distance, ears and toes by .015 and less.
_STANDS_OUT = 0.1
# Area of a ball over that of a flat disc: limbs have .11 to .25 at their root, heads .3 to .5, bumps .7.
_NARROW = 0.35
# How far a ball may reach towards the nearest other tip before it is no longer about one limb.
_REACH = 0.6
# Logarithms of ratios of areas. True pairs of bent animals have means up to .094 and maxima up to .20.
_ALIKE, _ALIKE_EVERYWHERE = 0.12, 0.25
_ROOTS_ALIKE = 0.6
_WAY_TO_MEETING = 0.9


@dataclass(frozen=True, eq=False, repr=False)
class Limbs:
    """Tips of a surface with geodesic balls around them.

    Parameters
    ----------
    frame : Frame
    tips : (t,) array of int
    """

    frame: Frame
    tips: IntArray

    @cached_property
    def distances(self) -> FloatArray:
        """(t, n) geodesic distance from each tip, in square roots of the area."""
        mesh = self.frame.mesh
        graph = edge_graph(mesh, "refined").matrix()
        rows: FloatArray = csgraph.dijkstra(graph, indices=self.tips) / mesh.area**0.5
        return frozen(rows)

    @cached_property
    def radii(self) -> FloatArray:
        """(r,) radii of the balls."""
        return frozen(_STEP * np.arange(1, round(_FARTHEST / _STEP) + 1))

    @cached_property
    def areas(self) -> FloatArray:
        """(t, r) share of the surface's area in each ball."""
        place = np.searchsorted(self.radii, self.distances)
        size = len(self.radii) + 1
        rows = [np.bincount(row, weights=self.frame.areas, minlength=size)[:-1].cumsum() for row in place]
        return frozen(np.array(rows).reshape(len(self.tips), -1))

    @cached_property
    def narrowness(self) -> FloatArray:
        """(t, r) area of each ball over that of a flat disc."""
        return frozen(self.areas / (np.pi * self.radii**2))

    @cached_property
    def between(self) -> FloatArray:
        """(t, t) distances between tips, inf from each to itself."""
        found = np.minimum(self.distances[:, self.tips], self.distances[:, self.tips].T)
        np.fill_diagonal(found, np.inf)
        return frozen(found)

    @cached_property
    def roots(self) -> IntArray:
        """(t,) place of the radius where each limb ends: where its ball is narrowest beside a flat disc."""
        stops = np.searchsorted(self.radii, _REACH * self.between.min(axis=1, initial=np.inf))
        stops = np.clip(stops, _SMALLEST + 1, len(self.radii))
        rows = self.narrowness
        return np.array(
            [_SMALLEST + int(row[_SMALLEST:stop].argmin()) for row, stop in zip(rows, stops, strict=True)]
        )

    def profile_gap(self, i: int, j: int, place: int) -> tuple[float, float]:
        """Mean and largest logarithm of the ratio of two limbs' areas, up to a radius."""
        rows = self.areas[[i, j], _SMALLEST : place + 1]
        gaps = np.abs(np.log(np.maximum(rows[0], 1e-12) / np.maximum(rows[1], 1e-12)))
        return (float(gaps.mean()), float(gaps.max())) if len(gaps) else (np.inf, np.inf)

    def alike(self, i: int, j: int) -> bool:
        """Whether two tips are those of limbs, of about one length, whose balls grow alike."""
        place = int(min(self.roots[i], self.roots[j]))
        if self.radii[place] < _ROOTS_ALIKE * self.radii[max(self.roots[i], self.roots[j])]:
            return False
        if max(self.narrowness[i, place], self.narrowness[j, place]) > _NARROW:
            return False
        mean, largest = self.profile_gap(i, j, place)
        return mean <= _ALIKE and largest <= _ALIKE_EVERYWHERE

    def pairs(self) -> IntArray:
        """(p, 2) places of the tips of limbs that are alike."""
        count = len(self.tips)
        found = [(i, j) for i in range(count) for j in range(i + 1, count) if self.alike(i, j)]
        return np.array(found, dtype=np.int64).reshape(-1, 2)

    def families(self, pairs: IntArray) -> list[IntArray]:
        """Split pairs into those of limbs that hang together by being alike."""
        _, labels = grouped(len(self.tips), pairs)
        return [pairs[labels[pairs[:, 0]] == label] for label in np.unique(labels[pairs[:, 0]])]

    def radius(self, pairs: IntArray) -> float:
        """Radius common to a family: nearly to where two of its balls meet, while areas agree.

        Tips keep their distance when a surface bends; the place where a limb's girth grows moves more.
        """
        meeting = _WAY_TO_MEETING * self.between[pairs[:, 0], pairs[:, 1]].min() / 2
        place = int(np.searchsorted(self.radii, meeting))
        members = np.unique(pairs)
        place = min(place, int(np.searchsorted(self.radii, _REACH * self.between[members].min())))
        place = min(place, len(self.radii) - 1)
        while place > _SMALLEST and any(
            self.profile_gap(i, j, place)[1] > _ALIKE_EVERYWHERE for i, j in pairs.tolist()
        ):
            place -= 1
        return float(min(meeting, self.radii[place]))

    def ball(self, i: int, radius: float) -> BoolArray:
        """(n,) whether a vertex is within a distance from a tip."""
        inside: BoolArray = self.distances[i] <= radius
        return inside


def limbs_of(frame: Frame) -> Limbs:
    """Find the tips: maxima of the biharmonic eccentricity, well above the saddle towards a higher one."""
    eccentricity = np.linalg.norm(frame.embedding, axis=1)
    order = np.argsort(-eccentricity, kind="stable")
    edges = frame.neighbours
    peaks = _standing_out(eccentricity, order, edges.indptr, edges.indices, _STANDS_OUT)
    return Limbs(frame, np.asarray(peaks[np.argsort(-eccentricity[peaks], kind="stable")], dtype=np.int64))


@kernel
def _standing_out(values: Any, order: Any, starts: Any, heads: Any, least: Any) -> Any:
    """Return the peaks whose height over the saddle where a higher peak's slope takes over is enough (persistence)."""
    n = len(values)
    parent = np.full(n, -1, np.int64)
    peak = np.zeros(n, np.int64)
    kept = np.zeros(n, np.bool_)
    for v in order:
        parent[v] = v
        peak[v] = v
        for e in range(starts[v], starts[v + 1]):
            u = np.int64(heads[e])
            if parent[u] < 0:
                continue
            while parent[u] != u:
                parent[u] = parent[parent[u]]
                u = parent[u]
            root = v
            while parent[root] != root:
                parent[root] = parent[parent[root]]
                root = parent[root]
            if u == root:
                continue
            if values[peak[u]] < values[peak[root]]:
                u, root = root, u
            # The slope of the lower peak ends here.
            if peak[root] != v and values[peak[root]] - values[v] >= least:
                kept[peak[root]] = True
            parent[root] = u
    kept[order[0]] = values[order[0]] - values[order[n - 1]] >= least
    return np.flatnonzero(kept)
