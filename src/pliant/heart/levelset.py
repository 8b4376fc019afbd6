"""Distance-regularised level sets in two and three dimensions (Li et al. 2005, 2010), on a narrow band."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from .._arrays import BoolArray, FloatArray, frozen
from .._parallel import job_count, ordered_map
from .._progress import progress_bar
from ..errors import InputError
from ._level_set_kernels import apply_changes, changes_on, front_places, kept_front, layers_around, normals_on
from .volume import checked_spacing

__all__ = ["LevelSet", "distance_regularized_level_set"]

Force: TypeAlias = Literal["region", "edge"]
Potential: TypeAlias = Literal["double-well", "single-well"]
Field: TypeAlias = NDArray[np.float32]

# Iterations between two looks at the front; even, so that a voxel that flips back and forth is not counted.
_LOOK = 6
# Half-width of the delta function, and what phi is kept within, in units of the smallest spacing.
_DELTA, _LIMIT = 1.5, 4.0
# Voxels a thread takes at a time: enough that passing them on costs nothing.
_CHUNK = 40_000


@dataclass(frozen=True, eq=False, repr=False)
class LevelSet:
    """Where a level set came to rest.

    Parameters
    ----------
    phi : array of float32
        The level-set function, negative inside; near the front its unit is the smallest spacing.
    iterations : int
        Steps taken.
    converged : bool
        Whether the front had come to rest.
    changed : (looks,) array of float
        Part of the front's voxels that changed sides between two looks, every six steps.
    """

    phi: Field
    iterations: int
    converged: bool
    changed: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "phi", frozen(self.phi))
        object.__setattr__(self, "changed", frozen(self.changed))

    @property
    def mask(self) -> BoolArray:
        """What lies inside."""
        inside: BoolArray = self.phi < 0
        return inside

    def __repr__(self) -> str:
        rest = "at rest" if self.converged else "not at rest"
        return f"LevelSet({int(self.mask.sum())} voxels inside, {rest} after {self.iterations} steps)"


def distance_regularized_level_set(
    image: ArrayLike,
    init: ArrayLike,
    *,
    spacing: float | ArrayLike = 1.0,
    force: Force = "region",
    levels: tuple[float, float] | None = None,
    threshold: ArrayLike | None = None,
    balloon: float | None = None,
    length: float | None = None,
    regularization: float = 0.12,
    potential: Potential = "double-well",
    edge_smoothing: float = 1.0,
    edge_scale: float | None = None,
    band: int = 4,
    max_iterations: int = 300,
    tolerance: float = 2e-3,
    n_jobs: int | None = None,
    progress: bool = False,
) -> LevelSet:
    """Evolve a front to the border of what is brighter, or to edges, keeping phi a distance near it.

    Parameters
    ----------
    image : (nx, ny) or (nx, ny, nz) array_like
        The image.
    init : array_like of bool, same shape
        Where the front starts: its inside. A step function of it is all that is needed.
    spacing : float or one number an axis
        Distance between voxel centres, in mm.
    force : {"region", "edge"}
        ``"region"``: the front moves out where the image is above half-way between two levels and in where it is
        below, as fast as the difference. ``"edge"``: Li's terms, a balloon that slows and a length that shortens
        where g = 1 / (1 + (s / scale)²) is small, s being the slope of the smoothed image.
    levels : (float, float), optional
        Typical values inside and outside for ``"region"``. Without them, the two means of the image; give them
        where it holds more than two tissues.
    threshold : array_like, optional
        Value half-way between inside and outside, a number or one a voxel; replaces the mean of ``levels``.
    balloon : float, optional
        Strength of the force times the step: 1.0 for region; for edge, -0.6, which moves the front out (positive
        moves it in). Above about 1.5 the front can jump voxels.
    length : float, optional
        Weight of the front's length times the step; 0.1 for region, 1.0 for edge. Larger is smoother.
    regularization : float
        Weight of the distance term times the step, at most 1/4 in 2D and 1/6 in 3D.
    potential : {"double-well", "single-well"}
        Li 2010, flat far from the front too, or Li 2005.
    edge_smoothing : float
        Gaussian sigma before the gradient, in mm (``"edge"``).
    edge_scale : float, optional
        Gradient, in image units a mm, at which g is a half; without it, a quarter of the 99th percentile.
    band : int
        Voxels on either side of the front that take part.
    max_iterations : int
        Steps at most.
    tolerance : float
        At rest when, in two looks six steps apart, less than this part of the front's voxels changed sides, or when
        nothing less has changed for the last eight looks; 0 takes all steps.
    n_jobs : int, optional
        Threads; None or -1 for all cores. The result does not depend on it.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    LevelSet

    Raises
    ------
    InputError
        If shapes differ, the image is not 2D or 3D or not finite, ``init`` is empty or everything, a number is out of
        range, or both levels are the same.

    Notes
    -----
    An explicit scheme; spacing enters every derivative. Only voxels within ``band`` face steps of the front change.
    A step costs about 60 ns a voxel of the band and thread; memory is 30 bytes a voxel of the box around ``init``
    and its surroundings. The front cannot appear where it is not: what is not reached from ``init`` is not found.
    With ``"edge"``, weak edges leak for a balloon that is too strong and strong noise stops one that is too weak;
    ``"region"`` needs the two sides to differ by more than about twice the noise.

    Li, Xu, Gui & Fox 2005 (CVPR); Li, Xu, Gui & Fox 2010 (IEEE Trans. Image Processing 19). Dissertation,
    section 5.4.1. The region force is that of Chan & Vese 2001 with fixed levels.

    Examples
    --------
    >>> x, y = np.mgrid[-20:21, -20:21]
    >>> image = 100.0 * (np.hypot(x, y) < 12)
    >>> found = distance_regularized_level_set(image, np.hypot(x, y) < 4)
    >>> found.converged, bool((found.mask == (image > 50)).mean() > 0.99)
    (True, True)
    """
    values, start, steps = _checked(image, init, spacing)
    _refuse_numbers(regularization, values, band, max_iterations, tolerance, edge_smoothing)
    if force == "region":
        edge = np.ones((1, 1, 1), dtype=np.float32)
        push = _region_push(values, start, steps, levels, threshold, 1.0 if balloon is None else balloon)
        weight = 0.1 if length is None else length
    elif force == "edge":
        edge = _edge_weight(values, steps, edge_smoothing, edge_scale)
        push = edge * np.float32(-0.6 if balloon is None else balloon)
        weight = 1.0 if length is None else length
    else:
        message = f"force must be region or edge, got {force!r}"
        raise InputError(message)
    if potential not in {"double-well", "single-well"}:
        message = f"potential must be double-well or single-well, got {potential!r}"
        raise InputError(message)
    phi = np.where(start, np.float32(-2), np.float32(2)).astype(np.float32)
    moving = _Band(phi, steps, edge, push, regularization, weight, potential == "double-well", band, n_jobs)
    iterations, converged, changed = _evolve(moving, max_iterations, tolerance, progress)
    return LevelSet(phi.reshape(np.shape(image)), iterations, converged, np.array(changed))


class _Band:
    """The voxels near the front, and one step of theirs; ``phi`` changes in place."""

    def __init__(
        self,
        phi: Field,
        steps: FloatArray,
        edge: Field,
        push: Field,
        regularization: float,
        length: float,
        double_well: bool,
        layers: int,
        n_jobs: int | None,
    ) -> None:
        self.phi, self.edge, self.push = phi, edge, push
        self.step = np.where(np.array(phi.shape) > 1, steps.min() / steps, 0.0)
        self.weights = (float(regularization), float(length))
        self.double_well, self.layers, self.n_jobs = double_well, layers, job_count(n_jobs)
        self.flux: Field = np.zeros((4, *phi.shape), dtype=np.float32)
        self.seen: BoolArray = np.zeros(phi.shape, dtype=bool)
        self.front = front_places(phi)
        self.rebuild()

    def rebuild(self) -> None:
        """Lay the band around where the front is now."""
        self.places, self.inner = layers_around(self.front, self.seen, self.layers)
        self.change: Field = np.zeros(self.inner, dtype=np.float32)

    def advance(self) -> None:
        """Take one step."""
        phi, inner = self.phi, self.places[: self.inner]
        self._each(
            len(self.places),
            lambda a, b: normals_on(phi, self.places[a:b], self.step, self.double_well, self.flux),
        )
        self._each(
            self.inner,
            lambda a, b: changes_on(
                phi,
                inner[a:b],
                self.step,
                self.flux,
                self.edge,
                self.push,
                *self.weights,
                _DELTA,
                self.change[a:b],
            ),
        )
        self._each(self.inner, lambda a, b: apply_changes(phi, inner[a:b], self.change[a:b], _LIMIT))

    def inside(self) -> BoolArray:
        """Which voxels of the band lie inside."""
        signs: BoolArray = self.phi[tuple(self.places.T)] < 0
        return signs

    def _each(self, n: int, work: Callable[[int, int], Any]) -> None:
        pieces = [(a, min(a + _CHUNK, n)) for a in range(0, n, _CHUNK)]
        for _ in ordered_map(lambda piece: work(*piece), pieces, self.n_jobs):
            pass


def _evolve(
    moving: _Band, max_iterations: int, tolerance: float, progress: bool
) -> tuple[int, bool, list[float]]:
    changed: list[float] = []
    iterations = 0
    with progress_bar("level set", max_iterations, show=progress) as advance:
        while iterations < max_iterations and len(moving.front):
            before = moving.inside()
            for _ in range(min(_LOOK, max_iterations - iterations)):
                moving.advance()
                iterations += 1
            advance(_LOOK)
            changed.append(float((moving.inside() != before).sum() / len(moving.front)))
            moving.front = kept_front(moving.phi, moving.places)
            if _at_rest(changed, tolerance):
                return iterations, True, changed
            moving.rebuild()
    return iterations, len(moving.front) == 0, changed


def _at_rest(changed: list[float], tolerance: float) -> bool:
    if tolerance == 0:
        return False
    if len(changed) >= 2 and max(changed[-2:]) < tolerance:
        return True
    # Noise keeps a few voxels moving for ever: no progress for long, at a low level, is rest as well.
    return len(changed) >= 16 and max(changed[-8:]) < 0.02 and min(changed[-8:]) >= min(changed[:-8])


def _checked(
    image: ArrayLike, init: ArrayLike, spacing: float | ArrayLike
) -> tuple[Field, BoolArray, FloatArray]:
    values = np.ascontiguousarray(image, dtype=np.float32)
    start = np.asarray(init, dtype=bool)
    if values.ndim not in {2, 3} or values.size == 0:
        message = f"the image must have two or three dimensions, got shape {values.shape}"
        raise InputError(message)
    if start.shape != values.shape:
        message = f"init must have the image's shape {values.shape}, got {start.shape}"
        raise InputError(message)
    if not np.isfinite(values).all():
        message = f"the image has {int((~np.isfinite(values)).sum())} values that are not finite; fill them"
        raise InputError(message)
    if not start.any() or start.all():
        message = f"init must be a part of the image; it is {'all' if start.all() else 'none'} of it"
        raise InputError(message)
    steps = checked_spacing(spacing, dimensions=values.ndim)
    if values.ndim == 2:
        return values[..., None], start[..., None], np.append(steps, steps.min())
    return values, start, steps


def _refuse_numbers(
    regularization: float, values: Field, band: int, max_iterations: int, tolerance: float, smoothing: float
) -> None:
    flat = values.shape[2] == 1
    most = 0.25 if flat else 1 / 6
    if not 0 <= regularization <= most:
        message = f"regularization must be between 0 and {most:.3g} (the step is unstable above), got {regularization}"
        raise InputError(message)
    if band < 2 or max_iterations < 0 or not tolerance >= 0 or not smoothing >= 0:
        message = (
            "needs band >= 2, max_iterations >= 0, tolerance >= 0, edge_smoothing >= 0; "
            f"got {band}, {max_iterations}, {tolerance}, {smoothing}"
        )
        raise InputError(message)


def _region_push(
    values: Field,
    start: BoolArray,
    steps: FloatArray,
    levels: tuple[float, float] | None,
    threshold: ArrayLike | None,
    strength: float,
) -> Field:
    if levels is None:
        levels = _two_levels(values, start)
    inside, outside = levels
    if inside == outside:
        message = f"inside and outside have the same level, {inside:g}; give levels"
        raise InputError(message)
    middle = np.asarray(0.5 * (inside + outside) if threshold is None else threshold, dtype=np.float32)
    try:
        middle = np.broadcast_to(middle[..., None] if middle.ndim == 2 else middle, values.shape)
    except ValueError as error:
        message = f"threshold must be a number or one a voxel, got shape {middle.shape}"
        raise InputError(message) from error
    speed = np.clip((values - middle) / np.float32(0.5 * (inside - outside)), -1, 1)
    return np.asarray(-strength * speed, dtype=np.float32)


def _two_levels(values: Field, start: BoolArray) -> tuple[float, float]:
    """Return the two means of the values, first the one near the median of the start."""
    near = values.ravel()
    inside = float(np.median(values[start]))
    ends = np.percentile(near, [5, 95])
    outside = float(ends[np.argmax(np.abs(ends - inside))])
    for _ in range(20):
        first = np.abs(near - inside) <= np.abs(near - outside)
        if first.all() or not first.any():
            break
        inside, outside = float(near[first].mean()), float(near[~first].mean())
    return inside, outside


def _edge_weight(values: Field, steps: FloatArray, smoothing: float, scale: float | None) -> Field:
    smooth = ndimage.gaussian_filter(values, smoothing / steps * (np.array(values.shape) > 1))
    squared = np.zeros_like(smooth)
    for axis, step in enumerate(steps):
        if values.shape[axis] > 1:
            squared += (np.gradient(smooth, axis=axis) / np.float32(step)) ** 2
    if scale is None:
        scale = 0.25 * float(np.sqrt(np.percentile(squared, 99)))
    if not scale > 0:
        message = f"the image has no edges, or edge_scale is not positive ({scale:g})"
        raise InputError(message)
    return np.asarray(1 / (1 + squared / np.float32(scale) ** 2), dtype=np.float32)
