from __future__ import annotations

import gzip
import hashlib
import zlib

import numpy as np
import pytest

from pliant import InputError
from pliant.cli import main
from pliant.datasets import (
    RemoteFile,
    fetch,
    fetching,
    kids_symmetry,
    load_pose,
    pose_symmetry,
    registry,
    remeshed_pose,
    verify,
)

CONTENT = b"a mesh" * 100


@pytest.fixture
def slam(monkeypatch):
    """One data set whose only file is CONTENT, kept plain and sent compressed."""
    base = next(d for d in registry() if d.name == "cortex/slam")
    part = RemoteFile(
        "mesh.gii", "https://there/mesh.gii.gz", hashlib.sha256(CONTENT).hexdigest(), unpack=True
    )
    line = f"{part.sha256}  mesh.gii\n".encode()
    dataset = type(base)(
        **{**vars(base), "files": 1, "remote": (part,), "sha256": hashlib.sha256(line).hexdigest()}
    )
    monkeypatch.setattr("pliant.datasets.verifying.registry", lambda: (dataset,))
    return dataset


def test_every_remote_file_is_pinned():
    for dataset in registry():
        for part in dataset.remote:
            assert part.url.startswith("https://")
            assert any(len(piece) == 40 for piece in part.url.split("/")), part.url
            assert len(part.sha256) == 64


def test_a_file_is_fetched_once_and_verified(slam, tmp_path, monkeypatch):
    asked = []

    def answer(url):
        asked.append(url)
        return gzip.compress(CONTENT)

    monkeypatch.setattr(fetching, "_download", answer)
    assert fetch("cortex/slam", tmp_path)[0].read_bytes() == CONTENT
    fetch("cortex/slam", tmp_path)
    assert len(asked) == 1
    assert verify(tmp_path)[0].state == "whole"


@pytest.mark.parametrize(
    "sent",
    [gzip.compress(b"other"), gzip.compress(CONTENT)[:-9], CONTENT, zlib.compress(CONTENT)],
    ids=["other", "cut off", "not compressed", "not gzip"],
)
def test_a_file_that_differs_is_refused_and_nothing_kept(slam, tmp_path, monkeypatch, sent):
    monkeypatch.setattr(fetching, "_download", lambda url: sent)
    with pytest.raises(InputError):
        fetch("cortex/slam", tmp_path)
    assert not list((tmp_path / "cortex" / "slam").iterdir())


def test_a_bomb_is_refused(slam, tmp_path, monkeypatch):
    monkeypatch.setattr(fetching, "LIMIT", 10_000)
    monkeypatch.setattr(fetching, "_download", lambda url: gzip.compress(bytes(100_000)))
    with pytest.raises(InputError, match="unpacks to more"):
        fetch("cortex/slam", tmp_path)


def test_verify_tells_absent_incomplete_different(slam, tmp_path):
    assert verify(tmp_path)[0].state == "absent"
    place = tmp_path / "cortex" / "slam"
    place.mkdir(parents=True)
    assert verify(tmp_path)[0].state == "incomplete"
    (place / "mesh.gii").write_bytes(b"x")
    assert verify(tmp_path)[0].state == "different"
    assert main(["data", "verify", "--data", str(tmp_path)]) == 3


def test_all_that_verify_asks_for_can_be_fetched_or_is_made_by_hand():
    """With every file downloadable, their digests alone give the digest of the whole."""
    for dataset in registry():
        if dataset.remote and not dataset.preparation:
            assert len(dataset.remote) == dataset.files, dataset.name
            lines = sorted((part.path, part.sha256) for part in dataset.remote)
            text = "".join(f"{digest}  {path}\n" for path, digest in lines)
            assert hashlib.sha256(text.encode()).hexdigest() == dataset.sha256, dataset.name


def test_verify_names_the_files_that_are_wrong(slam, tmp_path, capsys):
    place = tmp_path / "cortex" / "slam"
    place.mkdir(parents=True)
    (place / "other.gii").write_bytes(b"x")
    assert verify(tmp_path)[0].wrong == ("mesh.gii is missing", "other.gii is no part of it")
    (place / "other.gii").unlink()
    (place / "mesh.gii").write_bytes(b"x")
    assert verify(tmp_path)[0].wrong == ("mesh.gii differs",)
    assert main(["data", "verify", "--data", str(tmp_path)]) == 3
    assert "cortex/slam (mesh.gii differs)" in capsys.readouterr().err


def test_what_is_made_by_hand_is_no_fault_of_what_was_fetched(slam, tmp_path, monkeypatch, capsys):
    more = type(slam)(**{**vars(slam), "files": 2, "sha256": "0" * 64, "preparation": "a mesh by hand"})
    monkeypatch.setattr("pliant.datasets.verifying.registry", lambda: (more,))
    monkeypatch.setattr(fetching, "_download", lambda url: gzip.compress(CONTENT))
    fetch("cortex/slam", tmp_path)
    assert verify(tmp_path)[0].state == "fetched"
    assert main(["data", "verify", "--data", str(tmp_path)]) == 0
    assert "1 of 2 files; the rest is made by hand" in capsys.readouterr().out
    (tmp_path / "cortex" / "slam" / "mesh.gii").write_bytes(b"x")
    assert verify(tmp_path)[0].state == "incomplete"


@pytest.mark.parametrize("url", ["http://there/x", "file:///etc/hostname"])
def test_only_https_is_opened(url):
    with pytest.raises(InputError, match="https"):
        fetching._download(url)


@pytest.mark.parametrize("name", ["../cat0", "cat0/..", "", "cat0.ply"])
def test_names_of_poses_cannot_leave_the_folder(tmp_path, name):
    with pytest.raises(InputError):
        load_pose(name, data=tmp_path)


def test_the_list_needs_no_data(capsys):
    assert main(["data", "list"]) == 0
    out = capsys.readouterr().out
    assert all(dataset.name in out and dataset.terms in out for dataset in registry())


@pytest.mark.data
def test_the_data_are_what_is_known_of_them(data):
    assert {v.dataset.name: v.state for v in verify(data)} == {d.name: "whole" for d in registry()}


@pytest.mark.data
def test_symmetries_are_involutions_up_to_their_error(data):
    mesh = load_pose("wolf0", data=data)
    mirror = pose_symmetry("wolf", data=data)
    assert mirror.shape == (mesh.n_vertices,)
    known = np.flatnonzero(mirror >= 0)
    back = mesh.vertices[mirror[mirror[known]]] - mesh.vertices[known]
    size = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    assert np.median(np.linalg.norm(back, axis=1)) < 0.02 * size
    child = kids_symmetry(data=data)
    assert (child[child] == np.arange(len(child))).mean() > 0.99


@pytest.mark.data
def test_landmarks_of_remeshed_poses_are_their_vertices(data):
    mesh, landmarks, mirror = remeshed_pose("cat0", data=data)
    other, others, _ = remeshed_pose("cat3", data=data)
    assert len(landmarks) == len(others)
    assert landmarks.max() < mesh.n_vertices
    assert others.max() < other.n_vertices
    assert mirror is not None
    assert mirror.shape == landmarks.shape
