"""Deformed cylinders, Delta, noise curves, and the signature they are measured with."""

from __future__ import annotations

import numpy as np
import pytest

from pliant import check_up, eigenbasis, gch, gfe, nearest, principal_curvatures, shapes, with_noise
from pliant.cortex import (
    ConformalCylinder,
    ContextSignature,
    conformal_cylinder,
    deformation_response,
    noise_curve,
    tuning_table,
)
from pliant.descriptors import hks, wks
from pliant.errors import InputError
from pliant.mesh import boundary_loops, quasi_conformal_error


@pytest.fixture(scope="module")
def levels() -> list[ConformalCylinder]:
    return [conformal_cylinder(k, sides=24, rng=1) for k in range(1, 7)]


def test_the_cylinder_is_one_open_tube_wound_outwards() -> None:
    for sides, seed in ((8, 0), (13, 1), (24, 2)):
        mesh = conformal_cylinder(1, sides=sides, rng=seed).mesh
        assert not [f for f in check_up(mesh).findings if f.severity == "error"]
        assert [len(loop) for loop in boundary_loops(mesh)] == [sides, sides]
        assert mesh.n_faces == 2 * (mesh.n_vertices - sides)  # Euler characteristic 0
        outwards = mesh.vertices[mesh.faces].mean(axis=1) * [1, 1, 0]
        assert ((mesh.face_normals * outwards).sum(axis=1) > 0).all()


def test_levels_grow_conformally_at_the_bump(levels: list[ConformalCylinder]) -> None:
    plain = levels[0]
    stretch = [(level.mesh.vertex_areas / plain.mesh.vertex_areas) for level in levels]
    top = np.argsort(plain.density)[-15:]
    assert np.all(np.diff([s[top].mean() for s in stretch]) > 0.1)
    for level in levels:
        assert np.array_equal(level.mesh.faces, plain.mesh.faces)
        assert quasi_conformal_error(plain.mesh, level.mesh).mean() < 1.05


def test_seed_and_level(levels: list[ConformalCylinder]) -> None:
    again = conformal_cylinder(3, sides=24, rng=1).mesh
    assert again.vertices.tobytes() == levels[2].mesh.vertices.tobytes()
    assert not np.array_equal(conformal_cylinder(1, sides=24, rng=2).mesh.vertices, levels[0].mesh.vertices)
    for level, sides, height in ((0, 24, 6), (7, 24, 6), (1, 7, 6), (1, 24, 1)):
        with pytest.raises(InputError, match="level must be"):
            conformal_cylinder(level, sides=sides, height=height)


def test_the_context_histogram_answers_to_the_bump_and_beats_curvature(
    levels: list[ConformalCylinder],
) -> None:
    signature = ContextSignature()
    signature = signature.with_edges_of(*(signature.field(level.mesh) for level in levels))
    found = deformation_response([signature(level.mesh) for level in levels], levels[0].density)
    bent = deformation_response([principal_curvatures(x.mesh).mean for x in levels], levels[0].density)
    assert found.delta[0] == 0
    assert found.mean > 0.3
    assert found.mean > 2 * bent.mean
    assert (np.abs(found.normalised) <= 1).all()


def test_the_context_histogram_answers_three_times_as_strongly_as_spectral_signatures(
    levels: list[ConformalCylinder],
) -> None:
    signature = ContextSignature()
    signature = signature.with_edges_of(*(signature.field(level.mesh) for level in levels))
    density = levels[0].density
    context = deformation_response([signature(level.mesh) for level in levels], density).mean
    spectra = [eigenbasis(level.mesh, 60) for level in levels]
    for spectral in (hks, wks):
        assert context > 3 * deformation_response([spectral(s) for s in spectra], density).mean > 0


def test_response_against_its_definition() -> None:
    rng = np.random.default_rng(0)
    before, after = rng.random((40, 5)) + 0.1, rng.random((40, 5))
    density = rng.permutation(40)
    change = [np.sqrt(sum((a - b) ** 2)) / np.sqrt(sum(b**2)) for a, b in zip(after, before, strict=True)]
    ranked = [change[i] for i in np.argsort(density)]
    found = deformation_response([before, after], density, most=0.1, least=0.25)
    assert found.most[1] == pytest.approx(np.mean(ranked[-4:]))
    assert found.least[1] == pytest.approx(np.mean(ranked[:10]))
    scaled = deformation_response([7 * before, 7 * after], density, most=0.1, least=0.25)
    np.testing.assert_allclose(scaled.delta, found.delta)


def test_response_leaves_out_what_has_no_relative_change() -> None:
    found = deformation_response([[0, 1, 1, 1], [5, 2, 1, 1]], [0, 9, 1, 2], most=0.25, least=0.5)
    assert found.n_undefined == 1
    assert found.most[1] == 1
    assert found.least[1] == 0
    with pytest.raises(InputError, match="no relative change"):
        deformation_response([[0, 1, 1, 1], [5, 2, 1, 1]], [9, 0, 0, 0], most=0.25)
    with pytest.raises(InputError, match="one shape"):
        deformation_response([[1, 2], [1, 2, 3]], [0, 1])
    with pytest.raises(InputError, match="not finite at 1"):
        deformation_response([[1, np.nan], [1, 2]], [0, 1])
    with pytest.raises(InputError, match="shares"):
        deformation_response([[1, 2], [1, 2]], [0, 1], most=0.9, least=0.5)


def test_tuning_table_agrees_with_single_settings(levels: list[ConformalCylinder]) -> None:
    pair = [levels[0], levels[4]]
    table = tuning_table(pair, counts=(20, 60), bins=(5, 10))
    fields = [gfe(level.mesh) for level in pair]
    signature = ContextSignature(count=60, bins=5).with_edges_of(*fields)
    near = [
        gch(f, nearest(x.mesh, count=60), edges=signature.edges) for f, x in zip(fields, pair, strict=True)
    ]
    assert table.delta[1, 0] == pytest.approx(deformation_response(near, pair[0].density).mean)
    with pytest.raises(InputError, match="two levels"):
        tuning_table(pair[:1])


def test_noise_curve_starts_at_zero_grows_and_repeats() -> None:
    ball = shapes.icosphere(2)
    curve = noise_curve(ball, ContextSignature().field, [0, 0.05, 0.2], 3, repeats=2)
    assert curve.errors.shape == (2, 3)
    np.testing.assert_array_equal(curve.errors[:, 0], 0)
    assert np.all(np.diff(curve.mean) > 0)
    assert curve.errors[0, 1] != curve.errors[1, 1]
    again = noise_curve(ball, ContextSignature().field, [0, 0.05, 0.2], 3, repeats=2)
    assert again.errors.tobytes() == curve.errors.tobytes()
    with pytest.raises(InputError, match="0 everywhere"):
        noise_curve(ball, lambda mesh: np.zeros(mesh.n_vertices), [0.1], 0)


def test_smoothing_and_refined_paths_steady_the_field() -> None:
    ball = shapes.icosphere(3)
    errors = [
        noise_curve(ball, setting.field, [0.2], 0).mean[0]
        for setting in (
            ContextSignature(),
            ContextSignature(smoothing=3),
            ContextSignature(graph="refined", smoothing=3),
        )
    ]
    assert errors[1] < 0.6 * errors[0]
    assert errors[2] < errors[1]


def test_signature_is_its_parts() -> None:
    ball = with_noise(shapes.icosphere(2), 0.1, rng=0)
    setting = ContextSignature(radius=0.7, bins=6, weights="uniform", graph="refined")
    field = gfe(ball, weights="uniform", graph="refined")
    expected = gch(field, nearest(ball, radius=0.7, graph="refined"), bins=6)
    np.testing.assert_array_equal(setting(ball), expected)
    np.testing.assert_array_equal(setting.histograms(ball, field, [5, 3]), expected[[5, 3]])
    with pytest.raises(InputError, match="count or radius"):
        ContextSignature(count=5, radius=1.0)
    with pytest.raises(InputError, match="smoothing"):
        ContextSignature(smoothing=-1)


def test_logarithmic_bins() -> None:
    ball = shapes.bumpy_sphere(subdivisions=2, rng=0)
    setting = ContextSignature(scale="log", weights="uniform")
    field = setting.field(ball)
    plain = gfe(ball, weights="uniform")
    floor = np.median(plain) / 1000
    np.testing.assert_allclose(np.exp(field), np.maximum(plain, floor))
    edges = np.array(setting.with_edges_of(field).edges)
    np.testing.assert_allclose(edges[[0, -1]], np.percentile(field, [2, 98]))
    # Relative changes alone count: twice the field moves the bins and nothing else.
    twice = setting.with_edges_of(field + np.log(2))
    np.testing.assert_allclose(
        twice.histograms(ball, field + np.log(2)),
        setting.with_edges_of(field).histograms(ball, field),
        atol=0.041,
    )
    with pytest.raises(InputError, match="scale"):
        ContextSignature(scale="cubic")  # type: ignore[arg-type]
