"""Maps between two limbs: each with its own eigenbasis, many first guesses, refined, measured, and made to agree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import permutations

import numpy as np

from ..._arrays import BoolArray, FloatArray, IntArray
from ...errors import NumericalError
from ...mesh import Mesh, boundary_loops, vertex_components
from ...spectral import Spectrum, eigenbasis
from ._frame import Coarse, Frame
from ._refine import grown_between, nearest_images, orthogonal, reversed_share

_PAIRS = 40
FEWEST = 120
# Largest distortion of a map. Legs of bent animals, front to hind, have up to .15.
WORST = 0.25
_SAMPLES = 300
_START, _STEP = 14, 4
_QUARTERS, _TURNS = 4, 12
_DEPTHS = 6
_TIMES = (0.1, 0.4)
_KEPT = 3
_SAME = 0.15
# What an error of composed maps, from 0 to 2, and folding weigh against distortion and difference of signatures.
_CYCLE = 0.1
_FOLDING = 0.1


@dataclass(frozen=True, eq=False, repr=False)
class Region:
    """A limb as a surface of its own.

    Parameters
    ----------
    vertices : (m,) array of int
        Its vertices on the whole surface, ascending.
    frame : Frame
        Its mesh and eigenbasis.
    depth : (m,) array of float
        Distance from the tip over the largest.
    """

    vertices: IntArray
    frame: Frame
    depth: FloatArray

    @cached_property
    def coarse(self) -> Coarse:
        """Samples that stand for it."""
        return Coarse(self.frame, self.frame.samples(_SAMPLES))

    @cached_property
    def rim(self) -> IntArray:
        """(v,) its vertices around the longest hole, where it was cut off."""
        loops = boundary_loops(self.frame.mesh)
        mean = [self.depth[loop].mean() * len(loop) for loop in loops]
        return loops[int(np.argmax(mean))]

    def marks(self, turn: float, way: int) -> IntArray:
        """Vertices a quarter apart along the rim, from a share of it on, one way or the other."""
        rim = self.rim[::way]
        corners = self.frame.mesh.vertices[rim]
        along = np.linalg.norm(np.diff(corners, axis=0, append=corners[:1]), axis=1)
        share = np.concatenate([[0], np.cumsum(along)[:-1]]) / max(along.sum(), 1e-300)
        wanted = (turn + np.arange(_QUARTERS) / _QUARTERS) % 1
        gaps = np.abs(share[:, None] - wanted)
        return np.asarray(rim[np.minimum(gaps, 1 - gaps).argmin(axis=0)])

    def coefficients(self, marks: IntArray) -> FloatArray:
        """(start, d) what maps should keep, in the first eigenfunctions: depth, and heat around marks on the rim."""
        spectrum = self.frame.spectrum
        basis = spectrum.vectors[:, :_START] * spectrum.area**0.5
        scaled = spectrum.values[:_START] / spectrum.values[1]
        centres = (np.arange(_DEPTHS) + 0.5) / _DEPTHS
        bumps = np.exp(-(((self.depth[:, None] - centres) * _DEPTHS) ** 2) / 2)
        columns = [basis.T @ (self.frame.areas[:, None] * bumps)]
        columns += [np.exp(-time * scaled)[:, None] * basis[marks].T for time in _TIMES]
        return np.concatenate([block / max(float(np.abs(block).max()), 1e-300) for block in columns], axis=1)


def region(mesh: Mesh, inside: BoolArray, depth: FloatArray) -> Region | None:
    """Cut a limb off as a surface with an eigenbasis; None where it has too few vertices, or nothing to be cut from."""
    faces = mesh.faces[inside[mesh.faces].all(axis=1)]
    vertices = np.unique(faces)
    if len(vertices) < FEWEST:
        return None
    part = Mesh(mesh.vertices[vertices], np.searchsorted(vertices, faces))
    count, labels = vertex_components(part)
    if count > 1:
        kept = labels == np.bincount(labels).argmax()
        return region(mesh, _only(inside, vertices[kept]), depth)
    try:
        spectrum = eigenbasis(part, min(_PAIRS, part.n_vertices // 3))
    except NumericalError:
        return None
    own = depth[vertices]
    found = Region(vertices, Frame(part, spectrum), own / own.max())
    return found if boundary_loops(part) else None


def _only(inside: BoolArray, vertices: IntArray) -> BoolArray:
    kept = np.zeros_like(inside)
    kept[vertices] = inside[vertices]
    return kept


@dataclass(frozen=True, eq=False)
class RegionMap:
    """A map from one limb to another.

    Attributes
    ----------
    matrix : (k, k) array of float
        Functions on the second to functions on the first; orthogonal, on surfaces of unit area.
    points : (s,) array of int
        Sample of the second for each sample of the first.
    distortion, residual : float
        Mean change of biharmonic distances over their root mean square; median difference of signatures.
    turned : float
        Share of the first limb that arrives on the other side: near 1 for a reflection, near 0 for a turn.
    """

    matrix: FloatArray
    points: IntArray
    distortion: float
    residual: float
    turned: float

    @property
    def score(self) -> float:
        """Small where the map is good."""
        return self.distortion + self.residual + _FOLDING * (1 - abs(2 * self.turned - 1))


def region_maps(a: Region, b: Region, starts: list[FloatArray]) -> list[RegionMap]:
    """Refine maps from a to b that turn the rim by every share, either way about; keep the best that differ.

    A limb is nearly a surface of revolution: what tells one turn from another shows only in the refined maps. A map
    to start from, that of a reflection, decides it: what it leads to is kept alone, if it changes sides
    and is no bad map.
    """
    k = min(a.frame.spectrum.k, b.frame.spectrum.k)
    there = a.coefficients(a.marks(0.0, 1))
    seeded = [_measured(a, b, grown_between(a.coarse, b.coarse, start, k, _STEP)) for start in starts]
    followed = [one for one in seeded if one.turned > 0.5 and one.distortion <= WORST]
    if followed:
        return followed
    found = seeded
    for way in (1, -1):
        for turn in range(_TURNS):
            back = b.coefficients(b.marks(turn / _TURNS, way))
            guess = orthogonal(there @ back.T)
            found.append(_measured(a, b, grown_between(a.coarse, b.coarse, guess, k, _STEP)))
    found.sort(key=lambda one: one.score)
    kept: list[RegionMap] = []
    for one in found:
        if all(_apart(b, one, other) > _SAME for other in kept):
            kept.append(one)
    return kept[:_KEPT]


def _measured(a: Region, b: Region, matrix: FloatArray) -> RegionMap:
    points = nearest_images(a.coarse.basis[:, : len(matrix)], matrix, b.coarse.basis[:, : len(matrix)])
    here, there = a.coarse.samples, b.coarse.samples[points]
    weights = a.coarse.weights
    change = np.abs(a.frame.distances(here, here) - b.frame.distances(there, there))
    gaps = a.frame.signature[here] - b.frame.signature[there]
    squares = np.einsum("ij,ij->i", gaps, gaps) / (2 * gaps.shape[1])
    order = np.argsort(squares)
    half = int(np.searchsorted(np.cumsum(weights[order]), 0.5))
    return RegionMap(
        matrix,
        points,
        float(weights @ change @ weights),
        float(squares[order[half]]),
        reversed_share(a.coarse, b.coarse, matrix, points),
    )


def _apart(b: Region, one: RegionMap, other: RegionMap) -> float:
    embedding = b.frame.embedding[b.coarse.samples]
    return float(np.linalg.norm(embedding[one.points] - embedding[other.points], axis=1).mean())


def agreeing(candidates: dict[tuple[int, int], list[RegionMap]]) -> dict[tuple[int, int], int]:
    """Choose one candidate a pair so that maps are good and, around triangles of limbs, lead back.

    Starts from the best of each and changes one choice at a time while that helps.
    """
    chosen = dict.fromkeys(candidates, 0)
    members = sorted({limb for pair in candidates for limb in pair})
    triangles = [
        t for t in permutations(members, 3) if t[0] < t[1] < t[2] and all(p in candidates for p in _sides(t))
    ]
    for _ in range(20):
        before = dict(chosen)
        for pair, found in candidates.items():
            around = [t for t in triangles if pair in _sides(t)]
            costs = []
            for i, one in enumerate(found):
                trial = chosen | {pair: i}
                cycles = sum(_cycle(candidates, trial, t) for t in around)
                costs.append(one.score + _CYCLE * cycles)
            chosen[pair] = int(np.argmin(costs))
        if chosen == before:
            break
    return chosen


def _sides(triangle: tuple[int, ...]) -> tuple[tuple[int, int], ...]:
    a, b, c = triangle
    return (a, b), (b, c), (a, c)


def _cycle(
    candidates: dict[tuple[int, int], list[RegionMap]],
    chosen: dict[tuple[int, int], int],
    triangle: tuple[int, ...],
) -> float:
    ab, bc, ac = (candidates[pair][chosen[pair]].matrix[:_START, :_START] for pair in _sides(triangle))
    return float(np.linalg.norm(ab @ bc - ac) / _START**0.5)


def spectral_gap(a: Spectrum, b: Spectrum, k: int = 15) -> float:
    """Mean difference of the logarithms of the first eigenvalues, areas brought to one: 0 between isometric regions."""
    k = min(k, a.k, b.k)
    left, right = (np.log(one.values[1:k] * one.area) for one in (a, b))
    return float(np.abs(left - right).mean())
