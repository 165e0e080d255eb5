"""The goal bandit: values by hand, the floor, arming again, credit, and state that can be kept."""

import numpy as np
import pytest

from config.learning import GoalSelection, SubgoalSelection
from learning.checkpoint import decode, encode
from learning.goal_selector import GoalSelector
from learning.interfaces import Attempt, TrialOutcome


def selector(*, seed=0, n_goals=3, **config):
    return GoalSelector(
        n_goals=n_goals,
        config=GoalSelection(**config),
        subgoals=SubgoalSelection(),
        rng=np.random.default_rng(seed),
    )


def attempt(subgoal, *, is_achieved, goal=0, predicted=0.5, outcome=None, is_explored=False):
    return Attempt(
        epoch=0, goal=goal, subgoal=subgoal, state=(False,) * 3, state_after=(False,) * 3,
        outcome=outcome or (TrialOutcome.ACHIEVED if is_achieved else TrialOutcome.NOT_REACHED),
        predicted=predicted, skill=0.5, n_steps=10, is_explored=is_explored,
    )  # fmt: skip


def feed(bandit, subgoal, results, **kwargs):
    for result in results:
        bandit.update(attempt(subgoal, is_achieved=bool(result), **kwargs))


def test_a_goal_never_tried_is_as_likely_as_any():
    assert selector().probabilities() == pytest.approx([1 / 3] * 3)


def test_the_value_is_the_moving_average_of_the_improvement():
    bandit = selector(window=2, improvement="clipped_success", ema_rate=0.3)
    feed(bandit, 1, [0, 0, 1, 1])
    # The fourth attempt is the first with two windows: ΔC = 1 - 0, and 0.3 of it is taken.
    assert bandit.values == pytest.approx((0.0, 0.3, 0.0))
    feed(bandit, 1, [1])
    # Windows are now (0, 1) and (1, 1): ΔC = 0.5, so 0.3 + 0.3 * (0.5 - 0.3).
    assert bandit.values[1] == pytest.approx(0.36)


def test_equation_1_uses_the_prediction_said_at_the_trials_start():
    bandit = selector(window=1, improvement="printed", prediction="expert_utility", ema_rate=1.0)
    feed(bandit, 0, [1], predicted=0.9)
    feed(bandit, 0, [0], predicted=0.7)
    assert bandit.improvement(0) == pytest.approx(0.7 - 0.1)


def test_running_success_may_predict_in_place_of_the_expert():
    bandit = selector(window=1, improvement="printed", prediction="running_success", ema_rate=1.0)
    feed(bandit, 0, [1, 1], predicted=0.123)
    # The first attempt was predicted at 0 (nothing known), the second at 1: errors 1 and 0.
    assert bandit.improvement(0) == pytest.approx(0.0 - 1.0)


def test_what_curiosity_achieved_may_be_worth_less_than_what_the_model_did():
    half = selector(explored_worth=0.5)
    feed(half, 1, [1, 0], is_explored=True)
    feed(half, 1, [1, 1])
    assert half.success(1) == pytest.approx((0.5 + 0.0 + 1.0 + 1.0) / 4)
    whole = selector()
    feed(whole, 1, [1, 0], is_explored=True)
    assert whole.success(1) == pytest.approx(0.5)


def test_an_attempt_is_credited_to_the_subgoal_or_a_whole_epoch_to_the_main_goal():
    by_subgoal, by_goal = selector(credit="subgoal"), selector(credit="main_goal")
    for bandit in (by_subgoal, by_goal):
        bandit.update(attempt(1, goal=2, is_achieved=True))
        bandit.end_epoch(2, predicted=0.5, is_achieved=True)
    assert [by_subgoal.success(g) for g in range(3)] == [0.0, 1.0, 0.0]
    assert [by_goal.success(g) for g in range(3)] == [0.0, 0.0, 1.0]


def test_a_void_trial_changes_nothing():
    bandit = selector()
    before = bandit.state_dict()
    bandit.update(attempt(0, is_achieved=False, outcome=TrialOutcome.VOID))
    assert encode(bandit.state_dict()) == encode(before)


def test_the_floor_keeps_every_goal_in_sight():
    bandit = selector(window=2, improvement="clipped_success", probability_floor=0.3)
    feed(bandit, 1, [0, 0, 1, 1])
    p = bandit.probabilities()
    assert p.min() == pytest.approx(0.1, abs=1e-6)
    assert p.sum() == pytest.approx(1.0)


def test_a_part_of_the_floor_goes_where_epochs_fail():
    bandit = selector(window=2, improvement="clipped_success", probability_floor=0.6, floor_by_failure=0.5)
    for goal, is_achieved in enumerate((True, True, False)):
        for _ in range(3):
            bandit.end_epoch(goal, predicted=0.5, is_achieved=is_achieved)
    # A goal tried in vain on the way to another does not fail by that.
    feed(bandit, 0, [0] * 20)
    p = bandit.probabilities()
    # Values are all 0, so the free part is even; failing rates are 0.05, 0.05 and 1.05 of 1.15.
    even, by_failure = 0.4 / 3 + 0.3 / 3, 0.3 * np.array([0.05, 0.05, 1.05]) / 1.15
    np.testing.assert_allclose(p, even + by_failure, rtol=1e-9)


def test_a_starved_goal_is_not_looked_at_without_the_floor_and_is_with_it():
    starving, floored = (selector(window=2, improvement="clipped_success", probability_floor=f) for f in (0.0, 0.3))
    chosen = []
    for bandit in (starving, floored):
        feed(bandit, 1, [0, 0, 1, 1])
        chosen.append({bandit.select() for _ in range(200)})
    assert chosen == [{1}, {0, 1, 2}]


def test_arming_again_raises_a_value_only_where_the_config_asks_for_it():
    for is_on in (True, False):
        bandit = selector(rearm=is_on, rearm_value=0.2)
        bandit.rearm((0, 2))
        assert bandit.values == ((0.2, 0.0, 0.2) if is_on else (0.0, 0.0, 0.0))


def test_a_goal_armed_again_is_worth_no_less_than_the_best():
    bandit = selector(rearm=True, window=2, improvement="clipped_success", ema_rate=1.0)
    feed(bandit, 1, [0, 0, 1, 1])
    bandit.rearm((2,))
    assert bandit.values[2] == bandit.values[1] == 1.0


def test_a_mastered_goal_that_begins_to_fail_arms_itself():
    bandit = selector(rearm=True, improvement="clipped_success", window=10)
    feed(bandit, 0, [1] * 30)
    assert bandit.values[0] == 0.0
    feed(bandit, 0, [0, 0])
    assert bandit.values[0] == pytest.approx(0.2)


def test_same_seed_twice_is_the_same_curriculum():
    first, second = selector(seed=3), selector(seed=3)
    assert [first.select() for _ in range(50)] == [second.select() for _ in range(50)]


def test_saved_loaded_and_continued_is_as_if_never_stopped():
    whole = selector(seed=5, rearm=True, improvement="absolute", window=2)
    feed(whole, 1, [0, 1, 0, 1, 1])
    whole.select()
    resumed = selector(seed=99, rearm=True, improvement="absolute", window=2)
    resumed.load_state_dict(decode(encode(whole.state_dict())))
    for bandit in (whole, resumed):
        feed(bandit, 1, [1, 1, 0])
    assert [whole.select() for _ in range(20)] == [resumed.select() for _ in range(20)]
    assert encode(whole.state_dict()) == encode(resumed.state_dict())
