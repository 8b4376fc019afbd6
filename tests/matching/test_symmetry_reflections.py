"""Reflections of figures with exact symmetry, and refusals where there is none or no one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pliant import InputError, Mesh, eigenbasis, geodesic_distances, load_mesh, shapes
from pliant.errors import FileFormatError
from pliant.matching.symmetry import (
    Limits,
    Symmetry,
    SymmetryResult,
    complexity,
    detect_symmetries,
    map_quality,
    reflections,
    reversed_area,
    symmetric_pairs,
)


@pytest.fixture(scope="module")
def figure():
    bent = shapes.quadruped(2000)
    return bent.posed(bent.random_pose(rng=1))


@pytest.fixture(scope="module")
def spectrum(figure):
    return eigenbasis(figure.mesh, 150)


@pytest.fixture(scope="module")
def result(figure, spectrum):
    return detect_symmetries(figure.mesh, spectrum=spectrum)


def whole(result: SymmetryResult) -> list[Symmetry]:
    return [found for found in result.symmetries if found.kind == "global"]


def mean_error(mesh: Mesh, found: np.ndarray, vertices: np.ndarray, truth: np.ndarray) -> float:
    some = np.random.default_rng(0).choice(len(vertices), min(80, len(vertices)), replace=False)
    distances = geodesic_distances(mesh, truth[some])
    return float(distances[np.arange(len(some)), found[vertices[some]]].mean() / mesh.area**0.5)


def test_pairs_are_mirror_images(figure, spectrum):
    pairs = symmetric_pairs(figure.mesh, spectrum, samples=60)
    distances = geodesic_distances(figure.mesh, figure.symmetry[pairs.sources])
    off = distances[np.arange(len(pairs)), pairs.targets] / figure.mesh.area**0.5
    assert len(pairs) >= 20
    assert (off < 0.1).mean() > 0.85
    assert (np.diff(pairs.support) <= 0).all()
    assert len(np.unique(pairs.sources)) == len(pairs)


def test_pairs_do_not_change_with_scale_or_motion(figure, spectrum):
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    moved = figure.mesh.transformed(4 * turn * np.sign(np.linalg.det(turn)))
    here = symmetric_pairs(figure.mesh, spectrum, samples=40)
    there = symmetric_pairs(moved, eigenbasis(moved, 150), samples=40)
    same = np.intersect1d(here.sources, there.sources)
    assert len(same) > 0.8 * len(here)
    assert there.scale == pytest.approx(4 * here.scale)


def test_the_reflection_of_a_bent_figure(figure, result):
    assert len(whole(result)) == 1
    found = result.symmetries[0]
    everyone = np.arange(figure.mesh.n_vertices)
    assert mean_error(figure.mesh, found.point_map, everyone, figure.symmetry) < 0.03
    assert found.kind == "global"
    assert found.source.all()
    assert found.target.all()
    assert found.reversed_area > 0.8
    assert 0 < found.confidence <= 1
    assert not result.reasons
    k = len(found.fmap)
    assert np.abs(found.fmap @ found.fmap.T - np.eye(k)).max() < 1e-9


def test_the_same_twice(figure, spectrum, result):
    again = detect_symmetries(figure.mesh, spectrum=spectrum)
    assert np.array_equal(again.symmetries[0].point_map, result.symmetries[0].point_map)


def test_saved_and_loaded(result, tmp_path):
    result.save(tmp_path / "new")
    back = SymmetryResult.load(tmp_path / "new")
    assert back.as_json() == result.as_json()
    assert np.array_equal(back.symmetries[0].point_map, result.symmetries[0].point_map)
    assert np.array_equal(back.symmetries[0].fmap, result.symmetries[0].fmap)


def test_damaged_files_are_refused(result, tmp_path):
    result.save(tmp_path)
    stored = json.loads((tmp_path / "symmetries.json").read_text(encoding="utf-8"))
    (tmp_path / "symmetries.json").write_text(json.dumps(stored | {"format": "other"}))
    with pytest.raises(FileFormatError, match="another version"):
        SymmetryResult.load(tmp_path)
    (tmp_path / "symmetries.json").write_text("{")
    with pytest.raises(FileFormatError, match="damaged"):
        SymmetryResult.load(tmp_path)


def test_an_ellipsoid_has_the_reflections_that_are_true():
    mesh = shapes.ellipsoid([1, 0.8, 0.5], 3)
    found = reflections(mesh, eigenbasis(mesh, 120)).reflections
    # Three mirrors, and the point reflection, which turns the surface's sides about as well.
    signs = {
        tuple(np.sign(np.sum(mesh.vertices * mesh.vertices[r.point_map], axis=0)).astype(int)) for r in found
    }
    assert signs <= {(-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1)}
    assert len(signs) == len(found) >= 2
    for reflection in found:
        image = mesh.vertices[reflection.point_map]
        turned = np.abs(image) - np.abs(mesh.vertices)
        assert np.sqrt((turned**2).sum(axis=1)).mean() < 0.05


@pytest.mark.parametrize(
    ("mesh", "reason"),
    [
        (shapes.icosphere(4), "continuous"),
        (shapes.cylinder(), "continuous"),
        (shapes.torus(), "continuous"),
        (shapes.ellipsoid([1, 0.6, 0.6], 4), "continuous"),
        (shapes.bumpy_sphere(3, rng=0), "no reflection"),
        (shapes.bumpy_sphere(3, rng=6), "no reflection"),
        (shapes.bumpy_sphere(3, rng=16), "no reflection"),
    ],
    ids=["sphere", "cylinder", "torus", "spheroid", "blob 0", "blob 6", "blob 16"],
)
def test_no_arbitrary_reflection(mesh, reason):
    found = detect_symmetries(mesh, samples=80)
    assert not found.symmetries
    assert found.reasons
    assert any(reason in text or "rotation" in text for text in found.reasons)


def test_pieces_are_refused_with_their_number():
    one = shapes.icosphere(2)
    both = Mesh(
        np.concatenate([one.vertices, one.vertices + 5]),
        np.concatenate([one.faces, one.faces + one.n_vertices]),
    )
    found = detect_symmetries(both)
    assert not found.symmetries
    assert "2 pieces" in found.reasons[0]


def test_limits_refuse_with_the_figure_that_failed(figure, spectrum):
    found = reflections(figure.mesh, spectrum, limits=Limits(distortion=1e-6))
    assert not found.reflections
    assert any("distortion" in reason for reason in found.reasons)


def test_quality_tells_the_identity_from_the_reflection(figure, spectrum):
    n = figure.mesh.n_vertices
    still = map_quality(figure.mesh, spectrum, np.arange(n))
    true = map_quality(figure.mesh, spectrum, figure.symmetry)
    assert still.reversed_area == 0
    assert still.displacement == 0
    assert true.reversed_area == pytest.approx(1)
    assert true.involution == 0
    assert true.displacement > 0.2
    assert true.distortion < 0.05


def test_a_flipped_mesh_measures_the_same(figure):
    assert reversed_area(figure.mesh.flipped(), figure.symmetry) == pytest.approx(1)


def test_complexity_in_closed_form():
    assert complexity(np.diag([1.0, -1, 1])) == 0
    turn = np.array([[0.0, -1], [1, 0]])
    share = 1 - np.exp(-0.5)
    assert complexity(turn) == pytest.approx(share)
    assert complexity(turn, form="absolute") == pytest.approx(share)
    assert complexity(turn, form="literal") == pytest.approx(0)
    corner = np.zeros((30, 30))
    corner[0, 29] = 1
    assert complexity(corner) == 0
    assert complexity(corner, k=None) == pytest.approx(1 / 30)


@pytest.mark.parametrize("bad", [np.ones((2, 3)), np.full((2, 2), np.nan), np.zeros((0, 0))])
def test_complexity_refuses(bad):
    with pytest.raises(InputError):
        complexity(bad)


@pytest.mark.parametrize(
    "options", [{"samples": 0}, {"width": 0}, {"kept": 2}, {"signature_threshold": np.nan}, {"partners": 1.5}]
)
def test_options_out_of_range(figure, spectrum, options):
    with pytest.raises(InputError):
        symmetric_pairs(figure.mesh, spectrum, **options)


def test_inputs_that_do_not_fit(figure, spectrum):
    with pytest.raises(InputError, match="vertices"):
        reflections(shapes.icosphere(2), spectrum)
    with pytest.raises(InputError, match="30 eigenpairs"):
        reflections(figure.mesh, spectrum.truncated(10))
    with pytest.raises(InputError, match="limit of distortion"):
        Limits(distortion=-1)
    with pytest.raises(InputError, match="200 vertices"):
        detect_symmetries(shapes.icosphere(1))
    with pytest.raises(InputError, match="one image a vertex"):
        map_quality(figure.mesh, spectrum, [0, 1])
    n = 4
    with pytest.raises(InputError, match="point_map"):
        Symmetry(np.ones(n, bool), np.ones(n, bool), np.full(n, -1), np.eye(2), 0, 0, 0, 0, 0, 0)


@pytest.mark.data
@pytest.mark.parametrize(("name", "limit"), [("wolf0", 0.012), ("wolf2", 0.02)])
def test_the_wolf(data: Path, name: str, limit: float):
    mesh = load_mesh(data / "shapes" / "tosca" / f"{name}.ply")
    rows = np.loadtxt(data / "shapes" / "tosca" / "wolf.symmetry.csv", delimiter=",", comments="#")
    vertices, truth = rows[:, 0].astype(int), rows[:, 1].astype(int)
    found = whole(detect_symmetries(mesh, parts=False))
    assert len(found) == 1
    assert mean_error(mesh, found[0].point_map, vertices, truth) < limit


@pytest.mark.data
def test_a_remeshed_cat(data: Path):
    folder = data / "shapes" / "tosca_remeshed_5k"
    mesh = load_mesh(folder / "cat0.ply")
    vertices, truth = (np.loadtxt(folder / f"cat0.{kind}").astype(int) - 1 for kind in ("vts", "sym.vts"))
    found = whole(detect_symmetries(mesh, parts=False))
    assert len(found) == 1
    assert mean_error(mesh, found[0].point_map, vertices, truth) < 0.03


def test_a_slender_spheroid_gets_no_reflection_through_an_arbitrary_plane():
    mesh = shapes.ellipsoid([1, 0.2, 0.2], 3)
    across = mesh.vertices[:, 1:]
    for found in reflections(mesh, eigenbasis(mesh, 120)).reflections:
        image = across[found.point_map]
        cosine = (image * across).sum(axis=1)[np.abs(mesh.vertices[:, 0]) < 0.8] / 0.04
        assert abs(np.sign(cosine).sum()) > 0.9 * len(cosine)
