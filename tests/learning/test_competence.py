"""Competence: one hand-worked case for every reading of the paper."""

import pytest

from config.learning import SubgoalSelection
from learning.competence import (
    absolute_improvement,
    clipped_success_improvement,
    delta_competence,
    has_dropped,
    running_success,
    subgoal_temperature,
)


def test_equation_1_as_printed_is_the_newer_mean_error_minus_the_older():
    # Older window |CP| = 0.9, 0.7: mean 0.8; newer 0.1, 0.3: mean 0.2. Learning makes it negative.
    assert delta_competence([0.9, -0.7, 0.1, -0.3], window=2) == pytest.approx(0.2 - 0.8)


def test_equation_1_takes_the_newest_two_windows_only():
    assert delta_competence([1.0, 1.0, 0.4, 0.2, 0.5, 0.7], window=2) == pytest.approx(0.6 - 0.3)


def test_before_two_windows_of_attempts_there_is_no_improvement():
    assert delta_competence([1.0] * 10 + [0.0] * 9, window=10) == 0.0
    assert delta_competence([1.0] * 10 + [0.0] * 10, window=10) == -1.0
    assert clipped_success_improvement([0.0] * 10 + [1.0] * 9, window=10) == 0.0
    assert absolute_improvement([0.0] * 10 + [1.0] * 9, window=10) == 0.0
    assert delta_competence([], window=10) == 0.0


def test_clipped_difference_of_successes_ignores_loss():
    assert clipped_success_improvement([0, 0, 1, 0, 1, 1], window=3) == pytest.approx(1 / 3)
    assert clipped_success_improvement([1, 1, 1, 0], window=2) == 0.0


def test_absolute_difference_counts_loss_as_much_as_gain():
    assert absolute_improvement([0, 0, 1, 0], window=2) == pytest.approx(0.5)
    assert absolute_improvement([1, 0, 0, 0], window=2) == pytest.approx(0.5)


def test_running_success_is_the_mean_of_the_newest_results():
    assert running_success([1, 0, 0, 1, 1], window=4) == pytest.approx(0.5)
    assert running_success([1], window=20) == 1.0
    assert running_success([], window=20) == 0.0


def test_a_goal_that_begins_to_fail_is_noticed_within_half_a_window():
    assert not has_dropped([1.0] * 10 + [1.0, 1.0, 1.0, 1.0, 0.0], window=10)
    assert has_dropped([1.0] * 10 + [1.0, 1.0, 1.0, 0.0, 0.0], window=10)
    assert not has_dropped([0.0] * 30, window=10)
    assert not has_dropped([1.0] * 9 + [0.0] * 5, window=10)


@pytest.mark.parametrize(
    ("reading", "improvement", "success", "expected"),
    [
        ("one_minus_improvement", 0.0, 1.0, 0.6),  # a mastered goal does not improve: most noise, as the text has it
        ("one_minus_improvement", 0.5, 1.0, 0.305),
        ("one_minus_improvement", -1.0, 0.0, 1.19),
        ("one_minus_competence", 0.0, 1.0, 0.01),
        ("one_minus_competence", 0.0, 0.25, 0.4525),
        ("fixed", 0.7, 0.3, 0.01),
    ],
)
def test_temperature_by_hand(reading, improvement, success, expected):
    selection = SubgoalSelection(temperature=reading, temperature_least=0.01, temperature_scale=0.59)
    assert subgoal_temperature(selection, improvement=improvement, success=success) == pytest.approx(expected)
