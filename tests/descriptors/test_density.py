"""The biharmonic density estimate: eq. 3.3 word by word, laws, closed forms, refusals, real shapes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant import Mesh, Spectrum, bde, bdk
from pliant.descriptors import rms_biharmonic_distance


@pytest.fixture(scope="module")
def bumpy() -> tuple[Mesh, Spectrum]:
    mesh = pliant.shapes.bumpy_sphere(3, rng=0)
    return mesh, pliant.eigenbasis(mesh, 60)


def test_the_mean_distance_is_that_over_all_pairs(bumpy: tuple[Mesh, Spectrum]) -> None:
    mesh, spectrum = bumpy
    distances = pliant.biharmonic_distances(spectrum, np.arange(mesh.n_vertices))
    chance = mesh.vertex_areas / mesh.area
    assert rms_biharmonic_distance(spectrum) == pytest.approx(
        np.sqrt(chance @ distances**2 @ chance), rel=1e-12
    )


@pytest.mark.parametrize("weights", ["area", "uniform"])
@pytest.mark.parametrize("average", ["simple", "gaussian"])
def test_equation_3_3_word_by_word(bumpy: tuple[Mesh, Spectrum], average: str, weights: str) -> None:
    mesh, spectrum = bumpy
    distances = pliant.biharmonic_distances(spectrum, np.arange(mesh.n_vertices))
    unit = rms_biharmonic_distance(spectrum)
    kernel = bdk(spectrum)
    counted = mesh.vertex_areas if weights == "area" else np.ones(mesh.n_vertices)
    radii = [0.2, 0.7, 1.5]
    found = bde(spectrum, radii, average=average, statistic="both", form="raw", weights=weights)
    for i, r in enumerate(radii):
        inside = (distances <= r * unit) * counted
        if average == "gaussian":
            inside *= np.exp(-(distances**2) / (2 * (r * unit / 3) ** 2))
        np.testing.assert_allclose(found[:, i], inside.sum(axis=1) / counted.sum(), rtol=1e-8)
        mean = inside @ kernel / inside.sum(axis=1) / unit**2
        np.testing.assert_allclose(found[:, 3 + i], mean, rtol=1e-8)


def test_absolute_radii_are_in_the_meshs_unit(bumpy: tuple[Mesh, Spectrum]) -> None:
    _, spectrum = bumpy
    unit = rms_biharmonic_distance(spectrum)
    plain = bde(spectrum, [0.5 * unit], relative=False, form="raw", average="simple")
    scaled = bde(spectrum, [0.5], form="raw", average="simple")
    np.testing.assert_allclose(plain[:, 0], scaled[:, 0], rtol=1e-12)
    np.testing.assert_allclose(plain[:, 1], scaled[:, 1] * unit**2, rtol=1e-12)


def test_forms_say_the_same_in_other_words(bumpy: tuple[Mesh, Spectrum]) -> None:
    _, spectrum = bumpy
    radii = [0.1, 0.4, 1.2]
    raw, log, growth = (bde(spectrum, radii, form=form) for form in ("raw", "log", "growth"))
    np.testing.assert_allclose(np.log(raw), log, rtol=1e-12)
    np.testing.assert_allclose(growth, np.hstack([np.diff(log[:, :3]), np.diff(log[:, 3:])]), atol=1e-12)
    np.testing.assert_array_equal(bde(spectrum, [0.4]), bde(spectrum, [0.4], form="log"))
    np.testing.assert_array_equal(raw[:, :3], bde(spectrum, radii, form="raw", statistic="area"))
    np.testing.assert_array_equal(raw[:, 3:], bde(spectrum, radii, form="raw", statistic="mean"))


def test_size_place_and_numbering_do_not_matter(bumpy: tuple[Mesh, Spectrum]) -> None:
    mesh, spectrum = bumpy
    order = np.random.default_rng(0).permutation(mesh.n_vertices)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    other = Mesh(7 * mesh.vertices[order] @ turn.T + 3, np.argsort(order)[mesh.faces])
    np.testing.assert_allclose(bde(pliant.eigenbasis(other, 60)), bde(spectrum)[order], atol=1e-4)


def test_on_a_sphere_all_points_are_alike() -> None:
    # Whole eigenspaces, so that every point sees the same.
    spectrum = pliant.eigenbasis(pliant.shapes.icosphere(4), 49)
    for statistic in ("area", "mean"):
        values = bde(spectrum, [0.5, 0.9, 1.3], statistic=statistic, form="raw")
        assert (np.ptp(values, axis=0) < 0.05 * values.mean(axis=0)).all()


def test_small_patches_follow_the_metric_and_not_the_vertices() -> None:
    # On a sphere the area of a small ball grows as r^2, far below the distance of neighbouring vertices too.
    spectrum = pliant.eigenbasis(pliant.shapes.icosphere(4), 49)
    radii = np.array([0.01, 0.02, 0.3, 0.6])
    area = bde(spectrum, radii, statistic="area", form="raw").mean(axis=0)
    assert area[1] / area[0] == pytest.approx(4, rel=1e-6)
    assert area[2] / area[1] == pytest.approx((0.3 / 0.02) ** 2, rel=0.15)
    simple = bde(spectrum, radii, statistic="area", form="raw", average="simple").mean(axis=0)
    assert simple[1] / simple[0] == pytest.approx(1, rel=1e-6)


def test_pieces_keep_to_themselves() -> None:
    one = pliant.shapes.bumpy_sphere(2, rng=1)
    both = Mesh(
        np.concatenate([one.vertices, one.vertices + 9]),
        np.concatenate([one.faces, one.faces + one.n_vertices]),
    )
    alone, pair = pliant.eigenbasis(one, 30), pliant.eigenbasis(both, 60)
    radii = [0.3, 0.8, 50.0]
    area = bde(pair, radii, statistic="area", form="raw")
    np.testing.assert_allclose(area[:, -1], 0.5, rtol=1e-9)
    mean = bde(pair, radii, statistic="mean", form="raw")
    np.testing.assert_allclose(
        mean[: one.n_vertices], bde(alone, radii, statistic="mean", form="raw"), rtol=1e-4
    )


def test_vertices_without_area_get_the_kernel_itself() -> None:
    mesh = pliant.shapes.bumpy_sphere(2, rng=1)
    spectrum = pliant.eigenbasis(mesh, 20)
    mass = spectrum.mass.tolil()
    mass[5, 5] = 0.0
    lighter = Spectrum(spectrum.values, spectrum.vectors, mass.tocsr())
    unit = rms_biharmonic_distance(lighter)
    value = bde(lighter, [1e-4], statistic="mean", average="simple", form="raw")[5, 0]
    assert value == pytest.approx(bdk(lighter)[5] / unit**2, rel=1e-12)
    assert np.isfinite(bde(lighter)).all()


@pytest.mark.parametrize(
    ("radii", "words"),
    [
        ([], "one or more"),
        ([[0.1, 0.2]], "one or more"),
        ([0.1, -0.2], "positive and finite: 1 of 2"),
        ([0.0, 0.2], "positive and finite"),
        ([0.1, np.nan], "positive and finite"),
        ([0.1, np.inf], "positive and finite"),
        ([0.3, 0.2], "must ascend"),
        ([0.3, 0.3], "must ascend"),
        (["x"], "numbers"),
    ],
)
def test_refuses_radii(bumpy: tuple[Mesh, Spectrum], radii: list[float], words: str) -> None:
    with pytest.raises(pliant.InputError, match=words):
        bde(bumpy[1], radii)


def test_refuses_options_and_empty_spectra(bumpy: tuple[Mesh, Spectrum]) -> None:
    _, spectrum = bumpy
    for option in ("average", "statistic", "form", "weights"):
        with pytest.raises(pliant.InputError, match=f"{option} must be one of"):
            bde(spectrum, **{option: "best"})
    with pytest.raises(pliant.InputError, match="0"):
        bde(spectrum.truncated(1))


@pytest.mark.data
def test_default_finds_points_again_better_than_the_wave_signature(data: Path) -> None:
    a, b = (pliant.load_mesh(data / "shapes" / "tosca" / f"wolf{i}.ply") for i in (0, 1))
    spectra = [pliant.eigenbasis(mesh, 200) for mesh in (a, b)]
    points = np.random.default_rng(0).choice(a.n_vertices, 300, replace=False)
    same = np.arange(a.n_vertices)
    ours = pliant.hit_rate(*(bde(s) for s in spectra), same, points=points)
    theirs = pliant.hit_rate(*(pliant.wks(s) for s in spectra), same, points=points)
    assert ours.at(0.001) > 1.15 * theirs.at(0.001)
    assert ours.at(0.01) >= theirs.at(0.01) - 0.01
