"""The hit rate: by hand, laws, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pliant
from pliant import HitRates, hit_rate
from pliant.evaluate import mean_hit_rates


def test_by_hand() -> None:
    b = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    found = hit_rate([2.1, 0.9], b, [2, 3], fractions=[0.2, 0.4, 0.6, 0.8])
    # 0.9 is nearest 1, then 0, 2 and 3.
    assert found.ranks.tolist() == [1, 4]
    assert found.rates.tolist() == [0.5, 0.5, 0.5, 1.0]
    assert found.at(0.6) == 0.5


@given(n=st.integers(2, 60), d=st.integers(1, 4), seed=st.integers(0, 10**6))
def test_ranks_are_those_of_a_full_sort(n: int, d: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, n, d))
    truth = rng.permutation(n)
    found = hit_rate(a, b, truth, fractions=[1.0])
    for i in range(n):
        order = np.argsort(((b - a[i]) ** 2).sum(axis=1))
        assert found.ranks[i] == 1 + int(np.flatnonzero(order == truth[i])[0])
    assert found.rates.tolist() == [1.0]


def test_a_signature_that_says_nothing_earns_nothing() -> None:
    found = hit_rate(np.zeros((100, 3)), np.zeros((100, 3)), np.arange(100))
    assert (found.ranks == 100).all()
    assert found.at(0.5) == 0.0


def test_at_least_one_candidate_is_looked_at() -> None:
    found = hit_rate(np.arange(10.0), np.arange(10.0), np.arange(10), fractions=[0.001])
    assert found.rates.tolist() == [1.0]


def test_the_mirror_image_counts_when_asked() -> None:
    # Two halves with the same values; a tiny preference for the wrong half.
    half = np.arange(50.0)
    a = np.concatenate([half, half])
    b = np.concatenate([half + 1e-3, half])
    mirror = np.roll(np.arange(100), 50)
    found = hit_rate(a, b, np.arange(100), points=np.arange(50), symmetry=mirror, fractions=[0.01])
    assert found.rates.tolist() == [0.0]
    assert found.symmetric_rates is not None
    assert found.symmetric_rates.tolist() == [1.0]
    assert found.at(0.01, symmetric=True) == 1.0
    unknown = hit_rate(a, b, np.arange(100), points=[3], symmetry=np.full(100, -1), fractions=[0.01])
    assert unknown.symmetric_ranks is not None
    assert unknown.symmetric_ranks.tolist() == unknown.ranks.tolist()


def test_points_without_counterpart_are_counted() -> None:
    truth = np.arange(20)
    truth[:5] = -1
    found = hit_rate(np.arange(20.0), np.arange(20.0), truth, points=[0, 1, 7])
    assert (len(found.ranks), found.n_missing) == (1, 2)


def test_blocks_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 200, 3))
    whole = hit_rate(a, b, np.arange(200)).ranks
    monkeypatch.setattr("pliant.evaluate.hits._BLOCK", 1000)
    np.testing.assert_array_equal(hit_rate(a, b, np.arange(200)).ranks, whole)


def test_intervals_cover_the_rate_and_shrink() -> None:
    rng = np.random.default_rng(0)
    few = HitRates(rng.integers(1, 101, 40), 100, [0.5])
    many = HitRates(rng.integers(1, 101, 4000), 100, [0.5])
    for result in (few, many):
        low, high = result.interval()[:, 0]
        assert low <= result.rates[0] <= high
    assert np.ptp(many.interval(), axis=0)[0] < 0.3 * np.ptp(few.interval(), axis=0)[0]
    assert few.interval(rng=1).tobytes() == few.interval(rng=1).tobytes()


def test_means_over_pairs() -> None:
    results = [HitRates([1, 1], 10, [0.1, 0.5]), HitRates([3, 9], 10, [0.1, 0.5])]
    mean, interval = mean_hit_rates(results)
    assert mean.tolist() == [0.5, 0.75]
    assert (interval[0] <= mean).all()
    assert (mean <= interval[1]).all()
    assert np.isnan(mean_hit_rates(results[:1])[1]).all()
    with pytest.raises(pliant.InputError, match="same fractions"):
        mean_hit_rates([results[0], HitRates([1], 10, [0.2])])
    with pytest.raises(pliant.InputError, match="at least one"):
        mean_hit_rates([])


def test_refusals() -> None:
    a, same = np.arange(6.0), np.arange(6)
    with pytest.raises(pliant.InputError, match="same width"):
        hit_rate(np.zeros((6, 2)), np.zeros((6, 3)), same)
    with pytest.raises(pliant.InputError, match="shape"):
        hit_rate(a, a, same[:4])
    with pytest.raises(pliant.InputError, match=r"outside -1\.\.5"):
        hit_rate(a, a, same + 1)
    with pytest.raises(pliant.InputError, match="none of the 6 points"):
        hit_rate(a, a, np.full(6, -1))
    with pytest.raises(pliant.InputError, match="points"):
        hit_rate(a, a, same, points=[6])
    with pytest.raises(pliant.InputError, match="1 rows are not finite"):
        hit_rate(np.where(a == 3, np.nan, a), a, same)
    for fractions in ([], [0.0], [1.5], [0.2, 0.1], [np.nan]):
        with pytest.raises(pliant.InputError, match="fractions"):
            hit_rate(a, a, same, fractions=fractions)
    with pytest.raises(pliant.InputError, match="no symmetry"):
        hit_rate(a, a, same).at(0.5, symmetric=True)
    with pytest.raises(pliant.InputError, match="ranks"):
        HitRates([0], 5, [0.5])
    with pytest.raises(pliant.InputError, match="confidence"):
        hit_rate(a, a, same).interval(confidence=1.0)
