"""Curvatures against closed forms, the laws they obey, another implementation, and real surfaces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay

from pliant import Mesh, MeshError, errors, shapes
from pliant.mesh import Curvatures, principal_curvatures


def scattered_sphere(count, seed):
    """Random points on the unit sphere: triangles of every shape."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    faces = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = (points[faces[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    faces[inward] = faces[inward][:, ::-1]
    return Mesh(points, faces)


def scattered_graph(height, count, seed, half=1.0):
    """z = height(x, y) over random points of a square."""
    rng = np.random.default_rng(seed)
    side = np.linspace(-half, half, round(count**0.5))
    rim = np.concatenate([np.c_[side, np.full_like(side, s * half)] for s in (-1, 1)])
    plane = np.unique(np.concatenate([rng.uniform(-half, half, (count, 2)), rim, rim[:, ::-1]]), axis=0)
    faces = Delaunay(plane).simplices.astype(np.int64)
    a, b, c = (plane[faces[:, i]] for i in range(3))
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    faces = faces[np.abs(turn) > 1e-12]
    faces[turn[np.abs(turn) > 1e-12] < 0] = faces[turn[np.abs(turn) > 1e-12] < 0][:, ::-1]
    return Mesh(np.c_[plane, height(*plane.T)], faces)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def ellipsoid_truth(points, axes):
    axes = np.asarray(axes, dtype=float)
    support = (points**2 / axes**4).sum(axis=1)
    gaussian = 1 / (np.prod(axes) ** 2 * support**2)
    mean = ((axes**2).sum() - (points**2).sum(axis=1)) / (2 * np.prod(axes) ** 2 * support**1.5)
    half = np.sqrt(np.maximum(mean**2 - gaussian, 0))
    return mean + half, mean - half


def random_rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


class TestClosedForms:
    def test_sphere_is_convex_positive(self):
        ball = principal_curvatures(shapes.icosphere(4, radius=5.0))
        np.testing.assert_allclose(ball.maximum, 0.2, rtol=0.015)
        np.testing.assert_allclose(ball.minimum, 0.2, rtol=0.015)
        np.testing.assert_allclose(ball.curvedness, 0.2, rtol=0.015)
        np.testing.assert_allclose(ball.gaussian, 0.04, rtol=0.03)
        assert ball.shape_index.max() < 0.01
        assert (ball.n_planar, ball.n_missing, ball.n_widened, ball.n_unresolved) == (0, 0, 0, 0)

    def test_open_cylinder_to_its_boundary(self):
        tube = principal_curvatures(shapes.cylinder(2.0, 6.0, sides=96, caps=False))
        np.testing.assert_allclose(tube.maximum, 0.5, rtol=0.01)
        np.testing.assert_allclose(tube.minimum, 0.0, atol=2e-3)
        np.testing.assert_allclose(tube.shape_index, 0.25, atol=3e-3)
        np.testing.assert_allclose(np.abs(tube.minimum_directions[:, 2]), 1.0, atol=1e-3)

    def test_saddle_has_opposite_curvatures(self):
        mesh = scattered_graph(lambda x, y: 0.5 * (x**2 - y**2), 3000, seed=1)
        middle = np.linalg.norm(mesh.vertices[:, :2], axis=1) < 0.05
        saddle = principal_curvatures(mesh)
        assert middle.sum() > 5
        # z bends up along x, away from the normal's side: concave, so y carries the positive curvature.
        np.testing.assert_allclose(saddle.maximum[middle], 1.0, atol=0.02)
        np.testing.assert_allclose(saddle.minimum[middle], -1.0, atol=0.02)
        np.testing.assert_allclose(np.abs(saddle.maximum_directions[middle, 1]), 1.0, atol=0.01)
        np.testing.assert_allclose(saddle.shape_index[middle], 0.5, atol=0.01)

    def test_quadric_and_cubic_graphs_are_exact_at_the_origin(self):
        mesh = scattered_graph(
            lambda x, y: 0.3 * x**2 + 0.1 * x * y - 0.2 * y**2 + 0.4 * x**3 - x * y**2, 800, seed=2
        )
        distance = np.linalg.norm(mesh.vertices[:, :2], axis=1)
        centre = int(distance.argmin())
        x, y = mesh.vertices[centre, :2]
        gradient = np.array([0.6 * x + 0.1 * y + 1.2 * x**2 - y**2, 0.1 * x - 0.4 * y - 2 * x * y])
        hessian = np.array([[0.6 + 2.4 * x, 0.1 - 2 * y], [0.1 - 2 * y, -0.4 - 2 * x]])
        first = np.eye(2) + np.outer(gradient, gradient)
        truth = np.sort(
            np.linalg.eigvals(-np.linalg.solve(first, hessian)) / np.sqrt(1 + gradient @ gradient)
        )
        found = principal_curvatures(mesh)
        np.testing.assert_allclose([found.minimum[centre], found.maximum[centre]], truth, atol=5e-3)

    def test_torus(self):
        mesh = shapes.torus(2.0, 0.8, rings=160, sides=80)
        around = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1])
        found = principal_curvatures(mesh)
        np.testing.assert_allclose(found.maximum, 1 / 0.8, rtol=0.03)
        np.testing.assert_allclose(found.minimum, (around - 2.0) / 0.8 / around, atol=0.02)

    @pytest.mark.parametrize("height", [lambda x, y: 0 * x, lambda x, y: 0.3 * x - 2 * y])
    def test_plane_has_no_shape_and_is_counted(self, height):
        mesh = scattered_graph(height, 300, seed=3)
        flat = principal_curvatures(mesh)
        np.testing.assert_allclose(flat.curvedness, 0, atol=1e-8)
        assert np.isnan(flat.shape_index).all()
        assert flat.n_planar == mesh.n_vertices


class TestConvergence:
    """Error against the mesh width: four times the vertices, a quarter of the error."""

    @pytest.mark.parametrize(
        "make", [lambda k: shapes.icosphere(k), lambda k: scattered_sphere(10 * 4**k + 2, k)]
    )
    def test_second_order_on_ellipsoids(self, make):
        axes = (1.0, 1.3, 1.7)
        errors_found = []
        for level in (3, 4, 5):
            base = make(level)
            mesh = Mesh(base.vertices * axes, base.faces)
            truth = ellipsoid_truth(mesh.vertices, axes)
            found = principal_curvatures(mesh)
            errors_found.append(rms([found.maximum - truth[0], found.minimum - truth[1]]))
        rates = np.log2(np.divide(errors_found[:-1], errors_found[1:]))
        assert rates.min() > 1.7, rates
        assert errors_found[-1] < 0.005

    def test_second_order_on_an_irregular_open_saddle_boundary_included(self):
        errors_found = []
        for count in (500, 2000, 8000):
            mesh = scattered_graph(lambda x, y: 0.5 * np.sin(x) * np.cos(y), count, seed=count)
            x, y = mesh.vertices[:, :2].T
            gradient = 0.5 * np.cos(x) * np.cos(y), -0.5 * np.sin(x) * np.sin(y)
            xx, xy = -0.5 * np.sin(x) * np.cos(y), -0.5 * np.cos(x) * np.sin(y)
            slope = 1 + gradient[0] ** 2 + gradient[1] ** 2
            mean = (
                (1 + gradient[1] ** 2) * xx - 2 * gradient[0] * gradient[1] * xy + (1 + gradient[0] ** 2) * xx
            )
            found = principal_curvatures(mesh)
            errors_found.append(rms(found.mean + mean / (2 * slope**1.5)))
        rates = np.log2(np.divide(errors_found[:-1], errors_found[1:]))
        assert rates.mean() > 1.5, rates

    def test_larger_radius_quells_noise(self):
        mesh = shapes.icosphere(4)
        rough = mesh.with_vertices(
            mesh.vertices * (1 + 0.002 * np.random.default_rng(0).normal(size=(2562, 1)))
        )
        width = mesh.edge_lengths.mean()
        spread = [np.std(principal_curvatures(rough, radius=r * width).mean) for r in (2.5, 5.0)]
        assert spread[1] < 0.3 * spread[0]


class TestLaws:
    @given(st.integers(0, 10_000), st.floats(0.01, 100))
    def test_rigid_motion_and_scale(self, seed, factor):
        rng = np.random.default_rng(seed)
        mesh = shapes.bumpy_sphere(2, rng=seed)
        turn = random_rotation(rng)
        moved = mesh.transformed(factor * turn).translated(factor * rng.normal(size=3))
        here, there = principal_curvatures(mesh), principal_curvatures(moved)
        assert there.radius == pytest.approx(factor * here.radius)
        np.testing.assert_allclose(there.maximum * factor, here.maximum, rtol=1e-6, atol=1e-7)
        np.testing.assert_allclose(there.minimum * factor, here.minimum, rtol=1e-6, atol=1e-7)
        np.testing.assert_allclose(there.shape_index, here.shape_index, atol=1e-6)
        clear = here.maximum - here.minimum > 0.1
        aligned = np.einsum("ij,ij->i", there.maximum_directions, here.maximum_directions @ turn.T)
        np.testing.assert_allclose(np.abs(aligned[clear]), 1, atol=1e-5)

    @given(st.integers(0, 10_000))
    def test_renumbering_renumbers(self, seed):
        mesh = shapes.bumpy_sphere(2, rng=seed)
        order = np.random.default_rng(seed).permutation(mesh.n_vertices)
        rank = np.argsort(order)
        found = principal_curvatures(Mesh(mesh.vertices[order], rank[mesh.faces]))
        np.testing.assert_allclose(
            found.maximum, principal_curvatures(mesh).maximum[order], rtol=1e-7, atol=1e-9
        )

    def test_flipping_negates_and_swaps(self):
        mesh = shapes.bumpy_sphere(3, rng=1)
        here, there = principal_curvatures(mesh), principal_curvatures(mesh.flipped())
        np.testing.assert_allclose(there.maximum, -here.minimum, atol=1e-9)
        np.testing.assert_allclose(there.minimum, -here.maximum, atol=1e-9)
        np.testing.assert_allclose(there.shape_index, 1 - here.shape_index, atol=1e-9)

    def test_directions_are_unit_orthogonal_tangents_with_a_fixed_sign(self):
        found = principal_curvatures(shapes.bumpy_sphere(3, rng=2))
        for axes in (found.maximum_directions, found.minimum_directions):
            np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1, atol=1e-12)
            assert (axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)] > 0).all()
        np.testing.assert_allclose(
            np.einsum("ij,ij->i", found.maximum_directions, found.minimum_directions), 0, atol=1e-12
        )
        assert (found.maximum >= found.minimum).all()

    def test_threads_do_not_change_a_bit(self):
        mesh = shapes.bumpy_sphere(5, rng=3)
        one, three = principal_curvatures(mesh), principal_curvatures(mesh, n_jobs=3)
        assert one.maximum.tobytes() == three.maximum.tobytes()
        assert one.minimum_directions.tobytes() == three.minimum_directions.tobytes()


class TestNeighbourhoods:
    def test_two_near_sheets_do_not_mix(self):
        # Two concentric spheres 0.02 apart where an edge is 0.07 long: each keeps its own sign and radius.
        outer, inner = shapes.icosphere(4), shapes.icosphere(4, radius=0.98).flipped()
        both = Mesh(
            np.concatenate([outer.vertices, inner.vertices]),
            np.concatenate([outer.faces, inner.faces + 2562]),
        )
        found = principal_curvatures(both)
        np.testing.assert_allclose(found.mean[:2562], 1, rtol=0.02)
        np.testing.assert_allclose(found.mean[2562:], -1 / 0.98, rtol=0.02)

    def test_thin_closed_plate_is_flat_away_from_its_rim(self):
        plate = shapes.cylinder(1.0, 0.03, sides=60, rows=2)
        found = principal_curvatures(plate)
        inside = np.hypot(plate.vertices[:, 0], plate.vertices[:, 1]) < 1 - 1.2 * found.radius
        assert inside.sum() > 50
        np.testing.assert_allclose(found.curvedness[inside], 0, atol=1e-8)

    def test_coarse_parts_are_widened_and_tiny_ones_missing(self):
        fine, coarse = shapes.icosphere(3), shapes.icosphere(1).translated([5, 0, 0])
        alone = Mesh([[0, 9, 0], [1, 9, 0], [0, 9, 1]], [[0, 1, 2]])
        parts, faces, offset = [], [], 0
        for part in (fine, coarse, alone):
            parts.append(part.vertices)
            faces.append(part.faces + offset)
            offset += part.n_vertices
        mesh = Mesh(np.concatenate([*parts, [[20.0, 0, 0]]]), np.concatenate(faces))
        found = principal_curvatures(mesh)
        assert found.n_missing == 4
        assert np.isnan(found.shape_index[-4:]).all()
        assert found.n_widened >= 42
        np.testing.assert_allclose(found.mean[642:684], 1, rtol=0.5)

    def test_sharp_rim_is_reported(self):
        found = principal_curvatures(shapes.cylinder(1.0, 0.05, sides=60, rows=2))
        assert found.n_unresolved > 0
        assert np.isfinite(found.maximum).all()

    def test_fewer_points_than_a_cubic_needs_fall_back_to_a_quadric(self):
        mesh = shapes.platonic("octahedron")
        found = principal_curvatures(mesh)
        assert found.n_missing in (0, mesh.n_vertices)
        fan = np.linspace(0, 2 * np.pi, 7)[:-1]
        ring = np.c_[0.1 * np.cos(fan), 0.1 * np.sin(fan), np.full(6, -0.005)]
        cap = Mesh(np.concatenate([[[0, 0, 0]], ring]), [[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)])
        np.testing.assert_allclose(principal_curvatures(cap).maximum[0], 1.0, rtol=1e-6)


class TestBadInput:
    @pytest.mark.parametrize("radius", [0, -1, np.nan, np.inf, "wide"])
    def test_radius(self, radius):
        with pytest.raises(errors.InputError, match="radius must be a positive length"):
            principal_curvatures(shapes.icosphere(1), radius=radius)

    @pytest.mark.parametrize("n_jobs", [0, -2])
    def test_n_jobs(self, n_jobs):
        with pytest.raises(errors.InputError, match="n_jobs"):
            principal_curvatures(shapes.icosphere(1), n_jobs=n_jobs)

    @pytest.mark.parametrize("mesh", [Mesh([[0, 0, 0]], []), Mesh(np.ones((3, 3)), [[0, 1, 2]])])
    def test_no_surface(self, mesh):
        with pytest.raises(MeshError, match="no edge of the mesh has a length"):
            principal_curvatures(mesh)

    def test_duplicate_vertices_and_slivers_give_finite_or_missing(self):
        mesh = shapes.icosphere(2)
        vertices = mesh.vertices.copy()
        vertices[50] = vertices[mesh.faces[mesh.faces[:, 0] == 50][0, 1]]
        found = principal_curvatures(mesh.with_vertices(vertices))
        assert isinstance(found, Curvatures)
        assert np.isfinite(found.maximum).sum() + found.n_missing == mesh.n_vertices


def test_agrees_with_the_angle_defect():
    trimesh = pytest.importorskip("trimesh")
    mesh = shapes.bumpy_sphere(4, rng=5)
    other = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    defect = other.vertex_defects / mesh.vertex_areas
    assert np.corrcoef(principal_curvatures(mesh).gaussian, defect)[0, 1] > 0.97


def test_gauss_bonnet():
    for mesh, total in ((shapes.bumpy_sphere(5, rng=6), 4 * np.pi), (shapes.torus(rings=192, sides=96), 0.0)):
        assert principal_curvatures(mesh).gaussian @ mesh.vertex_areas == pytest.approx(total, abs=0.15)


@pytest.mark.data
def test_cortex_folds_both_ways_and_a_cat_is_mostly_convex(data):
    nibabel = pytest.importorskip("nibabel")
    white = Mesh(*nibabel.freesurfer.read_geometry(data / "cortex" / "subject1" / "lh.white"))
    found = principal_curvatures(white, n_jobs=2)
    assert found.n_missing == 0
    assert found.n_unresolved < 0.06 * white.n_vertices
    assert 0.3 < np.mean(found.mean > 0) < 0.7
    trimesh = pytest.importorskip("trimesh")
    cat = trimesh.load(data / "shapes" / "tosca" / "cat0.ply", process=False)
    cat_found = principal_curvatures(Mesh(np.asarray(cat.vertices), np.asarray(cat.faces)))
    assert np.mean(cat_found.mean > 0) > 0.75
    assert cat_found.n_missing == 0
