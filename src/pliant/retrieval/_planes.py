"""Many linear support vector machines over the same rows, one a bit, started from where the last ones ended."""

from __future__ import annotations

import numpy as np

from .._arrays import FloatArray, IntArray
from .._kernels import kernel

__all__ = ["PlaneTrainer"]

# Passes over all rows, and the violation of the optimality conditions at which a machine is done.
_PASSES = 60
_TOLERANCE = 0.05


class PlaneTrainer:
    """Fits planes to changing bits of the same rows.

    Squared hinge loss and an L2 penalty, by dual coordinate descent (Hsieh et al. 2008). The offset is the weight
    of a feature that is 1 everywhere, so it is penalised too; rows are centred and brought to a mean square length of 1
    first, so that ``cost`` means the same whatever their unit.

    Parameters
    ----------
    table : (n, d) array of float
    cost : float
        Weight of the losses against the penalty.
    rng : Generator
        Orders in which rows are visited.
    """

    def __init__(self, table: FloatArray, cost: float, rng: np.random.Generator) -> None:
        self.mean = table.mean(axis=0)
        rows = table - self.mean
        length = float(np.sqrt((rows**2).sum(axis=1).mean()))
        self.scale = 1.0 / length if length > 0 else 1.0
        self.rows = np.column_stack([rows * self.scale, np.ones(len(rows))])
        self.cost = cost
        self.orders = np.stack([rng.permutation(len(rows)) for _ in range(_PASSES)])
        self.duals = np.zeros((0, len(rows)))
        self.signs = np.zeros((0, len(rows)))

    def fit(self, signs: FloatArray) -> FloatArray:
        """Fit a plane to each column of (n, b) signs -1 and 1; return the side of each row, (n, b)."""
        wanted = np.ascontiguousarray(signs.T)
        if wanted.shape == self.signs.shape:
            # What a row has pushed one way says nothing once its bit has changed.
            self.duals[wanted != self.signs] = 0.0
        else:
            self.duals = np.zeros(wanted.shape)
        self.signs = wanted
        self.planes = _fitted(self.rows, wanted, self.duals, self.cost, self.orders, _TOLERANCE)
        sides: FloatArray = self.rows @ self.planes.T
        return sides

    def in_input_units(self) -> tuple[FloatArray, FloatArray]:
        """Return the last planes as weights (d, b) and offsets (b,) for rows as they were given."""
        weights = np.ascontiguousarray(self.planes[:, :-1].T) * self.scale
        return weights, self.planes[:, -1] - self.mean @ weights


@kernel
def _fitted(
    rows: FloatArray, signs: FloatArray, duals: FloatArray, cost: float, orders: IntArray, tolerance: float
) -> FloatArray:
    count, width = rows.shape
    planes = np.zeros((len(signs), width))
    squares = np.empty(count)
    for i in range(count):
        squares[i] = np.dot(rows[i], rows[i])
    slack = 0.5 / cost
    for bit in range(len(signs)):
        plane, sign, dual = planes[bit], signs[bit], duals[bit]
        for i in range(count):
            if dual[i] > 0:
                plane += dual[i] * sign[i] * rows[i]
        for order in orders:
            worst = 0.0
            for i in order:
                slope = sign[i] * np.dot(plane, rows[i]) - 1.0 + slack * dual[i]
                if dual[i] == 0.0 and slope >= 0.0:
                    continue
                worst = max(worst, abs(slope))
                moved = max(dual[i] - slope / (squares[i] + slack), 0.0)
                step = (moved - dual[i]) * sign[i]
                dual[i] = moved
                for j in range(width):
                    plane[j] += step * rows[i, j]
            if worst < tolerance:
                break
    return planes
