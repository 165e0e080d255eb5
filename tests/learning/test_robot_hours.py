"""What a person at an arm is told before a run: hours and resets."""

import msgspec
import pytest

from config.loader import resolve
from learning.robot_hours import workload_of


def run_of(**protocol):
    resolved = resolve(rig="virtual_lab")
    experiment = msgspec.structs.replace(resolved.learning.experiment, **protocol)
    learning = msgspec.structs.replace(resolved.learning, experiment=experiment)
    return msgspec.structs.replace(resolved, learning=learning)


SHORT = {"epochs": 100, "trials": 8, "steps": 70, "evaluate_every": 50, "dense_for": 0, "test_epochs": 10}


def test_the_most_is_epochs_times_trials_times_steps_times_the_step_with_the_evaluations():
    work = workload_of(run_of(**SHORT), n_done=0, changes=())
    assert work.n_tests == 2 * 6 * 10
    assert work.n_resets == 100 + 120
    assert work.at_most_h == pytest.approx(220 * 8 * 70 * 0.05 / 3600)
    assert work.expected_h is None


def test_a_run_that_is_gone_on_with_needs_the_rest_at_the_pace_so_far():
    work = workload_of(run_of(**SHORT), n_done=60, changes=(), steps_done=60 * 100)
    assert work.n_resets == 40 + 60
    assert work.expected_h == pytest.approx(100 * 100 * 0.05 / 3600)
    assert workload_of(run_of(**SHORT), n_done=100, changes=()).n_resets == 0
