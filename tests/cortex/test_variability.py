"""Statistics over a cohort: against definitions, exact cases, and simulations with a known truth."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from pliant.cortex import (
    compare_groups,
    false_discovery_rates,
    mean_absolute_deviation,
    rank_agreement,
    variability,
)
from pliant.errors import InputError


def cohort(seed: int, subjects: int = 31, sites: int = 60, low: float = 0.2) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    spread = rng.permutation(np.linspace(low, 1, sites))
    values = rng.normal(size=(subjects, sites, 5)) * spread[:, None] + rng.normal(size=(sites, 5))
    return values, spread


def test_mad_against_its_definition_with_missing_sites() -> None:
    values, _ = cohort(0, subjects=8, sites=6)
    values[2, 1] = np.nan
    values[1:7, 4] = np.nan  # two subjects are left
    found = mean_absolute_deviation(values)
    for site in (0, 1, 2, 3, 5):
        rows = values[~np.isnan(values[:, site, 0]), site]
        expected = np.mean([np.abs(row - rows.mean(axis=0)).sum() for row in rows])
        assert found[site] == pytest.approx(expected)
    assert np.isnan(found[4])


@given(seed=st.integers(0, 1000), scale=st.floats(0.1, 10))
def test_mad_laws(seed: int, scale: float) -> None:
    values, _ = cohort(seed, subjects=7, sites=5)
    rng = np.random.default_rng(seed)
    base = mean_absolute_deviation(values)
    np.testing.assert_allclose(mean_absolute_deviation(values[rng.permutation(7)]), base)
    np.testing.assert_allclose(
        mean_absolute_deviation(values * scale + rng.normal(size=(5, 5))), base * scale
    )
    np.testing.assert_allclose(mean_absolute_deviation(np.concatenate([values, values])), base)
    assert (mean_absolute_deviation(np.repeat(values[:1], 4, axis=0)) < 1e-15).all()


def test_known_spread_is_ranked_and_extremes_are_named() -> None:
    values, spread = cohort(1)
    found = variability(values, rng=0, resamples=200)
    assert stats.spearmanr(found.mad, spread).statistic > 0.95
    assert found.rank_stability > 0.85
    assert len(found.regular) == len(found.variable) == 3
    assert found.mad[found.regular[0]] == found.mad.min()
    assert found.mad[found.variable[0]] == found.mad.max()
    assert found.regular_frequency.sum() == pytest.approx(3)
    assert found.regular_frequency[found.regular].mean() > 0.6
    assert (found.p_regular[found.regular] < 0.01).all()
    assert (found.p_variable[found.variable] < 0.01).all()
    assert (found.low <= found.mad * 1.05).all()
    assert (found.high >= found.mad * 0.95).all()


def test_same_seed_same_bytes() -> None:
    values, _ = cohort(2, subjects=9, sites=8)
    a, b = (variability(values, rng=5, resamples=50) for _ in range(2))
    assert a.low.tobytes() == b.low.tobytes()
    assert a.p_regular.tobytes() == b.p_regular.tobytes()
    assert a.rank_stability == b.rank_stability


def test_bootstrap_interval_covers_the_truth() -> None:
    # E |x - mean| of n normal numbers is sqrt(2 / pi (n - 1) / n): the truth for one bin.
    n, truth = 25, np.sqrt(2 / np.pi * 24 / 25)
    values = np.random.default_rng(3).normal(size=(n, 400, 1))
    found = variability(values, rng=0, resamples=300)
    covered = ((found.low <= truth) & (truth <= found.high)).mean()
    assert 0.88 < covered < 0.98


def test_permutation_p_values_are_uniform_when_sites_vary_alike() -> None:
    values = np.random.default_rng(4).normal(size=(20, 400, 3))
    found = variability(values, rng=0, resamples=200)
    assert abs((found.p_regular < 0.1).mean() - 0.1) < 0.05
    assert abs((found.p_variable < 0.1).mean() - 0.1) < 0.05
    assert abs(found.rank_stability) < 0.15


def test_missing_sites_stay_missing() -> None:
    values, _ = cohort(5, subjects=8, sites=10)
    values[1:, 3] = np.nan
    found = variability(values, rng=0, resamples=50)
    for name in ("mad", "low", "high", "p_regular", "p_variable"):
        assert np.flatnonzero(np.isnan(getattr(found, name))).tolist() == [3], name
    assert found.n_subjects.tolist() == [8, 8, 8, 1, 8, 8, 8, 8, 8, 8]
    assert 3 not in found.regular
    assert found.variable_frequency[3] == 0


def test_group_difference_is_found_where_it_is() -> None:
    values = np.random.default_rng(6).normal(size=(24, 40, 5))
    labels = np.array(["patient"] * 12 + ["control"] * 12)
    values[:12, 7] += 1.5
    found = compare_groups(values, labels, permutations=500, rng=0)
    assert found.names == ("control", "patient")
    # At a rate of 5 % one more of forty may be named.
    assert found.q[7] < 0.05
    assert np.argmax(found.distance) == 7
    assert (found.q < 0.05).sum() <= 2
    difference = values[:12].mean(axis=0) - values[12:].mean(axis=0)
    np.testing.assert_allclose(found.distance, np.linalg.norm(difference, axis=1))
    np.testing.assert_allclose(compare_groups(values, labels[::-1], permutations=500, rng=0).p, found.p)


def test_group_p_values_are_uniform_without_a_difference() -> None:
    values = np.random.default_rng(7).normal(size=(16, 500, 3))
    found = compare_groups(values, np.arange(16) % 2, permutations=400, rng=0)
    assert abs((found.p < 0.2).mean() - 0.2) < 0.06
    assert found.p.min() >= 1 / 401


def test_group_comparison_with_missing_sites_and_wrong_labels() -> None:
    values, _ = cohort(8, subjects=6, sites=4)
    values[1:3, 0] = np.nan
    found = compare_groups(values, [0, 0, 0, 1, 1, 1], permutations=20, rng=0)
    assert np.isnan(found.distance[0])
    assert np.isnan(found.q[0])
    assert np.isfinite(found.q[1:]).all()
    for labels in ([0] * 6, [0, 1, 2, 0, 1, 2], [0, 1, 1]):
        with pytest.raises(InputError, match="two groups"):
            compare_groups(values, labels)
    with pytest.raises(InputError, match="two subjects"):
        compare_groups(values, [0, 1, 1, 1, 1, 1])


def test_false_discovery_rates_against_the_rule() -> None:
    p = np.random.default_rng(9).random(30) ** 2
    found = false_discovery_rates(np.append(p, np.nan))
    ranked = np.sort(p)
    expected = [min(ranked[k] * 30 / (k + 1) for k in range(i, 30)) for i in range(30)]
    np.testing.assert_allclose(np.sort(found[:30]), expected)
    assert np.isnan(found[30])


def test_rank_agreement_against_scipy() -> None:
    rng = np.random.default_rng(10)
    a = rng.integers(0, 20, 80).astype(float)
    b = a + rng.normal(size=80) * 4
    b[3] = np.nan
    found = rank_agreement(a, b, rng=0, resamples=200)
    keep = np.isfinite(b)
    assert found.spearman == pytest.approx(stats.spearmanr(a[keep], b[keep]).statistic)
    assert found.low < found.spearman < found.high
    assert found.p < 0.01
    assert found.n_sites == 79
    assert rank_agreement(a, -a, rng=0, resamples=20).top == 0
    assert rank_agreement(a, rng.random(80), rng=0, resamples=200).p > 0.01
    with pytest.raises(InputError, match="only 3 sites"):
        rank_agreement([1, 2, 3], [1, 2, 3])
    with pytest.raises(InputError, match="one value a site"):
        rank_agreement([1, 2, 3], [1, 2])


def test_refusals() -> None:
    values, _ = cohort(11, subjects=5, sites=3)
    with pytest.raises(InputError, match="shape"):
        variability(values[0])
    with pytest.raises(InputError, match="3 of them or more"):
        variability(values[:2])
    values[0, 0, 0] = np.nan
    with pytest.raises(InputError, match="1 histograms are not finite in part"):
        mean_absolute_deviation(values)
    with pytest.raises(InputError, match="percentile"):
        variability(np.ones((4, 3, 2)), percentile=80)


def test_cumulative_deviation_is_how_far_values_move() -> None:
    rng = np.random.default_rng(12)
    values = rng.normal(size=(9, 2, 4000)) * 0.5
    values[:, 1] += rng.normal(size=(9, 1)) * 3
    edges = np.linspace(-15, 15, 301)
    histograms = np.array([[np.histogram(v, edges)[0] / 4000 for v in row] for row in values])
    found = mean_absolute_deviation(histograms, edges=edges)
    # The mean of the cumulative histograms is that of the pooled values.
    expected = [
        np.mean([stats.wasserstein_distance(v, values[:, site].ravel()) for v in values[:, site]])
        for site in (0, 1)
    ]
    np.testing.assert_allclose(found, expected, rtol=0.03)
    # Sums over bins saturate: moving three times as far changes nothing once nothing overlaps.
    far = np.eye(30)[[0, 0, 10, 10]][:, None]
    farther = np.eye(30)[[0, 0, 29, 29]][:, None]
    assert mean_absolute_deviation(far) == mean_absolute_deviation(farther)
    wide = np.arange(31.0)
    assert mean_absolute_deviation(farther, edges=wide) == pytest.approx(
        2.9 * mean_absolute_deviation(far, edges=wide)
    )
    np.testing.assert_allclose(variability(histograms, edges=edges, rng=0, resamples=3).mad, found)
    for wrong in ([0, 1], edges[::-1]):
        with pytest.raises(InputError, match="ascending numbers for 300 bins"):
            mean_absolute_deviation(histograms, edges=wrong)


def test_unequal_bins_count_by_the_distance_between_their_centres() -> None:
    moves = np.eye(3)[[0, 2, 0, 2]][:, None]
    edges = np.array([0.0, 1.0, 3.0, 7.0])
    centres = 0.5 * (edges[:-1] + edges[1:])
    assert mean_absolute_deviation(moves, edges=edges) == pytest.approx([(centres[2] - centres[0]) / 2])
