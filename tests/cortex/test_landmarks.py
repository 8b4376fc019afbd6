"""Landmarks from vertex numbers, positions, parcels and files."""

from __future__ import annotations

from pathlib import Path

import nibabel
import numpy as np
import pytest

from pliant import Mesh, load_mesh, save_arrays, shapes
from pliant.cortex import Landmarks, landmarks_at, parcel_centres, read_landmarks, snapped_landmarks
from pliant.errors import FileFormatError, InputError


def test_snapping_finds_the_nearest_vertex_of_a_face_and_its_distance() -> None:
    ball = shapes.icosphere(2)
    loose = Mesh(np.vstack([ball.vertices, [[0, 0, 5.0]]]), ball.faces)
    points = np.random.default_rng(0).normal(size=(30, 3)) * 2
    points[0] = [0, 0, 5]
    found = snapped_landmarks(loose, points)
    every = np.linalg.norm(points[:, None] - ball.vertices[None], axis=2)
    np.testing.assert_array_equal(found.vertices, every.argmin(axis=1))
    np.testing.assert_allclose(found.distances, every.min(axis=1))


def test_parcel_centres_are_in_the_middle_and_skip_the_medial_wall() -> None:
    sheet = shapes.grid(9, 27)
    x = sheet.vertices[:, 0] if np.ptp(sheet.vertices[:, 0]) > 10 else sheet.vertices[:, 1]
    labels = np.digitize(x, [8.5, 17.5])
    found = parcel_centres(sheet, labels, names={0: "a", 1: "Medial_wall", 2: "c"})
    assert found.names == ("a", "c")
    for vertex, label in zip(found.vertices, (0, 2), strict=True):
        middle = sheet.vertices[labels == label].mean(axis=0)
        assert np.linalg.norm(sheet.vertices[vertex] - middle) <= 1.5
    assert parcel_centres(sheet, labels, exclude=["0"]).names == ("1", "2")
    assert parcel_centres(sheet, np.where(labels == 0, -1, labels)).names == ("1", "2")


def test_a_parcel_in_pieces_is_centred_in_its_largest() -> None:
    sheet = shapes.grid(5, 30)
    x = sheet.vertices[:, 0] if np.ptp(sheet.vertices[:, 0]) > 10 else sheet.vertices[:, 1]
    labels = np.where((x < 12) | (x > 26), 0, -1)
    vertex = parcel_centres(sheet, labels).vertices[0]
    assert 4 <= x[vertex] <= 7


def test_files(tmp_path: Path) -> None:
    ball = shapes.icosphere(1)
    path = tmp_path / "sites.csv"
    path.write_text("name,x,y,z\ntop,0,0,3\n")
    assert read_landmarks(path, ball).names == ("top",)
    assert read_landmarks(path, ball).distances[0] >= 2
    path.write_text("vertex\n4\n5\n")
    assert read_landmarks(path, ball).names == ("4", "5")
    for text, problem in (
        ("vertex\n4\nfive\n", "five"),
        ("vertex\n4\n400\n", "outside"),
        ("a,b\n1,2\n", "needs a header"),
        ("", "needs a header"),
        ("x,y,z\n1,2,\n", "convert"),
        ("name,vertex\na,1\na,2\n", "share a name"),
        ("vertex\n1.5\n", "whole"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=problem):
            read_landmarks(path, ball)
    path.write_bytes(b"vertex\n\x80\x81\n")
    with pytest.raises(FileFormatError, match="not a table that can be read"):
        read_landmarks(path, ball)
    with pytest.raises(FileFormatError, match="read from"):
        read_landmarks(tmp_path / "sites.txt", ball)
    (tmp_path / "bad.annot").write_bytes(b"nothing of the kind")
    with pytest.raises(FileFormatError, match="not an annotation"):
        read_landmarks(tmp_path / "bad.annot", ball)
    with pytest.raises(FileFormatError, match="no such file"):
        read_landmarks(tmp_path / "none.annot", ball)


def test_refusals() -> None:
    ball = shapes.icosphere(1)
    with pytest.raises(InputError, match="outside"):
        landmarks_at(ball, [1, 42])
    with pytest.raises(InputError, match="names for"):
        landmarks_at(ball, [1, 2], names=["a"])
    with pytest.raises(InputError, match="not finite"):
        snapped_landmarks(ball, [[0, 0, np.nan]])
    with pytest.raises(InputError, match="shape"):
        snapped_landmarks(ball, [0, 0, 1])
    with pytest.raises(InputError, match="no parcel"):
        parcel_centres(ball, np.full(ball.n_vertices, -1))
    with pytest.raises(InputError, match="one number a vertex"):
        parcel_centres(ball, [0, 1])


@pytest.mark.data
def test_parcels_of_a_native_hemisphere(data: Path) -> None:
    mesh = load_mesh(data / "cortex/subject1/lh.white")
    found = read_landmarks(data / "cortex/subject1/lh.aparc.annot.gz", mesh)
    assert isinstance(found, Landmarks)
    assert "precentral" in found.names
    assert not {"unknown", "corpuscallosum"} & set(found.names)
    assert 33 <= len(found.names) <= 36
    front = mesh.vertices[found.vertices[found.names.index("frontalpole")], 1]
    back = mesh.vertices[found.vertices[found.names.index("lateraloccipital")], 1]
    assert front > back + 80


def test_gifti_parcellation_gives_what_its_annotation_does(tmp_path: Path) -> None:
    sheet = shapes.grid(6, 9)
    labels = np.where(sheet.vertices[:, 0] < 3.5, 5, 9).astype(np.int32)
    labels[0] = 77  # not in the table
    table = nibabel.gifti.GiftiLabelTable()
    for key, name in ((5, "front"), (9, "Medial_Wall")):
        entry = nibabel.gifti.GiftiLabel(key)
        entry.label = name
        table.labels.append(entry)
    array = nibabel.gifti.GiftiDataArray(labels, intent="NIFTI_INTENT_LABEL")
    path = tmp_path / "lh.parcels.label.gii"
    nibabel.save(nibabel.gifti.GiftiImage(labeltable=table, darrays=[array]), path)
    found = read_landmarks(path, sheet)
    assert found.names == ("front",)
    expected = parcel_centres(sheet, np.where(labels == 5, 5, -1))
    assert found.vertices.tolist() == expected.vertices.tolist()
    with pytest.raises(InputError, match="one number a vertex"):
        read_landmarks(path, shapes.grid(3, 3))
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(FileFormatError, match="not a GIFTI parcellation"):
        read_landmarks(path, sheet)
    depth = tmp_path / "depth.gii"
    save_arrays(depth, {"depth": np.ones(3)})
    with pytest.raises(FileFormatError, match="holds no parcellation"):
        read_landmarks(depth, sheet)
