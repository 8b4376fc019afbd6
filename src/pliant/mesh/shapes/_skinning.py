"""Bending a figure: weights that spread along the surface, joints turned in a tree, dual quaternions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from ..._arrays import FloatArray, IntArray

_REACH = 0.45


def skin_weights(
    vertices: FloatArray, faces: IntArray, ownership: FloatArray, radii: FloatArray
) -> FloatArray:
    """Spread (n, joints) ownership over the surface, to about half the local radius of the limb.

    Two implicit steps of heat flow: weights stay within [0, 1], add up to 1, and do not leak through the air
    from limb to limb (the reason bone heat, Baran & Popovic 2007, uses the surface too).
    """
    stiffness, mass = _conduction(vertices, faces, (_REACH * radii) ** 2)
    solver = splu(
        csc_array(stiffness + diags_array(mass)), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
    )
    weights = ownership
    for _ in range(2):
        weights = solver.solve(np.ascontiguousarray(mass[:, None] * weights))
    weights = np.maximum(weights, 0)
    weights /= weights.sum(axis=1, keepdims=True)
    return weights


def joint_motions(
    positions: FloatArray, parents: Sequence[int], turns: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Quaternions (j, 4) and translations (j, 3) of all joints when each turns by a vector in degrees."""
    local = _quaternions(turns)
    rotations, moved = np.empty_like(local), np.empty_like(positions)
    for joint, parent in enumerate(parents):
        if parent < 0:
            rotations[joint], moved[joint] = local[joint], positions[joint]
        else:
            # A product of near neighbours keeps signs continuous down the tree, as blending needs.
            rotations[joint] = _product(rotations[parent], local[joint])
            arm = positions[joint] - positions[parent]
            moved[joint] = moved[parent] + _rotated(rotations[parent], arm)
    return rotations, moved - _rotated(rotations, positions)


def skinned(
    vertices: FloatArray, weights: FloatArray, rotations: FloatArray, translations: FloatArray
) -> FloatArray:
    """Dual quaternion blending (Kavan, Collins, Zara & O'Sullivan 2008)."""
    pure = np.column_stack([np.zeros(len(translations)), translations])
    real = weights @ rotations
    dual = weights @ (0.5 * _product(pure, rotations))
    norms = np.linalg.norm(real, axis=1, keepdims=True)
    real, dual = real / norms, dual / norms
    conjugate = real * [1, -1, -1, -1]
    return _rotated(real, vertices) + 2 * _product(dual, conjugate)[:, 1:]


def _conduction(
    vertices: FloatArray, faces: IntArray, conductance: FloatArray
) -> tuple[csc_array, FloatArray]:
    """Cotangent stiffness with a conductance a vertex, and lumped mass."""
    rows, columns, values = [], [], []
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    conducts = conductance[faces].mean(axis=1)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        dot = ((corners[:, j] - corners[:, i]) * (corners[:, k] - corners[:, i])).sum(axis=1)
        # Obtuse angles would let weights leave [0, 1].
        half = np.maximum(dot / area, 1e-3) * conducts / 2
        rows += [faces[:, j], faces[:, k], faces[:, j], faces[:, k]]
        columns += [faces[:, k], faces[:, j], faces[:, j], faces[:, k]]
        values += [-half, -half, half, half]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    stiffness = csc_array(coo_array(entries, shape=(len(vertices), len(vertices))))
    mass: FloatArray = np.bincount(
        faces.ravel(), weights=np.repeat(area / 6, 3), minlength=len(vertices)
    ).astype(np.float64)
    return stiffness, mass


def _quaternions(turns: FloatArray) -> FloatArray:
    angles = np.radians(np.linalg.norm(turns, axis=1, keepdims=True))
    axes = np.radians(turns) / np.where(angles > 0, angles, 1)
    return np.column_stack([np.cos(angles / 2), axes * np.sin(angles / 2)])


def _product(p: FloatArray, q: FloatArray) -> FloatArray:
    vector = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    scalar = p[..., :1] * q[..., :1] - (p[..., 1:] * q[..., 1:]).sum(axis=-1, keepdims=True)
    return np.concatenate([scalar, vector], axis=-1)


def _rotated(q: FloatArray, v: FloatArray) -> FloatArray:
    twice = 2 * np.cross(q[..., 1:], v)
    return v + q[..., :1] * twice + np.cross(q[..., 1:], twice)
