"""A left ventricle drawn at random: its wall, trabeculae that change with stenosis, papillary muscles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .._arrays import FloatArray, IntArray
from ._ventricle_kernels import blood_distances, wall_distance

# Territory (0 LAD, 1 LCX, 2 RCA) of AHA segments 1 to 17 (Cerqueira et al. 2002).
TERRITORY = np.array([0, 0, 2, 2, 1, 1, 0, 0, 2, 2, 1, 1, 0, 0, 2, 1, 0])
# Cuts of the long axis, apex 0 to base 1: the apical cap, then thirds.
CUTS = (0.06, 1 / 3, 2 / 3)

# Trabeculae without stenosis: mm between strands across and along, half-width, length, height.
_SPACING, _ALONG, _WIDTH, _LENGTH, _HEIGHT = 5.6, 11.0, 1.35, 7.5, 3.2
_CANDIDATES = 4000


@dataclass(frozen=True, eq=False)
class Ventricle:
    """The arrays the kernels take (see :mod:`._ventricle_kernels`), and the height of the apex."""

    wall: FloatArray
    ridges: FloatArray
    muscles: FloatArray
    offset: float

    @property
    def arrays(self) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """What the kernels take, in their order."""
        return self.wall, self.ridges, self.muscles, self.offset

    def distances(self, points: FloatArray) -> FloatArray:
        """(n,) implicit function of the blood pool at (n, 3) points of the heart frame."""
        flat = np.ascontiguousarray(points, dtype=np.float64)
        values: FloatArray = blood_distances(flat, self.wall, self.ridges, self.muscles, self.offset)
        return values

    def gradients(self, points: FloatArray, step: float = 1e-4) -> FloatArray:
        """(n, 3) central differences of :meth:`distances`."""
        columns = []
        for axis in range(3):
            shift = np.zeros(3)
            shift[axis] = step
            columns.append((self.distances(points + shift) - self.distances(points - shift)) / (2 * step))
        return np.column_stack(columns)

    def projected(
        self, points: FloatArray, *, in_plane: FloatArray | None = None, rounds: int = 8
    ) -> FloatArray:
        """Move points onto the zero set by Newton steps; those ``in_plane`` keep their z."""
        moved = points.copy()
        for _ in range(rounds):
            slopes = self.gradients(moved)
            if in_plane is not None:
                slopes[in_plane, 2] = 0
            lengths = np.maximum(np.einsum("ij,ij->i", slopes, slopes), 0.05)
            steps = slopes * (self.distances(moved) / lengths)[:, None]
            far = np.maximum(np.linalg.norm(steps, axis=1, keepdims=True) / 0.5, 1.0)
            moved -= steps / far
        return moved

    def on_ray(self, origin: FloatArray, direction: FloatArray, reach: float = 90.0) -> FloatArray:
        """(3,) where a ray from inside the blood first leaves it."""
        low, high = 0.0, 0.0
        for high in np.arange(0.25, reach, 0.25):
            if self.distances((origin + high * direction)[None])[0] > 0:
                break
            low = float(high)
        for _ in range(50):
            middle = 0.5 * (low + high)
            inside = self.distances((origin + middle * direction)[None])[0] < 0
            low, high = (middle, high) if inside else (low, middle)
        return origin + 0.5 * (low + high) * direction


def segment_labels(points: FloatArray, apex_height: float) -> IntArray:
    """(n,) AHA segments of points in the heart frame; 0 above the basal plane."""
    along = (points[:, 2] - apex_height) / -apex_height
    turn = np.degrees(np.arctan2(points[:, 1], points[:, 0])) % 360
    # From the middle of the septum towards the anterior wall: 2 1 6 5 4 3, and 14 13 16 15 of the apical ring.
    six = np.array([2, 1, 6, 5, 4, 3])[(turn // 60).astype(int) % 6]
    four = np.array([14, 13, 16, 15])[((turn + 45) // 90).astype(int) % 4]
    labels: IntArray = np.select(
        [along < CUTS[0], along < CUTS[1], along < CUTS[2]], [17, four, six + 6], six
    )
    labels[points[:, 2] >= -1e-9] = 0
    return labels


def draw_ventricle(
    rng: np.random.Generator,
    stenosis: FloatArray,
    change: Mapping[str, FloatArray],
    *,
    trabeculation: float = 1.0,
) -> Ventricle:
    """Draw a ventricle.

    ``change`` gives, for "height", "spacing", "direction", "smoothing", how strongly (0 to 1) each of the three
    territories follows its stenosis.
    """
    scale, longer = rng.normal(1.0, 0.05), rng.normal(1.0, 0.04)
    a, b, length = 25.5 * scale, 24.0 * scale * rng.normal(1.0, 0.03), 84.0 * scale * longer
    level = -0.3 * length
    # At the basal plane the wall is 0.9 as wide as at its widest.
    wall = np.array([a, b, length + level, -level / np.sqrt(1 - 0.9**2), level])
    ridges = _trabeculae(rng, wall, stenosis / 100, change, trabeculation)
    muscles = _papillary_muscles(rng, wall, length)
    return Ventricle(wall, ridges, muscles, _mean_height(wall, ridges))


def _papillary_muscles(rng: np.random.Generator, wall: FloatArray, length: float) -> FloatArray:
    rows = []
    for turn in np.radians(rng.normal([140.0, 250.0], 6.0)):
        low, high = -length * rng.normal(0.66, 0.02), -length * rng.normal(0.30, 0.03)
        outwards = np.array([np.cos(turn), np.sin(turn)])
        root = np.sqrt(1 - ((low - wall[4]) / wall[2]) ** 2) * wall[:2] * outwards
        tip = rng.normal(0.5, 0.03) * wall[:2] * outwards
        rows.append([*root, low, *tip, high, rng.normal(5.0, 0.4), rng.normal(3.4, 0.2)])
    return np.array(rows)


def _surface_points(rng: np.random.Generator, wall: FloatArray, n: int) -> FloatArray:
    """(n, 3) points of the smooth wall, by area, up to a little above the basal plane."""
    kept: list[FloatArray] = []
    while sum(map(len, kept)) < n:
        ball = rng.normal(size=(2 * n, 3))
        ball /= np.linalg.norm(ball, axis=1, keepdims=True)
        depth = np.where(ball[:, 2] < 0, wall[2], wall[3])
        axes = np.column_stack([np.full(2 * n, wall[0]), np.full(2 * n, wall[1]), depth])
        stretch = axes.prod(axis=1) * np.linalg.norm(ball / axes, axis=1)
        points = ball * axes + [0, 0, wall[4]]
        kept.append(points[(rng.random(2 * n) * stretch.max() < stretch) & (points[:, 2] < 4)])
    return np.concatenate(kept)[:n]


def _directions(points: FloatArray, wall: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return unit tangents of the smooth wall: towards the base, and around."""
    depth = np.where(points[:, 2] < wall[4], wall[2], wall[3])
    normals = np.column_stack(
        [points[:, 0] / wall[0] ** 2, points[:, 1] / wall[1] ** 2, (points[:, 2] - wall[4]) / depth**2]
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    around = np.cross([0.0, 0.0, 1.0], normals)
    around /= np.maximum(np.linalg.norm(around, axis=1, keepdims=True), 1e-9)
    return np.cross(normals, around), around


def _trabeculae(
    rng: np.random.Generator,
    wall: FloatArray,
    severity: FloatArray,
    change: Mapping[str, FloatArray],
    much: float,
) -> FloatArray:
    points = _surface_points(rng, wall, _CANDIDATES)
    up, around = _directions(points, wall)
    apex = wall[4] - wall[2]
    territory = TERRITORY[np.maximum(segment_labels(np.minimum(points, [np.inf, np.inf, -1.0]), apex), 1) - 1]
    follow = {name: strength[territory] * severity[territory] for name, strength in change.items()}
    # Towards the base, and there most of all, trabeculae grow sparse.
    sparse = 1 + 0.5 * np.clip((points[:, 2] - apex) / -apex - 0.55, 0, None) / 0.45
    spread = sparse * (1 + 0.8 * follow["spacing"]) / np.sqrt(max(much, 0.05))
    turn = rng.normal(0, np.radians(14), len(points)) + np.radians(75) * follow["direction"]
    along = np.cos(turn)[:, None] * up + np.sin(turn)[:, None] * around
    across = np.cos(turn)[:, None] * around - np.sin(turn)[:, None] * up
    blurred = np.sqrt(_WIDTH**2 + (1.8 * follow["smoothing"]) ** 2)
    height = much * _HEIGHT * rng.lognormal(0, 0.18, len(points)) * _WIDTH / blurred
    height *= 1 - 0.65 * follow["height"]
    rows = np.column_stack(
        [points, across, along, height, blurred, _LENGTH * rng.lognormal(0, 0.15, len(points))]
    )
    return rows[_spread_out(rows, spread)]


def _spread_out(rows: FloatArray, spread: FloatArray) -> IntArray:
    """Numbers of the rows kept, in order, so that each keeps its distance from those before it."""
    kept: list[int] = []
    for i, row in enumerate(rows):
        offsets = row[:3] - rows[kept, :3]
        across = np.einsum("ij,ij->i", offsets, rows[kept, 3:6]) / _SPACING
        along = np.einsum("ij,ij->i", offsets, rows[kept, 6:9]) / _ALONG
        far = np.einsum("ij,ij->i", offsets, offsets) > (2 * _ALONG) ** 2
        if (far | (across**2 + along**2 > spread[i] ** 2)).all():
            kept.append(i)
    return np.array(kept, dtype=np.int64)


def _mean_height(wall: FloatArray, ridges: FloatArray) -> float:
    """Mean height of the trabeculae: moving the wall out by it keeps the cavity's volume off the list of clues."""
    points = _surface_points(np.random.default_rng(0), wall, 3000)
    none = np.empty((0, 8))
    smooth = np.array([wall_distance(x, y, z, wall)[0] for x, y, z in points])
    return float(np.mean(blood_distances(points, wall, ridges, none, 0.0) - smooth))
