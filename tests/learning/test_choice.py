"""Softmax choice is safe at every temperature and never takes what is not available."""

import numpy as np
import pytest

from learning.choice import draw, softmax


def test_softmax_of_two_values_is_the_logistic_of_their_difference():
    p = softmax(np.array([0.3, 0.1]), 0.2)
    assert p[0] == pytest.approx(1.0 / (1.0 + np.exp(-1.0)))


@pytest.mark.parametrize("temperature", [1e-300, 1e-6, 1.0, 1e6])
def test_softmax_is_finite_and_sums_to_one_at_any_temperature(temperature):
    p = softmax(np.array([1e3, -1e3, 999.0]), temperature)
    assert np.isfinite(p).all()
    assert p.sum() == pytest.approx(1.0)


def test_what_is_not_available_has_no_chance_even_where_it_is_best():
    p = softmax(np.array([100.0, 0.0, 0.0]), 0.01, (False, True, True))
    assert p.tolist() == [0.0, 0.5, 0.5]


def test_nothing_available_is_refused():
    with pytest.raises(ValueError, match="at least one available"):
        softmax(np.zeros(2), 1.0, (False, False))


@pytest.mark.parametrize("temperature", [0.0, -1.0, float("nan")])
def test_a_temperature_that_is_not_positive_is_refused(temperature):
    with pytest.raises(ValueError, match="above 0"):
        softmax(np.zeros(2), temperature)


def test_draws_follow_the_probabilities():
    rng = np.random.default_rng(0)
    counts = np.bincount([draw(np.array([0.2, 0.0, 0.8]), rng) for _ in range(4000)], minlength=3)
    assert counts[1] == 0
    assert counts[0] / 4000 == pytest.approx(0.2, abs=0.03)
