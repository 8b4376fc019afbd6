"""The phantom is what it says it is: mask, mesh, labels, landmarks and CT numbers agree with one another."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from pliant.errors import InputError
from pliant.heart import HeartPhantom, heart_phantom, load_volume, phantom_cohort
from pliant.mesh import check_up, load_mesh

COARSE = {"spacing": 3.0, "mesh_step": 2.0}


@pytest.fixture(scope="module")
def phantom() -> HeartPhantom:
    return heart_phantom(spacing=2.0, mesh_step=1.5, rng=2)


def volume_of(phantom: HeartPhantom) -> float:
    corners = phantom.mesh.vertices[phantom.mesh.faces]
    return float(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6)


def test_mesh_is_closed_and_faces_outwards_and_encloses_the_mask(phantom: HeartPhantom) -> None:
    found = check_up(phantom.mesh)
    assert not found.findings
    blood = phantom.mask.sum() * phantom.volume.voxel_volume
    assert volume_of(phantom) == pytest.approx(blood, rel=0.01)
    assert 60e3 < blood < 220e3


def test_mesh_error_falls_with_the_square_of_its_step() -> None:
    fine, coarse, coarser = (volume_of(heart_phantom(spacing=8, mesh_step=h, rng=5)) for h in (1.0, 2.0, 4.0))
    assert abs(coarse - fine) < 0.4 * abs(coarser - fine)
    assert coarse == pytest.approx(fine, rel=5e-3)


def test_vertices_lie_between_blood_and_wall(phantom: HeartPhantom) -> None:
    fine = heart_phantom(spacing=1.5, mesh_step=3.0, noise=0, blur=0, rng=2)
    wall = fine.labels > 0
    out = fine.mesh.vertices + 1.5 * fine.mesh.vertex_normals
    into = fine.mesh.vertices - 1.5 * fine.mesh.vertex_normals
    inside, outside = (
        fine.mask[tuple(np.rint(fine.volume.indices(p[wall])).astype(int).T)].mean() for p in (into, out)
    )
    assert inside > 0.93
    assert outside < 0.07


def test_labels_are_right_handed_and_in_their_places(phantom: HeartPhantom) -> None:
    marks = phantom.landmarks
    axis = marks["base"] - marks["apex"]
    length = np.linalg.norm(axis)
    axis = axis / length
    place = phantom.mesh.vertices - marks["apex"]
    level = place @ axis / length
    assert sorted(set(phantom.labels)) == list(range(18))
    assert np.allclose(level[phantom.labels == 0], 1, atol=1e-9)
    middle = {s: level[phantom.labels == s].mean() for s in range(1, 18)}
    assert middle[17] < middle[14] < middle[8] < middle[2] < 1
    centre = {s: place[phantom.labels == s].mean(axis=0) for s in (7, 8, 9, 10, 12)}
    septal = (centre[8] + centre[9]) / 2
    anterior = centre[7] - centre[10]
    # Anterior x septal points from the base to the apex in a patient; a mirrored heart has it the other way.
    assert np.cross(anterior, septal - centre[12]) @ axis < 0
    assert anterior[2] > 0
    assert anterior[1] > 0


def test_the_septum_faces_the_right_ventricle(phantom: HeartPhantom) -> None:
    right = phantom.volume.points(np.argwhere(phantom.right_ventricle)).mean(axis=0)
    sides = [
        np.linalg.norm(phantom.mesh.vertices[phantom.labels == s].mean(axis=0) - right) for s in range(7, 13)
    ]
    assert {7 + int(i) for i in np.argsort(sides)[:2]} == {8, 9}
    nearest = [np.linalg.norm(phantom.mesh.vertices - p, axis=1).min() for p in phantom.landmarks["septum"]]
    assert max(nearest) < 1.5
    assert not (phantom.right_ventricle & phantom.mask).any()


def test_numbers_are_those_of_a_contrast_ct(phantom: HeartPhantom) -> None:
    values = phantom.volume.values
    assert phantom.volume.modality == "CT"
    core = values[phantom.mask]
    assert 400 < np.median(core) < 550
    sharp = heart_phantom(spacing=2.0, mesh_step=3.0, noise=0, rng=2).volume.values
    assert np.std(values - sharp) == pytest.approx(47, abs=1.5)


def test_same_seed_same_bytes_whatever_the_threads() -> None:
    one, two = (heart_phantom(**COARSE, rng=7, n_jobs=jobs) for jobs in (1, 2))
    assert np.array_equal(one.volume.values, two.volume.values)
    assert np.array_equal(one.mesh.vertices, two.mesh.vertices)
    assert not np.array_equal(one.volume.values, heart_phantom(**COARSE, rng=8).volume.values)


def area_of(phantom: HeartPhantom, segments: list[int]) -> float:
    return float(phantom.mesh.vertex_areas[np.isin(phantom.labels, segments)].sum())


@pytest.mark.parametrize("change", ["height", "spacing", "smoothing"])
def test_stenosis_changes_its_territory_and_no_other(change: str) -> None:
    lad, lcx = [7, 8, 13, 14], [11, 12, 16]
    ratios = []
    for seed in range(2):
        sick, well = (
            heart_phantom(spacing=8, mesh_step=2.0, stenosis=(p, 0, 0), change=change, rng=seed)
            for p in (100, 0)
        )
        ratios.append([area_of(sick, s) / area_of(well, s) for s in (lad, lcx)])
    ratio = np.mean(ratios, axis=0)
    assert ratio[0] < 0.95
    assert abs(ratio[1] - 1) < 0.04


def test_nothing_changes_where_nothing_is_to_change() -> None:
    sick, well = (heart_phantom(**COARSE, stenosis=(p, p, p), change="none", rng=3) for p in (100, 0))
    assert np.array_equal(sick.volume.values, well.volume.values)
    assert np.array_equal(sick.mesh.vertices, well.mesh.vertices)
    turned = heart_phantom(**COARSE, stenosis=(100, 100, 100), change={"direction": 1.0}, rng=3)
    assert not np.array_equal(turned.mesh.n_vertices, well.mesh.n_vertices) or not np.allclose(
        turned.mesh.vertices, well.mesh.vertices
    )


def test_volume_is_not_a_clue() -> None:
    pairs = [
        [
            volume_of(heart_phantom(spacing=8, mesh_step=2, stenosis=(p,) * 3, change="height", rng=s))
            for p in (0, 100)
        ]
        for s in range(2)
    ]
    well, sick = np.mean(pairs, axis=0)
    assert sick == pytest.approx(well, rel=0.02)


def test_cohort_is_written_whole_and_resumes(tmp_path) -> None:
    cohort = phantom_cohort(2, rng=4, spacing=6.0, mesh_step=3.0)
    table = cohort.save(tmp_path / "made")
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    assert [row["diseased"] for row in rows] == ["0", "1"]
    phantom = cohort.subject(1)
    stenosis = [float(rows[1][f"stenosis_{t}"]) for t in ("LAD", "LCX", "RCA")]
    assert stenosis == pytest.approx(phantom.stenosis, abs=0.05)
    assert load_mesh(table.parent / rows[1]["mesh"]).n_vertices == phantom.mesh.n_vertices
    read = load_volume(table.parent / rows[1]["volume"], modality="CT")
    assert np.array_equal(read.values, phantom.volume.values)
    assert np.allclose(read.affine, phantom.volume.affine, atol=1e-4)
    marks = json.loads((table.parent / rows[1]["landmarks"]).read_text(encoding="utf-8"))
    assert marks["apex"] == pytest.approx(phantom.landmarks["apex"], abs=1e-5)
    (table.parent / rows[0]["mesh"]).write_text("kept")
    cohort.save(tmp_path / "made")
    assert (table.parent / rows[0]["mesh"]).read_text(encoding="utf-8") == "kept"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"spacing": -1.0}, "positive"),
        ({"spacing": 20.0}, "between 0.3 and 8"),
        ({"stenosis": (120, 0, 0)}, "percentages"),
        ({"stenosis": 70}, "percentages"),
        ({"change": "colour"}, "change must be"),
        ({"change": {"height": 2.0}}, "strengths"),
        ({"noise": -1.0}, "noise"),
        ({"contrast": 0.0}, "contrast"),
        ({"mesh_step": 9.0, "spacing": 8.0}, "between 0.2 and 4"),
    ],
)
def test_refusals_say_what_is_wrong(wrong: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        heart_phantom(**({"spacing": 8.0, "mesh_step": 4.0} | wrong))


def test_a_cohort_of_one_is_refused() -> None:
    with pytest.raises(InputError, match="2 subjects"):
        phantom_cohort(1)
    with pytest.raises(InputError, match="drawn by the cohort"):
        phantom_cohort(4, stenosis=(0, 0, 0))
