"""Discriminative binary codes: bits that tell classes apart and can be predicted (Rastegari et al. 2012)."""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import BoolArray, FloatArray, IntArray
from .._kernels import kernel
from ..errors import InputError
from ._coder import LinearCoder, principal_axes
from ._planes import PlaneTrainer

__all__ = ["DiscriminativeBinaryCodes"]

_SWEEPS = 10
# A bit with fewer rows than this on a side says nothing, and is drawn anew.
_LEAST_SHARE = 0.02


class DiscriminativeBinaryCodes(LinearCoder):
    """Bits that pull a class together, push classes apart, and that a linear SVM can predict (DBC).

    Bits start as signs of principal components. Then, in turn: a linear SVM is fitted to each bit; each row's
    bits are flipped where that lowers ::

        (share of pairs inside classes that disagree) - separation * (share of pairs between classes that disagree)
        + independence * (C - 1) * (mean squared correlation with the other bits) + prediction * (mean hinge loss)

    summed over bits. Codes are the sides of the SVMs.

    Parameters
    ----------
    bits : int
        Length of the codes, a multiple of 8. There is no upper limit.
    cost : float
        Weight of the losses of the SVMs against their penalty, for rows of mean square length 1.
    separation, independence, prediction : float
        Weights of the terms above.
    rounds : int
        Alternations; fewer where no bit changes any more.
    rng : int or Generator
        Seed: of bits beyond the principal components, and of the order in which rows are visited.

    Attributes
    ----------
    weights_ : (d, bits) array of float
    offsets_ : (bits,) array of float
    n_rounds_ : int
        Alternations made.

    Notes
    -----
    Shares of pairs balance classes against each other whatever their number, which the paper does by its lambda. The
    paper's flips do not tie bits to each other: nothing there keeps two bits from becoming one. ``independence`` does,
    in units of 1 / (C - 1), the mean squared correlation of random divisions of C classes: much above 0.5 it would
    rather break up classes than let bits be alike.
    Cost of a round: n d bits for each pass of the SVMs, and n bits^2 for the flips. Do not trust the distances between
    rows of training: their bits are what the planes were fitted to.

    References
    ----------
    Rastegari, Farhadi & Forsyth, *Attribute discovery via predictable discriminative binary codes*, ECCV 2012; section
    6.4.1 of the dissertation.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> y = np.repeat([0, 1, 2], 20)
    >>> X = rng.normal(size=(3, 8))[y] + 0.1 * rng.normal(size=(60, 8))
    >>> codes = DiscriminativeBinaryCodes(bits=32).fit(X, y).transform(X)
    >>> codes.shape, len(np.unique(codes, axis=0))
    ((60, 4), 3)
    """

    learns_from_labels = True

    def __init__(
        self,
        bits: int = 128,
        *,
        cost: float = 1.0,
        separation: float = 1.0,
        independence: float = 0.25,
        prediction: float = 0.2,
        rounds: int = 10,
        rng: int | np.random.Generator = 0,
    ) -> None:
        self.bits = bits
        self.cost = cost
        self.separation = separation
        self.independence = independence
        self.prediction = prediction
        self.rounds = rounds
        self.rng = rng

    def fit(self, X: ArrayLike, y: ArrayLike | None = None) -> Self:
        """Learn from (n, d) X and the class of each row, (n,) y.

        Raises
        ------
        InputError
            If X or y cannot be used, there is one class only, or an option is out of range.
        """
        self._check_options()
        table, classes, n_classes = self._checked_with_labels(X, y)
        generator = np.random.default_rng(self.rng)
        signs = _first_signs(table, self.bits, generator)
        trainer = PlaneTrainer(table, self.cost, generator)
        sides = trainer.fit(signs)
        for turn in range(self.rounds):
            before = signs
            signs = np.where(sides > 0, 1.0, -1.0) if turn else signs
            signs = self._flipped(signs, sides, classes, n_classes, generator)
            self.n_rounds_ = turn + 1
            if turn and np.array_equal(before, signs):
                break
            sides = trainer.fit(signs)
        self.weights_, self.offsets_ = trainer.in_input_units()
        return self

    def _flipped(
        self,
        signs: FloatArray,
        sides: FloatArray,
        classes: IntArray,
        n_classes: int,
        rng: np.random.Generator,
    ) -> FloatArray:
        signs, sides = _without_empty_bits(signs, sides, classes, n_classes, rng)
        sizes = np.bincount(classes, minlength=n_classes).astype(np.float64)
        total = len(classes)
        inside = max(float((sizes * (sizes - 1)).sum()) / 2, 1.0)
        between = max(total * (total - 1) / 2 - float((sizes * (sizes - 1)).sum()) / 2, 1.0)
        loss = np.maximum(1 - sides, 0), np.maximum(1 + sides, 0)
        pull = self.prediction / total * (loss[0] - loss[1])
        orders = np.stack([rng.permutation(total) for _ in range(_SWEEPS)])
        weights = np.array(
            [1 / inside, self.separation / between, self.independence * (n_classes - 1) / (self.bits - 1)]
        )
        flipped = np.array(signs)
        _flip(flipped, pull, classes, sizes, weights, orders)
        return flipped

    def _check_options(self) -> None:
        terms = (self.separation, self.independence, self.prediction)
        if not self.cost > 0 or min(terms) < 0 or self.rounds < 1:
            message = (
                f"cost must be positive, the weights not negative and rounds 1 or more, got cost={self.cost}, "
                f"separation={terms[0]}, independence={terms[1]}, prediction={terms[2]}, rounds={self.rounds}"
            )
            raise InputError(message)


def _first_signs(table: FloatArray, bits: int, rng: np.random.Generator) -> FloatArray:
    """Return signs of principal components; past their number, of random mixtures of them."""
    mean, axes = principal_axes(table, bits)
    scores = (table - mean) @ axes
    more = bits - scores.shape[1]
    if more > 0:
        scores = np.column_stack([scores, scores @ rng.normal(size=(scores.shape[1], more))])
    return np.where(scores > 0, 1.0, -1.0)


def _without_empty_bits(
    signs: FloatArray, sides: FloatArray, classes: IntArray, n_classes: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Give each bit with (nearly) all rows on one side a random half of the classes instead."""
    ones: BoolArray = signs > 0
    share = np.minimum(ones.mean(axis=0), 1 - ones.mean(axis=0))
    signs, sides = signs.copy(), sides.copy()
    for bit in np.flatnonzero(share < min(_LEAST_SHARE, 1 / len(signs))):
        halves = np.where(np.arange(n_classes) < n_classes // 2, 1.0, -1.0)[rng.permutation(n_classes)]
        signs[:, bit] = halves[classes]
        # Nothing is known yet about how well it can be predicted.
        sides[:, bit] = 0.0
    return signs, sides


@kernel
def _flip(
    signs: FloatArray,
    pull: FloatArray,
    classes: IntArray,
    sizes: FloatArray,
    weights: FloatArray,
    orders: IntArray,
) -> None:
    """Flip bits in place, one at a time, where that lowers the objective; ``pull`` is added for a bit that is 1."""
    count, bits = signs.shape
    inside, between, independence = weights
    ones = np.zeros(len(sizes))
    for bit in range(bits):
        ones[:] = 0.0
        total = 0.0
        for i in range(count):
            if signs[i, bit] > 0:
                ones[classes[i]] += 1.0
                total += 1.0
        products = np.zeros(bits)
        for i in range(count):
            products += signs[i, bit] * signs[i]
        products[bit] = 0.0
        for order in orders:
            changed = 0
            for i in order:
                now, own = signs[i, bit], classes[i]
                # Disagreements that the row takes part in, as it is and flipped.
                same = ones[own] if now > 0 else sizes[own] - ones[own]
                alike = total if now > 0 else count - total
                more_inside = (same - 1) - (sizes[own] - same)
                more_between = (alike - 1) - (count - alike) - more_inside
                tie = 0.0
                for j in range(bits):
                    tie += products[j] * signs[i, j]
                tie = 4.0 * ((bits - 1) - now * tie) / (count * float(count))
                gain = inside * more_inside - between * more_between + independence * tie - now * pull[i, bit]
                if gain < -1e-15:
                    signs[i, bit] = -now
                    ones[own] -= now
                    total -= now
                    for j in range(bits):
                        products[j] -= 2.0 * now * signs[i, j]
                    products[bit] = 0.0
                    changed += 1
            if changed == 0:
                break
