"""The synthetic cohort: what it says it is, and that the ranking finds its truth."""

from __future__ import annotations

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


def test_sliding_and_shared_folds_are_as_large_as_they_are_said_to_be() -> None:
    cohort = synthetic_cohort(30, n_sites=20, amplitude=2.0, sliding=0.5, shared=3.0, rng=2)
    normals = cohort.base.vertex_normals
    moved = np.stack([cohort.subject(i).vertices for i in range(len(cohort))]) - cohort.base.vertices
    depth = (moved * normals).sum(axis=2)
    across = moved - depth[..., None] * normals
    # Two directions, each of half the depth's amplitude.
    size = np.sqrt((across**2).sum(axis=2).mean(axis=0)) / cohort.amplitude
    assert size.mean() == pytest.approx(0.5 * np.sqrt(2), rel=0.06)
    assert np.corrcoef(depth.mean(axis=0), cohort.common)[0, 1] > 0.97
    assert cohort.common.std() == pytest.approx(3.0, rel=0.2)
    assert (depth.std(axis=0) / cohort.amplitude).mean() == pytest.approx(1, abs=0.08)


def test_amplitudes_are_distributed_as_they_are_said_to_be() -> None:
    def shares(spread: str) -> list[float]:
        amplitude = synthetic_cohort(1, n_sites=2, spread=spread, rng=3).amplitude  # type: ignore[arg-type]
        assert amplitude.max() / amplitude.min() == pytest.approx(40)
        values = amplitude if spread == "even" else np.log(amplitude)
        low, lower, upper, high = np.percentile(values, [0, 25, 75, 100])
        return [(lower - low) / (high - low), (upper - low) / (high - low)]

    assert shares("even") == pytest.approx([0.25, 0.75], abs=0.01)
    assert shares("logarithmic") == pytest.approx([0.25, 0.75], abs=0.01)
    # Quartiles of a logistic distribution, cut at 1 and 99 %.
    inner = 0.5 * np.log(3) / np.log(99)
    assert shares("logistic") == pytest.approx([0.5 - inner, 0.5 + inner], abs=0.01)


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
    assert (tmp_path / "truth.csv").read_text(encoding="utf-8").count("\n") == 9


def test_refusals() -> None:
    for options in ({"n_subjects": 0}, {"n_sites": 1}, {"amplitude": 0}, {"wavelengths": (30, 15)}):
        with pytest.raises(InputError, match="needs a subject"):
            synthetic_cohort(**options)  # type: ignore[arg-type]
    for options in ({"spread": "wide"}, {"shared": -1}, {"sliding": float("nan")}):
        with pytest.raises(InputError, match="spread must be one of"):
            synthetic_cohort(**options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_ranking_finds_the_truth() -> None:
    cohort = synthetic_cohort(8, n_sites=100, rng=0)
    setting = ContextSignature(radius=8.0, scale="log", bins=30, percentile=99.9)
    meshes = [cohort.subject(i) for i in range(len(cohort))]
    fields = [setting.field(mesh) for mesh in meshes]
    setting = setting.with_edges_of(*fields)
    found = [setting.histograms(m, f, cohort.sites) for m, f in zip(meshes, fields, strict=True)]
    moved = mean_absolute_deviation(found, edges=setting.edges)
    agreement = rank_agreement(moved, cohort.truth, rng=0, resamples=50)
    assert agreement.spearman > 0.65
    assert agreement.p < 0.05
    # Sums over bins saturate, and say less.
    assert agreement.spearman > rank_agreement(mean_absolute_deviation(found), cohort.truth, rng=0).spearman
