"""The blood pool: overlap with the truth of phantoms and with a rough reference on a real CT; leaks and bad input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from pliant.errors import InputError, PliantWarning
from pliant.heart import (
    HeartPhantom,
    Volume,
    heart_phantom,
    load_volume,
    phantom_cohort,
    segment_blood_pool,
    volume_overlap,
)


@pytest.fixture(scope="module")
def phantom() -> HeartPhantom:
    return heart_phantom(spacing=1.5, mesh_step=4.0, rng=11)


def plane_of(phantom: HeartPhantom) -> tuple[np.ndarray, np.ndarray]:
    marks = phantom.landmarks
    return marks["base"], marks["base"] - marks["apex"]


def dice(mask: np.ndarray, truth: np.ndarray) -> float:
    return volume_overlap(mask, truth, measure="dice")


def test_found_by_itself_and_better_with_the_plane(phantom: HeartPhantom) -> None:
    alone = segment_blood_pool(phantom.volume)
    given = segment_blood_pool(phantom.volume, basal_plane=plane_of(phantom))
    assert dice(alone.mask, phantom.mask) > 0.95
    assert dice(given.mask, phantom.mask) > 0.97
    assert not alone.leak
    assert not alone.warnings
    assert alone.confidence > 0.6
    assert given.confidence == 1
    point, normal = alone.basal_plane
    assert np.linalg.norm(normal) == pytest.approx(1)
    assert abs((phantom.landmarks["base"] - point) @ normal) < 6
    axis = phantom.landmarks["base"] - phantom.landmarks["apex"]
    assert normal @ axis / np.linalg.norm(axis) > np.cos(np.radians(15))
    assert given.millilitres == pytest.approx(phantom.mask.sum() * 1.5**3 / 1000, rel=0.04)


@pytest.mark.parametrize(("method", "least"), [("region", 0.965), ("edge", 0.93)])
def test_level_sets_come_to_rest(phantom: HeartPhantom, method: str, least: float) -> None:
    found = segment_blood_pool(phantom.volume, method=method, basal_plane=plane_of(phantom))
    assert dice(found.mask, phantom.mask) > least
    assert found.settings["level_set_at_rest"]


def test_papillary_muscles_are_out_and_the_mask_is_one_piece(phantom: HeartPhantom) -> None:
    found = segment_blood_pool(phantom.volume, basal_plane=plane_of(phantom)).mask
    assert ndimage.label(found)[1] == 1
    filled = ndimage.binary_closing(np.pad(phantom.mask, 8), iterations=5)[8:-8, 8:-8, 8:-8]
    muscle = ndimage.binary_erosion(filled & ~phantom.mask)
    assert muscle.sum() > 50
    assert found[muscle].mean() < 0.1


def test_a_wide_median_costs_overlap(phantom: HeartPhantom) -> None:
    fine, wide = (
        segment_blood_pool(phantom.volume, smoothing="median", width=w, basal_plane=plane_of(phantom)).mask
        for w in (3.0, 7.5)
    )
    assert dice(fine, phantom.mask) > dice(wide, phantom.mask) + 0.01


def test_moving_and_turning_the_patient_moves_the_mask(phantom: HeartPhantom) -> None:
    volume = phantom.volume
    plain = segment_blood_pool(volume).mask
    # The same body stored along other axes: each stays in its place in space.
    affine = volume.affine @ np.array(
        [[0, 0, -1, volume.shape[0] - 1], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]]
    )
    stored = Volume(np.transpose(volume.values, (2, 1, 0))[:, :, ::-1], affine, "CT", "HU")
    at = np.array([3, 4, 5])
    assert np.isclose(
        stored.values[tuple(at)], volume.values[tuple(np.rint(volume.indices(stored.points(at))).astype(int))]
    )
    turned = segment_blood_pool(stored).mask
    assert dice(np.transpose(turned[:, :, ::-1], (2, 1, 0)), plain) > 0.995
    shifted = volume.affine.copy()
    shifted[:3, 3] += [100, -200, 300]
    moved = segment_blood_pool(Volume(volume.values, shifted, "CT", "HU"))
    assert dice(moved.mask, plain) > 0.999


def test_a_ventricle_split_by_its_papillary_muscles_is_put_together() -> None:
    # Its main part is 63 of 106 ml; behind that part's rim at the base lies much fat.
    heart = phantom_cohort(12, rng=21, spacing=1.5, mesh_step=4.0).subject(11)
    pool = segment_blood_pool(heart.volume)
    assert not pool.leak
    assert volume_overlap(pool.mask, heart.mask, measure="dice") > 0.97


def test_unequal_spacing(phantom: HeartPhantom) -> None:
    stretched = phantom.volume.resampled((1.5, 1.5, 3.0))
    truth = phantom.mask[:, :, ::2]
    assert dice(segment_blood_pool(stretched, basal_plane=plane_of(phantom)).mask, truth) > 0.95


def test_a_leak_is_reported_and_the_mask_still_given(phantom: HeartPhantom) -> None:
    base, axis = plane_of(phantom)
    far = base + 28 * axis / np.linalg.norm(axis)
    with pytest.warns(PliantWarning, match="leak: .* outside the ventricle"):
        found = segment_blood_pool(phantom.volume, basal_plane=(far, axis))
    assert found.leak
    assert found.mask.sum() > 1.2 * phantom.mask.sum()


def test_a_heart_cut_off_by_the_border_is_reported(phantom: HeartPhantom) -> None:
    low = int(np.argwhere(phantom.mask)[:, 0].min()) + 14
    cut = Volume(phantom.volume.values[low:], phantom.volume.affine, "CT", "HU")
    with pytest.warns(PliantWarning, match="reaches the volume's border"):
        found = segment_blood_pool(cut)
    assert found.leak


def test_seed_and_mask_say_where_to_look(phantom: HeartPhantom) -> None:
    inside = phantom.volume.points(np.argwhere(ndimage.binary_erosion(phantom.mask, iterations=6))[0])
    assert dice(segment_blood_pool(phantom.volume, seed=inside).mask, phantom.mask) > 0.95
    near = ndimage.binary_dilation(phantom.mask, iterations=12)
    assert dice(segment_blood_pool(phantom.volume, mask=near).mask, phantom.mask) > 0.95
    with pytest.raises(InputError, match="mask holds no chamber"):
        segment_blood_pool(phantom.volume, mask=phantom.volume.values < -700)
    wall = inside + 300
    with pytest.raises(InputError, match="outside the volume"):
        segment_blood_pool(phantom.volume, seed=wall)
    lung = phantom.volume.points(np.argwhere(phantom.volume.values < -700)[0])
    with pytest.raises(InputError, match="in no chamber of blood"):
        segment_blood_pool(phantom.volume, seed=lung)


def test_no_contrast_agent_is_refused() -> None:
    plain = heart_phantom(spacing=2.5, mesh_step=4.0, rng=1, contrast=0.1)
    with pytest.raises(InputError, match=r"no blood with contrast agent|no chamber"):
        segment_blood_pool(plain.volume)


def test_other_volumes_are_refused(phantom: HeartPhantom) -> None:
    values = phantom.volume.values
    with pytest.raises(InputError, match="this volume is MR"):
        segment_blood_pool(Volume(values, phantom.volume.affine, "MR"))
    with pytest.raises(InputError, match=r"too thin.*single slice"):
        segment_blood_pool(Volume(values[:, :, 50:51], phantom.volume.affine, "CT"))
    with pytest.raises(InputError, match="hardly any soft tissue"):
        segment_blood_pool(Volume(np.full((40, 40, 40), -1000.0), np.diag([2.0, 2, 2, 1]), "CT"))
    noise = np.random.default_rng(0).normal(50, 20, (40, 40, 40))
    with pytest.raises(InputError, match="no blood with contrast agent"):
        segment_blood_pool(Volume(noise, np.diag([2.0, 2, 2, 1]), "CT"))
    lump = np.where(np.hypot(*np.indices((40, 40, 40))[:2] - 20) < 9, 400.0, -900.0) + noise
    with pytest.raises(InputError, match="no chamber with a thick wall"):
        segment_blood_pool(Volume(lump, np.diag([2.0, 2, 2, 1]), "CT"))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"method": "magic"}, "method must be"),
        ({"smoothing": "mean"}, "smoothing must be"),
        ({"width": -1.0}, "width must be"),
        ({"mask": np.zeros((3, 3, 3))}, "mask has shape"),
        ({"seed": (1, 2)}, "three finite numbers"),
        ({"basal_plane": ((0, 0, 0), (0, 0, 0))}, "not zero"),
    ],
)
def test_bad_arguments_are_refused(phantom: HeartPhantom, wrong: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        segment_blood_pool(phantom.volume, **wrong)


def test_a_plane_beyond_the_apex_leaves_all_and_is_reported(phantom: HeartPhantom) -> None:
    base, axis = plane_of(phantom)
    with pytest.warns(PliantWarning, match="leak"):
        found = segment_blood_pool(phantom.volume, basal_plane=(base - 1.1 * axis, axis))
    assert found.leak


def test_overlap_measures() -> None:
    first, second = np.array([1, 1, 1, 0, 0]), np.array([0, 1, 1, 1, 0])
    assert volume_overlap(first, second) == pytest.approx(2 / 4)
    assert volume_overlap(first, second, measure="dice") == pytest.approx(2 / 3)
    assert np.isnan(volume_overlap([0], [0]))
    with pytest.raises(InputError, match="one shape"):
        volume_overlap([1], [1, 0])
    with pytest.raises(InputError, match="measure must be"):
        volume_overlap([1], [1], measure="jaccard")


@pytest.mark.data
def test_a_real_ct_agrees_with_a_rough_reference_and_does_not_leak(data: Path) -> None:
    folder = data / "heart" / "ct"
    volume = load_volume(folder / "ct_pulm_cropped.nii.gz", modality="CT")
    reference = load_volume(folder / "silver_LV_bloodpool_watershed.nii.gz").values > 0
    found = segment_blood_pool(volume)
    assert not found.leak
    assert dice(found.mask, reference) > 0.92
    other = segment_blood_pool(load_volume(folder / "ct_aorta_cropped.nii.gz", modality="CT"))
    assert not other.leak
    # Two crops of one patient.
    assert other.millilitres == pytest.approx(found.millilitres, rel=0.06)
