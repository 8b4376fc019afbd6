"""The synthetic cohort: what it says it is, and that the ranking finds its truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pliant import load_mesh
from pliant.cortex import (
    ContextSignature,
    landmarks_at,
    mean_absolute_deviation,
    rank_agreement,
    read_cohort,
    read_landmarks,
    synthetic_cohort,
)
from pliant.errors import InputError


def test_depths_have_the_amplitude_and_the_band_they_are_said_to_have() -> None:
    cohort = synthetic_cohort(25, n_sites=20, amplitude=2.0, rng=1)
    base, normals = cohort.base, cohort.base.vertex_normals
    depths = np.stack(
        [((cohort.subject(i).vertices - base.vertices) * normals).sum(axis=1) for i in range(len(cohort))]
    )
    spread = depths.std(axis=0)
    assert np.corrcoef(spread, cohort.amplitude)[0, 1] > 0.9
    assert (spread / cohort.amplitude).mean() == pytest.approx(1, abs=0.08)
    assert cohort.amplitude.max() == pytest.approx(2.0)
    assert cohort.amplitude.min() == pytest.approx(0.05)
    # Waves of 15 mm and more: across an edge of 2 mm depth changes by less than a full amplitude.
    ends = base.edges
    steps = np.abs(np.diff(depths[:, ends], axis=2)[..., 0]) / cohort.amplitude[ends].mean(axis=1)
    slope = np.sqrt((steps**2).mean()) / base.edge_lengths.mean()
    assert 2 * np.pi / 30 / 2 < slope < 2 * np.pi / 15


def test_same_seed_same_cohort_and_files(tmp_path: Path) -> None:
    cohort = synthetic_cohort(2, n_sites=8, rng=4)
    again = synthetic_cohort(2, n_sites=8, rng=4)
    assert cohort.subject(1).vertices.tobytes() == again.subject(1).vertices.tobytes()
    assert not np.array_equal(cohort.subject(0).vertices, cohort.subject(1).vertices)
    subjects = read_cohort(cohort.save(tmp_path))
    mesh = load_mesh(subjects[1].mesh)
    np.testing.assert_allclose(mesh.vertices, cohort.subject(1).vertices, rtol=1e-5, atol=1e-4)
    sites = read_landmarks(tmp_path / "landmarks.csv", mesh)
    assert sites.names == landmarks_at(mesh, cohort.sites).names
    assert len(np.unique(cohort.sites)) == 8
    assert (tmp_path / "truth.csv").read_text().count("\n") == 9


def test_refusals() -> None:
    for options in ({"n_subjects": 0}, {"n_sites": 1}, {"amplitude": 0}, {"wavelengths": (30, 15)}):
        with pytest.raises(InputError, match="needs a subject"):
            synthetic_cohort(**options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_ranking_finds_the_truth() -> None:
    cohort = synthetic_cohort(8, n_sites=100, rng=0)
    setting = replace(ContextSignature(radius=8.0), scale="log")
    meshes = [cohort.subject(i) for i in range(len(cohort))]
    fields = [setting.field(mesh) for mesh in meshes]
    setting = setting.with_edges_of(*fields)
    found = [setting.histograms(m, f, cohort.sites) for m, f in zip(meshes, fields, strict=True)]
    agreement = rank_agreement(mean_absolute_deviation(found), cohort.truth, rng=0, resamples=50)
    assert agreement.spearman > 0.55
    assert agreement.p < 0.05
