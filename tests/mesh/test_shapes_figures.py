"""Posable figures: exact symmetry and correspondence, sound meshes, gentle bending."""

from __future__ import annotations

import pickle
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from pliant import Mesh, shapes
from pliant.errors import InputError

MAKERS = {"human": shapes.human, "quadruped": shapes.quadruped}
POSES = {
    "human": ["rest", "walk", "run", "sit", "wave", "crouch", "reach", "bow"],
    "quadruped": ["rest", "walk", "gallop", "sit", "lie", "graze", "look_back", "rear"],
}
KIND_AND_POSE = [(kind, pose) for kind, poses in POSES.items() for pose in poses]


@cache
def built(kind: str, n_vertices: int) -> shapes.Figure:
    return MAKERS[kind](n_vertices)


@pytest.fixture(scope="module")
def figures():
    return {kind: built(kind, 5000) for kind in MAKERS}


def volume(mesh: Mesh) -> float:
    return float(np.linalg.det(mesh.vertices[mesh.faces]).sum() / 6)


def qualities(mesh: Mesh) -> np.ndarray:
    corners = mesh.vertices[mesh.faces]
    sides = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=(1, 2))
    return 4 * np.sqrt(3) * mesh.face_areas / sides


def crossings(mesh: Mesh) -> int:
    """Edges that pierce a triangle with which they share no vertex."""
    triangles = mesh.vertices[mesh.faces]
    centres = triangles.mean(axis=1)
    reach = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)
    middles, halves = mesh.vertices[mesh.edges].mean(axis=1), mesh.edge_lengths / 2
    found = cKDTree(centres).query_ball_point(middles, halves + reach.max())
    edge = np.repeat(np.arange(len(found)), [len(near) for near in found])
    face = np.concatenate([np.array(near, dtype=int) for near in found])
    close = np.linalg.norm(middles[edge] - centres[face], axis=1) <= halves[edge] + reach[face]
    apart = ~(mesh.edges[edge][:, :, None] == mesh.faces[face][:, None, :]).any(axis=(1, 2))
    edge, face = edge[close & apart], face[close & apart]
    p, q = mesh.vertices[mesh.edges[edge, 0]], mesh.vertices[mesh.edges[edge, 1]]
    a, b, c = (triangles[face, i] for i in range(3))

    def side(o, u, v, w):
        return np.sign(np.linalg.det(np.stack([u - o, v - o, w - o], axis=1)))

    pierced = side(a, b, c, p) * side(a, b, c, q) < 0
    turns = np.stack([side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)])
    return int((pierced & (np.abs(turns.sum(axis=0)) == 3)).sum())


def components(mesh: Mesh) -> int:
    n = mesh.n_vertices
    graph = coo_array((np.ones(len(mesh.edges)), tuple(mesh.edges.T)), shape=(n, n))
    return int(connected_components(graph, directed=False)[0])


def sorted_faces(faces: np.ndarray) -> np.ndarray:
    """Faces with the smallest vertex first (winding kept), in ascending order."""
    first = faces.argmin(axis=1)
    rolled = faces[np.arange(len(faces))[:, None], (first[:, None] + np.arange(3)) % 3]
    return rolled[np.lexsort(rolled.T[::-1])]


def assert_sound(figure: shapes.Figure) -> None:
    mesh = figure.mesh
    half = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert len(np.unique(half, axis=0)) == len(half)
    assert np.array_equal(
        np.unique(np.sort(half, axis=1), axis=0, return_counts=True)[1], [2] * len(mesh.edges)
    )
    assert mesh.n_vertices - len(mesh.edges) + mesh.n_faces == 2
    assert components(mesh) == 1
    assert np.array_equal(np.unique(mesh.faces), np.arange(mesh.n_vertices))
    assert volume(mesh) > 0


def assert_mirrored(figure: shapes.Figure) -> None:
    mesh, symmetry = figure.mesh, figure.symmetry
    assert np.array_equal(mesh.vertices[symmetry], mesh.vertices * [-1, 1, 1])
    assert np.array_equal(symmetry[symmetry], np.arange(mesh.n_vertices))
    assert np.array_equal(symmetry == np.arange(mesh.n_vertices), mesh.vertices[:, 0] == 0)
    assert np.array_equal(sorted_faces(symmetry[mesh.faces[:, ::-1]]), sorted_faces(mesh.faces))


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("asked", [1000, 2501, 5000])
def test_rest_is_sound_symmetric_and_of_the_asked_size(kind, asked, figures):
    figure = built(kind, asked)
    assert abs(figure.mesh.n_vertices - asked) <= 0.02 * asked
    assert_sound(figure)
    assert_mirrored(figure)
    assert crossings(figure.mesh) == 0
    assert qualities(figure.mesh).min() > 0.25
    assert np.percentile(qualities(figure.mesh), 1) > 0.7
    assert figure.pose.name == "rest"


@pytest.mark.parametrize("kind", MAKERS)
def test_larger_meshes_converge_to_one_surface(kind, figures):
    fine = built(kind, 9000)
    areas = [built(kind, 1000).mesh.area, figures[kind].mesh.area, fine.mesh.area]
    assert areas[0] < areas[1] < areas[2]
    assert areas[1] == pytest.approx(areas[2], rel=0.01)
    gaps, _ = cKDTree(fine.mesh.vertices).query(figures[kind].mesh.vertices)
    assert gaps.max() < 1.5 * fine.mesh.edge_lengths.max()


@pytest.mark.parametrize("kind", MAKERS)
def test_same_arguments_same_bytes(kind):
    first, again = built(kind, 1000), MAKERS[kind](1000)
    assert first.mesh.vertices.tobytes() == again.mesh.vertices.tobytes()
    assert first.mesh.faces.tobytes() == again.mesh.faces.tobytes()
    walk, walk_again = first.posed("walk"), again.posed("walk")
    assert walk.mesh.vertices.tobytes() == walk_again.mesh.vertices.tobytes()


@pytest.mark.parametrize("kind", MAKERS)
def test_triangulation_is_generic(kind, figures):
    mesh, symmetry = figures[kind].mesh, figures[kind].symmetry
    degrees = np.bincount(mesh.edges.ravel())
    assert degrees.min() >= 4
    assert 0.2 < np.mean(degrees == 6) < 0.9
    # Lengths tie with their mirror images and with nothing else.
    image = np.sort(symmetry[mesh.edges], axis=1)
    own = (image >= mesh.edges).all(axis=1) | (image[:, 0] > mesh.edges[:, 0])
    lengths = np.sort(mesh.edge_lengths[own])
    assert (np.diff(lengths) == 0).mean() < 1e-3


@pytest.mark.parametrize("kind", MAKERS)
def test_front_and_back_differ(kind, figures):
    """No other mirror plane and no half turn maps the figure near itself."""
    vertices = figures[kind].mesh.vertices
    tree = cKDTree(vertices)
    middle = (vertices.max(axis=0) + vertices.min(axis=0)) / 2
    size = np.ptp(vertices, axis=0).max()
    for signs in ([1, 1, -1], [1, -1, 1], [-1, 1, -1], [-1, -1, 1], [1, -1, -1]):
        gaps, _ = tree.query((vertices - middle) * signs + middle)
        assert gaps.mean() > 0.01 * size


@pytest.mark.parametrize(("kind", "pose"), KIND_AND_POSE)
def test_named_poses_are_gentle(kind, pose, figures):
    rest, posed = figures[kind], figures[kind].posed(pose)
    assert np.array_equal(posed.mesh.faces, rest.mesh.faces)
    assert np.array_equal(posed.symmetry, rest.symmetry)
    assert posed.pose.name == pose
    change = np.abs(posed.mesh.edge_lengths / rest.mesh.edge_lengths - 1)
    assert np.median(change) < 0.02
    assert np.percentile(change, 95) < 0.27
    assert volume(posed.mesh) == pytest.approx(volume(rest.mesh), rel=0.08)
    assert crossings(posed.mesh) == 0
    assert (pose == "rest") == np.array_equal(posed.mesh.vertices, rest.mesh.vertices)


@pytest.mark.parametrize("kind", MAKERS)
def test_pose_names_are_listed_and_rest_is_exact_after_bending(kind, figures):
    figure = figures[kind]
    assert list(figure.pose_names) == POSES[kind]
    back = figure.posed("walk").posed("rest")
    assert back.mesh.vertices.tobytes() == figure.mesh.vertices.tobytes()
    assert figure.posed({}).mesh.vertices.tobytes() == figure.mesh.vertices.tobytes()


@pytest.mark.parametrize("kind", MAKERS)
def test_turning_the_root_is_a_rigid_motion(kind, figures):
    figure = figures[kind]
    turn = np.array([20.0, -50.0, 35.0])
    moved = figure.posed({"pelvis": tuple(turn)})
    pivot = figure.joints["pelvis"]
    expected = Rotation.from_rotvec(turn, degrees=True).apply(figure.mesh.vertices - pivot) + pivot
    np.testing.assert_allclose(moved.mesh.vertices, expected, atol=1e-12)


def test_what_a_joint_does_not_carry_stays():
    figure = built("human", 2501)
    moved = np.linalg.norm(
        figure.posed({"left_elbow": (-40, -40, 0)}).mesh.vertices - figure.mesh.vertices, axis=1
    )
    away = figure.mesh.vertices[:, 0] < 0
    assert moved[away].max() < 1e-6
    hand = figure.parts == figure.part_names.index("left hand")
    assert moved[hand].min() > 0.02


@pytest.mark.parametrize("kind", MAKERS)
@given(seed=st.integers(0, 10_000), strength=st.floats(0, 0.7))
@settings(max_examples=15)
def test_a_mirrored_pose_gives_the_mirrored_shape(kind, figures, seed, strength):
    figure = figures[kind]
    pose = figure.random_pose(rng=seed, strength=strength)
    posed, mirrored = figure.posed(pose), figure.posed(pose.mirrored())
    expected = posed.mesh.vertices[figure.symmetry] * [-1, 1, 1]
    np.testing.assert_allclose(mirrored.mesh.vertices, expected, atol=1e-9)
    change = np.abs(posed.mesh.edge_lengths / figure.mesh.edge_lengths - 1)
    assert np.median(change) < 0.03
    assert np.percentile(change, 95) < 0.3


def test_random_poses_are_drawn_within_limits_and_by_seed(figures):
    figure = figures["human"]
    assert figure.random_pose(rng=3) == figure.random_pose(rng=3)
    assert figure.random_pose(rng=3) != figure.random_pose(rng=4)
    assert figure.random_pose(rng=3, strength=0).scaled(1) == shapes.Pose(name="random")
    knees = [figure.random_pose(rng=s, strength=1).turns["left_knee"] for s in range(50)]
    assert all(0 <= x <= 80 and y == 0 == z for x, y, z in knees)
    elbows = [figure.random_pose(rng=s, strength=1).turns["right_elbow"][1] for s in range(50)]
    assert 0 <= min(elbows) <= max(elbows) <= 55


@pytest.mark.parametrize("kind", MAKERS)
def test_parts_are_named_connected_and_mirrored(kind, figures):
    figure = figures[kind]
    mesh = figure.mesh
    assert np.array_equal(np.unique(figure.parts), np.arange(len(figure.part_names)))
    swapped = [
        name.replace("left", "RIGHT").replace("right", "left").replace("RIGHT", "right")
        for name in figure.part_names
    ]
    image = np.array([figure.part_names.index(name) for name in swapped])
    assert np.array_equal(figure.parts[figure.symmetry], image[figure.parts])
    for part, name in enumerate(figure.part_names):
        if not name.startswith(("left", "right")):
            continue
        x = mesh.vertices[figure.parts == part, 0]
        assert (x > 0).all() if name.startswith("left") else (x < 0).all()
    inner = (figure.parts[mesh.edges[:, 0]] == figure.parts[mesh.edges[:, 1]]).mean()
    assert inner > 0.9


@pytest.mark.parametrize(
    ("kind", "name", "factor"),
    [("human", n, f) for n, f in (("legs", 1.3), ("arms", 0.75), ("head", 1.3), ("girth", 0.8))]
    + [("quadruped", n, f) for n, f in (("legs", 0.75), ("neck", 1.3), ("tail", 0.75), ("girth", 1.3))],
)
def test_proportions(kind, name, factor):
    plain, other = built(kind, 1000), MAKERS[kind](1000, proportions={name: factor})
    assert_sound(other)
    assert_mirrored(other)
    measure = {
        "legs": lambda v: np.ptp(v[:, 1]),
        "arms": lambda v: np.ptp(v[:, 0]),
        "neck": lambda v: v[:, 1].max(),
        "tail": lambda v: -v[:, 2].min(),
    }.get(name)
    sizes = [volume(f.mesh) if measure is None else measure(f.mesh.vertices) for f in (plain, other)]
    assert (sizes[1] > sizes[0]) == (factor > 1)


def test_figures_and_poses_travel_between_processes():
    figure = pickle.loads(pickle.dumps(shapes.quadruped(1000, pose="sit")))
    assert figure.pose.name == "sit"
    assert np.array_equal(figure.posed("rest").mesh.vertices, built("quadruped", 1000).mesh.vertices)


def test_pose_verbs():
    pose = shapes.Pose({"left_hip": [-40, 5, 0]}, name="kick")
    assert pose.mirrored().turns == {"right_hip": (-40.0, -5.0, 0.0)}
    assert pose.mirrored().mirrored() == pose
    assert pose.scaled(0.5).turns["left_hip"] == (-20.0, 2.5, 0.0)
    assert pose.as_array(("head", "left_hip")).tolist() == [[0, 0, 0], [-40, 5, 0]]


@pytest.mark.parametrize(
    ("call", "about"),
    [
        (lambda: shapes.human(999), "n_vertices must be between 1000 and 200000, got 999"),
        (lambda: shapes.human(1e4), "whole number"),
        (lambda: shapes.quadruped(10**7), "between 1000"),
        (lambda: built("human", 1000).posed("fly"), "unknown pose 'fly'; this figure knows: rest, walk"),
        (lambda: built("human", 1000).posed({"left_hock": (1, 2, 3)}), "left_hock.*this figure has: pelvis"),
        (lambda: built("human", 1000).posed({"head": (1, 2)}), "turn of head must be three numbers"),
        (lambda: built("human", 1000).posed({"head": (1, 2, np.nan)}), "finite"),
        (lambda: shapes.human(1000, proportions={"tail": 1.2}), "unknown proportion 'tail'"),
        (lambda: shapes.human(1000, proportions={"legs": 2}), "between 0.7 and 1.4"),
        (lambda: shapes.human(1000, proportions={"legs": "long"}), "finite number"),
        (lambda: shapes.Pose({"head": (200, 0, 0)}), "at most 180"),
        (lambda: shapes.Pose([1, 2]), "must map joint names"),
        (lambda: built("human", 1000).random_pose(rng=1, strength=1.5), "between 0 and 1"),
        (lambda: built("human", 1000).posed(7), "must map joint names"),
    ],
)
def test_bad_arguments_are_named(call, about):
    with pytest.raises(InputError, match=about):
        call()
