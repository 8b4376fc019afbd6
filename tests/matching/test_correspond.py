"""Sparse correspondence: exact copies, poses of one figure, what confidence means, refusals."""

from __future__ import annotations

import numpy as np
import pytest

import pliant
from pliant import InputError, eigenbasis, shapes
from pliant.evaluate.maps import map_error
from pliant.matching import correspond


@pytest.fixture(scope="module")
def figure():
    return shapes.human(2000)


def test_a_shape_and_its_renumbered_copy_match_exactly():
    shape = shapes.bumpy_sphere(3, rng=0)
    old = np.random.default_rng(0).permutation(shape.n_vertices)
    copy = pliant.Mesh(shape.vertices[old], np.argsort(old)[shape.faces])
    a, b = eigenbasis(shape, 50), eigenbasis(copy, 50)
    places = shape.vertices
    found = correspond(a, b, samples=60, descriptors=(places, places[old]))
    assert len(found) == 60
    assert (old[found.points_b] == found.points_a).all()
    np.testing.assert_allclose(found.confidence, 1, atol=1e-3)


def test_points_of_two_poses_match_up_to_the_symmetry(figure):
    posed = figure.posed("walk")
    found = correspond(figure.mesh, posed.mesh)
    assert 30 <= len(found) <= 200
    error = map_error(found.points_a, found.points_b, figure.mesh, symmetry=figure.symmetry)
    assert np.median(error.pointwise_errors) < 0.08
    surest = error.pointwise_errors[: len(found) // 3]
    assert np.median(surest) <= np.median(error.pointwise_errors)


def test_pairs_are_one_to_one_and_the_surest_come_first(figure):
    found = correspond(figure.mesh, figure.posed("sit").mesh, samples=80)
    assert len(np.unique(found.points_a)) == len(np.unique(found.points_b)) == len(found)
    assert (np.diff(found.confidence) <= 0).all()
    assert found.confidence.min() >= 0
    assert found.confidence.max() <= 1
    sure = correspond(figure.mesh, figure.posed("sit").mesh, samples=80, least_confidence=0.3)
    assert (sure.confidence >= 0.3).all()
    assert len(sure) == (found.confidence >= 0.3).sum()
    assert found.surest(5).points_a.tolist() == found.points_a[:5].tolist()


def test_mirror_twins_leave_no_confidence():
    """Signatures that are the same on both sides: each point has two equally good answers."""
    figure = shapes.human(1000)
    signatures = figure.mesh.vertices * [1, 1, 1]
    signatures[:, 0] = np.abs(signatures[:, 0])
    spectrum = eigenbasis(figure.mesh, 30)
    found = correspond(spectrum, spectrum, samples=2000, descriptors=(signatures, signatures))
    off_plane = figure.mesh.vertices[found.points_a, 0] != 0
    assert found.confidence[off_plane].max(initial=0) < 1e-3


def test_refusals(figure):
    spectrum = eigenbasis(shapes.icosphere(2), 20)
    places = shapes.icosphere(2).vertices
    for options, words in (
        ({"samples": 2}, "samples"),
        ({"dim": 0}, "dim"),
        ({"least_confidence": 2}, "least_conf"),
    ):
        with pytest.raises(InputError, match=words):
            correspond(spectrum, spectrum, descriptors=(places, places), **options)
    with pytest.raises(InputError, match="3 descriptors and b 1"):
        correspond(spectrum, spectrum, descriptors=(places, places[:, :1]))
