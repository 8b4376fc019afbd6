"""Cohorts: tables, equal results however they are computed, resumption, and subjects that fail."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pliant import (
    estimate_gfe,
    gch,
    gch_edges,
    gfe,
    load_mesh,
    nearest,
    principal_curvatures,
    save_arrays,
    save_mesh,
    shapes,
)
from pliant.cortex import ContextSignature, Subject, read_cohort, study_cohort
from pliant.errors import FileFormatError, InputError
from pliant.mesh import Mesh

N = 4


def mean_curvature(mesh: Mesh) -> np.ndarray:
    return principal_curvatures(mesh, n_jobs=1).mean


@pytest.fixture
def table(tmp_path: Path) -> Path:
    lines = ["subject,mesh,group"]
    for i in range(N):
        save_mesh(tmp_path / f"s{i}.ply", shapes.bumpy_sphere(subdivisions=2, rng=i))
        lines.append(f"s{i},s{i}.ply,{'ab'[i % 2]}")
    (tmp_path / "sites.csv").write_text("name,vertex\nx,3\ny,17\nz,40\n")
    (tmp_path / "cohort.csv").write_text("\n".join(lines) + "\n")
    return tmp_path / "cohort.csv"


def study(table: Path, name: str = "out", **options):
    options = {"n_jobs": 1, "landmarks": table.parent / "sites.csv", **options}
    return study_cohort(read_cohort(table), table.parent / name, **options)


def test_histograms_are_those_of_the_library_over_common_edges(table: Path) -> None:
    found = study(table, signature=ContextSignature(count=20, bins=7))
    meshes = [load_mesh(table.parent / f"s{i}.ply") for i in range(N)]
    fields = [gfe(mesh) for mesh in meshes]
    edges = gch_edges(*fields, bins=7)
    np.testing.assert_allclose(found.edges, edges)
    for i, (mesh, field) in enumerate(zip(meshes, fields, strict=True)):
        expected = gch(field, nearest(mesh, [3, 17, 40], count=20), edges=edges)
        np.testing.assert_allclose(found.histograms[i], expected)
    assert found.sites == ("x", "y", "z")
    assert [s.group for s in found.subjects] == ["a", "b", "a", "b"]
    assert found.n_failed == 0


def test_processes_do_not_change_the_result(table: Path) -> None:
    one = study(table, "one")
    two = study(table, "two", n_jobs=2)
    assert one.histograms.tobytes() == two.histograms.tobytes()
    for i in range(N):
        name = f"subjects/s{i}.npz"
        assert (table.parent / "one" / name).read_bytes() == (table.parent / "two" / name).read_bytes()


def test_done_work_is_reused_and_changed_work_is_not(table: Path) -> None:
    study(table)
    files = [table.parent / "out/subjects" / f"s{i}.npz" for i in range(N)]
    times = [path.stat().st_mtime_ns for path in files]
    study(table)
    assert [path.stat().st_mtime_ns for path in files] == times
    files[1].write_bytes(files[1].read_bytes()[:100])  # damaged
    save_mesh(table.parent / "s2.ply", shapes.bumpy_sphere(subdivisions=2, rng=99))  # another surface
    again = study(table)
    changed = [path.stat().st_mtime_ns != t for path, t in zip(files, times, strict=True)]
    assert changed == [False, True, True, False]
    assert again.histograms.tobytes() == study(table, "fresh").histograms.tobytes()
    before = study(table).histograms
    after = study(table, signature=ContextSignature(count=20)).histograms
    assert (
        after.tobytes() == study(table, "fresh20", signature=ContextSignature(count=20)).histograms.tobytes()
    )
    assert not np.array_equal(before, after)


def test_a_bad_subject_ends_with_its_error_and_the_others_go_on(table: Path) -> None:
    (table.parent / "s1.ply").write_bytes(b"not a mesh")
    (table.parent / "s2.ply").unlink()
    (table.parent / "own.csv").write_text("name,vertex\ny,17\n")
    text = (
        table.read_text(encoding="utf-8")
        .replace("group", "group,landmarks")
        .replace("s3,s3.ply,b", "s3,s3.ply,b,own.csv")
    )
    table.write_text(text)
    found = study(table)
    assert found.n_failed == 2
    assert "s1.ply" in found.errors[1]
    assert "s2.ply" in found.errors[2]
    assert np.isnan(found.histograms[1:3]).all()
    assert np.isfinite(found.histograms[0]).all()
    assert np.isfinite(found.histograms[3]).all(axis=1).tolist() == [False, True, False]
    assert found.vertices[3].tolist() == [-1, 17, -1]
    assert np.isnan(found.distances[3]).tolist() == [True, False, True]
    good = study(table, "two", n_jobs=2)
    assert good.errors == found.errors


def test_a_subject_without_landmarks_and_a_cohort_without_subjects(table: Path) -> None:
    with pytest.raises(InputError, match="none of 4 subjects"):
        study(table, landmarks=None)
    with pytest.raises(InputError, match="at least one subject"):
        study_cohort([], table.parent)
    with pytest.raises(InputError, match="cannot name a file"):
        study_cohort([Subject("../x", table)], table.parent)
    with pytest.raises(InputError, match="name of another"):
        study_cohort([Subject("x", table), Subject("X", table)], table.parent)


def test_another_measure(table: Path) -> None:
    found = study(table, measure=mean_curvature)
    assert found.edges[0] != study(table).edges[0]
    assert np.isfinite(found.histograms).all()
    with pytest.raises(InputError, match="one value a vertex"):
        study(table, measure=lambda mesh: [1.0])


def test_maps_and_curvature_by_name(table: Path) -> None:
    people = []
    for subject in read_cohort(table):
        heights = load_mesh(subject.mesh).vertices[:, 2]
        save_arrays(table.parent / f"{subject.name}.shape.gii", {"height": heights})
        maps = {"height": table.parent / f"{subject.name}.shape.gii"}
        people.append(replace(subject, maps=maps if subject.name != "s3" else {}))
    options = {"landmarks": table.parent / "sites.csv", "n_jobs": 1}
    found = study_cohort(people, table.parent / "height", measure="height", **options)
    assert found.n_failed == 1
    assert "no map 'height'; it has none" in found.errors[3]
    heights = load_mesh(people[0].mesh).vertices[:, 2].astype(np.float32).astype(float)
    near = nearest(load_mesh(people[0].mesh), [3, 17, 40], count=50)
    np.testing.assert_allclose(found.histograms[0], gch(heights, near, edges=found.edges))
    save_arrays(people[1].maps["height"], {"height": -heights})
    again = study_cohort(people, table.parent / "height", measure="height", **options)
    assert not np.array_equal(again.histograms[1], found.histograms[1])
    named = study_cohort(people, table.parent / "named", measure="curvature", **options)
    np.testing.assert_array_equal(named.histograms, study(table, "called", measure=mean_curvature).histograms)


def test_a_dask_cluster_gives_the_same_bytes(table: Path) -> None:
    distributed = pytest.importorskip("distributed")
    expected = study(table, "here")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        found = study(table, "there", scheduler=client)
    assert found.histograms.tobytes() == expected.histograms.tobytes()
    name = "subjects/s1.npz"
    assert (table.parent / "here" / name).read_bytes() == (table.parent / "there" / name).read_bytes()


def test_large_meshes_are_estimated_from_samples(table: Path) -> None:
    sampled = ContextSignature(samples=32)
    mesh = load_mesh(table.parent / "s0.ply")
    np.testing.assert_array_equal(sampled.field(mesh), estimate_gfe(mesh, 32, rng=0).values)
    np.testing.assert_array_equal(ContextSignature(samples=500).field(mesh), gfe(mesh))
    assert study(table, signature=sampled).n_failed == 0
    with pytest.raises(InputError, match="at least 32"):
        ContextSignature(samples=8)
    with pytest.raises(InputError, match="percentile must lie"):
        ContextSignature(percentile=20)


def test_tables(tmp_path: Path) -> None:
    path = tmp_path / "cohort.csv"
    for text, problem in (
        ("", "missing mesh, subject"),
        ("subject\ns1\n", "missing mesh"),
        ("subject,mesh\ns1,\n", "row 1 names no mesh"),
        ("subject,mesh\na/b,x.ply\n", "cannot name a file"),
        ("subject,mesh\na,x.ply\na,y.ply\n", "name of another"),
    ):
        path.write_text(text)
        with pytest.raises(FileFormatError, match=problem):
            read_cohort(path)


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("n_jobs", [1, 2])
def test_killed_at_any_moment_and_resumed_it_ends_the_same(table: Path, n_jobs: int) -> None:
    expected = study(table, "whole")
    code = (
        "from pliant.cortex import read_cohort, study_cohort\n"
        "if __name__ == '__main__':\n"
        f"    print('ready', flush=True)\n"
        f"    study_cohort(read_cohort({str(table)!r}), {str(table.parent / 'cut')!r}, n_jobs={n_jobs},\n"
        f"                 landmarks={str(table.parent / 'sites.csv')!r})\n"
    )
    script = table.parent / "run.py"
    script.write_text(code)
    done: list[int] = []
    for wait in np.random.default_rng(n_jobs).uniform(0.0, 2.0, 2):
        with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE) as running:
            assert running.stdout is not None
            running.stdout.readline()
            time.sleep(wait)
            running.send_signal(signal.SIGKILL)
        done.append(len(list((table.parent / "cut/subjects").glob("s?.npz"))))
    assert done == sorted(done)
    found = study(table, "cut")
    assert found.histograms.tobytes() == expected.histograms.tobytes()
    for i in range(N):
        name = f"subjects/s{i}.npz"
        assert (table.parent / "cut" / name).read_bytes() == (table.parent / "whole" / name).read_bytes()
