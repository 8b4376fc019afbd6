"""Noise and occlusion protocols."""

from __future__ import annotations

import numpy as np
import pytest

import pliant
from pliant.descriptors import rms_biharmonic_distance
from pliant.evaluate import NoiseCurve, noise_curve, part_of, relative_errors


def test_relative_errors_by_hand() -> None:
    clean = np.array([[3.0, 4.0], [0.0, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(
        relative_errors(clean, [[3.0, 3.0], [1.0, 1.0], [0.0, 0.0]]), [0.2, np.nan, 1.0]
    )
    np.testing.assert_allclose(relative_errors(clean, [[1.0, 0.5]], source=[2]), [0.5])


def test_errors_do_not_depend_on_the_unit_of_the_signature() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 50, 4))
    np.testing.assert_allclose(relative_errors(9 * a, 9 * b), relative_errors(a, b))


def test_noise_that_is_as_big_as_asked() -> None:
    # The distance from the centre of a unit ball: its relative error is the displacement itself.
    ball = pliant.shapes.icosphere(4)
    curve = noise_curve(
        ball,
        lambda mesh: np.linalg.norm(mesh.vertices, axis=1)[:, None],
        sigmas=[0.1, 0.4],
        repeats=3,
        rng=0,
    )
    expected = np.array([0.1, 0.4]) * ball.edge_lengths.mean() * np.sqrt(2 / np.pi)
    np.testing.assert_allclose(curve.mean, expected, rtol=0.03)
    assert (curve.spread < 0.05 * curve.mean).all()
    assert np.isnan(NoiseCurve([0.1], [[0.2]]).spread).all()


def test_noise_is_the_same_for_a_seed() -> None:
    ball = pliant.shapes.icosphere(2)

    def run(seed: int) -> np.ndarray:
        return noise_curve(ball, lambda mesh: mesh.vertices, sigmas=[0.2], rng=seed).errors

    assert run(1).tobytes() == run(1).tobytes()
    assert run(1).tobytes() != run(2).tobytes()


def test_ball_areas_agree_until_the_ball_reaches_the_cut() -> None:
    # Fig. 3.4: a rod whole and without its far end, seen from the tip that both have.
    rod = pliant.shapes.ellipsoid([1, 1, 5], 4)
    part, source = part_of(rod, rod.vertices[:, 2] > -4)
    whole, cut = pliant.eigenbasis(rod, 60), pliant.eigenbasis(part, 60)
    tip = int(rod.vertices[:, 2].argmax())
    at = int(np.flatnonzero(source == tip)[0])
    radii = np.array([0.2, 0.4, 1.6]) * rms_biharmonic_distance(whole)
    options = {"relative": False, "form": "raw"}
    area = [
        pliant.bde(s, radii, statistic="area", **options)[v] * s.area for s, v in ((whole, tip), (cut, at))
    ]
    errors = np.abs(area[1] / area[0] - 1)
    assert errors[:2].max() < 0.01
    assert errors[2] > 3 * errors[:2].max()
    # The kernel itself is global, and so is its mean: it moves at every radius.
    mean = [pliant.bde(s, radii, statistic="mean", **options)[v] for s, v in ((whole, tip), (cut, at))]
    assert (np.abs(mean[1] / mean[0] - 1) > 0.1).all()


def test_parts_keep_positions_and_drop_loose_vertices() -> None:
    ball = pliant.shapes.icosphere(2)
    keep = np.zeros(ball.n_vertices, dtype=bool)
    keep[ball.faces[0]] = True
    keep[ball.faces[-1][0]] = True
    part, source = part_of(ball, keep)
    assert part.n_faces == 1
    assert set(source) == set(ball.faces[0])


def test_refusals() -> None:
    ball = pliant.shapes.icosphere(1)
    with pytest.raises(pliant.InputError, match="one width"):
        relative_errors(np.zeros((3, 2)), np.zeros((3, 4)))
    with pytest.raises(pliant.InputError, match="1 are out of range"):
        relative_errors(np.zeros((3, 2)), np.zeros((2, 2)), source=[0, 3])
    with pytest.raises(pliant.InputError, match="at least one sigma"):
        noise_curve(ball, lambda mesh: mesh.vertices, sigmas=[])
    with pytest.raises(pliant.InputError, match="0 everywhere"):
        noise_curve(ball, lambda mesh: np.zeros((mesh.n_vertices, 2)), sigmas=[0.1])
    with pytest.raises(pliant.InputError, match="42 booleans"):
        part_of(ball, np.arange(42))
    with pytest.raises(pliant.InputError, match="nothing is left"):
        part_of(ball, np.zeros(42, dtype=bool))
