"""Heat, wave and biharmonic signatures: parity, closed forms, laws, refusals."""

from __future__ import annotations

import numpy as np
import pytest

import pliant
from pliant import Mesh, Spectrum
from pliant.descriptors import bdk, hks, wks


@pytest.fixture(scope="module")
def bumpy() -> tuple[Mesh, Spectrum]:
    mesh = pliant.shapes.bumpy_sphere(3, rng=0)
    return mesh, pliant.eigenbasis(mesh, 80)


def test_agree_with_pyfm_on_the_same_eigenpairs(bumpy: tuple[Mesh, Spectrum]) -> None:
    heat = pytest.importorskip("pyFM.signatures.HKS_functions")
    wave = pytest.importorskip("pyFM.signatures.WKS_functions")
    _, spectrum = bumpy
    np.testing.assert_allclose(
        hks(spectrum), heat.auto_HKS(spectrum.values, spectrum.vectors, 100), rtol=1e-9
    )
    np.testing.assert_allclose(
        wks(spectrum), wave.auto_WKS(spectrum.values, spectrum.vectors, 100), rtol=1e-9
    )


def test_constant_on_a_sphere() -> None:
    # Whole eigenspaces: 1 + 3 + 5 + 7 + 9 pairs, so that the sum of squares is the same everywhere.
    spectrum = pliant.eigenbasis(pliant.shapes.icosphere(4), 25)
    for values in (hks(spectrum), wks(spectrum), bdk(spectrum)[:, None]):
        np.testing.assert_allclose(values / values.mean(axis=0), 1, atol=0.02)
    degree = np.arange(1, 5)
    expected = ((2 * degree + 1) / (4 * np.pi) / (degree * (degree + 1)) ** 2.0).sum()
    assert bdk(spectrum).mean() == pytest.approx(expected, rel=0.02)


def test_heat_signatures_integrate_to_one(bumpy: tuple[Mesh, Spectrum]) -> None:
    mesh, spectrum = bumpy
    np.testing.assert_allclose(mesh.vertex_areas @ hks(spectrum), 1, rtol=1e-9)
    np.testing.assert_allclose(mesh.vertex_areas @ wks(spectrum), 1, rtol=1e-9)


def test_scale_renumbering_and_motion(bumpy: tuple[Mesh, Spectrum]) -> None:
    mesh, spectrum = bumpy
    order = np.random.default_rng(0).permutation(mesh.n_vertices)
    other = Mesh(3 * mesh.vertices[order] + 7, np.argsort(order)[mesh.faces])
    moved = pliant.eigenbasis(other, 80)
    np.testing.assert_allclose(hks(moved) * 9, hks(spectrum)[order], rtol=1e-5)
    np.testing.assert_allclose(wks(moved) * 9, wks(spectrum)[order], rtol=1e-5)
    np.testing.assert_allclose(bdk(moved) / 9, bdk(spectrum)[order], rtol=1e-5)


def test_pieces_do_not_change_each_other() -> None:
    one = pliant.shapes.bumpy_sphere(2, rng=1)
    two = Mesh(
        np.concatenate([one.vertices, one.vertices + 9]),
        np.concatenate([one.faces, one.faces + one.n_vertices]),
    )
    alone, both = pliant.eigenbasis(one, 30), pliant.eigenbasis(two, 60)
    np.testing.assert_allclose(bdk(both)[: one.n_vertices], bdk(alone), rtol=1e-6)
    times = [0.1, 1.0]
    share = hks(both, times=times)[: one.n_vertices] / hks(alone, times=times)
    np.testing.assert_allclose(share, 0.5, rtol=1e-6)


def test_refusals(bumpy: tuple[Mesh, Spectrum]) -> None:
    _, spectrum = bumpy
    for wrong in ({"times": [0.0, 1.0]}, {"times": [np.nan]}, {"times": []}, {"n_times": 0}):
        with pytest.raises(pliant.InputError):
            hks(spectrum, **wrong)
    for wrong in ({"width": 0.0}, {"width": np.nan}, {"energies": [np.inf]}, {"n_energies": 0}):
        with pytest.raises(pliant.InputError):
            wks(spectrum, **wrong)
    with pytest.raises(pliant.InputError, match="outside the spectrum"):
        wks(spectrum, energies=[1e6])
    with pytest.raises(pliant.InputError, match="none is positive"):
        bdk(spectrum.truncated(1))
