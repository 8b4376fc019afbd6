"""Spin transformations: bend a surface conformally by prescribing how its mean curvature changes."""

from __future__ import annotations

import warnings
from typing import TypeAlias

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu

from .._arrays import FloatArray, IntArray, vertex_values
from ..errors import MeshError, NumericalError, PliantWarning, first_indices
from ._quaternions import conjugate, imaginary, left_blocks, product
from .surface import Mesh
from .topology import boundary_loops, edge_faces, vertex_components

__all__ = ["quasi_conformal_error", "spin_transform"]

Sparse: TypeAlias = sp.csc_array

# The factored operator is shifted by this fraction of its mean diagonal: far below its smallest eigenvalues
# that matter, far above rounding.
_SHIFT = 1e-9
_MOST_STEPS = 500
_TURN = 1e-12
_MISFIT = 0.05
# A disc over a hole has rings down to this fraction of the rim.
_INNERMOST = 0.1


def spin_transform(mesh: Mesh, rho: ArrayLike) -> Mesh:
    """Deform a surface without changing its angles, so that its mean curvature changes as prescribed.

    The new surface's mean curvature half-density ``H~ |df~|`` is ``(H + rho + c) |df|``: where rho is positive the
    surface swells outwards, where it is negative it is dented.

    Parameters
    ----------
    mesh : Mesh
        One manifold piece, consistently wound; closed, or with boundary.
    rho : (n,) array_like of float
        Change of the mean curvature half-density at each vertex, in 1 / unit. Only its differences act: the mean by
        area is taken off first, and the constant c is whatever lets the surface close.

    Returns
    -------
    Mesh
        The same triangles over new positions, with the area and the centre of the original. A constant rho gives the
        original back; another rho leaves the rotation free and small.

    Raises
    ------
    MeshError
        If the mesh is in several pieces, wound inconsistently, or has unused vertices, faces without area, or edges
        of three faces.
    InputError
        If rho is not one finite number a vertex.
    NumericalError
        If the smallest eigenvector is not reached: rho is so large that two deformations fit it equally well.

    Warns
    -----
    PliantWarning
        If more than 5 % of the new edges' length (root mean square) cannot be fitted by positions.

    Notes
    -----
    The smallest eigenvector of the squared quaternionic Dirac operator minus rho turns and scales each edge; positions
    follow by a Poisson solve. Holes are closed with discs first, for the time of the solve: the boundary is as free to
    move as the inside.

    Conformal up to discretisation: :func:`quasi_conformal_error` falls in proportion to the edge length or faster.
    Do not trust it where rho changes within an edge, or where rho times the size of the feature exceeds about 5.
    Around a handle the new edges need not close; the Poisson solve then spreads the misfit, and a warning says so.
    Cost: one sparse factor of 4 n unknowns, about 1 s at 2,500 vertices, 8 s at 10,000.

    References
    ----------
    Crane, Pinkall & Schroder 2011, Spin transformations of discrete surfaces. Dissertation, Fig. 2.7.

    Examples
    --------
    >>> from pliant import shapes
    >>> ball = shapes.icosphere(2)
    >>> bump = np.exp(-8 * (1 - ball.vertices[:, 2]))
    >>> bent = spin_transform(ball, bump)
    >>> bool(np.mean(quasi_conformal_error(ball, bent)) < 1.05)
    True
    """
    density = vertex_values(rho, mesh.n_vertices, "rho")
    _refuse_unfit(mesh)
    density = density - mesh.vertex_areas @ density / mesh.area
    whole = _closed(mesh)
    density = np.concatenate([density, np.zeros(whole.n_vertices - mesh.n_vertices)])
    sides = _turned_sides(whole, _smallest_spinor(whole, density))
    positions = _poisson(whole, sides)
    _warn_of_misfit(whole, positions, sides)
    return _placed(mesh, positions[: mesh.n_vertices])


def quasi_conformal_error(mesh: Mesh, deformed: Mesh) -> FloatArray:
    """Measure how far a deformation is from keeping angles, triangle by triangle.

    Parameters
    ----------
    mesh, deformed : Mesh
        The same triangles over two sets of positions.

    Returns
    -------
    (m,) array of float
        Longest over shortest stretch of each triangle: 1 where angles are kept, inf where it collapsed.

    Raises
    ------
    MeshError
        If the triangles differ, or one of the original has no area.

    Examples
    --------
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> quasi_conformal_error(square, square.transformed(np.diag([2.0, 1.0, 1.0]))).round(6)
    array([2.])
    """
    if not np.array_equal(mesh.faces, deformed.faces):
        raise MeshError("the two meshes must have the same triangles, in the same order")
    _refuse_flat(mesh)
    before, after = _in_plane(mesh), _in_plane(deformed)
    stretches = np.linalg.svd(after @ np.linalg.inv(before), compute_uv=False)
    longest, shortest = stretches[:, 0], stretches[:, 1]
    ratio: FloatArray = np.divide(longest, shortest, out=np.full(len(longest), np.inf), where=shortest > 0)
    return ratio


def _refuse_unfit(mesh: Mesh) -> None:
    pieces, _ = vertex_components(mesh)
    if pieces != 1 or not mesh.n_faces:
        message = (
            f"a spin transformation needs one piece, this mesh has {pieces}; see pliant.largest_component"
        )
        raise MeshError(message)
    sides = edge_faces(mesh)
    crowded = np.flatnonzero(sides.counts > 2)
    if crowded.size:
        message = f"{crowded.size} edges have three faces or more, first {first_indices(crowded)}; see pliant.repaired"
        raise MeshError(message)
    astray = np.flatnonzero(~sides.agree)
    if astray.size:
        message = (
            f"{astray.size} pairs of neighbouring faces are wound against each other; use pliant.orient first"
        )
        raise MeshError(message)
    _refuse_flat(mesh)


def _refuse_flat(mesh: Mesh) -> None:
    flat = np.flatnonzero(mesh.face_areas <= 1e-14 * mesh.edge_lengths.mean() ** 2)
    if flat.size:
        message = f"{flat.size} faces have no area, first {first_indices(flat)}; see pliant.repaired"
        raise MeshError(message)


def _closed(mesh: Mesh) -> Mesh:
    """Close every hole with a disc, its vertices after the mesh's own.

    On an open tube the turned edges around the tube need not sum to zero; discs over its ends make them. The rings of
    a disc shrink by a constant factor, which keeps its triangles even whatever the hole's size.
    """
    vertices, faces, count = [mesh.vertices], [mesh.faces], mesh.n_vertices
    for loop in boundary_loops(mesh):
        rim = mesh.vertices[loop]
        middle = rim.mean(axis=0)
        step = 1 - min(2 * np.pi / len(loop), 0.5)
        factors = step ** np.arange(1, int(np.log(_INNERMOST) / np.log(step)) + 1)
        rings = middle + factors[:, None, None] * (rim - middle)
        inside = count + np.arange(rings[..., 0].size).reshape(len(factors), len(loop))
        vertices += [rings.reshape(-1, 3), middle[None]]
        faces.append(_disc_faces(np.vstack([loop[None], inside]), count + inside.size))
        count += inside.size + 1
    if len(vertices) == 1:
        return mesh
    whole = Mesh(np.concatenate(vertices), np.concatenate(faces))
    flat = np.flatnonzero(whole.face_areas[mesh.n_faces :] <= 1e-14 * mesh.edge_lengths.mean() ** 2)
    if flat.size:
        raise MeshError("a hole is too crooked to close with a disc: close it first, see pliant.repaired")
    return whole


def _disc_faces(rings: IntArray, apex: int) -> IntArray:
    """Triangles between rings of vertex numbers, outermost first, then a fan; they run against the rim."""
    outer, inner = rings[:-1], rings[1:]
    outer_next, inner_next = np.roll(outer, -1, axis=1), np.roll(inner, -1, axis=1)
    last = rings[-1]
    parts = [
        np.stack([outer_next, outer, inner], axis=-1).reshape(-1, 3),
        np.stack([outer_next, inner, inner_next], axis=-1).reshape(-1, 3),
        np.column_stack([np.roll(last, -1), last, np.full(len(last), apex)]),
    ]
    return np.concatenate(parts)


def _warn_of_misfit(mesh: Mesh, positions: FloatArray, sides: FloatArray) -> None:
    found = positions[mesh.faces[:, [1, 2, 0]]] - positions[mesh.faces]
    misfit = float(np.linalg.norm(found - sides) / np.linalg.norm(sides))
    if misfit > _MISFIT:
        message = (
            f"the turned edges do not close up: {misfit:.0%} of their length is lost, so angles change too; "
            "scale rho down, or refine the mesh (around a handle no refinement helps)"
        )
        warnings.warn(message, PliantWarning, stacklevel=3)


def _smallest_spinor(mesh: Mesh, density: FloatArray) -> FloatArray:
    """(n, 4) eigenvector, nearest 0, of the squared Dirac operator minus rho, found from the constant 1."""
    operator = _dirac_square(mesh, density)
    mass = np.repeat(mesh.vertex_areas, 4)
    shift = _SHIFT * operator.diagonal().sum() / mass.sum()
    factor = splu(
        sp.csc_array(operator + shift * sp.diags_array(mass)),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    at = np.tile([1.0, 0.0, 0.0, 0.0], mesh.n_vertices) / np.sqrt(mesh.area)
    for _ in range(_MOST_STEPS):
        step = factor.solve(mass * at)
        step /= np.sqrt(step @ (mass * step))
        # Above rounding, one minus the cosine is half the squared turn.
        turn = 1.0 - abs(step @ (mass * at))
        at = step
        if turn < _TURN:
            spinor: FloatArray = at.reshape(-1, 4)
            return spinor
    message = (
        f"the smallest eigenvector was not reached in {_MOST_STEPS} steps: rho is so large that several deformations "
        "fit it equally well; scale rho down, or apply it in several transformations"
    )
    raise NumericalError(message)


def _dirac_square(mesh: Mesh, density: FloatArray) -> Sparse:
    """(4 n, 4 n) real matrix of (D - rho)* (D - rho), with linear spinors and one equation a triangle."""
    n, faces = mesh.n_vertices, mesh.faces
    corners = mesh.vertices[faces]
    opposite = imaginary(corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]])
    area = mesh.face_areas[:, None]
    unit = np.array([1.0, 0.0, 0.0, 0.0])
    total = sp.csr_array((4 * n, 4 * n))
    for i in range(3):
        for j in range(3):
            rho_i, rho_j = density[faces[:, i], None], density[faces[:, j], None]
            weight = (
                -product(opposite[:, i], opposite[:, j]) / (4 * area)
                + (rho_i * opposite[:, j] - rho_j * opposite[:, i]) / 6
                + area * rho_i * rho_j / 9 * unit
            )
            total = total + _scattered(weight, faces[:, i], faces[:, j], n)
    return total.tocsc()


def _scattered(weight: FloatArray, rows: IntArray, columns: IntArray, n: int) -> sp.csr_array:
    inside = np.arange(4)
    at_row = np.broadcast_to(4 * rows[:, None, None] + inside[:, None], (len(rows), 4, 4))
    at_column = np.broadcast_to(4 * columns[:, None, None] + inside, (len(rows), 4, 4))
    entries = left_blocks(weight).ravel()
    return sp.coo_array((entries, (at_row.ravel(), at_column.ravel())), shape=(4 * n, 4 * n)).tocsr()


def _turned_sides(mesh: Mesh, spinor: FloatArray) -> FloatArray:
    """(m, 3, 3) new vector of each face's side from corner k to the next: conj(spinor) e spinor, averaged along it."""
    starts, stops = mesh.faces, mesh.faces[:, [1, 2, 0]]
    side = imaginary(mesh.vertices[stops] - mesh.vertices[starts])
    p, q = spinor[starts], spinor[stops]
    # The mixed terms p* e q and q* e p are minus each other's conjugates: their sum is imaginary.
    ends = product(conjugate(p), product(side, p)) + product(conjugate(q), product(side, q))
    mixed = product(conjugate(p), product(side, q)) + product(conjugate(q), product(side, p))
    turned: FloatArray = (ends / 3 + mixed / 6)[..., 1:]
    return turned


def _poisson(mesh: Mesh, sides: FloatArray) -> FloatArray:
    """(n, 3) positions whose edges fit the given sides best, weighted by cotangents."""
    n, faces = mesh.n_vertices, mesh.faces
    corners = mesh.vertices[faces]
    forth, back = corners[:, [1, 2, 0]] - corners, corners[:, [2, 0, 1]] - corners
    cotangents = (forth * back).sum(axis=-1) / (2 * mesh.face_areas[:, None])
    weights = 0.5 * cotangents[:, [2, 0, 1]]  # side k runs from corner k to the next, opposite corner k + 2
    starts, stops = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    pull = (weights[..., None] * sides).reshape(-1, 3)
    right = np.zeros((n, 3))
    np.add.at(right, stops, pull)
    np.subtract.at(right, starts, pull)
    off = sp.coo_array((weights.ravel(), (starts, stops)), shape=(n, n)).tocsr()
    off = off + off.T
    stiffness = sp.csc_array(sp.diags_array(off.sum(axis=1)) - off)
    # Positions are free up to a translation: the first vertex stays at the origin.
    positions = np.zeros((n, 3))
    factor = splu(stiffness[1:, 1:], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    positions[1:] = factor.solve(right[1:])
    return positions


def _placed(mesh: Mesh, positions: FloatArray) -> Mesh:
    """Give the new surface the area and the centre of the old one."""
    moved = mesh.with_vertices(positions)
    if not moved.area > 0:
        raise NumericalError("the transformed surface has no area: scale rho down")
    moved = moved.scaled(np.sqrt(mesh.area / moved.area))
    return moved.translated(_centre(mesh) - _centre(moved))


def _centre(mesh: Mesh) -> FloatArray:
    centre: FloatArray = mesh.vertex_areas @ mesh.vertices / mesh.area
    return centre


def _in_plane(mesh: Mesh) -> FloatArray:
    """(m, 2, 2) two sides of each triangle in a frame of its own plane, as columns."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    length = np.linalg.norm(b - a, axis=1)
    along = (b - a) / np.where(length > 0, length, 1.0)[:, None]
    x = ((c - a) * along).sum(axis=1)
    y = np.linalg.norm(c - a - x[:, None] * along, axis=1)
    return np.stack([np.stack([length, x], axis=1), np.stack([np.zeros_like(y), y], axis=1)], axis=1)
