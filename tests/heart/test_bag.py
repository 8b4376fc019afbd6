"""Bags of features: counts, weighting, and life as a scikit-learn estimator."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import cross_val_predict
from sklearn.pipeline import make_pipeline

from pliant import InputError
from pliant.heart import FEATURE_BLOCKS, BagOfFeatures, ColumnHistograms


def bags(n: int = 8, m: int = 120, seed: int = 0, step: float = 1.0) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.normal((i % 2) * step, 1, (m + i, 23)) for i in range(n)]


def test_histograms_count_nearest_words() -> None:
    sets = bags()
    bag = BagOfFeatures(words=6).fit(sets)
    scaled = (sets[0] - bag.mean_) / bag.scale_
    nearest = ((scaled[:, None] - bag.centres_) ** 2).sum(axis=2).argmin(axis=1)
    assert np.array_equal(bag.words_of(sets[0]), nearest)
    assert bag.transform(sets)[0] == pytest.approx(np.bincount(nearest, minlength=6) / len(nearest))


def test_blocks_have_equal_variance_and_plain_columns_have() -> None:
    sets = bags()
    rows = np.concatenate(sets)
    blocks, plain = BagOfFeatures(words=4).fit(sets), BagOfFeatures(words=4, weighting="plain").fit(sets)
    assert ((rows - plain.mean_) / plain.scale_).var(axis=0) == pytest.approx(1, rel=0.1)
    variance = ((rows - blocks.mean_) / blocks.scale_).var(axis=0)
    assert [variance[block].sum() for block in FEATURE_BLOCKS.values()] == pytest.approx([1] * 5, rel=0.1)


def test_chosen_columns_weigh_within_their_kinds() -> None:
    bag = BagOfFeatures(words=4, columns=(0, 3, 4)).fit(bags())
    assert bag.centres_.shape == (4, 3)
    assert bag.scale_[1] / bag.scale_[0] == pytest.approx(np.sqrt(2), rel=0.1)


def test_clones_and_seeds_repeat_to_the_byte() -> None:
    sets = bags()
    bag = BagOfFeatures(words=5, weighting="plain", rng=3)
    copy = clone(bag)
    assert copy.get_params() == bag.get_params()
    assert copy.fit_transform(sets).tobytes() == bag.fit_transform(sets).tobytes()


def test_works_inside_cross_validation() -> None:
    sets, labels = bags(n=12, step=0.8), np.arange(12) % 2
    model = make_pipeline(BagOfFeatures(words=4), LogisticRegression())
    predicted = cross_val_predict(model, np.array([s[:100] for s in sets]), labels, cv=3)
    assert (predicted == labels).mean() > 0.8


@settings(max_examples=10)
@given(seed=st.integers(0, 1000))
def test_order_of_points_and_columns_scale_do_not_matter(seed: int) -> None:
    sets = bags(seed=seed)
    rng = np.random.default_rng(seed)
    bag = BagOfFeatures(words=5).fit(sets)
    assert bag.transform([rng.permutation(s) for s in sets]) == pytest.approx(bag.transform(sets))
    scale = rng.uniform(0.01, 100, 23)
    rescaled = BagOfFeatures(words=5).fit([s * scale for s in sets])
    assert rescaled.transform([s * scale for s in sets]) == pytest.approx(bag.transform(sets))


def test_a_constant_column_is_left_out_not_divided_by_zero() -> None:
    sets = [np.column_stack([s[:, :22], np.full(len(s), 7.0)]) for s in bags()]
    assert np.isfinite(BagOfFeatures(words=4).fit(sets).centres_).all()


def test_column_histograms_have_equal_shares_of_what_they_learned_from() -> None:
    sets = bags(m=4000, n=2)
    shares = ColumnHistograms(bins=10, columns=(0, 5)).fit(sets).transform([np.concatenate(sets)])
    assert shares.shape == (1, 20)
    assert shares == pytest.approx(0.1, abs=0.01)


def test_bad_bags_are_refused() -> None:
    sets = bags()
    with pytest.raises(InputError, match="empty"):
        BagOfFeatures().fit([])
    with pytest.raises(InputError, match="lack rows"):
        BagOfFeatures(words=3).fit([sets[0], sets[1][:, :5]])
    with pytest.raises(InputError, match="not finite"):
        BagOfFeatures(words=3).fit([np.full((4, 23), np.nan)])
    with pytest.raises(InputError, match="words"):
        BagOfFeatures(words=50).fit([sets[0][:10]])
    with pytest.raises(InputError, match="weighting"):
        BagOfFeatures(weighting="none").fit(sets)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="columns"):
        BagOfFeatures(columns=(40,)).fit(sets)
    with pytest.raises(InputError, match="lack rows"):
        BagOfFeatures(words=3).fit(sets).transform([sets[0][:, :7]])
    with pytest.raises(InputError, match="bins"):
        ColumnHistograms(bins=1).fit(sets)
