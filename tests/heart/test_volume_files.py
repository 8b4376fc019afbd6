"""Volumes keep their place in the body through every format, and broken input is named."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pliant.errors import FileFormatError, InputError
from pliant.heart import Volume, load_volume, save_mask

sitk = pytest.importorskip("SimpleITK")


def tilted() -> np.ndarray:
    turn = np.linalg.qr(np.array([[1.0, 0.2, -0.1], [-0.3, 1.0, 0.2], [0.1, -0.1, 1.0]]))[0]
    affine = np.eye(4)
    affine[:3, :3] = turn * [0.5, 0.7, 1.5]
    affine[:3, 3] = [-31.0, 12.5, 600.25]
    return affine


def write_series(
    folder: Path,
    values: np.ndarray,
    *,
    modality: str = "CT",
    uid: str = "1.2.3",
    step: float = 2.0,
    first: int = 0,
) -> list[Path]:
    folder.mkdir(exist_ok=True)
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    paths = []
    for k in range(values.shape[2]):
        image = sitk.GetImageFromArray(np.ascontiguousarray(values[:, :, k].T.astype(np.int16))[None])
        image.SetSpacing([0.5, 0.75, step])
        tags = {
            "0008|0060": modality,
            "0020|000e": uid,
            "0020|000d": "1.2",
            "0008|0018": f"{uid}.{first + k + 1}",
            "0020|0032": f"-10\\-20\\{30 + step * k}",
            "0020|0037": "1\\0\\0\\0\\1\\0",
            "0020|0013": str(k),
            "0028|1052": "-1024",
            "0028|1053": "1",
        }
        for key, text in tags.items():
            image.SetMetaData(key, text)
        # Names run against the slices' order in space: the position decides.
        path = folder / f"{uid}-{values.shape[2] - k:03d}.dcm"
        writer.SetFileName(str(path))
        writer.Execute(image)
        paths.append(path)
    return paths


@pytest.fixture
def numbers() -> np.ndarray:
    return np.random.default_rng(0).integers(-500, 500, (7, 6, 5)).astype(np.float32)


@pytest.mark.parametrize("ending", ["nii", "nii.gz", "nrrd", "mha"])
def test_a_mask_comes_back_in_its_place(tmp_path: Path, ending: str) -> None:
    volume = Volume(np.arange(60.0).reshape(3, 4, 5), tilted(), "CT", "HU")
    save_mask(volume.values > 30, volume, tmp_path / f"mask.{ending}")
    read = load_volume(tmp_path / f"mask.{ending}")
    assert np.array_equal(read.values, volume.values > 30)
    assert np.allclose(read.affine, volume.affine, atol=1e-4)
    assert [p.name for p in tmp_path.iterdir()] == [f"mask.{ending}"]


def test_formats_agree_on_where_a_voxel_is(tmp_path: Path, numbers: np.ndarray) -> None:
    image = sitk.GetImageFromArray(numbers.transpose(2, 1, 0))
    image.SetSpacing([0.5, 0.75, 2.0])
    image.SetOrigin([-10, -20, 30])
    points = []
    for ending in ("nii.gz", "nrrd", "mhd"):
        sitk.WriteImage(image, str(tmp_path / f"v.{ending}"))
        read = load_volume(tmp_path / f"v.{ending}", modality="CT")
        assert read.units == "HU"
        assert np.allclose(read.values, numbers)
        points.append(read.points([3, 2, 1]))
    write_series(tmp_path / "series", numbers)
    points.append(load_volume(tmp_path / "series").points([3, 2, 1]))
    # LPS (-8.5, -18.5, 32) is RAS (8.5, 18.5, 32).
    assert np.allclose(points, [8.5, 18.5, 32.0], atol=1e-4)


def test_a_series_is_rescaled_and_put_in_order(tmp_path: Path, numbers: np.ndarray) -> None:
    write_series(tmp_path / "s", numbers)
    volume = load_volume(tmp_path / "s", modality="CT")
    assert (volume.modality, volume.units) == ("CT", "HU")
    assert volume.spacing == pytest.approx([0.5, 0.75, 2.0])
    assert np.array_equal(volume.values, numbers)


def test_missing_and_unequal_slices_are_named(tmp_path: Path, numbers: np.ndarray) -> None:
    write_series(tmp_path / "gap", numbers)[2].unlink()
    with pytest.raises(InputError, match=r"2 mm apart but 4 mm after slice 1 \(1 such gaps; about 1 missing"):
        load_volume(tmp_path / "gap")
    write_series(tmp_path / "uneven", numbers)
    write_series(tmp_path / "uneven", numbers[:, :, :1] + 1, step=2.0, first=20)
    paths = write_series(tmp_path / "uneven", numbers)
    moved = sitk.ReadImage(str(paths[4]))
    for key in ("0008|0060", "0020|000e", "0020|000d", "0020|0037", "0028|1052", "0028|1053"):
        moved.SetMetaData(key, moved.GetMetaData(key))
    moved.SetMetaData("0020|0032", "-10\\-20\\38.6")
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    writer.SetFileName(str(paths[4]))
    writer.Execute(moved)
    with pytest.raises(InputError, match="unequally spaced"):
        load_volume(tmp_path / "uneven")


def test_a_slice_twice_is_named(tmp_path: Path, numbers: np.ndarray) -> None:
    paths = write_series(tmp_path / "s", numbers)
    (tmp_path / "s" / "copy.dcm").write_bytes(paths[3].read_bytes())
    with pytest.raises(InputError, match="at the place of another"):
        load_volume(tmp_path / "s")


def test_mixed_series_are_refused_and_one_can_be_named(tmp_path: Path, numbers: np.ndarray) -> None:
    write_series(tmp_path / "s", numbers, uid="1.2.3")
    write_series(tmp_path / "s", numbers + 7, uid="1.2.4")
    with pytest.raises(InputError, match="2 series mixed"):
        load_volume(tmp_path / "s")
    ids = sitk.ImageSeriesReader.GetGDCMSeriesIDs(str(tmp_path / "s"))
    chosen = load_volume(tmp_path / "s", series=ids[1])
    assert np.array_equal(chosen.values, numbers + 7)
    with pytest.raises(InputError, match="no series 9"):
        load_volume(tmp_path / "s", series="9")


def test_wrong_modality_is_refused(tmp_path: Path, numbers: np.ndarray) -> None:
    write_series(tmp_path / "s", numbers, modality="MR")
    with pytest.raises(InputError, match="series is MR; CT is needed"):
        load_volume(tmp_path / "s", modality="CT")
    assert load_volume(tmp_path / "s").modality == "MR"


@pytest.mark.parametrize("kept", [0.3, 0.97])
def test_a_truncated_slice_is_refused(tmp_path: Path, numbers: np.ndarray, kept: float) -> None:
    path = write_series(tmp_path / "s", numbers)[1]
    path.write_bytes(path.read_bytes()[: int(kept * path.stat().st_size)])
    with pytest.raises((FileFormatError, InputError), match=r"cut short|missing"):
        load_volume(tmp_path / "s")


def test_an_empty_folder_and_strange_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(FileFormatError, match="no readable DICOM"):
        load_volume(tmp_path / "empty")
    (tmp_path / "notes.txt").write_text("no volume")
    with pytest.raises(FileFormatError, match="not a folder of DICOM"):
        load_volume(tmp_path / "notes.txt")
    with pytest.raises(InputError, match="does not exist"):
        load_volume(tmp_path / "nothing.nii")


@pytest.mark.parametrize("ending", ["nii.gz", "nii", "nrrd", "mha"])
def test_a_file_cut_short_is_refused(tmp_path: Path, ending: str) -> None:
    volume = Volume(np.random.default_rng(0).random((20, 20, 20)), np.eye(4))
    path = tmp_path / f"v.{ending}"
    save_mask(volume.values > 0.5, volume, path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(FileFormatError, match="cut short"):
        load_volume(path)


def test_negative_and_missing_spacing_is_refused(tmp_path: Path) -> None:
    header = (
        "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementSpacing = 1 -1 1\nElementType = MET_UCHAR\n"
    )
    (tmp_path / "v.mha").write_bytes(f"{header}ElementDataFile = LOCAL\n".encode() + bytes(8))
    with pytest.raises(InputError, match="spacing must be positive"):
        load_volume(tmp_path / "v.mha")
    volume = Volume(np.zeros((3, 3, 3)), np.eye(4))
    for wrong in (-1.0, 0.0, (1.0, np.nan, 1.0)):
        with pytest.raises(InputError, match="spacing must be positive"):
            volume.resampled(wrong)
    with pytest.raises(InputError, match="singular"):
        Volume(np.zeros((3, 3, 3)), np.diag([1.0, 0.0, 1.0, 1.0]))


def test_a_negative_spacing_of_nifti_is_refused_where_it_counts(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(np.zeros((3, 3, 3), dtype=np.float32), np.diag([2.0, 2.0, 2.0, 1.0]))
    content = bytearray(image.to_bytes())
    content[80:84] = np.float32(-2).tobytes()
    (tmp_path / "matrix.nii").write_bytes(content)
    assert load_volume(tmp_path / "matrix.nii").spacing.tolist() == [2, 2, 2]
    content[252:256] = bytes(4)
    for name, written in (("v.nii", bytes(content)), ("v.nii.gz", gzip.compress(bytes(content)))):
        (tmp_path / name).write_bytes(written)
        with pytest.raises(InputError, match=r"positive.*-2"):
            load_volume(tmp_path / name)
    assert capfd.readouterr().err == ""


def test_four_dimensions_are_refused(tmp_path: Path) -> None:
    nibabel = pytest.importorskip("nibabel")
    nibabel.save(nibabel.Nifti1Image(np.zeros((3, 3, 3, 2), dtype=np.float32), np.eye(4)), tmp_path / "v.nii")
    with pytest.raises(InputError, match="4 dimensions"):
        load_volume(tmp_path / "v.nii")


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (np.zeros((3, 3)), "shape"),
        (np.zeros((0, 3, 3)), "at least one voxel"),
        (np.full((2, 2, 2), np.nan), "8 of 8 voxels are not finite"),
        ([[["a"]]], "array of numbers"),
    ],
)
def test_bad_values_are_refused(values: object, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Volume(values, np.eye(4))


def test_masks_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    volume = Volume(np.zeros((3, 3, 3)), np.eye(4))
    with pytest.raises(InputError, match="volume's shape"):
        save_mask(np.zeros((2, 2, 2)), volume, tmp_path / "m.nii.gz")
    with pytest.raises(InputError, match="must end in"):
        save_mask(np.zeros((3, 3, 3)), volume, tmp_path / "m.png")
    with pytest.raises(InputError, match="does not exist"):
        save_mask(np.zeros((3, 3, 3)), volume, tmp_path / "no" / "m.nii.gz")


@given(st.integers(0, 10_000))
def test_points_and_indices_undo_each_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    affine = np.eye(4)
    affine[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.3, 5, 3)
    affine[:3, 3] = rng.normal(0, 300, 3)
    volume = Volume(np.zeros((2, 3, 4)), affine)
    at = rng.uniform(-5, 5, (6, 3))
    assert np.allclose(volume.indices(volume.points(at)), at, atol=1e-8)
    assert volume.voxel_volume == pytest.approx(volume.spacing.prod())


def test_resampling_keeps_a_linear_field(tmp_path: Path) -> None:
    affine = tilted()
    i, j, k = np.indices((20, 20, 12))
    volume = Volume(3.0 * i + 2.0 * j - k, affine, "CT", "HU")
    finer = volume.resampled(0.4)
    inside = tuple(slice(3, -3) for _ in range(3))
    at = volume.indices(finer.points(np.moveaxis(np.indices(finer.shape), 0, -1)))
    assert np.allclose(finer.values[inside], (at @ [3.0, 2.0, -1.0])[inside], atol=1e-3)
    coarser = volume.resampled((1.0, 1.4, 3.0))
    assert coarser.spacing == pytest.approx([1.0, 1.4, 3.0])
    assert coarser.modality == "CT"


@pytest.mark.data
def test_a_real_ct_lies_where_its_header_says(data: Path, tmp_path: Path) -> None:
    volume = load_volume(data / "heart" / "ct" / "ct_pulm_cropped.nii.gz", modality="CT")
    assert volume.shape == (122, 102, 112)
    assert volume.spacing == pytest.approx([1.5] * 3)
    # The ventricle's blood, in RAS mm: left of the right heart's brighter blood.
    blood = load_volume(data / "heart" / "ct" / "silver_LV_bloodpool_watershed.nii.gz")
    assert np.allclose(blood.affine, volume.affine)
    left, right = (
        volume.points(np.argwhere(m)).mean(axis=0) for m in (blood.values > 0, volume.values > 750)
    )
    assert left[0] < right[0] - 30
    cut = (data / "heart" / "ct" / "silver_LV_bloodpool_watershed.nii.gz").read_bytes()
    (tmp_path / "cut.nii.gz").write_bytes(cut[: len(cut) // 2])
    with pytest.raises(FileFormatError):
        load_volume(tmp_path / "cut.nii.gz")
    assert gzip.decompress(cut)[:4] == b"\x5c\x01\x00\x00"
