"""Who is in a cohort: tables, FreeSurfer and BIDS folders, per-vertex maps."""

from __future__ import annotations

import gzip
from pathlib import Path

import nibabel
import numpy as np
import pytest

from pliant import save_arrays
from pliant.cortex import read_cohort, read_map
from pliant.errors import FileFormatError, InputError


def touch(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch()
    return path


def test_freesurfer_folder(tmp_path: Path) -> None:
    for name in ("b", "a", "fsaverage", "fsaverage5"):
        touch(tmp_path / name / "surf" / "lh.white")
        touch(tmp_path / name / "surf" / "rh.white")
    touch(tmp_path / "a" / "surf" / "rh.sulc")
    touch(tmp_path / "notes.txt")
    (tmp_path / "participants.tsv").write_text("participant_id\tgroup\na\tpatient\nb\tn/a\n")
    found = read_cohort(tmp_path, hemisphere="right", annotation="aparc")
    assert [s.name for s in found] == ["a", "b"]
    assert found[0].mesh == tmp_path / "a/surf/rh.white"
    assert found[0].landmarks == tmp_path / "a/label/rh.aparc.annot"
    assert found[0].maps == {"sulc": tmp_path / "a/surf/rh.sulc"}
    assert [s.group for s in found] == ["patient", ""]
    assert read_cohort(tmp_path)[0].landmarks is None


def test_bids_folder_with_sessions(tmp_path: Path) -> None:
    native = touch(tmp_path / "sub-01/anat/sub-01_hemi-L_white.surf.gii")
    touch(tmp_path / "sub-01/anat/sub-01_hemi-R_white.surf.gii")
    touch(tmp_path / "sub-01/anat/sub-01_space-fsLR_den-32k_hemi-L_white.surf.gii")
    touch(tmp_path / "sub-01/anat/sub-01_hemi-L_pial.surf.gii")
    depth = touch(tmp_path / "sub-01/anat/sub-01_hemi-L_sulc.shape.gii")
    touch(tmp_path / "sub-02/ses-1/anat/sub-02_ses-1_hemi-L_white.surf.gii")
    found = read_cohort(tmp_path)
    assert [s.name for s in found] == ["sub-01", "sub-02_ses-1"]
    assert found[0].mesh == native
    assert found[0].maps == {"sulc": depth}
    touch(tmp_path / "sub-01/anat/sub-01_run-2_hemi-L_white.surf.gii")
    with pytest.raises(FileFormatError, match="1 subjects have several white surfaces, first sub-01"):
        read_cohort(tmp_path)
    with pytest.raises(FileFormatError, match="holds neither NAME/surf"):
        read_cohort(tmp_path, surface="midthickness")


def test_maps_of_a_table(tmp_path: Path) -> None:
    (tmp_path / "cohort.csv").write_text("subject,mesh,map_depth,age\na,a.ply,a.sulc,3\nb,b.ply,,4\n")
    first, second = read_cohort(tmp_path / "cohort.csv")
    assert first.maps == {"depth": tmp_path / "a.sulc"}
    assert second.maps == {}


def test_maps_are_read_as_nibabel_writes_them(tmp_path: Path) -> None:
    values = np.linspace(-1, 2, 7).astype(np.float32)
    nibabel.freesurfer.write_morph_data(tmp_path / "lh.sulc", values)
    np.testing.assert_array_equal(read_map(tmp_path / "lh.sulc", 7), values)
    packed = tmp_path / "lh.sulc.gz"
    packed.write_bytes(gzip.compress((tmp_path / "lh.sulc").read_bytes()))
    np.testing.assert_array_equal(read_map(packed, 7), values)
    save_arrays(tmp_path / "d.npz", {"d": values})
    np.testing.assert_array_equal(read_map(tmp_path / "d.npz", 7), values)
    with pytest.raises(InputError, match="one value a vertex"):
        read_map(tmp_path / "lh.sulc", 8)
    (tmp_path / "short").write_bytes((tmp_path / "lh.sulc").read_bytes()[:-1])
    (tmp_path / "bad.gz").write_bytes(b"nothing")
    for name in ("short", "bad.gz"):
        with pytest.raises(FileFormatError, match="cut short"):
            read_map(tmp_path / name, 7)


@pytest.mark.parametrize("content", [b"\xff\xfe\x00\x01subject,mesh", b"subject,mesh\n\x80\x81,a.ply\n"])
def test_a_binary_file_is_no_table(tmp_path: Path, content: bytes) -> None:
    table = tmp_path / "cohort.csv"
    table.write_bytes(content)
    with pytest.raises(FileFormatError, match="not a table that can be read"):
        read_cohort(table)
    (tmp_path / "people" / "a" / "surf").mkdir(parents=True)
    touch(tmp_path / "people/a/surf/lh.white")
    (tmp_path / "people/participants.tsv").write_bytes(content)
    with pytest.raises(FileFormatError, match=r"participants\.tsv"):
        read_cohort(tmp_path / "people")
