"""Limbs that are alike, the space of symmetries and its groups, and the protocols that judge them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pliant import InputError, eigenbasis, load_mesh, shapes
from pliant.evaluate import region_overlap, symmetry_noise, symmetry_repeatability
from pliant.matching.symmetry import (
    SymmetryResult,
    detect_symmetries,
    group_symmetries,
    partial_symmetries,
    symmetry_space,
)


@pytest.fixture(scope="module")
def figure():
    bent = shapes.quadruped(2500)
    return bent.posed(bent.random_pose(rng=2))


@pytest.fixture(scope="module")
def spectrum(figure):
    return eigenbasis(figure.mesh, 100)


@pytest.fixture(scope="module")
def parts(figure, spectrum):
    return partial_symmetries(figure.mesh, spectrum, reflections=[figure.symmetry]).symmetries


def names(figure, found):
    return frozenset(
        figure.part_names[np.bincount(figure.parts[mask]).argmax()] for mask in (found.source, found.target)
    )


def test_every_leg_is_like_every_other_and_nothing_else_is(figure, parts):
    legs = [f"{side} {end} leg" for side in ("left", "right") for end in ("front", "hind")]
    wanted = {frozenset((a, b)) for a in legs for b in legs if a < b}
    assert {names(figure, found) for found in parts} == wanted
    assert len(parts) == len(wanted)


def test_regions_have_maps_and_bases_of_their_own(parts):
    for found in parts:
        assert not (found.source & found.target).any()
        assert (found.point_map[~found.source] == -1).all()
        assert found.target[found.point_map[found.source]].all()
        assert [basis.n_vertices for basis in found.bases] == [found.source.sum(), found.target.sum()]
        k = len(found.fmap)
        assert np.abs(found.fmap @ found.fmap.T - np.eye(k)).max() < 1e-9


def test_a_matrix_takes_functions_on_the_target_to_the_source(parts):
    found = parts[0]
    source, target = (basis.vectors[:, :20] * basis.area**0.5 for basis in found.bases)
    place = np.searchsorted(np.flatnonzero(found.target), found.point_map[found.source])
    carried = source @ found.fmap[:20, :20]
    assert np.corrcoef(carried[:, 1:8].ravel(), target[place, 1:8].ravel())[0, 1] > 0.9


def test_pairs_that_the_reflection_implies_follow_it(figure, parts):
    implied = [found for found in parts if found.implied_by == 0]
    assert {names(figure, found) for found in implied} == {
        frozenset(("left front leg", "right front leg")),
        frozenset(("left hind leg", "right hind leg")),
    }
    for found in implied:
        same = figure.symmetry[found.source]
        gaps = np.linalg.norm(
            figure.mesh.vertices[found.point_map[found.source]] - figure.mesh.vertices[same], axis=1
        )
        assert gaps.mean() / figure.mesh.area**0.5 < 0.02
        assert found.reversed_area > 0.9


def test_limbs_of_too_few_vertices_are_said_to_be():
    mesh = shapes.quadruped(1000).mesh
    found = partial_symmetries(mesh, eigenbasis(mesh, 60))
    assert not found.symmetries
    assert "fewer than" in found.reasons[0]


@pytest.mark.parametrize(
    ("mesh", "reason"),
    [(shapes.icosphere(3), "continuous"), (shapes.bumpy_sphere(3, rng=6), "no partial symmetry")],
    ids=["sphere", "blob"],
)
def test_no_parts_where_there_are_none(mesh, reason):
    found = partial_symmetries(mesh, eigenbasis(mesh, 60))
    assert not found.symmetries
    assert reason in found.reasons[0]


def test_parts_are_kept_by_saving(parts, tmp_path):
    kept = SymmetryResult((replace(parts[0], group=3),), (), {})
    kept.save(tmp_path)
    back = SymmetryResult.load(tmp_path).symmetries[0]
    assert (back.kind, back.group, back.implied_by) == ("partial", 3, parts[0].implied_by)
    assert np.array_equal(back.point_map, parts[0].point_map)
    assert np.array_equal(back.bases[1].vectors, parts[0].bases[1].vectors)
    assert np.array_equal(back.bases[0].mass.diagonal(), parts[0].bases[0].mass.diagonal())


def test_a_map_must_lead_into_its_target(parts):
    with pytest.raises(InputError, match="lead into"):
        replace(parts[0], target=np.zeros_like(parts[0].target))


def test_groups_tell_maps_apart_and_count_them(parts, spectrum):
    exact, moved = np.eye(20), np.eye(20)[::-1]
    made = [replace(parts[i], fmap=exact if i < 3 else moved) for i in range(6)]
    assert group_symmetries(made, spectrum).tolist() == [0, 0, 0, 1, 1, 1]
    assert group_symmetries(made, spectrum, count=1).tolist() == [0] * 6
    alike = [replace(found, fmap=exact) for found in parts]
    assert group_symmetries(alike, spectrum).tolist() == [0] * 6
    assert symmetry_space(made)[:3].tolist() == [0, 0, 0]
    assert (symmetry_space(made)[3:] > 0.9).all()


def test_groups_do_not_depend_on_signs_or_on_which_end_is_the_source(parts, spectrum):
    turned = np.eye(20)
    turned[[3, 4]] = turned[[4, 3]]
    turned[[4, 5]] = turned[[5, 4]]
    made = [replace(parts[0], fmap=turned)] * 3
    back = replace(
        parts[0],
        source=parts[0].target,
        target=parts[0].source,
        point_map=np.where(parts[0].target, np.flatnonzero(parts[0].source)[0], -1),
        fmap=-turned.T,
    )
    assert group_symmetries([*made, back], spectrum, count=2).tolist() == [0] * 4
    wrong = replace(parts[0], fmap=-turned.T)
    assert group_symmetries([*made, wrong], spectrum, count=2).tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize("options", [{"count": 0}, {"k": 1.5}])
def test_groups_refuse(parts, spectrum, options):
    with pytest.raises(InputError):
        group_symmetries(parts, spectrum, **options)


def test_repeatability_of_a_region_that_lost_half(figure, parts):
    n = figure.mesh.n_vertices
    same = symmetry_repeatability(parts, parts, figure.mesh, np.arange(n))
    assert same.rate == 1
    assert same.at(0.999) == 1
    assert same.found == 1
    other = symmetry_repeatability(parts[:1], [replace(parts[0], kind="global")], figure.mesh, np.arange(n))
    assert other.rate == 0
    areas = figure.mesh.vertex_areas
    assert region_overlap(parts[0].source, parts[0].source | parts[0].target, areas) == pytest.approx(
        areas[parts[0].source].sum() / areas[parts[0].source | parts[0].target].sum()
    )
    with pytest.raises(InputError, match="vertices"):
        symmetry_repeatability(parts, parts, figure.mesh, np.arange(n - 1))
    with pytest.raises(InputError, match="one size"):
        region_overlap([True], [True, False], [1.0, 1.0])


def test_noise_moves_maps_and_missing_ones_are_nan(figure, parts):
    answers = iter([[parts[0]], [], [replace(parts[0], fmap=np.zeros_like(parts[0].fmap))]])
    moved = symmetry_noise(figure.mesh, lambda mesh: next(answers), sigmas=[0.1, 0.2])
    assert np.isnan(moved[0])
    assert moved[1] == pytest.approx(1)
    with pytest.raises(InputError, match="no symmetry"):
        symmetry_noise(figure.mesh, lambda mesh: [])


@pytest.mark.data
def test_the_legs_of_the_wolf(data: Path):
    mesh = load_mesh(data / "shapes" / "tosca" / "wolf0.ply")
    result = detect_symmetries(mesh)
    legs = [found for found in result.symmetries if found.kind == "partial"]
    assert len(legs) == 6
    low = mesh.vertices[:, 2].min() + 0.1 * np.ptp(mesh.vertices[:, 2])
    for found in legs:
        assert all(mesh.vertices[mask, 2].min() < low for mask in (found.source, found.target))
    assert sum(found.implied_by == 0 for found in legs) == 2
