"""Kinds of binary codes, each against a law or a closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import ortho_group
from sklearn.base import clone
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import LinearSVC

from pliant.errors import InputError
from pliant.retrieval import (
    CCAIterativeQuantization,
    ClassifierCodes,
    DiscriminativeBinaryCodes,
    IterativeQuantization,
    LocalitySensitiveHashing,
    SpectralHashing,
    hamming_distances,
    unpack_bits,
)
from pliant.retrieval._planes import PlaneTrainer
from pliant.retrieval.codes import quantising_rotation
from pliant.retrieval.discriminative import _first_signs, _flip, _without_empty_bits
from pliant.retrieval.supervised import _canonical

KINDS = (
    LocalitySensitiveHashing,
    IterativeQuantization,
    SpectralHashing,
    CCAIterativeQuantization,
    ClassifierCodes,
    DiscriminativeBinaryCodes,
)


def blobs(n_classes: int = 4, each: int = 15, width: int = 12, noise: float = 0.5) -> tuple:
    rng = np.random.default_rng(5)
    y = np.repeat(np.arange(n_classes), each)
    return rng.normal(size=(n_classes, width))[y] * 2 + noise * rng.normal(size=(len(y), width)), y


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_an_estimator_that_gives_bytes_and_repeats_itself(kind: type) -> None:
    X, y = blobs()
    codes = kind(bits=64).fit(X, y).transform(X)
    assert codes.shape == (60, 8)
    assert codes.dtype == np.uint8
    assert np.array_equal(codes, clone(kind(bits=64)).fit(X, y).transform(X))
    assert make_pipeline(StandardScaler(), kind(bits=16)).fit(X, y).transform(X[:3]).shape == (3, 2)
    apart = hamming_distances(codes, codes)
    alike = y[:, None] == y
    # Waves along axes of noise alone are part of spectral hashing: it separates least.
    assert apart[alike].mean() < (0.9 if kind is SpectralHashing else 0.7) * apart[~alike].mean()


@pytest.mark.parametrize("kind", KINDS)
def test_fitted_state_is_arrays_and_nothing_else(kind: type) -> None:
    X, y = blobs()
    fitted = kind(bits=32).fit(X, y)
    again = kind(bits=32).with_state({k: v.copy() for k, v in fitted.state().items()})
    assert np.array_equal(again.transform(X), fitted.transform(X))
    with pytest.raises(InputError, match="damaged"):
        kind(bits=32).with_state({})


@pytest.mark.parametrize("kind", KINDS)
def test_longer_codes_than_there_are_dimensions(kind: type) -> None:
    X, y = blobs()
    assert kind(bits=128).fit(X, y).transform(X).shape == (60, 16)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("bits", [0, 12, -8])
def test_bits_come_in_bytes(kind: type, bits: int) -> None:
    X, y = blobs()
    with pytest.raises(InputError, match="multiple of 8"):
        kind(bits=bits).fit(X, y)


@pytest.mark.parametrize("kind", KINDS)
def test_what_cannot_be_used_is_refused(kind: type) -> None:
    X, y = blobs()
    hole = X.copy()
    hole[3, 1] = np.nan
    for bad, message in (
        (hole, "not finite, first at"),
        (X[0], "shape"),
        (X[:1], "two rows"),
        (0 * X, "differ"),
    ):
        with pytest.raises(InputError, match=message):
            kind(bits=8).fit(bad, y[: len(bad)])
    with pytest.raises(InputError, match="not fitted"):
        kind(bits=8).transform(X)
    with pytest.raises(InputError, match="12 columns"):
        kind(bits=8).fit(X, y).transform(X[:, 1:])


@pytest.mark.parametrize("kind", KINDS[3:])
def test_codes_with_labels_need_labels_of_two_classes(kind: type) -> None:
    X, y = blobs()
    with pytest.raises(InputError, match="give y"):
        kind(bits=8).fit(X)
    with pytest.raises(InputError, match="one label a row"):
        kind(bits=8).fit(X, y[1:])
    with pytest.raises(InputError, match="two classes"):
        kind(bits=8).fit(X, 0 * y)


def test_random_planes_measure_angles() -> None:
    rng = np.random.default_rng(0)
    X = rng.normal(size=(40, 6))
    X -= X.mean(axis=0)
    codes = LocalitySensitiveHashing(bits=8192, rng=3).fit(X).transform(X)
    unit = X / np.linalg.norm(X, axis=1, keepdims=True)
    angles = np.arccos(np.clip(unit @ unit.T, -1, 1)) / np.pi
    # Four standard deviations of a share of 8192 bits.
    assert np.abs(hamming_distances(codes, codes) / 8192 - angles).max() < 4 * 0.5 / np.sqrt(8192) * 1.2


@pytest.mark.parametrize("bits", [4, 8, 24])
def test_the_rotation_keeps_lengths_and_each_round_loses_less(bits: int) -> None:
    rng = np.random.default_rng(1)
    V = rng.normal(size=(200, 8)) * np.linspace(1, 3, 8)
    V = V[:, : min(bits, 8)]
    turns = [quantising_rotation(V, bits, rounds, 0) for rounds in (1, 2, 5, 20)]
    for turn in turns:
        product = turn @ turn.T if bits >= V.shape[1] else turn.T @ turn
        assert np.allclose(product, np.eye(len(product)))
    losses = [np.linalg.norm(np.where(V @ t > 0, 1, -1) - V @ t) for t in turns]
    assert losses == sorted(losses, reverse=True)


def test_quantised_codes_do_not_depend_on_the_frame() -> None:
    X, _ = blobs()
    frame = ortho_group.rvs(X.shape[1], random_state=0)
    one = IterativeQuantization(bits=8).fit(X).transform(X)
    two = IterativeQuantization(bits=8).fit(5 + 3 * X @ frame).transform(5 + 3 * X @ frame)
    apart = hamming_distances(one, one), hamming_distances(two, two)
    # The signs of the axes are free, so bits differ but distances hardly.
    assert np.corrcoef(apart[0].ravel(), apart[1].ravel())[0, 1] > 0.95


def test_spectral_hashing_takes_the_longest_waves_of_the_box() -> None:
    x, y = np.meshgrid(np.linspace(0, 4, 80), np.linspace(0, 1, 21))
    X = np.column_stack([x.ravel(), y.ravel()])
    coder = SpectralHashing(bits=8).fit(X)
    # Modes by (number / side): four of the long side before the first of the short one, which ties with the fourth.
    assert sorted(coder.axis_of_bit_.tolist()) == [0] * 7 + [1]
    bits = unpack_bits(coder.transform(X))
    half, quarter = bits[:, 0], bits[:, 1]
    assert np.array_equal(half, x.ravel() < 2) or np.array_equal(half, x.ravel() > 2)
    inner = (x.ravel() > 1) & (x.ravel() < 3)
    assert (quarter == ~inner).mean() > 0.97


def test_canonical_correlations_are_those_of_the_two_subspaces() -> None:
    X, y = blobs(noise=3.0)
    rows = X - X.mean(axis=0)
    directions, correlations = _canonical(rows, y, 4, 1e-9)
    indicator = np.eye(4)[y] - np.eye(4)[y].mean(axis=0)
    basis = np.linalg.svd(indicator, full_matrices=False)[0][:, :3]
    true = np.linalg.svd(np.linalg.qr(rows)[0].T @ basis)[1]
    assert directions.shape == (12, 3)
    assert np.allclose(correlations, true, atol=1e-6)
    # A direction's scores have the correlation as their deviation.
    assert np.allclose((rows @ directions).std(axis=0), correlations, atol=1e-6)


def test_canonical_codes_past_the_number_of_classes_stay_supervised() -> None:
    X, y = blobs(noise=2.0)
    frame = CCAIterativeQuantization(bits=64).fit(X, y)
    assert np.linalg.matrix_rank(frame.weights_) == 3
    filled = CCAIterativeQuantization(bits=64, extension="pca").fit(X, y)
    assert np.linalg.matrix_rank(filled.weights_) == 12
    with pytest.raises(InputError, match="extension one of"):
        CCAIterativeQuantization(bits=8, extension="zeros").fit(X, y)


def test_a_classifier_gives_one_code_to_all_it_takes_for_one_class() -> None:
    X, y = blobs()
    codes = ClassifierCodes(bits=16).fit(X, y).transform(X)
    assert all(len(np.unique(codes[y == c], axis=0)) == 1 for c in range(4))
    assert len(np.unique(codes, axis=0)) == 4
    many = np.repeat(np.arange(300), 2)
    with pytest.raises(InputError, match=r"8 bits are too few for 300 classes; 16 will do"):
        ClassifierCodes(bits=8).fit(np.random.default_rng(0).normal(size=(600, 5)), many)


def test_planes_are_those_of_liblinear() -> None:
    X, y = blobs(noise=3.0)
    signs = np.where((y[:, None] >> np.arange(2)) & 1, 1.0, -1.0)
    trainer = PlaneTrainer(X, 2.0, np.random.default_rng(0))
    sides = trainer.fit(signs)
    weights, offsets = trainer.in_input_units()
    assert np.allclose(X @ weights + offsets, sides)
    for bit in range(2):
        other = LinearSVC(C=2.0, intercept_scaling=1.0, max_iter=100_000, tol=1e-8).fit(
            (X - trainer.mean) * trainer.scale, signs[:, bit]
        )
        theirs = other.decision_function((X - trainer.mean) * trainer.scale)
        assert np.abs(theirs - sides[:, bit]).max() < 0.05 * np.abs(theirs).max()


def objective(signs, sides, y, weights, prediction) -> float:
    """The objective as its docstring states it, pair by pair."""
    count, bits = signs.shape
    same = (y[:, None] == y) & ~np.eye(count, dtype=bool)
    differ = (signs[:, None] != signs).sum(axis=2)
    inside, between = same.sum() / 2, (y[:, None] != y).sum() / 2
    correlation = signs.T @ signs / count
    np.fill_diagonal(correlation, 0)
    loss = np.maximum(1 - signs * sides, 0).mean(axis=0).sum()
    separation, independence = weights
    return (
        differ[same].sum() / 2 / inside
        - separation * differ[y[:, None] != y].sum() / 2 / between
        + independence * (len(set(y)) - 1) * (correlation**2).sum() / 2 / (bits - 1)
        + prediction * loss
    )


def test_flips_lower_the_stated_objective_until_no_flip_does() -> None:
    X, y = blobs(3, 6)
    coder = DiscriminativeBinaryCodes(bits=8, separation=0.7, independence=0.8, prediction=0.3)
    rng = np.random.default_rng(0)
    signs, sides = _first_signs(X, 8, rng), rng.normal(size=(18, 8))
    value = lambda s: objective(s, sides, y, (0.7, 0.8), 0.3)  # noqa: E731
    flipped = coder._flipped(signs, sides, y, 3, rng)
    assert value(flipped) < value(signs)
    # Bits are settled one after another; go on until all are, then no single flip helps.
    for _ in range(20):
        flipped = coder._flipped(flipped, sides, y, 3, rng)
    best = value(flipped)
    for i in range(18):
        for bit in range(8):
            other = flipped.copy()
            other[i, bit] *= -1
            assert value(other) >= best - 1e-12


def test_independence_keeps_bits_apart() -> None:
    X, y = blobs(6, 10)
    apart = {}
    for independence in (0.0, 1.0):
        coder = DiscriminativeBinaryCodes(bits=16, independence=independence)
        signs = np.repeat(_first_signs(X, 1, np.random.default_rng(0)), 16, axis=1)
        flipped = coder._flipped(signs, 0 * signs, y, 6, np.random.default_rng(0))
        correlation = np.abs(np.corrcoef(flipped.T))
        apart[independence] = (correlation.sum() - 16) / 240
    assert apart[1.0] < 0.5 * apart[0.0]


@pytest.mark.parametrize("n_classes", [2, 3, 7])
def test_long_codes_of_few_classes_do_not_break_classes_up(n_classes: int) -> None:
    X, y = blobs(n_classes, 20, noise=0.1)
    codes = DiscriminativeBinaryCodes(bits=128).fit(X, y).transform(X)
    assert len(np.unique(codes, axis=0)) == n_classes


def test_a_bit_with_one_side_empty_starts_again_from_half_the_classes() -> None:
    y = np.repeat(np.arange(4), 5)
    signs = np.ones((20, 2))
    signs[::2, 1] = -1
    filled, sides = _without_empty_bits(signs, signs, y, 4, np.random.default_rng(0))
    assert np.abs(filled[:, 0].sum()) == 0
    assert all(len(set(filled[y == c, 0])) == 1 for c in range(4))
    assert np.array_equal(filled[:, 1], signs[:, 1])
    assert not sides[:, 0].any()


def test_noisy_classes_come_closer_than_principal_components_bring_them() -> None:
    X, y = blobs(8, 30, 40, noise=4.0)
    train = np.arange(len(y)) % 2 == 0
    ratio = {}
    for kind in (IterativeQuantization, DiscriminativeBinaryCodes):
        coder = kind(bits=64).fit(X[train], y[train])
        apart = hamming_distances(coder.transform(X[~train]), coder.transform(X[train]))
        alike = y[~train][:, None] == y[train]
        ratio[kind] = apart[alike].mean() / apart[~alike].mean()
    assert ratio[DiscriminativeBinaryCodes] < 0.93 * ratio[IterativeQuantization]


@pytest.mark.parametrize("option", [{"cost": 0}, {"separation": -1}, {"rounds": 0}])
def test_discriminative_codes_refuse_options_out_of_range(option: dict) -> None:
    X, y = blobs()
    with pytest.raises(InputError, match="cost must be positive"):
        DiscriminativeBinaryCodes(bits=8, **option).fit(X, y)


def test_the_flip_kernel_counts_bits_as_it_goes() -> None:
    """A row flipped in one bit changes what the next bits see."""
    y = np.array([0, 0, 1, 1])
    signs = np.array([[1.0, 1.0], [-1.0, -1.0], [1.0, 1.0], [-1.0, -1.0]])
    _flip(signs, np.zeros((4, 2)), y, np.array([2.0, 2.0]), np.array([0.5, 0.25, 0.0]), np.arange(4)[None])
    assert np.array_equal(signs[0], signs[1])
    assert np.array_equal(signs[2], signs[3])
