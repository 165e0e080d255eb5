"""What runs come to together: interquartile means, intervals by bootstrap, and how surely one learner beats another.

After Agarwal et al. 2021, "Deep Reinforcement Learning at the Edge of the Statistical Precipice": a mean that a lucky
or a hopeless seed does not move, with an interval that says how few the runs were. SciPy reckons; generators are passed
in.
"""

import math
from collections.abc import Callable, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

__all__ = ["Interval", "Reached", "interval_of", "iqm", "median_of", "probability_of_improvement", "reached_by_half"]

Array = NDArray[np.float64]
N_DRAWS = 2000
LEVEL = 0.95
TRIMMED = 0.25
"""Share of the values left out at either end."""
FEWEST = 3
"""Runs below which no interval says anything."""


class Interval(msgspec.Struct, frozen=True, kw_only=True):
    """A figure with its 95 % interval over the runs that might as well have been."""

    value: float
    low: float
    high: float


class Reached(msgspec.Struct, frozen=True, kw_only=True):
    """After how long half of the runs have reached something, with its 95 % interval; None: they never have."""

    value: float | None
    low: float | None
    high: float | None


def iqm(values: Array) -> Array:
    """Return the mean of the middle half, a quarter, rounded down, left out at either end.  (..., n) -> (...)"""
    from scipy.stats import trim_mean  # seconds that most commands do not need

    return trim_mean(values, TRIMMED, axis=-1)


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
    if len(values) < FEWEST:
        return None
    strata = tuple(np.asarray(values, dtype=np.float64).reshape(len(values), -1).T)
    return _bootstrapped(strata, lambda *parts, axis=-1: figure(np.concatenate(parts, axis=axis)), rng, n_draws)


def reached_by_half(
    values: Sequence[float | None], *, rng: np.random.Generator, n_draws: int = N_DRAWS
) -> Reached | None:
    """Return after how long half of the runs have reached something; a run that never did counts as later than all.

    None of fewer runs than three. With an even number it is the later one of the two in the middle, so that a run that
    never reached it is not averaged with one that did; so the interval's ends are values of runs.
    """
    n = len(values)
    if n < FEWEST:
        return None
    times = np.sort([math.inf if value is None else value for value in values])
    middles = times[np.sort(rng.integers(n, size=(n_draws, n)), axis=-1)[:, n // 2]]
    low, high = np.quantile(middles, ((1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0), method="inverted_cdf")
    return Reached(value=_finite(times[n // 2]), low=_finite(low), high=_finite(high))


def probability_of_improvement(
    ours: Sequence[float], theirs: Sequence[float], *, rng: np.random.Generator, n_draws: int = N_DRAWS
) -> Interval | None:
    """Return how surely a run of ours has more than one of theirs, a tie counting half; None of fewer runs than three.

    The share of pairs (Mann and Whitney's U over their number), both sides drawn anew for the interval.
    """
    if min(len(ours), len(theirs)) < FEWEST:
        return None
    sides = (np.asarray(ours, dtype=np.float64), np.asarray(theirs, dtype=np.float64))
    return _bootstrapped(sides, _share_of_pairs, rng, n_draws)


def _share_of_pairs(x: Array, y: Array, axis: int = -1) -> Array:
    """Return the share of pairs in which x has more, ties by half.  (..., n), (..., m) -> (...)"""
    difference = np.moveaxis(x, axis, -1)[..., :, None] - np.moveaxis(y, axis, -1)[..., None, :]
    return (0.5 + 0.5 * np.sign(difference)).mean(axis=(-2, -1))


def _bootstrapped(
    samples: tuple[Array, ...], figure: Callable[..., Array], rng: np.random.Generator, n_draws: int
) -> Interval:
    """Return a figure of samples and its interval, each sample drawn anew by itself."""
    from scipy.stats import bootstrap

    value = float(figure(*samples, axis=-1))
    drawn = bootstrap(
        samples, figure, n_resamples=n_draws, confidence_level=LEVEL, method="percentile", rng=rng, axis=-1,
        vectorized=True,
    )  # fmt: skip
    low, high = drawn.confidence_interval
    return Interval(value=value, low=float(low), high=float(high))


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
