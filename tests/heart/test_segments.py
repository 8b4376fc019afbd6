"""The frame of a ventricle and its seventeen segments: truth, laws, another package's labels, refusals."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pliant import InputError, Mesh, MeshError, load_arrays, load_mesh, shapes
from pliant.heart import (
    SEGMENT_NAMES,
    TERRITORIES,
    HeartPhantom,
    VentricleFrame,
    aha_segments,
    describe_heart,
    heart_phantom,
    ventricle_frame,
)


@pytest.fixture(scope="module")
def phantom() -> HeartPhantom:
    return heart_phantom(spacing=4.0, mesh_step=1.5, rng=3)


def test_labels_are_the_phantoms_truth(phantom: HeartPhantom) -> None:
    frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    assert frame.confidence == 1.0
    assert (aha_segments(phantom.mesh, frame) == phantom.labels).mean() > 0.99


def test_apex_and_base_are_found_and_doubted_a_little(phantom: HeartPhantom) -> None:
    frame = ventricle_frame(phantom.mesh, septum=phantom.landmarks["septum"])
    assert np.linalg.norm(frame.apex - phantom.landmarks["apex"]) < 2.0
    assert np.linalg.norm(frame.base - phantom.landmarks["base"]) < 1.0
    assert 0.5 < frame.confidence < 1.0
    assert (aha_segments(phantom.mesh, frame) == phantom.labels).mean() > 0.97


def test_right_ventricle_fixes_the_rotation_to_a_fraction_of_a_sector(phantom: HeartPhantom) -> None:
    mask = phantom.volume.with_values(phantom.right_ventricle)
    frame = ventricle_frame(phantom.mesh, right_ventricle=mask)
    truth = ventricle_frame(phantom.mesh, **phantom.landmarks)
    # The phantom's right ventricle lies a little to the front of the middle of its septum.
    assert np.degrees(np.arccos(frame.axes[:, 0] @ truth.axes[:, 0])) < 20
    assert frame.origin == "right ventricle"
    assert 0 < frame.confidence < 1


def test_without_anything_the_confidence_is_low(phantom: HeartPhantom) -> None:
    frame = ventricle_frame(phantom.mesh)
    assert frame.origin == "automatic"
    assert 0.2 < frame.confidence <= 0.4
    upside_down = phantom.mesh.transformed(Rotation.from_euler("x", 180, degrees=True).as_matrix())
    assert ventricle_frame(upside_down).confidence < 0.2


@pytest.mark.parametrize("seed", range(4))
def test_labels_follow_a_rigid_motion(phantom: HeartPhantom, seed: int) -> None:
    turn = Rotation.random(random_state=seed).as_matrix()
    shift = np.random.default_rng(seed).normal(0, 100, 3)
    moved = phantom.mesh.transformed(turn).translated(shift)
    landmarks = {name: points @ turn.T + shift for name, points in phantom.landmarks.items()}
    before = aha_segments(phantom.mesh, ventricle_frame(phantom.mesh, **phantom.landmarks))
    after = aha_segments(moved, ventricle_frame(moved, **landmarks))
    assert (before == after).mean() > 0.9999


def test_a_mirror_image_is_refused_not_mislabelled(phantom: HeartPhantom) -> None:
    flip = np.diag([-1.0, 1.0, 1.0])
    landmarks = {name: points @ flip for name, points in phantom.landmarks.items()}
    with pytest.raises(InputError, match="wrong way round"):
        ventricle_frame(phantom.mesh.transformed(flip), **landmarks)
    with pytest.raises(InputError, match="right-handed"):
        VentricleFrame(np.zeros(3), np.array([0.0, 0.0, 80.0]), flip, "landmarks", 1.0)


def test_vertex_order_does_not_matter(phantom: HeartPhantom) -> None:
    order = np.random.default_rng(0).permutation(phantom.mesh.n_vertices)
    place = np.argsort(order)
    shuffled = Mesh(phantom.mesh.vertices[order], place[phantom.mesh.faces])
    found = aha_segments(shuffled, ventricle_frame(shuffled, **phantom.landmarks))
    labels = aha_segments(phantom.mesh, ventricle_frame(phantom.mesh, **phantom.landmarks))
    assert (found == labels[order]).all()


def test_an_open_surface_has_its_base_at_the_opening(phantom: HeartPhantom) -> None:
    kept = phantom.mesh.faces[(phantom.labels[phantom.mesh.faces] > 0).any(axis=1)]
    frame = ventricle_frame(Mesh(phantom.mesh.vertices, kept), septum=phantom.landmarks["septum"])
    assert np.linalg.norm(frame.base - phantom.landmarks["base"]) < 2.0


def test_ellipsoid_sectors_have_their_angles_and_heights() -> None:
    ball = shapes.icosphere(5)
    below = Mesh(ball.vertices * [25, 25, 80], ball.faces[(ball.vertices[ball.faces, 2] < 0).all(axis=1)])
    frame = VentricleFrame(np.array([0.0, 0, -80]), np.zeros(3), np.eye(3), "landmarks", 1.0)
    labels = aha_segments(below, frame)
    x, y, z = below.vertices.T
    degrees, along = np.degrees(np.arctan2(y, x)) % 360, 1 + z / 80
    assert set(labels[(along > 0.7) & (along < 0.85) & (degrees > 60) & (degrees < 120)]) == {1}
    assert set(labels[(along > 0.4) & (along < 0.6) & (degrees > 240) & (degrees < 300)]) == {10}
    assert set(labels[(along > 0.1) & (along < 0.3) & (np.abs(degrees - 180) < 45)]) == {16}
    assert set(labels[along < 0.06]) == {17}


def test_territories_and_names_cover_every_segment_once() -> None:
    assert sorted(s for segments in TERRITORIES.values() for s in segments) == list(range(1, 18))
    assert TERRITORIES["LAD"] == (1, 2, 7, 8, 13, 14, 17)
    assert TERRITORIES["RCA"] == (3, 4, 9, 10, 15)
    assert len(SEGMENT_NAMES) == 17
    assert SEGMENT_NAMES[8] == "mid inferoseptal"
    assert SEGMENT_NAMES[15] == "apical lateral"


def test_landmarks_that_cannot_be_used_are_refused(phantom: HeartPhantom) -> None:
    mesh, marks = phantom.mesh, phantom.landmarks
    with pytest.raises(InputError, match="not on the surface"):
        ventricle_frame(mesh, apex=marks["apex"] + 60)
    with pytest.raises(InputError, match="not on the surface"):
        ventricle_frame(mesh, septum=marks["septum"] + [0, 0, 70])
    line = marks["septum"][0] + np.outer([0, 1, 2], [1.5, 1.0, 0.5])
    with pytest.raises(InputError, match="collinear"):
        ventricle_frame(mesh, septum=line)
    with pytest.raises(InputError, match="wrong way round"):
        ventricle_frame(mesh, septum=marks["septum"][::-1])
    with pytest.raises(InputError, match="shape"):
        ventricle_frame(mesh, septum=marks["septum"][:2])
    with pytest.raises(InputError, match="no long axis"):
        ventricle_frame(mesh, apex=marks["apex"], base=marks["apex"])
    with pytest.raises(InputError, match="finite"):
        ventricle_frame(mesh, apex=[np.nan, 0, 0])
    with pytest.raises(InputError, match="empty"):
        ventricle_frame(mesh, right_ventricle=phantom.volume.with_values(np.zeros(phantom.volume.shape)))


def test_surfaces_that_are_no_ventricle_are_refused(phantom: HeartPhantom) -> None:
    with pytest.raises(MeshError, match="no surface"):
        ventricle_frame(Mesh([[0, 0, 0], [1, 0, 0]], np.empty((0, 3), int)))
    holes = np.ones(phantom.mesh.n_faces, dtype=bool)
    holes[[100, 20000 % phantom.mesh.n_faces]] = False
    with pytest.raises(MeshError, match="2 openings"):
        ventricle_frame(Mesh(phantom.mesh.vertices, phantom.mesh.faces[holes]))
    with pytest.raises(MeshError, match="flat"):
        ventricle_frame(
            Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 0, 2], [1, 3, 2], [3, 1, 2]])
        )


def test_segments_without_vertices_are_named(phantom: HeartPhantom) -> None:
    frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    far = VentricleFrame(frame.apex + 200, frame.base + 200, frame.axes, "landmarks", 1.0)
    with pytest.raises(MeshError, match="segments have no vertex"):
        aha_segments(phantom.mesh, far)
    with pytest.raises(InputError, match="ascend"):
        aha_segments(phantom.mesh, frame, cuts=(0.5, 0.3, 0.7))


@pytest.mark.data
def test_labels_agree_with_another_packages_on_a_real_ventricle(data: Path) -> None:
    folder = data / "heart" / "aha"
    mesh = load_mesh(folder / "LV_4396_vertices_with_aha_segments.vtk")
    truth = np.asarray(load_arrays(folder / "LV_4396_vertices_with_aha_segments.vtk")["subpartID"]).astype(
        int
    )
    side = np.asarray(load_arrays(folder / "LV_4396_vertices_with_epi_endo.vtk")["subpartID"]).astype(int)
    inner = (truth > 0) & (side == 2)
    # Its axis is the principal one of all vertices; its septum lies between the borders of 7 and 8, 8 and 9, 9 and 10.
    middle = mesh.vertices.mean(axis=0)
    axis = np.linalg.eigh(np.cov(mesh.vertices.T))[1][:, 2]
    axis *= np.sign(axis[2])
    height = (mesh.vertices - middle) @ axis
    septum = []
    for one, two in ((7, 8), (8, 9), (9, 10)):
        ends = mesh.edges[(np.sort(truth[mesh.edges], axis=1) == (one, two)).all(axis=1)]
        ends = ends[(side[ends] == 2).all(axis=1)]
        septum.append(mesh.vertices[ends].reshape(-1, 3).mean(axis=0))
    frame = ventricle_frame(
        mesh,
        apex=middle + axis * height[inner].min(),
        base=middle + axis * height[truth > 0].max(),
        septum=np.array(septum),
    )
    found = aha_segments(mesh, frame, cuts=(0.06, 0.35, 0.66))
    assert (found == truth)[inner].mean() > 0.85
    assert np.linalg.det(frame.axes) == pytest.approx(1)


@pytest.mark.data
def test_a_long_axis_that_is_guessed_is_said_to_be(
    data: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh = load_mesh(data / "heart" / "sunnybrook" / "lv_endo_ply" / "case06_cat0.ply")
    guessed = describe_heart(mesh, points=20)
    assert any(text.startswith("the long axis is found from the surface") for text in guessed.cautions)
    ends = {"apex": guessed.frame.apex, "base": guessed.frame.base}
    monkeypatch.setattr("pliant._progress.FIRST", 0.01)
    given = describe_heart(mesh, landmarks=ends, points=20, progress=True)
    said = capsys.readouterr().err
    assert re.search(r"describing the heart: steps: \d of 4 after", said)
    assert "describing the heart: steps: done in" in said
    assert not any("long axis" in text for text in given.cautions)
