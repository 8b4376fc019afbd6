"""Finding the left ventricle in a contrast CT: blood split into chambers, the one with the thick wall kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .._arrays import BoolArray, FloatArray, IntArray
from ..errors import InputError, require
from .volume import Volume

# Edge of a coarse voxel, in mm, and the sigma the volume is smoothed by first.
STEP, _SIGMA = 2.0, 1.0
# A chamber's wall is looked for in this shell around it, in mm; myocardium has CT numbers above the first here.
_SHELL, _TISSUE = (2.0, 7.0), 20.0
# What a part of the left ventricle must be: share of wall in its shell, with and without the blood next to it.
_LEAST_WALL, _LEAST_OF_TISSUE, _LEAST_VOLUME = 0.4, 0.85, 15.0
# A part that is open to the ventricle without a neck, across more than a face of a cube of its volume, needs less:
# fat and lung lie behind the thin rim of muscle at the base. A valve is narrower than that.
_LEAST_OPEN = 0.6
# Contact that joins two parts of one chamber, or a neighbour to the ventricle, in mm².
_CONTACT = 150.0
# Blood with contrast agent is at least this much brighter than the tissue around it, in HU.
_LEAST_CONTRAST = 100.0


@dataclass(frozen=True, eq=False)
class Chambers:
    """The coarse volume, on a grid along RAS of :data:`STEP` mm, and what was found in it.

    ``ventricle`` is the left ventricle, roughly; ``beyond`` the chambers it opens into; ``others`` all other blood.
    """

    values: NDArray[np.float32]
    corner: FloatArray
    threshold: float
    ventricle: BoolArray
    beyond: BoolArray
    others: BoolArray
    wall_share: float

    @property
    def affine(self) -> FloatArray:
        """(4, 4) from coarse voxels to RAS mm."""
        matrix = np.diag([STEP, STEP, STEP, 1.0])
        matrix[:3, 3] = self.corner
        return matrix

    def points(self, mask: BoolArray) -> FloatArray:
        """(k, 3) RAS positions of the voxels of a mask, in mm."""
        return np.argwhere(mask) * STEP + self.corner

    def at(self, volume: Volume, mask: BoolArray) -> BoolArray:
        """Return a coarse mask on a volume's grid, by nearest voxels; False outside the coarse grid."""
        to_coarse = volume.affine[:3, :3] / STEP
        offset = (volume.affine[:3, 3] - self.corner) / STEP
        taken = ndimage.affine_transform(
            mask.astype(np.float32), to_coarse, offset, output_shape=volume.shape, order=1, mode="nearest"
        )
        return np.asarray(taken > 0.5)

    @property
    def levels(self) -> tuple[float, float]:
        """Median CT numbers of the ventricle's blood, away from its border, and of its wall."""
        core = ndimage.binary_erosion(self.ventricle, iterations=2)
        blood = self.values[core if core.any() else self.ventricle]
        wall = _shell_values(self.values, self.ventricle)
        wall = wall[(wall > _TISSUE) & (wall < self.threshold)]
        return float(np.median(blood)), float(np.median(wall)) if wall.size else _TISSUE


def coarse_grid(volume: Volume) -> tuple[NDArray[np.float32], FloatArray]:
    """Return the smoothed volume on a grid along RAS, and the position of its first voxel."""
    ends = np.array(volume.shape) - 1
    corners = volume.points(
        np.stack(np.meshgrid(*([0, e] for e in ends), indexing="ij"), axis=-1).reshape(-1, 3)
    )
    low, high = corners.min(axis=0), corners.max(axis=0)
    shape = tuple(int(n) for n in np.floor((high - low) / STEP + 1e-6) + 1)
    smooth = ndimage.gaussian_filter(np.asarray(volume.values), _SIGMA / volume.spacing)
    back = np.linalg.inv(volume.affine)
    values = ndimage.affine_transform(
        smooth,
        back[:3, :3] * STEP,
        back[:3, :3] @ low + back[:3, 3],
        output_shape=shape,
        order=1,
        cval=-1000.0,
    )
    return values, low


def find_chambers(volume: Volume, *, seed: FloatArray | None, near: BoolArray | None) -> Chambers:
    """Find the left ventricle; ``seed`` is a point in it (RAS mm), ``near`` a mask that it lies in."""
    values, corner = coarse_grid(volume)
    threshold = blood_threshold(values)
    blood = values > threshold
    basins = _basins(blood)
    walls = _wall_shares(values, basins, threshold)
    if near is None:
        main = _main_basin(basins, walls, seed, corner)
    else:
        main = _basin_in(basins, walls, coarse_grid(Volume(near.astype(np.float32), volume.affine))[0] > 0.25)
    ventricle = _joined(basins, main, _contacts_needed(walls))
    beyond, others = _neighbours(basins, ventricle)
    return Chambers(values, corner, threshold, ventricle, beyond, others, walls[main][0])


def blood_threshold(values: NDArray[np.float32]) -> float:
    """Return the CT number between tissue and blood with contrast agent, or refuse where there is none."""
    filters = require("skimage.filters", "heart")
    soft = values[(values > -50) & (values < 1200)]
    if soft.size < 1000 or np.ptp(soft) < 1:
        message = "the volume shows hardly any soft tissue or blood (CT numbers between -50 and 1200 HU)"
        raise InputError(message)
    threshold = float(filters.threshold_otsu(soft))
    dark, bright = soft[soft <= threshold], soft[soft > threshold]
    blood, tissue = float(np.median(bright)), float(np.median(dark))
    if blood - tissue < _LEAST_CONTRAST or blood < 180 or bright.size * STEP**3 < 40e3:
        message = (
            f"no blood with contrast agent: the bright class has {blood:.0f} HU, tissue {tissue:.0f} HU, "
            f"{bright.size * STEP**3 / 1000:.0f} ml. A contrast CT with the left heart enhanced is needed"
        )
        raise InputError(message)
    return threshold


def _basins(blood: BoolArray) -> IntArray:
    """Blood split where it is narrow: watersheds of the distance to its border."""
    feature, segmentation = require("skimage.feature", "heart"), require("skimage.segmentation", "heart")
    depth = ndimage.gaussian_filter(ndimage.distance_transform_edt(blood) * STEP, 1.0)
    peaks = feature.peak_local_max(depth, min_distance=4, threshold_abs=5.0, exclude_border=False)
    if not len(peaks):
        raise InputError("no chamber: the blood is nowhere more than 10 mm wide")
    markers = np.zeros(blood.shape, dtype=np.int32)
    markers[tuple(peaks.T)] = np.arange(1, len(peaks) + 1)
    labels: IntArray = segmentation.watershed(-depth, markers, mask=blood)
    return labels


def _wall_shares(
    values: NDArray[np.float32], basins: IntArray, threshold: float
) -> dict[int, tuple[float, float, float]]:
    """Of each basin large enough: shares of wall and of blood in its shell, and its volume in ml."""
    found = {}
    for label, box in enumerate(ndimage.find_objects(basins), start=1):
        if box is None:
            continue
        wide = tuple(slice(max(s.start - 4, 0), s.stop + 4) for s in box)
        mask = basins[wide] == label
        volume = float(mask.sum() * STEP**3 / 1000)
        if volume < _LEAST_VOLUME:
            continue
        shell = _shell_values(values[wide], mask)
        wall, blood = (shell > _TISSUE) & (shell <= threshold), shell > threshold
        found[label] = (float(wall.mean()), float(blood.mean()), volume)
    return found


def _shell_values(values: NDArray[np.float32], mask: BoolArray) -> NDArray[np.float32]:
    distance = ndimage.distance_transform_edt(~mask) * STEP
    shell: NDArray[np.float32] = values[(distance > _SHELL[0]) & (distance <= _SHELL[1])]
    return shell if shell.size else np.zeros(1, dtype=np.float32)


def _is_ventricle(row: tuple[float, float, float], least: float = _LEAST_OF_TISSUE) -> bool:
    wall, blood, _ = row
    return wall > _LEAST_WALL and wall > least * (1 - blood)


def _main_basin(
    basins: IntArray,
    walls: dict[int, tuple[float, float, float]],
    seed: FloatArray | None,
    corner: FloatArray,
) -> int:
    if seed is not None:
        at = np.rint((seed - corner) / STEP).astype(int)
        inside = bool((at >= 0).all() and (at < basins.shape).all())
        label = int(basins[tuple(at)]) if inside else 0
        if label not in walls:
            what = "in no chamber of blood" if inside else "outside the volume"
            message = (
                f"the seed {seed.round(1).tolist()} (RAS mm) lies {what}; give a point in the left ventricle"
            )
            raise InputError(message)
        return label
    accepted = [b for b in walls if _is_ventricle(walls[b])]
    if not accepted:
        best = max((row[0] for row in walls.values()), default=0.0)
        message = (
            f"no chamber with a thick wall all around: the best of {len(walls)} has wall over {100 * best:.0f} % of "
            "its border. Give a seed or a mask, or check that the volume holds a contrast-filled left ventricle"
        )
        raise InputError(message)
    return max(accepted, key=lambda b: walls[b][2] * (walls[b][0] - 0.4))


def _basin_in(basins: IntArray, walls: dict[int, tuple[float, float, float]], near: BoolArray) -> int:
    """Return the basin that has most of its volume in a mask, thick walls first."""
    counts = np.bincount(basins[near], minlength=basins.max() + 1)
    held = {
        b: counts[b] * (row[0] - 0.4 if _is_ventricle(row) else 1e-3) for b, row in walls.items() if counts[b]
    }
    if not held:
        message = f"the mask holds no chamber of blood ({STEP**3 * near.sum() / 1000:.0f} ml); it should hold the heart"
        raise InputError(message)
    return max(held, key=lambda b: held[b])


def _contacts_needed(walls: dict[int, tuple[float, float, float]]) -> dict[int, float]:
    """Area of contact, mm², from which a basin belongs to the ventricle; basins that never do are left out."""
    needed = {b: (1000 * row[2]) ** (2 / 3) for b, row in walls.items() if _is_ventricle(row, _LEAST_OPEN)}
    return needed | {b: _CONTACT for b, row in walls.items() if _is_ventricle(row)}


def _joined(basins: IntArray, main: int, needed: dict[int, float]) -> BoolArray:
    """Join basins that touch enough of the ventricle: papillary muscles can split it."""
    ventricle: BoolArray = basins == main
    waiting = [b for b in needed if b != main]
    touching = True
    while touching:
        touching = False
        around = ndimage.binary_dilation(ventricle)
        for label in list(waiting):
            part = basins == label
            if (part & around).sum() * STEP**2 > needed[label]:
                ventricle |= part
                waiting.remove(label)
                touching = True
                break
    return ventricle


def _neighbours(basins: IntArray, ventricle: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Split other blood into what the ventricle opens into, at its one end, and what it must not take."""
    rest = np.where(ventricle, 0, basins)
    contact = ndimage.binary_dilation(ventricle) & (rest > 0)
    counts = np.bincount(rest[contact], minlength=rest.max() + 1) * STEP**2
    wide = np.flatnonzero(counts > _CONTACT)
    if not len(wide):
        return np.zeros_like(ventricle), rest > 0
    mouth = np.argwhere(contact & np.isin(rest, wide)).mean(axis=0)
    axis = mouth - np.argwhere(ventricle).mean(axis=0)
    upper = [int(b) for b in wide if (((np.argwhere(rest == b) - mouth) @ axis) > 0).mean() > 0.5]
    beyond: BoolArray = np.isin(rest, upper)
    return beyond, (rest > 0) & ~beyond
