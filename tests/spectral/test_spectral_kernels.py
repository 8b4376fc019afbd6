"""Kernels and distances against series on the sphere and torus, and against their laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import eval_legendre

from pliant import Mesh, shapes
from pliant.errors import InputError
from pliant.spectral import (
    Spectrum,
    biharmonic_distances,
    biharmonic_embedding,
    biharmonic_kernel,
    commute_time_distances,
    commute_time_embedding,
    commute_time_kernel,
    diffusion_distances,
    diffusion_embedding,
    eigenbasis,
    heat_kernel,
    wave_kernel,
)

DISTANCES = {
    "biharmonic": biharmonic_distances,
    "commute": commute_time_distances,
    "diffusion": lambda spectrum, sources: diffusion_distances(spectrum, 0.05, sources),
}


@pytest.fixture(scope="module")
def sphere() -> tuple[Mesh, Spectrum]:
    mesh = shapes.icosphere(4)
    return mesh, eigenbasis(mesh, 121)


@pytest.fixture(scope="module")
def bumpy() -> tuple[Mesh, Spectrum]:
    mesh = shapes.bumpy_sphere(3, rng=0)
    return mesh, eigenbasis(mesh, 40)


def series(cosine: np.ndarray, weight) -> np.ndarray:
    """Sum of weight(l (l + 1)) over spherical harmonics up to degree 10, by the addition theorem."""
    degrees = np.arange(11)
    terms = [(2 * d + 1) / (4 * np.pi) * weight(d * (d + 1.0)) * eval_legendre(d, cosine) for d in degrees]
    return np.sum(terms, axis=0)


def inverse(power: float):
    return lambda value: value**-power if value else 0.0


def test_kernels_on_the_sphere(sphere):
    mesh, spectrum = sphere
    cosine = mesh.vertices[[0, 99]] @ mesh.vertices.T
    cases = [
        (heat_kernel(spectrum, 0.1, [0, 99]), lambda value: np.exp(-0.1 * value)),
        (biharmonic_kernel(spectrum, [0, 99]), inverse(2)),
        (commute_time_kernel(spectrum, [0, 99]), inverse(1)),
    ]
    for rows, weight in cases:
        expected = series(cosine, weight)
        assert np.abs(rows - expected).max() < 0.02 * np.abs(expected).max()


def test_distances_on_the_sphere(sphere):
    mesh, spectrum = sphere
    cosine = mesh.vertices[[0, 99]] @ mesh.vertices.T
    cases = [
        (biharmonic_distances(spectrum, [0, 99]), inverse(2)),
        (commute_time_distances(spectrum, [0, 99]), inverse(1)),
        (diffusion_distances(spectrum, 0.1, [0, 99]), lambda value: np.exp(-0.2 * value) if value else 0.0),
    ]
    for distances, weight in cases:
        expected = np.sqrt(np.maximum(2 * series(np.ones(1), weight) - 2 * series(cosine, weight), 0))
        assert np.abs(distances - expected).max() < 0.02 * expected.max()


def test_wave_kernel_picks_its_band(sphere):
    mesh, spectrum = sphere
    rows = wave_kernel(spectrum, np.log(12), 7, width=0.05)
    expected = 7 / (4 * np.pi) * eval_legendre(3, mesh.vertices[7] @ mesh.vertices.T) / 7
    assert np.abs(rows[0] - expected).max() < 0.03 * np.abs(expected).max()


def test_wave_kernel_far_outside_the_spectrum_is_finite(sphere):
    rows = wave_kernel(sphere[1], 500.0, 0, width=0.01)
    assert np.isfinite(rows).all()
    assert np.abs(rows).max() > 0


def test_heat_is_kept_and_spreads(bumpy):
    mesh, spectrum = bumpy
    total = heat_kernel(spectrum, 0.3, [1, 2, 3]) @ mesh.vertex_areas
    np.testing.assert_allclose(total, 1, atol=1e-9)
    late = heat_kernel(spectrum, 1e6, 1)
    np.testing.assert_allclose(late, 1 / mesh.area, rtol=1e-9)


@given(factor=st.floats(0.05, 20))
def test_scale_laws(factor):
    mesh = shapes.bumpy_sphere(2, rng=0)
    one, other = eigenbasis(mesh, 30), eigenbasis(mesh.scaled(factor), 30)
    s = [0, 9]
    # lambda ~ 1/length^2 and phi ~ 1/length: phi / lambda is a length, phi / sqrt(lambda) a number.
    np.testing.assert_allclose(
        biharmonic_distances(other, s), factor * biharmonic_distances(one, s), atol=1e-6 * factor
    )
    np.testing.assert_allclose(commute_time_distances(other, s), commute_time_distances(one, s), atol=1e-6)
    np.testing.assert_allclose(
        diffusion_distances(other, 0.1 * factor**2, s),
        diffusion_distances(one, 0.1, s) / factor,
        atol=1e-6 / factor,
    )
    np.testing.assert_allclose(
        heat_kernel(other, 0.1 * factor**2, s), heat_kernel(one, 0.1, s) / factor**2, atol=1e-6 / factor**2
    )


@pytest.mark.parametrize("name", DISTANCES)
@given(picks=st.lists(st.integers(0, 641), min_size=3, max_size=6))
def test_metric_axioms(bumpy, name, picks):
    distances = DISTANCES[name](bumpy[1], picks)[:, picks]
    scale = distances.max() + 1e-300
    assert (np.diag(distances) == 0).all()
    assert (distances >= 0).all()
    np.testing.assert_allclose(distances, distances.T, atol=1e-12 * scale)
    through = (distances[:, :, None] + distances[None, :, :]).min(axis=1)
    assert (distances <= through + 1e-12 * scale).all()
    different = np.not_equal.outer(picks, picks)
    assert (distances[different] > 0).all()


def test_embeddings_carry_the_distances(bumpy):
    _, spectrum = bumpy
    pairs = [
        (biharmonic_embedding(spectrum), biharmonic_distances(spectrum, 5)),
        (commute_time_embedding(spectrum), commute_time_distances(spectrum, 5)),
        (diffusion_embedding(spectrum, 0.2), diffusion_distances(spectrum, 0.2, 5)),
    ]
    for embedding, distances in pairs:
        assert embedding.shape == (642, 39)
        np.testing.assert_allclose(np.linalg.norm(embedding - embedding[5], axis=1), distances[0], atol=1e-12)


def test_distances_do_not_depend_on_signs_or_on_bases_of_repeated_values(sphere):
    _, spectrum = sphere
    vectors = spectrum.vectors.copy()
    turn, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))
    vectors[:, 1:4] = vectors[:, 1:4] @ turn
    vectors[:, 5] *= -1
    turned = Spectrum(spectrum.values, vectors, spectrum.mass)
    np.testing.assert_allclose(biharmonic_distances(turned, 3), biharmonic_distances(spectrum, 3), atol=1e-5)


def test_between_pieces():
    ball = shapes.icosphere(2)
    two = Mesh(np.vstack([ball.vertices, ball.vertices + 5]), np.vstack([ball.faces, ball.faces + 162]))
    spectrum = eigenbasis(two, 40)
    assert spectrum.n_zero == 2
    for distances in DISTANCES.values():
        rows = distances(spectrum, [0, 200])
        assert np.isinf(rows[0, 162:]).all()
        assert np.isinf(rows[1, :162]).all()
        assert np.isfinite(rows[0, :162]).all()
        assert np.isfinite(rows[1, 162:]).all()
    assert np.abs(biharmonic_kernel(spectrum, 0)[0, 162:]).max() < 1e-12
    heat = heat_kernel(spectrum, 0.1, 0)[0]
    assert np.abs(heat[162:]).max() < 1e-12
    assert heat @ two.vertex_areas == pytest.approx(1)
    alone = biharmonic_distances(eigenbasis(ball, 20), 0)
    np.testing.assert_allclose(biharmonic_distances(spectrum, 0)[0, :162], alone[0], rtol=1e-6)


def test_refusals(bumpy):
    _, spectrum = bumpy
    with pytest.raises(InputError, match=r"outside 0\.\.641"):
        biharmonic_distances(spectrum, [0, 642])
    with pytest.raises(InputError, match="time must be"):
        heat_kernel(spectrum, -1, 0)
    with pytest.raises(InputError, match="time must be"):
        diffusion_distances(spectrum, np.nan, 0)
    with pytest.raises(InputError, match="width must be positive"):
        wave_kernel(spectrum, 0.0, 0, width=0)
    with pytest.raises(InputError, match="energy must be finite"):
        wave_kernel(spectrum, np.inf, 0)
    with pytest.raises(InputError, match="all 1 eigenvalues are 0"):
        biharmonic_distances(spectrum.truncated(1), 0)
