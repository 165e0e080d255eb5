import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import mannwhitneyu

from learning.statistics import (
    Interval,
    Reached,
    interval_of,
    iqm,
    median_of,
    probability_of_improvement,
    reached_by_half,
)

NUMBERS = st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=25)


def drawn(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize(
    ("values", "expected"),
    [([1.0, 2.0, 3.0, 4.0], 2.5), ([0.0, 2.0, 3.0, 1000.0], 2.5), ([5.0], 5.0), ([1, 2, 3, 4, 5, 6, 7, 80], 4.5)],
)
def test_the_middle_half_is_averaged_and_no_outlier_moves_it(values, expected):
    assert iqm(np.array(values, dtype=float)) == expected


def test_the_interval_covers_the_truth_as_often_as_it_says():
    rng, n_covering = drawn(7), 0
    for _ in range(300):
        interval = interval_of(rng.normal(2.0, 1.0, 20), rng=rng, figure=lambda v: v.mean(axis=-1), n_draws=400)
        n_covering += interval.low <= 2.0 <= interval.high
    assert 0.89 <= n_covering / 300 <= 0.98  # the percentile bootstrap of 20 is a little too narrow


def test_strata_keep_what_lies_between_goals_out_of_the_interval():
    rng = drawn(3)
    easy, hard = rng.normal(0.9, 0.01, 20), rng.normal(0.1, 0.01, 20)
    apart = interval_of(np.stack([easy, hard], axis=1), rng=drawn(), figure=lambda v: v.mean(axis=-1))
    mixed = interval_of(np.concatenate([easy, hard]), rng=drawn(), figure=lambda v: v.mean(axis=-1))
    assert apart.high - apart.low < 0.01 < 0.2 < mixed.high - mixed.low
    assert abs(apart.value - 0.5) < 0.01


@given(NUMBERS, st.integers(0, 100))
def test_an_interval_lies_within_the_values_and_is_the_same_of_the_same_seed(values, seed):
    interval = interval_of(values, rng=drawn(seed), n_draws=50, figure=median_of)
    assert interval == interval_of(values, rng=drawn(seed), n_draws=50, figure=median_of)
    assert min(values) - 1e-9 <= interval.low <= interval.high <= max(values) + 1e-9


@pytest.mark.parametrize("values", [[], [1.0], [1.0, 2.0]])
def test_two_runs_have_no_interval(values):
    assert interval_of(values, rng=drawn()) is None
    assert probability_of_improvement(values, [1.0, 2.0, 3.0], rng=drawn()) is None


def test_a_learner_that_is_always_better_improves_surely_and_one_that_is_alike_by_half():
    better = probability_of_improvement([4.0, 5.0, 6.0], [1.0, 2.0, 3.0], rng=drawn())
    assert better == Interval(value=1.0, low=1.0, high=1.0)
    alike = probability_of_improvement([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], rng=drawn())
    assert alike.value == 0.5
    assert alike.low < 0.5 < alike.high


@given(NUMBERS, NUMBERS)
def test_what_one_wins_the_other_loses(a, b):
    ours = probability_of_improvement(a, b, rng=drawn(), n_draws=10)
    theirs = probability_of_improvement(b, a, rng=drawn(), n_draws=10)
    assert ours.value + theirs.value == pytest.approx(1.0)


def test_the_share_of_pairs_is_mann_and_whitneys_and_the_interval_of_many_is_the_normal_one():
    ours, theirs = [3.0, 1.0, 4.0, 1.0, 5.0], [2.0, 7.0, 1.0, 8.0]
    told = probability_of_improvement(ours, theirs, rng=drawn())
    assert told.value == pytest.approx(mannwhitneyu(ours, theirs).statistic / 20)
    assert told.value == pytest.approx(7 / 20)  # six pairs won, two tied
    values = np.linspace(-1.0, 1.0, 401)
    mean = interval_of(values, rng=drawn(), figure=lambda v: v.mean(axis=-1))
    half = 1.96 * values.std() / np.sqrt(401)
    assert (mean.low, mean.high) == (pytest.approx(-half, rel=0.06), pytest.approx(half, rel=0.06))


def test_a_run_that_never_came_there_counts_as_later_than_all():
    assert reached_by_half([10, None, 30], rng=drawn()) == Reached(value=30.0, low=10.0, high=None)
    assert reached_by_half([None, None, 30], rng=drawn()).value is None
    all_alike = reached_by_half([20] * 20, rng=drawn())
    assert all_alike == Reached(value=20.0, low=20.0, high=20.0)
    most = reached_by_half([10 * i for i in range(1, 20)] + [None], rng=drawn())
    assert most.value == 110.0
    assert 50.0 <= most.low < most.value < most.high <= 160.0


@pytest.mark.parametrize("values", [[], [5], [None, 3]])
def test_half_of_two_runs_is_no_figure(values):
    assert reached_by_half(values, rng=drawn()) is None
