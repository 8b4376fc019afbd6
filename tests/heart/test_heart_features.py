"""Twenty-three numbers a point: closed forms, laws, repeatability between noise draws, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from pliant import InputError, Mesh, MeshError, principal_curvatures, shapes
from pliant.heart import (
    FEATURE_BLOCKS,
    FEATURE_NAMES,
    HeartPhantom,
    VentricleFrame,
    aha_segments,
    endocardial_features,
    endocardial_surface,
    heart_phantom,
    ventricle_frame,
)
from pliant.heart.features import SegmentFeatures
from pliant.mesh.adjacency import edge_matrix

FRAME = VentricleFrame(np.array([0.0, 0, -40]), np.array([0.0, 0, 20]), np.eye(3), "landmarks", 1.0)


@pytest.fixture(scope="module")
def phantom() -> HeartPhantom:
    return heart_phantom(spacing=4.0, mesh_step=2.0, rng=2)


@pytest.fixture(scope="module")
def found(phantom: HeartPhantom) -> SegmentFeatures:
    frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    return endocardial_features(phantom.mesh, phantom.labels, frame, points=60, rng=0, n_jobs=1)


@pytest.fixture(scope="module")
def bowl() -> tuple[Mesh, np.ndarray]:
    """The lower part of a sphere of radius 20, labelled by the model."""
    ball = shapes.icosphere(5, radius=20.0).translated([0, 0, -20.0])
    frame = VentricleFrame(np.array([0.0, 0, -40]), np.array([0.0, 0, 0]), np.eye(3), "landmarks", 1.0)
    return ball, aha_segments(ball, frame)


def test_names_blocks_and_shapes_agree(found: SegmentFeatures) -> None:
    assert len(FEATURE_NAMES) == 23
    assert sum(block.stop - block.start for block in FEATURE_BLOCKS.values()) == 23
    assert found.values.shape == (17 * 60, 23)
    assert found.blocks == FEATURE_BLOCKS
    assert (np.diff(found.segments) >= 0).all()


def test_points_lie_in_their_segment_and_repeat_only_if_they_must(
    phantom: HeartPhantom, found: SegmentFeatures
) -> None:
    assert (phantom.labels[found.vertices] == found.segments).all()
    for segment in range(1, 18):
        inside = found.vertices[found.segments == segment]
        assert len(np.unique(inside)) == 60 or (phantom.labels == segment).sum() < 90


def test_a_ball_has_its_own_curvature_and_the_least_shape_index(bowl: tuple[Mesh, np.ndarray]) -> None:
    mesh, labels = bowl
    found = endocardial_features(mesh, labels, FRAME, points=40, radius=4.0, rng=0, n_jobs=1)
    assert found.values[:, 1] == pytest.approx(1 / 20, rel=0.02)
    assert found.values[:, 0].max() < 0.1
    assert found.roughness[1:] == pytest.approx(1 / 20, rel=0.02)
    assert found.areas[1:].sum() == pytest.approx(found.areas[0])
    # The normal of a ball is its radius: the angle with the plane of x and z is the sine of y.
    y = (mesh.vertices[found.vertices] - [0, 0, -20])[:, 1] / 20
    assert found.values[:, 2] == pytest.approx(np.degrees(np.arcsin(y)), abs=1.0)
    assert found.cavity_ml == pytest.approx(4 / 3 * np.pi * 8, rel=0.01)


def test_context_is_the_histogram_of_paths_inside_the_segment(
    phantom: HeartPhantom, found: SegmentFeatures
) -> None:
    context = found.values[:, FEATURE_BLOCKS["context"]]
    assert context.sum(axis=1) == pytest.approx(1)
    members = np.flatnonzero(phantom.labels == 10)
    graph = edge_matrix(phantom.mesh)[members][:, members]
    chosen = found.vertices[found.segments == 10]
    place = np.searchsorted(members, chosen)
    paths = dijkstra(graph, indices=place)[:, place]
    for row, expected in zip(paths, context[found.segments == 10], strict=True):
        known = row[np.isfinite(row)]
        shares = np.histogram(known / known.max(), bins=10, range=(0, 1))[0] / len(known)
        assert np.abs(shares - expected).max() < 0.05


def test_a_wave_at_a_scale_in_mm_does_not_care_for_area(bowl: tuple[Mesh, np.ndarray]) -> None:
    mesh, labels = bowl
    spectrum = endocardial_features(mesh, labels, FRAME, points=200, rng=0, n_jobs=1).values[
        :, FEATURE_BLOCKS["spectrum"]
    ]
    assert spectrum[:, 5:].mean() == pytest.approx(1, abs=0.1)


def test_numbers_follow_a_rigid_motion_with_its_frame(phantom: HeartPhantom, found: SegmentFeatures) -> None:
    turn = Rotation.random(random_state=3).as_matrix()
    mesh = phantom.mesh.transformed(turn).translated([10, -30, 5])
    landmarks = {name: p @ turn.T + [10, -30, 5] for name, p in phantom.landmarks.items()}
    moved = endocardial_features(
        mesh, phantom.labels, ventricle_frame(mesh, **landmarks), points=60, rng=0, n_jobs=1
    )
    assert np.array_equal(moved.vertices, found.vertices)
    assert np.nanmax(np.abs(moved.values - found.values)) < 1e-3


def test_same_seed_same_bytes_whatever_the_threads(phantom: HeartPhantom, found: SegmentFeatures) -> None:
    frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    again = endocardial_features(phantom.mesh, phantom.labels, frame, points=60, rng=0, n_jobs=2)
    assert again.values.tobytes() == found.values.tobytes()
    other = endocardial_features(phantom.mesh, phantom.labels, frame, points=60, rng=1, n_jobs=1)
    assert not np.array_equal(other.vertices, found.vertices)


def test_bins_and_wavelengths_set_the_width(phantom: HeartPhantom) -> None:
    frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    wide = endocardial_features(
        phantom.mesh, phantom.labels, frame, points=20, bins=20, wavelengths=(30, 20, 14), rng=0
    )
    assert wide.values.shape[1] == 3 + 20 + 3
    assert wide.blocks["spectrum"] == slice(23, 26)


def test_curvedness_repeats_between_two_draws_of_noise() -> None:
    clean = heart_phantom(spacing=1.0, mesh_step=3.0, noise=0.0, rng=4, field_of_view=120.0)
    fields = []
    for seed in (1, 2):
        grain = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=clean.volume.shape), 0.6)
        noisy = clean.volume.with_values(clean.volume.values + 47 * grain / grain.std())
        mesh = endocardial_surface(noisy, mask=clean.mask).mesh
        fields.append((mesh, principal_curvatures(mesh, radius=3.0).curvedness))
    (one, first), (two, second) = fields
    nearest = cKDTree(two.vertices).query(one.vertices)[1]
    wall = cKDTree(clean.mesh.vertices).query(one.vertices)[1]
    inside = clean.labels[wall] > 0
    assert np.corrcoef(first[inside], second[nearest][inside])[0, 1] > 0.83


def test_of_drops_points_that_lack_a_number() -> None:
    values = np.ones((4, 23))
    values[1, 0] = np.nan
    made = SegmentFeatures(values, np.array([1, 1, 2, 3]), np.arange(4), np.ones(18), np.ones(18), 1.0)
    assert made.n_missing == 1
    assert len(made.of((1, 2))) == 2
    with pytest.raises(InputError, match="no point"):
        made.of((9,))


def test_what_cannot_be_described_is_refused(phantom: HeartPhantom) -> None:
    frame = ventricle_frame(phantom.mesh, **phantom.landmarks)
    with pytest.raises(InputError, match="one segment a vertex"):
        endocardial_features(phantom.mesh, phantom.labels[:-1], frame)
    with pytest.raises(InputError, match="are outside 0"):
        endocardial_features(phantom.mesh, phantom.labels + 1, frame)
    with pytest.raises(MeshError, match="segment 7"):
        endocardial_features(phantom.mesh, np.where(phantom.labels == 7, 1, phantom.labels), frame)
    with pytest.raises(InputError, match="wavelengths"):
        endocardial_features(phantom.mesh, phantom.labels, frame, wavelengths=(5, 10))
    with pytest.raises(InputError, match="points"):
        endocardial_features(phantom.mesh, phantom.labels, frame, points=2)
