"""Perturbations: each class does what it says, maps back rightly, keeps what it must, and repeats."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pliant import Mesh, MeshError, errors, shapes
from pliant.mesh import boundary_loops, edge_faces, vertex_components
from pliant.mesh import perturb as p
from pliant.mesh.perturb._collapse import badness, stars_of
from pliant.mesh.perturb.cut import is_disc

KINDS = get_args(p.Kind)
STILL = ("isometry", "scale", "local_scale", "noise", "shot_noise")


def star(n_arms=3):
    """Ball with long limbs: something that can bend."""
    mesh = shapes.icosphere(4)
    axes = np.eye(3)[:n_arms]
    reach = sum(np.exp(-((1 - mesh.vertices @ axis) / 0.12)) for axis in axes)
    return mesh.with_vertices(mesh.vertices * (1 + 4 * reach[:, None]))


def euler(mesh):
    used = len(np.unique(mesh.faces))
    return used - len(mesh.edges) + mesh.n_faces


def crowded_or_torn(mesh):
    """Vertices whose faces are not one fan, edges with more than two faces, and faces of disagreeing winding."""
    sides = edge_faces(mesh)
    links = [{} for _ in range(mesh.n_vertices)]
    for face in mesh.faces.tolist():
        for k in range(3):
            links[face[k]].setdefault(face[(k + 1) % 3], []).append(face[(k + 2) % 3])
    torn = 0
    for link in links:
        follower = {a: b[0] for a, b in link.items()}
        starts = set(follower) - set(follower.values())
        at = next(iter(starts)) if starts else next(iter(follower), None)
        seen = 0
        while at in follower and seen < len(follower):
            at, seen = follower[at], seen + 1
        torn += seen != len(follower) or any(len(b) > 1 for b in link.values())
    return torn, int((sides.counts > 2).sum()), int((~sides.agree).sum())


def joined(*meshes):
    offsets = np.cumsum([0] + [m.n_vertices for m in meshes])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + o for m, o in zip(meshes, offsets, strict=False)]),
    )


NULLS = {
    "ball": shapes.icosphere(4),
    "torus": shapes.torus(2.0, 0.7, rings=60, sides=30),
    "tube": shapes.cylinder(1.0, 4.0, sides=40, caps=False),
    "sheet": shapes.grid(30, 30),
    "star": star(),
    "pieces": joined(shapes.icosphere(3), shapes.torus(rings=40, sides=20).translated([6, 0, 0])),
}


@pytest.fixture(params=NULLS, scope="module")
def null(request):
    return NULLS[request.param]


@pytest.mark.parametrize("kind", KINDS)
class TestEveryClass:
    def test_strength_zero_is_the_null_shape(self, kind):
        null = NULLS["ball"]
        result = p.perturbed(null, kind, strength=0, rng=0)
        assert result.mesh is null
        np.testing.assert_array_equal(result.source, np.arange(null.n_vertices))

    def test_same_seed_same_bytes_and_seeds_differ(self, kind):
        null = NULLS["star"]
        one, two, other = (p.perturbed(null, kind, strength=3, rng=seed) for seed in (7, 7, 8))
        assert one.mesh.vertices.tobytes() == two.mesh.vertices.tobytes()
        assert one.mesh.faces.tobytes() == two.mesh.faces.tobytes()
        assert one.source.tobytes() == two.source.tobytes()
        if kind != "scale":
            assert one.mesh.vertices.tobytes() != other.mesh.vertices.tobytes()

    @pytest.mark.parametrize("strength", [1, 5])
    def test_stays_a_surface_in_as_many_pieces(self, kind, null, strength):
        result = p.perturbed(null, kind, strength=strength, rng=strength)
        assert crowded_or_torn(result.mesh) == (0, 0, 0)
        assert len(np.unique(result.mesh.faces)) == result.mesh.n_vertices
        assert vertex_components(result.mesh)[0] == vertex_components(null)[0]
        assert (result.kind, result.strength) == (kind, strength)

    def test_map_back_is_one_to_one_and_exact_where_vertices_stay(self, kind, null):
        result = p.perturbed(null, kind, strength=4, rng=3)
        assert len(np.unique(result.source)) == result.mesh.n_vertices
        if kind in STILL:
            np.testing.assert_array_equal(result.source, np.arange(null.n_vertices))
            np.testing.assert_array_equal(result.mesh.faces, null.faces)
        else:
            np.testing.assert_array_equal(result.mesh.vertices, null.vertices[result.source])

    def test_stronger_changes_more(self, kind):
        null = NULLS["star"]
        sizes = []
        for strength in (1, 3, 5):
            result = p.perturbed(null, kind, strength=strength, rng=5)
            moved = np.linalg.norm(result.mesh.vertices - null.vertices[result.source], axis=1).sum()
            lost = null.n_vertices - result.mesh.n_vertices
            sizes.append(moved + lost)
        assert 0 < sizes[0] < sizes[1] < sizes[2]

    @pytest.mark.parametrize("strength", [-1, 6, 2.5, True, "3"])
    def test_bad_strength(self, kind, strength):
        with pytest.raises(errors.InputError, match="strength must be a whole number from 0"):
            p.perturbed(NULLS["ball"], kind, strength=strength, rng=0)

    def test_tiny_and_flat_meshes_answer_or_say_why(self, kind):
        point = np.zeros((3, 3))
        for mesh in (
            Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
            shapes.platonic("tetrahedron"),
            shapes.icosphere(0),
            Mesh(point, [[0, 1, 2]]),
            Mesh([[0.0, 0, 0]], []),
        ):
            try:
                result = p.perturbed(mesh, kind, strength=5, rng=0)
            except MeshError:
                continue
            assert len(result.source) == result.mesh.n_vertices >= 1
            assert np.isfinite(result.mesh.vertices).all()

    def test_unreferenced_vertices_and_crowded_edges_pass_through(self, kind):
        ball = shapes.icosphere(3)
        vertices = np.concatenate([ball.vertices, [[9.0, 9, 9], [0, 0, 5]]])
        fin = [[*ball.faces[0, :2].tolist(), 643]]
        null = Mesh(vertices, np.concatenate([ball.faces, fin]))
        result = p.perturbed(null, kind, strength=2, rng=0)
        assert 642 in result.source
        assert np.isfinite(result.mesh.vertices).all()
        assert (edge_faces(result.mesh).counts > 2).sum() <= 1


class TestNoise:
    @given(st.integers(0, 1000), st.floats(0.001, 1))
    def test_along_normals_with_the_asked_spread(self, seed, sigma):
        null = NULLS["ball"]
        shift = p.with_noise(null, sigma, rng=seed).vertices - null.vertices
        along = np.einsum("ij,ij->i", shift, null.vertex_normals)
        np.testing.assert_allclose(shift, along[:, None] * null.vertex_normals, atol=1e-12)
        spread = sigma * null.edge_lengths.mean()
        assert abs(along.std() - spread) <= 0.08 * spread
        assert abs(along.mean()) <= 0.1 * spread + 1e-15

    def test_class_is_with_noise(self):
        null = NULLS["ball"]
        result = p.noise(null, strength=4, rng=11)
        np.testing.assert_array_equal(result.mesh.vertices, p.with_noise(null, 0.4, rng=11).vertices)

    def test_follows_scale_and_motion(self):
        null = NULLS["star"]
        here, there = (
            p.with_noise(null, 0.3, rng=1),
            p.with_noise(null.scaled(7).translated([1, 2, 3]), 0.3, rng=1),
        )
        np.testing.assert_allclose(there.vertices, 7 * here.vertices + [1, 2, 3], atol=1e-9)

    @pytest.mark.parametrize("sigma", [-0.1, np.nan, np.inf])
    def test_bad_sigma(self, sigma):
        with pytest.raises(errors.InputError, match="sigma must be at least 0"):
            p.with_noise(NULLS["ball"], sigma, rng=0)

    def test_shot_noise_hits_few_and_hard(self):
        null = NULLS["ball"]
        result = p.shot_noise(null, strength=5, rng=0)
        shift = np.linalg.norm(result.mesh.vertices - null.vertices, axis=1) / null.edge_lengths.mean()
        assert np.count_nonzero(shift) == round(0.01 * null.n_vertices)
        assert 2 <= shift[shift > 0].min() <= shift.max() <= 6


class TestScale:
    def test_global(self):
        null = NULLS["star"]
        result = p.scale(null, strength=3)
        np.testing.assert_allclose(result.mesh.vertices, null.vertices * 1.25**3)

    def test_local_is_bounded_and_leaves_the_rest_alone(self):
        null = shapes.ellipsoid([1, 1, 12], 5)
        result = p.local_scale(null, strength=3, rng=2)
        shift = np.linalg.norm(result.mesh.vertices - null.vertices, axis=1)
        assert np.mean(shift == 0) > 0.1
        assert result.mesh.area > 1.05 * null.area
        ratio = result.mesh.edge_lengths / null.edge_lengths
        assert ratio.max() < 1.75**3
        assert ratio.max() > 1.3

    @given(st.integers(0, 300), st.integers(1, 5))
    def test_the_map_of_space_is_one_to_one(self, seed, strength):
        # On a line of points through space order must be kept along every ray from the centre of a ball.
        from pliant.mesh.perturb.displace import _inflated

        rng = np.random.default_rng(seed)
        ray = np.linspace(0, 1.2, 200)[:, None] * rng.normal(size=3)
        moved = _inflated(ray, np.zeros(3), float(np.linalg.norm(ray[-1])) / 1.2, 1 + strength / 4)
        assert (np.diff(np.linalg.norm(moved, axis=1)) > 0).all()


class TestHoles:
    @pytest.mark.parametrize("strength", [1, 3, 5])
    def test_micro_holes_add_that_many_loops(self, null, strength):
        result = p.micro_holes(null, strength=strength, rng=1)
        wanted = round(0.005 * strength * null.n_vertices)
        assert len(boundary_loops(result.mesh)) == len(boundary_loops(null)) + wanted
        assert null.n_vertices - result.mesh.n_vertices == wanted
        assert euler(result.mesh) == euler(null) - wanted

    @pytest.mark.parametrize("strength", [1, 3, 5])
    def test_holes_add_that_many_loops_and_take_their_share(self, null, strength):
        result = p.holes(null, strength=strength, rng=1)
        assert len(boundary_loops(result.mesh)) == len(boundary_loops(null)) + strength
        assert euler(result.mesh) == euler(null) - strength
        lost = 1 - result.mesh.area / null.area
        assert 0.2 * 0.02 * strength < lost < 2.5 * 0.02 * strength
        assert f"{strength} holes" in result.description

    def test_discs(self):
        ball, tube = NULLS["ball"], NULLS["tube"]
        assert is_disc(ball.faces[(ball.faces == 0).any(axis=1)])
        assert is_disc(NULLS["sheet"].faces)
        assert not is_disc(ball.faces)
        assert not is_disc(tube.faces)
        assert not is_disc(np.array([[0, 1, 2], [0, 3, 4]]))
        assert not is_disc(np.array([[0, 1, 2], [3, 4, 5]]))
        assert not is_disc(np.zeros((0, 3), dtype=int))

    def test_no_place(self):
        with pytest.raises(MeshError, match="no place for a hole"):
            p.holes(shapes.grid(2, 2), strength=1, rng=0)
        with pytest.raises(MeshError, match="no place for a hole"):
            p.micro_holes(shapes.grid(2, 2), strength=1, rng=0)


class TestTopology:
    @pytest.mark.parametrize("strength", [1, 3, 5])
    def test_each_weld_is_a_handle(self, null, strength):
        result = p.topology_change(null, strength=strength, rng=4)
        welds = int(result.description.split()[0])
        assert 1 <= welds <= strength
        assert euler(result.mesh) == euler(null) - 2 * welds
        assert len(boundary_loops(result.mesh)) == len(boundary_loops(null))
        assert result.mesh.n_vertices == null.n_vertices - 2 * welds

    def test_welds_across_the_gap_of_a_horseshoe(self):
        rod = shapes.ellipsoid([0.4, 0.4, 8.0], 4)
        x, y, z = rod.vertices.T
        angle = z / 8 * 0.94 * np.pi
        ring = rod.with_vertices(np.c_[(3 - x) * np.cos(angle), y, (3 - x) * np.sin(angle)])
        result = p.topology_change(ring.flipped(), strength=1, rng=0)
        lost = np.setdiff1d(np.arange(ring.n_vertices), result.source)
        # Its two tips point at each other over a gap much shorter than the way around.
        assert angle[lost].min() < -2 < 2 < angle[lost].max()
        assert np.linalg.norm(np.diff(ring.vertices[lost], axis=0)) < 2.5
        assert euler(result.mesh) == 0

    def test_shortcuts_shorten_paths_along_the_surface(self):
        from scipy.sparse.csgraph import dijkstra

        from pliant.mesh.adjacency import edge_matrix

        null = NULLS["star"]
        result = p.topology_change(null, strength=1, rng=0)
        new = np.setdiff1d(
            result.mesh.edges @ [10**6, 1], np.searchsorted(result.source, null.edges) @ [10**6, 1]
        )
        a, b = np.divmod(new[0], 10**6)
        before = dijkstra(edge_matrix(null), indices=result.source[a])[result.source[b]]
        after = dijkstra(edge_matrix(result.mesh), indices=a)[b]
        assert after < before / 1.5

    def test_nothing_to_join(self):
        with pytest.raises(MeshError, match="no two places"):
            p.topology_change(shapes.platonic("tetrahedron"), strength=1, rng=0)


class TestSampling:
    @pytest.mark.parametrize("strength", [1, 3, 5])
    def test_takes_the_asked_share_and_keeps_topology(self, null, strength):
        result = p.sampling(null, strength=strength, rng=2)
        left = 1 - 0.16 * strength
        assert result.mesh.n_vertices == pytest.approx(left * null.n_vertices, rel=0.03)
        assert euler(result.mesh) == euler(null)
        assert len(boundary_loops(result.mesh)) == len(boundary_loops(null))

    def test_surface_and_its_orientation_stay(self):
        ball = NULLS["ball"]
        coarse = p.sampling(ball, strength=4, rng=0).mesh
        assert coarse.area == pytest.approx(ball.area, rel=0.03)
        centres = coarse.vertices[coarse.faces].mean(axis=1)
        assert (np.einsum("ij,ij->i", centres, coarse.face_normals) > 0.7).all()

    @given(st.integers(0, 1000))
    def test_small_random_shapes_never_break(self, seed):
        null = shapes.bumpy_sphere(1, rng=seed)
        result = p.sampling(null, strength=5, rng=seed)
        assert crowded_or_torn(result.mesh) == (0, 0, 0)
        assert euler(result.mesh) == 2
        assert result.mesh.n_vertices >= 4

    @given(st.integers(0, 1000), st.integers(0, 2))
    def test_crumpled_shapes_keep_topology(self, seed, subdivisions):
        # Positions say nothing here, so the connectivity alone must forbid what would tear or pinch.
        ball = shapes.icosphere(subdivisions)
        null = ball.with_vertices(np.random.default_rng(seed).normal(size=ball.vertices.shape))
        result = p.sampling(null, strength=5, rng=seed)
        assert crowded_or_torn(result.mesh) == (0, 0, 0)
        assert euler(result.mesh) == 2

    def test_no_triangle_turns_over(self):
        flat = NULLS["sheet"]
        shaken = flat.with_vertices(
            flat.vertices + np.random.default_rng(0).uniform(-0.3, 0.3, (900, 3)) * [1, 1, 0]
        )
        for seed in range(5):
            result = p.sampling(shaken, strength=5, rng=seed)
            assert (result.mesh.face_normals[:, 2] > 0).all()
            assert result.mesh.n_vertices < 0.25 * 900

    def test_a_merge_that_turns_a_triangle_over_is_refused(self):
        # Seen from the tips of a four-pointed star its notches hide part of the rim.
        angle = np.arange(8) * np.pi / 4
        ring = np.where(np.arange(8) % 2, 0.2, 1.0)[:, None] * np.c_[np.cos(angle), np.sin(angle), 0 * angle]
        vertices = np.concatenate([[[0.0, 0, 0]], ring])
        faces = np.array([[0, 1 + k, 1 + (k + 1) % 8] for k in range(8)])
        starts, around = stars_of(faces, np.ones(8, dtype=bool), 9)
        for into in range(1, 9, 2):
            assert badness(0, into, vertices, faces, starts, around, np.empty(3), np.empty(3)) == np.inf
        round_ring = vertices / np.maximum(np.linalg.norm(vertices, axis=1), 0.1)[:, None]
        assert badness(0, 1, round_ring, faces, starts, around, np.empty(3), np.empty(3)) < 10

    @given(st.integers(0, 1000))
    def test_smallest_surfaces_cannot_vanish(self, seed):
        flattened = np.random.default_rng(seed).normal(size=(4, 3)) * [1, 1, 0.02]
        tetrahedron = shapes.platonic("tetrahedron")
        for null in (tetrahedron, tetrahedron.with_vertices(flattened), Mesh(np.eye(3), [[0, 1, 2]])):
            result = p.sampling(null, strength=5, rng=0)
            assert (result.mesh.n_vertices, result.mesh.n_faces) == (null.n_vertices, null.n_faces)


class TestIsometry:
    def test_limbs_bend_and_lengths_nearly_stay(self):
        null = star()
        mean, far = [], []
        for strength in (1, 3, 5):
            bent = p.isometry(null, strength=strength, rng=1).mesh
            mean.append(p.edge_strain(null, bent).mean())
            near = np.linalg.norm(null.vertices, axis=1) > 4
            there = np.linalg.norm(bent.vertices[:, None] - bent.vertices[None, near][:, ::20], axis=2)
            here = np.linalg.norm(null.vertices[:, None] - null.vertices[None, near][:, ::20], axis=2)
            far.append(np.abs(there - here).max())
        assert mean[0] < mean[1] < mean[2] < 0.05
        assert far[2] > 0.5
        assert far[0] < far[2]

    def test_a_rod_bends_like_a_beam(self):
        rod = shapes.ellipsoid([0.5, 0.5, 8], 4)
        result = p.isometry(rod, strength=5, rng=0)
        assert p.edge_strain(rod, result.mesh).mean() < 0.03
        assert np.ptp(result.mesh.vertices[:, 2]) < 0.95 * 16
        assert "edges changed by" in result.description

    def test_rotations_of_a_rigid_motion_are_found_and_followed(self):
        from pliant.mesh.perturb._rigid import RigidFit
        from pliant.mesh.perturb.bend import _rotations

        mesh = shapes.bumpy_sphere(2, rng=0)
        turn = _rotations(np.array([[0.3, -1.2, 0.5]]))[0]
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.norm([0.3, -1.2, 0.5]) == pytest.approx(np.arccos((np.trace(turn) - 1) / 2))
        solver = RigidFit(mesh, np.array([0]))
        moved = (mesh.vertices - mesh.vertices[0]) @ turn.T + mesh.vertices[0]
        rotations = solver.best_rotations(moved)
        np.testing.assert_allclose(rotations, np.broadcast_to(turn, rotations.shape), atol=1e-9)
        np.testing.assert_allclose(solver.positions(rotations), moved, atol=1e-9)
        crumpled = solver.best_rotations(np.random.default_rng(0).normal(size=moved.shape))
        np.testing.assert_allclose(np.linalg.det(crumpled), 1, atol=1e-9)

    def test_small_pieces_stay(self):
        both = joined(star(), shapes.icosphere(1).translated([20, 0, 0]))
        bent = p.isometry(both, strength=3, rng=0).mesh
        np.testing.assert_array_equal(bent.vertices[-42:], both.vertices[-42:])
        assert not np.allclose(bent.vertices[:-42], both.vertices[:-42])

    def test_strain_wants_the_same_triangles(self):
        with pytest.raises(errors.InputError, match="other edges"):
            p.edge_strain(shapes.icosphere(1), shapes.icosphere(2))

    def test_figures_take_poses(self):
        figure = shapes.quadruped(2000)
        result = p.perturbed(figure, "isometry", strength=4, rng=3)
        np.testing.assert_array_equal(result.mesh.faces, figure.mesh.faces)
        pose = figure.random_pose(rng=3, strength=0.56)
        np.testing.assert_allclose(result.mesh.vertices, figure.posed(pose).mesh.vertices, atol=1e-12)
        assert p.perturbed(figure, "noise", strength=1, rng=0).mesh.n_vertices == figure.mesh.n_vertices


def test_unknown_kind():
    with pytest.raises(errors.InputError, match="kind must be one of isometry"):
        p.perturbed(NULLS["ball"], "melting", strength=1, rng=0)


def test_result_checks_its_map():
    with pytest.raises(errors.InputError, match="source must name one vertex"):
        p.Perturbed(NULLS["ball"], [0, 1], "noise", 1, "")


@pytest.mark.data
@pytest.mark.parametrize("name", ["cat0", "horse0"])
def test_real_shapes(data, name):
    from pliant.mesh import load_mesh

    null = load_mesh(data / "shapes" / "tosca" / f"{name}.ply")
    before = crowded_or_torn(null)
    for kind in KINDS:
        result = p.perturbed(null, kind, strength=5, rng=1)
        after = crowded_or_torn(result.mesh)
        assert all(a <= b for a, b in zip(after, before, strict=True)), kind
        if kind == "isometry":
            assert p.edge_strain(null, result.mesh).mean() < 0.03
