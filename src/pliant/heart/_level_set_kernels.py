"""Level-set evolution on a narrow band: lists of voxels, two passes over them, fluxes in dense arrays.

Lengths are in units of the smallest spacing; ``step`` holds 1 / spacing of each axis in that unit, 0 along an axis of
one voxel. Values beyond the array's faces are those on them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import BoolArray, FloatArray
from .._kernels import kernel

Field = NDArray[np.float32]
Places = NDArray[np.int32]

_TINY = 1e-6


@kernel
def normals_on(
    phi: Field, places: Places, step: FloatArray, double_well: bool, flux: NDArray[np.float32]
) -> None:
    """Write unit normals and |grad phi| (d(|grad phi|) - 1) of the listed voxels into ``flux`` (4, nx, ny, nz)."""
    last0, last1, last2 = phi.shape[0] - 1, phi.shape[1] - 1, phi.shape[2] - 1
    for row in range(places.shape[0]):
        i, j, k = places[row, 0], places[row, 1], places[row, 2]
        px = (phi[min(i + 1, last0), j, k] - phi[max(i - 1, 0), j, k]) * np.float32(0.5 * step[0])
        py = (phi[i, min(j + 1, last1), k] - phi[i, max(j - 1, 0), k]) * np.float32(0.5 * step[1])
        pz = (phi[i, j, min(k + 1, last2)] - phi[i, j, max(k - 1, 0)]) * np.float32(0.5 * step[2])
        slope = np.sqrt(px * px + py * py + pz * pz)
        inverse = np.float32(1.0) / (slope + np.float32(_TINY))
        flux[0, i, j, k] = px * inverse
        flux[1, i, j, k] = py * inverse
        flux[2, i, j, k] = pz * inverse
        if double_well and slope < 1:
            turn = np.float32(2 * np.pi) * slope
            flux[3, i, j, k] = np.sin(turn) / np.float32(2 * np.pi) - slope
        else:
            flux[3, i, j, k] = -1.0


@kernel
def changes_on(
    phi: Field,
    places: Places,
    step: FloatArray,
    flux: NDArray[np.float32],
    edge: Field,
    push: Field,
    regularization: float,
    length: float,
    width: float,
    change: Field,
) -> None:
    """Write the change of phi in one step at the listed voxels.

    ``edge`` weighs the length term (one voxel large where the weight is 1 everywhere); ``push`` is what moves the
    front out of itself, before the delta function of the given half-width.
    """
    last0, last1, last2 = phi.shape[0] - 1, phi.shape[1] - 1, phi.shape[2] - 1
    weighted = edge.size > 1
    for row in range(places.shape[0]):
        i, j, k = places[row, 0], places[row, 1], places[row, 2]
        i0, i1 = max(i - 1, 0), min(i + 1, last0)
        j0, j1 = max(j - 1, 0), min(j + 1, last1)
        k0, k1 = max(k - 1, 0), min(k + 1, last2)
        here = phi[i, j, k]
        spread = (
            (phi[i1, j, k] + phi[i0, j, k] - 2 * here) * step[0] ** 2
            + (phi[i, j1, k] + phi[i, j0, k] - 2 * here) * step[1] ** 2
            + (phi[i, j, k1] + phi[i, j, k0] - 2 * here) * step[2] ** 2
        )
        spread += 0.5 * (
            (flux[0, i1, j, k] * flux[3, i1, j, k] - flux[0, i0, j, k] * flux[3, i0, j, k]) * step[0]
            + (flux[1, i, j1, k] * flux[3, i, j1, k] - flux[1, i, j0, k] * flux[3, i, j0, k]) * step[1]
            + (flux[2, i, j, k1] * flux[3, i, j, k1] - flux[2, i, j, k0] * flux[3, i, j, k0]) * step[2]
        )
        moved = regularization * spread
        if abs(here) < width:
            delta = 0.5 / width * (1 + np.cos(np.pi * here / width))
            curved = 0.5 * (
                (flux[0, i1, j, k] - flux[0, i0, j, k]) * step[0]
                + (flux[1, i, j1, k] - flux[1, i, j0, k]) * step[1]
                + (flux[2, i, j, k1] - flux[2, i, j, k0]) * step[2]
            )
            if weighted:
                pull = 0.5 * (
                    (edge[i1, j, k] - edge[i0, j, k]) * step[0] * flux[0, i, j, k]
                    + (edge[i, j1, k] - edge[i, j0, k]) * step[1] * flux[1, i, j, k]
                    + (edge[i, j, k1] - edge[i, j, k0]) * step[2] * flux[2, i, j, k]
                )
                curved = edge[i, j, k] * curved + pull
            moved += delta * (length * curved + push[i, j, k])
        change[row] = moved


@kernel
def apply_changes(phi: Field, places: Places, change: Field, limit: float) -> None:
    """Add the changes, keeping phi within the limit."""
    for row in range(places.shape[0]):
        i, j, k = places[row, 0], places[row, 1], places[row, 2]
        phi[i, j, k] = min(limit, max(-limit, phi[i, j, k] + change[row]))


@kernel
def _is_front(phi: Field, i: int, j: int, k: int) -> bool:
    inside = phi[i, j, k] < 0
    return bool(
        (i > 0 and (phi[i - 1, j, k] < 0) != inside)
        or (i < phi.shape[0] - 1 and (phi[i + 1, j, k] < 0) != inside)
        or (j > 0 and (phi[i, j - 1, k] < 0) != inside)
        or (j < phi.shape[1] - 1 and (phi[i, j + 1, k] < 0) != inside)
        or (k > 0 and (phi[i, j, k - 1] < 0) != inside)
        or (k < phi.shape[2] - 1 and (phi[i, j, k + 1] < 0) != inside)
    )


@kernel
def front_places(phi: Field) -> Places:
    """Return (m, 3) voxels with a neighbour of the other sign, over the whole array."""
    found = np.empty((1024, 3), dtype=np.int32)
    n = 0
    for i in range(phi.shape[0]):
        for j in range(phi.shape[1]):
            for k in range(phi.shape[2]):
                if _is_front(phi, i, j, k):
                    if n == found.shape[0]:
                        grown = np.empty((2 * n, 3), dtype=np.int32)
                        grown[:n] = found
                        found = grown
                    found[n, 0], found[n, 1], found[n, 2] = i, j, k
                    n += 1
    return found[:n].copy()


@kernel
def kept_front(phi: Field, places: Places) -> Places:
    """Return those of the listed voxels that have a neighbour of the other sign."""
    kept = np.empty(places.shape, dtype=np.int32)
    n = 0
    for row in range(places.shape[0]):
        if _is_front(phi, places[row, 0], places[row, 1], places[row, 2]):
            kept[n] = places[row]
            n += 1
    return kept[:n].copy()


@kernel
def layers_around(front: Places, seen: BoolArray, layers: int) -> Any:
    """Return (voxels within so many face steps of the front, number of them within one step less).

    ``seen`` is a scratch array, all False before and after.
    """
    room = max(1024, front.shape[0] * (2 * layers + 3))
    places = np.empty((room, 3), dtype=np.int32)
    n = 0
    for row in range(front.shape[0]):
        i, j, k = front[row, 0], front[row, 1], front[row, 2]
        if not seen[i, j, k]:
            seen[i, j, k] = True
            places[n, 0], places[n, 1], places[n, 2] = i, j, k
            n += 1
    start, inner = 0, n
    for _ in range(layers):
        inner = n
        for row in range(start, inner):
            for side in range(6):
                axis = side // 2
                shift = 1 - 2 * (side % 2)
                i = places[row, 0] + (shift if axis == 0 else 0)
                j = places[row, 1] + (shift if axis == 1 else 0)
                k = places[row, 2] + (shift if axis == 2 else 0)
                if i < 0 or j < 0 or k < 0 or i >= seen.shape[0] or j >= seen.shape[1] or k >= seen.shape[2]:
                    continue
                if seen[i, j, k]:
                    continue
                if n == places.shape[0]:
                    grown = np.empty((2 * n, 3), dtype=np.int32)
                    grown[:n] = places
                    places = grown
                seen[i, j, k] = True
                places[n, 0], places[n, 1], places[n, 2] = i, j, k
                n += 1
        start = inner
    for row in range(n):
        seen[places[row, 0], places[row, 1], places[row, 2]] = False
    return places[:n].copy(), inner
