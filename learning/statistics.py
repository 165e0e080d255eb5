"""What runs come to together: interquartile means, intervals by bootstrap, and how surely one learner beats another.

After Agarwal et al. 2021, "Deep Reinforcement Learning at the Edge of the Statistical Precipice": a mean that a lucky
or a hopeless seed does not move, with an interval that says how few the runs were. Seeded generators are passed in.
"""

from collections.abc import Callable, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

__all__ = ["Interval", "interval_of", "iqm", "median_of", "probability_of_improvement"]

Array = NDArray[np.float64]
N_DRAWS = 2000
TAIL = 2.5
"""Percent left out at either end: 95 % intervals."""
FEWEST = 3
"""Runs below which no interval says anything."""


class Interval(msgspec.Struct, frozen=True, kw_only=True):
    """A figure with its 95 % interval over the runs that might as well have been."""

    value: float
    low: float
    high: float


def iqm(values: Array) -> Array:
    """Return the mean of the middle half, a quarter, rounded down, left out at either end.  (..., n) -> (...)"""
    n = values.shape[-1]
    cut = n // 4
    return np.sort(values, axis=-1)[..., cut : n - cut].mean(axis=-1)


def median_of(values: Array) -> Array:
    """Return the median.  (..., n) -> (...)"""
    return np.median(values, axis=-1)


def interval_of(
    values: Sequence[float] | Array,
    *,
    rng: np.random.Generator,
    figure: Callable[[Array], Array] = iqm,
    n_draws: int = N_DRAWS,
) -> Interval | None:
    """Return a figure of runs and its interval by percentile bootstrap; None of fewer runs than three.

    Args:
        values: one a run (n,), or one a run and stratum (n, strata): runs are then drawn anew within each stratum, and
            the figure is that of all values together.
        rng: draws.
        figure: of values along the last axis.
        n_draws: times that runs are drawn anew.
    """
    n = len(values)
    if n < FEWEST:
        return None
    table = np.asarray(values, dtype=np.float64).reshape(n, -1)
    n_strata = table.shape[1]
    drawn = rng.integers(n, size=(n_draws, n, n_strata))
    again = np.take_along_axis(np.broadcast_to(table, (n_draws, n, n_strata)), drawn, axis=1)
    figures = figure(again.reshape(n_draws, -1))
    low, high = np.percentile(figures, (TAIL, 100.0 - TAIL))
    return Interval(value=float(figure(table.reshape(-1))), low=float(low), high=float(high))


def probability_of_improvement(
    ours: Sequence[float], theirs: Sequence[float], *, rng: np.random.Generator, n_draws: int = N_DRAWS
) -> Interval | None:
    """Return how surely a run of ours has more than one of theirs, a tie counting half; None of fewer runs than three.

    The share of pairs (Mann and Whitney's U over their number), both sides drawn anew for the interval.
    """
    x, y = np.asarray(ours, dtype=np.float64), np.asarray(theirs, dtype=np.float64)
    if min(len(x), len(y)) < FEWEST:
        return None
    wins = (x[:, None] > y[None, :]) + 0.5 * (x[:, None] == y[None, :])
    rows = rng.integers(len(x), size=(n_draws, len(x)))
    columns = rng.integers(len(y), size=(n_draws, len(y)))
    shares = np.array([wins[np.ix_(row, column)].mean() for row, column in zip(rows, columns, strict=True)])
    low, high = np.percentile(shares, (TAIL, 100.0 - TAIL))
    return Interval(value=float(wins.mean()), low=float(low), high=float(high))
