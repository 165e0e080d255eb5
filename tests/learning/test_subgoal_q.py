"""Q-learning over goal-states: updates by hand, the known-context rule, masking, hindsight, state that can be kept."""

import numpy as np
import pytest

from config.learning import SubgoalSelection
from learning.checkpoint import decode, encode
from learning.interfaces import Attempt, TrialOutcome
from learning.subgoal_selector import SELECTORS, make_subgoal_selector

ALL = (True, True, True)


def selector(kind="q", *, seed=0, **config):
    config = {"alpha": 0.5, "gamma": 0.8, "dyna_replays": 0} | config
    return make_subgoal_selector(
        n_goals=3, config=SubgoalSelection(kind=kind, **config), rng=np.random.default_rng(seed)
    )


def state(*goals):
    return tuple(i in goals for i in range(3))


def trial(goal, subgoal, before, after, outcome=None):
    outcome = outcome or (TrialOutcome.ACHIEVED if subgoal in after else TrialOutcome.NOT_REACHED)
    return Attempt(
        epoch=0, goal=goal, subgoal=subgoal, state=state(*before), state_after=state(*after), outcome=outcome,
        predicted=0.5, skill=0.9, n_steps=10,
    )  # fmt: skip


def test_achieving_the_goal_is_worth_one_by_alpha():
    q = selector()
    q.update(trial(2, 2, (), (2,)))
    assert q.q_values(2, state()).tolist() == [0.0, 0.0, 0.5]
    assert q.q_values(1, state()).tolist() == [0.0, 0.0, 0.0]


def test_a_step_towards_it_is_worth_gamma_of_the_best_next():
    q = selector()
    q.update(trial(2, 2, (0,), (0, 2)))  # Q(0 on, 2) = 0.5
    q.update(trial(2, 0, (), (0,)))  # Q(-, 0) = 0.5 * 0.8 * 0.5
    assert q.q_values(2, state())[0] == pytest.approx(0.2)


def test_a_failure_decays_towards_gamma_of_the_same_goal_state():
    q = selector()
    q.update(trial(2, 2, (), (2,)))
    q.update(trial(2, 2, (), ()))
    assert q.q_values(2, state())[2] == pytest.approx(0.5 + 0.5 * (0.8 * 0.5 - 0.5))


def test_with_the_known_context_rule_a_failure_counts_only_where_there_was_success():
    q = selector(known_context=True)
    q.update(trial(2, 0, (), (0,)))
    q.update(trial(2, 2, (0,), (0, 2)))
    q.update(trial(2, 0, (), (0,)))
    before = q.q_values(2, state())
    q.update(trial(2, 1, (), ()))  # never achieved from here: does not count
    assert q.q_values(2, state()).tolist() == before.tolist()
    q.update(trial(2, 0, (), ()))  # achieved from here before: counts
    assert q.q_values(2, state())[0] < before[0]


def test_without_the_rule_every_failure_counts():
    q = selector(known_context=False)
    q.update(trial(2, 2, (), (2,)))
    q.update(trial(2, 1, (), ()))
    assert q.q_values(2, state())[1] == pytest.approx(0.5 * 0.8 * 0.5)


@pytest.mark.parametrize("kind", list(SELECTORS))
def test_only_available_subgoals_are_chosen(kind):
    q = selector(kind)
    q.update(trial(2, 2, (), (2,)))
    for explore in (True, False):
        chosen = {
            q.select(goal=1, state=state(0, 2), available=(False, True, False), temperature=0.5, explore=explore)
            for _ in range(20)
        }
        assert chosen == {1}


@pytest.mark.parametrize("kind", list(SELECTORS))
def test_nothing_available_is_refused(kind):
    with pytest.raises(ValueError, match="at least one"):
        selector(kind).select(goal=0, state=ALL, available=(False,) * 3, temperature=0.5, explore=True)


@pytest.mark.parametrize("kind", list(SELECTORS))
def test_testing_draws_nothing_and_changes_nothing(kind):
    q = selector(kind)
    q.update(trial(2, 0, (), (0,)))
    before = encode(q.state_dict())
    for s in (state(), state(0), state(1)):
        available = tuple(not on for on in s)
        choices = {q.select(goal=2, state=s, available=available, temperature=9.0, explore=False) for _ in range(5)}
        assert len(choices) == 1
    assert encode(q.state_dict()) == before


@pytest.mark.parametrize("kind", list(SELECTORS))
def test_void_trials_change_nothing(kind):
    q = selector(kind, dyna_replays=5)
    q.update(trial(2, 2, (), (2,)))
    q.update(trial(2, 1, (), (1,), TrialOutcome.NOT_REACHED))
    before = encode(q.state_dict())
    q.update(trial(2, 0, (), (0,), TrialOutcome.VOID))
    after = q.state_dict()
    after.pop("changed", None)
    kept = decode(before)
    kept.pop("changed", None)
    assert encode(after) == encode(kept)


def test_hindsight_learns_about_every_goal_from_one_trial():
    q = selector("q_hindsight")
    q.update(trial(2, 0, (), (0,)))
    assert q.q_values(0, state())[0] == pytest.approx(0.5)
    assert q.q_values(2, state())[0] == 0.0
    plain = selector("q")
    plain.update(trial(2, 0, (), (0,)))
    assert plain.q_values(0, state())[0] == 0.0


def test_what_came_about_by_accident_is_learnt_in_hindsight():
    q = selector("q_hindsight")
    q.update(trial(2, 0, (), (1,), TrialOutcome.NOT_REACHED))
    assert q.q_values(1, state())[0] == pytest.approx(0.5)


def test_replays_spread_value_backwards_faster_than_trials():
    with_replays, without = selector("q_hindsight", dyna_replays=50), selector("q_hindsight")
    for q in (with_replays, without):
        q.update(trial(2, 0, (), (0,)))
        q.update(trial(2, 2, (0,), (0, 2)))
    assert without.q_values(2, state())[0] == 0.0
    assert with_replays.q_values(2, state())[0] > 0.5


def test_a_state_that_never_was_has_no_row():
    q = selector()
    q.select(goal=2, state=state(1), available=(True, False, True), temperature=0.5, explore=True)
    assert q.state_dict()["states"].size == 0


@pytest.mark.parametrize("kind", list(SELECTORS))
def test_saved_loaded_and_continued_is_as_if_never_stopped(kind):
    whole, resumed = selector(kind, seed=1, dyna_replays=7), selector(kind, seed=2, dyna_replays=7)
    steps = [(0, (), (0,)), (2, (0,), (0, 2)), (1, (), ()), (2, (), ())]
    for subgoal, before, after in steps:
        whole.update(trial(2, subgoal, before, after))
    resumed.load_state_dict(decode(encode(whole.state_dict())))
    for q in (whole, resumed):
        for subgoal, before, after in steps:
            q.update(trial(1, subgoal, before, after, TrialOutcome.BLOCKED if subgoal not in after else None))
    choices = [
        [q.select(goal=2, state=state(), available=ALL, temperature=0.3, explore=True) for _ in range(30)]
        for q in (whole, resumed)
    ]
    assert choices[0] == choices[1]
    assert encode(whole.state_dict()) == encode(resumed.state_dict())


def test_an_untaught_table_does_not_go_by_the_order_of_the_goals():
    firsts = {
        selector(seed=seed).select(goal=2, state=state(), available=ALL, temperature=0.1, explore=False)
        for seed in range(20)
    }
    assert firsts == {0, 1, 2}
