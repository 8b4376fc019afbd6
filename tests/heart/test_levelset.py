"""Level sets: closed forms, equivariance, both potentials and forces, and an independent implementation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from pliant.errors import InputError
from pliant.heart import LevelSet, distance_regularized_level_set, volume_overlap


def ball(
    radius: float, n: int = 36, spacing: tuple[float, ...] = (1.0, 1.0, 1.0)
) -> tuple[np.ndarray, np.ndarray]:
    """Distances from the middle of a box of about n mm, and a noisy bright ball."""
    axes = [(np.arange(round(n / s)) - (round(n / s) - 1) / 2) * s for s in spacing]
    grid = np.meshgrid(*axes, indexing="ij")
    distance = np.sqrt(sum(g**2 for g in grid))
    noise = np.random.default_rng(0).normal(0, 40, distance.shape)
    return distance, 120 + 350 * np.clip(radius + 0.5 - distance, 0, 1) + noise


def dice(found: LevelSet, truth: np.ndarray) -> float:
    return volume_overlap(found.mask, truth, measure="dice")


@pytest.mark.parametrize("potential", ["double-well", "single-well"])
@pytest.mark.parametrize(("force", "least"), [("region", 0.985), ("edge", 0.97)])
@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_ball_is_found_from_a_seed_inside(
    force: str, least: float, potential: str, dimensions: int
) -> None:
    distance, image = ball(11.0)
    if dimensions == 2:
        distance, image = distance[..., 18], image[..., 18]
    found = distance_regularized_level_set(image, distance < 6, force=force, potential=potential)
    assert found.converged
    assert dice(found, distance <= 11.0) > least


@pytest.mark.parametrize(("force", "least"), [("region", 0.98), ("edge", 0.88)])
def test_the_front_also_moves_in(force: str, least: float) -> None:
    distance, image = ball(9.0)
    options = {"levels": (470, 120)} if force == "region" else {"balloon": 0.3}
    found = distance_regularized_level_set(image, distance < 14, force=force, **options)
    assert dice(found, distance <= 9.0) > least


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 2.0), (0.8, 0.8, 0.8), (2.0, 1.0, 1.5)])
def test_spacing_enters_every_derivative(spacing: tuple[float, float, float]) -> None:
    distance, image = ball(12.0, 36, spacing)
    found = distance_regularized_level_set(image, distance < 7, spacing=spacing)
    assert found.converged
    assert found.mask.sum() * np.prod(spacing) == pytest.approx(4 / 3 * np.pi * 12.0**3, rel=0.04)


def test_length_alone_shrinks_a_circle_at_the_rate_of_its_curvature() -> None:
    x, y = np.mgrid[-40:41, -40:41]
    start = np.hypot(x, y) < 30

    def area(steps: int) -> float:
        found = distance_regularized_level_set(
            start * 1.0, start, balloon=0.0, length=0.4, regularization=0.2, max_iterations=steps, tolerance=0
        )
        # Partial voxels by the distance function, or steps of a voxel would hide the rate.
        return float(np.clip(0.5 - found.phi, 0, 1).sum())

    early, middle, late = area(120), area(480), area(840)
    # The radius obeys dr/dt = -c/r, so the area falls at one rate whatever the radius.
    assert early > middle > late
    assert (early - middle) == pytest.approx(middle - late, rel=0.15)
    smaller = np.hypot(x, y) < 15

    def vanishing(steps: int) -> float:
        return float(
            distance_regularized_level_set(
                smaller * 1.0,
                smaller,
                balloon=0.0,
                length=0.4,
                regularization=0.2,
                max_iterations=steps,
                tolerance=0,
            ).mask.sum()
        )

    assert vanishing(120) < smaller.sum()


@pytest.mark.parametrize(("potential", "spread"), [("double-well", 0.15), ("single-well", 0.3)])
def test_phi_is_a_distance_near_the_front(potential: str, spread: float) -> None:
    x, y = np.mgrid[-30:31, -30:31]
    image = 100.0 * (np.hypot(x, y) < 20)
    found = distance_regularized_level_set(
        image,
        np.hypot(x, y) < 20,
        balloon=0.0,
        length=0.0,
        potential=potential,
        max_iterations=240,
        tolerance=0,
    )
    slopes = np.hypot(*np.gradient(found.phi.astype(float)))[np.abs(found.phi) < 1.5]
    # It starts as a step of 4: slopes of 2.
    assert slopes.mean() == pytest.approx(1.0, abs=1.5 * spread)
    assert slopes.std() < spread


def test_turning_and_mirroring_the_image_turns_the_result() -> None:
    rng = np.random.default_rng(3)
    image = ndimage.gaussian_filter(rng.normal(size=(24, 24, 24)), 3) * 3000
    start = image > np.percentile(image, 95)
    settings_ = {"levels": (150.0, -150.0), "max_iterations": 30}
    plain = distance_regularized_level_set(image, start, **settings_)
    for turn in (lambda a: np.swapaxes(a, 0, 2), lambda a: a[::-1], lambda a: np.rot90(a, axes=(0, 1))):
        turned = distance_regularized_level_set(turn(image), turn(start), **settings_)
        assert (turned.mask != turn(plain.mask)).mean() < 1e-3
        assert np.allclose(turned.phi, turn(plain.phi), atol=2e-3)


def test_millimetres_and_threads_do_not_matter() -> None:
    distance, image = ball(10.0, 40)
    plain = distance_regularized_level_set(image, distance < 6, n_jobs=1)
    scaled = distance_regularized_level_set(image, distance < 6, spacing=0.25, n_jobs=2)
    assert np.array_equal(plain.phi, scaled.phi)


@given(st.floats(0.1, 50), st.floats(-500, 500))
@settings(max_examples=8)
def test_units_of_the_image_do_not_matter(gain: float, shift: float) -> None:
    distance, image = ball(7.0, 24)
    plain = distance_regularized_level_set(image, distance < 4, force="region")
    other = distance_regularized_level_set(image * gain + shift, distance < 4, force="region")
    assert dice(other, plain.mask) > 0.995


def test_a_map_of_thresholds_follows_uneven_contrast() -> None:
    distance, image = ball(10.0)
    ramp = np.linspace(0.4, 1.6, 36)[:, None, None]
    found = distance_regularized_level_set(
        image * ramp, distance < 5, levels=(470, 120), threshold=295 * ramp
    )
    assert dice(found, distance <= 10) > 0.97


def test_what_is_not_reached_is_not_found_and_a_lost_front_ends() -> None:
    distance, image = ball(8.0)
    far = np.roll(image, 0) + 350 * (np.indices(image.shape)[0] < 3)
    found = distance_regularized_level_set(far, distance < 4)
    assert not found.mask[:3].any()
    empty = distance_regularized_level_set(np.zeros((12, 12)), np.eye(12) > 0, levels=(100, 50))
    assert empty.converged
    assert not empty.mask.any()


def test_the_rule_for_stopping_is_stable() -> None:
    distance, image = ball(11.0)
    stopped = distance_regularized_level_set(image, distance < 6)
    longer = distance_regularized_level_set(
        image, distance < 6, tolerance=0, max_iterations=2 * stopped.iterations
    )
    assert longer.iterations == 2 * stopped.iterations
    assert dice(stopped, longer.mask) > 0.998
    short = distance_regularized_level_set(image, distance < 6, max_iterations=6)
    assert not short.converged
    assert short.iterations == 6


def test_overlap_is_that_of_another_implementation() -> None:
    sitk = pytest.importorskip("SimpleITK")
    distance, image = ball(10.0, 40)
    truth = distance <= 10
    start = sitk.GetImageFromArray(np.where(distance < 6, -1.0, 1.0).astype(np.float32))
    smooth = ndimage.gaussian_gradient_magnitude(image, 1.0)
    feature = sitk.GetImageFromArray((1 / (1 + (smooth / 35) ** 2)).astype(np.float32))
    contour = sitk.GeodesicActiveContourLevelSetImageFilter()
    contour.SetPropagationScaling(1.0)
    contour.SetCurvatureScaling(0.5)
    contour.SetAdvectionScaling(1.0)
    contour.SetNumberOfIterations(200)
    signed = sitk.SignedMaurerDistanceMap(sitk.Cast(start < 0, sitk.sitkUInt8), squaredDistance=False)
    theirs = sitk.GetArrayFromImage(contour.Execute(signed, feature)) < 0
    ours = distance_regularized_level_set(image, distance < 6, force="edge")
    assert dice(ours, truth) > volume_overlap(theirs, truth, measure="dice") - 0.01
    assert dice(ours, theirs) > 0.93


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"image": np.zeros(5)}, "two or three dimensions"),
        ({"init": np.zeros((3, 3), bool)}, "image's shape"),
        ({"init": np.zeros((8, 8), bool)}, "none of it"),
        ({"init": np.ones((8, 8), bool)}, "all of it"),
        ({"image": np.full((8, 8), np.nan)}, "64 values that are not finite"),
        ({"spacing": -1.0}, "spacing must be positive"),
        ({"spacing": (1.0, 1.0, 1.0)}, "one number or 2"),
        ({"regularization": 0.3}, "unstable"),
        ({"force": "gravity"}, "region or edge"),
        ({"potential": "flat"}, "double-well or single-well"),
        ({"band": 1}, "band >= 2"),
        ({"levels": (5.0, 5.0)}, "same level"),
        ({"threshold": np.zeros((3, 3))}, "one a voxel"),
        ({"image": np.ones((8, 8)), "force": "edge"}, "no edges"),
    ],
)
def test_refusals_say_what_is_wrong(wrong: dict, said: str) -> None:
    image = np.zeros((8, 8))
    image[2:6, 2:6] = 1
    init = np.zeros((8, 8), bool)
    init[3:5, 3:5] = True
    with pytest.raises(InputError, match=said):
        distance_regularized_level_set(**({"image": image, "init": init} | wrong))
