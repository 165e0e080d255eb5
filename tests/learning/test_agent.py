"""One epoch, as the paper tells it."""

import math

import msgspec
import numpy as np
import pytest

from config.learning import Experiment
from learning.agent import RISEN_WITHIN_M, Agent
from learning.checkpoint import encode
from learning.interfaces import TrialOutcome
from learning.seeds import named_generator
from tests.support.toy_learner import (
    N_GOALS,
    TOUCH_M,
    ToyExperts,
    ToyGoalSelector,
    ToyJudge,
    ToyStation,
    ToySubgoalSelector,
    make_toy_learner,
)


def free(goal, state, epoch):
    return True


class FixedGoal(ToyGoalSelector):
    """Always the same goal; records what it is told."""

    def __init__(self, goal):
        super().__init__(np.random.default_rng(0))
        self.goal = goal
        self.ended = []

    def select(self):
        return self.goal

    def end_epoch(self, goal, *, predicted, is_achieved):
        self.ended.append((goal, predicted, is_achieved))


class Sequence(ToySubgoalSelector):
    """Chooses sub-goals from a list, over and over; records what was available."""

    def __init__(self, *subgoals):
        super().__init__(np.random.default_rng(0))
        self.subgoals = subgoals
        self.seen = []

    def select(self, *, goal, state, available, temperature, explore):
        self.seen.append((state, available))
        return self.subgoals[(len(self.seen) - 1) % len(self.subgoals)]


class FadingJudge(ToyJudge):
    """Goal 1 holds only while the tool is near its lamp: it can be lost again."""

    def achieved(self, percept):
        lit = list(super().achieved(percept))
        lit[1] = lit[1] and percept.distances_m[1] < TOUCH_M
        return tuple(lit)


class LiftingStation(ToyStation):
    """The tool has a height that follows the intents; what is asked of it between trials is recorded."""

    RISE_M = 0.02

    def __init__(self, *, lit_on_the_way_up=None, void_on_the_way_up=False):
        super().__init__(free)
        self.height_m = 0.1
        self.rises = []
        self._lit_on_the_way_up, self._void_on_the_way_up = lit_on_the_way_up, void_on_the_way_up

    def step(self, intent, *, duration_s=None):
        change_m = min(max(intent.height_m - self.height_m, -self.RISE_M), self.RISE_M)
        self.height_m += change_m
        is_rising = change_m > 0.0
        if is_rising:
            self.rises.append(intent)
        if is_rising and self._lit_on_the_way_up is not None:
            self._lit[self._lit_on_the_way_up] = True
        result = super().step(intent, duration_s=duration_s)
        return msgspec.structs.replace(result, is_void=result.is_void or (is_rising and self._void_on_the_way_up))

    def _percept(self):
        percept = super()._percept()
        x, y, _ = percept.tcp_position_m
        return msgspec.structs.replace(percept, tcp_position_m=(x, y, self.height_m))


class Low(ToyExperts):
    """Moves as its parent does, at the bottom."""

    def act(self, percept):
        return msgspec.structs.replace(super().act(percept), height_m=0.0)


class Idle(ToyExperts):
    """Never moves."""

    def act(self, percept):
        return super().act(percept).__class__(heading_rad=0.0, distance_m=0.0, height_m=0.05)


class HandFull(ToyJudge):
    """A hand that holds something, which one goal is about."""

    def __init__(self, goal):
        self.about = goal

    def is_hand_free(self, goal, percept):
        return goal == self.about


class Told(Idle):
    """Never moves; records whether a miss was a fair try."""

    def __init__(self, rng):
        super().__init__(rng)
        self.told = []

    def end_trial(self, outcome, *, is_fair=True, late=None):
        self.told.append(is_fair)


class Curious(ToyExperts):
    """Says that curiosity moved the arm."""

    is_exploring = True


def skilled(kind=ToyExperts):
    experts = kind(np.random.default_rng(0))
    experts.load_state_dict({**experts.state_dict(), "worth": 9.0 * np.eye(N_GOALS)})
    return experts


def agent_for(goal, subgoals, *, experts=None, judge=None, **protocol):
    return Agent(
        goal_selector=FixedGoal(goal),
        subgoal_selector=Sequence(*subgoals),
        experts=experts or skilled(),
        judge=judge or ToyJudge(),
        protocol=Experiment(**protocol),
    )


def learn(agent, allowed=free, **station):
    return agent.learn_epoch(ToyStation(allowed, **station), epoch=5, seed=3, goal=agent.choose_goal())


def outcomes(record):
    return [entry.attempt.outcome for entry in record.trials]


def test_an_epoch_ends_when_its_goal_is_achieved():
    record = learn(agent_for(2, (0, 1, 2, 3)))
    assert record.is_achieved
    assert [entry.attempt.subgoal for entry in record.trials] == [0, 1, 2]
    assert outcomes(record) == [TrialOutcome.ACHIEVED] * 3
    assert [entry.trial for entry in record.trials] == [1, 2, 3]


def test_an_epoch_has_eight_trials_at_most_and_a_trial_seventy_steps():
    record = learn(agent_for(2, (2,), experts=skilled(Idle)))
    assert not record.is_achieved
    assert outcomes(record) == [TrialOutcome.NOT_REACHED] * 8
    assert [entry.attempt.n_steps for entry in record.trials] == [70] * 8
    assert record.n_steps == 560


@pytest.mark.parametrize(("kind", "expected"), [(ToyExperts, False), (Curious, True)])
def test_an_attempt_tells_who_moved_the_arm(kind, expected):
    record = learn(agent_for(0, (0,), experts=skilled(kind)))
    assert [entry.attempt.is_explored for entry in record.trials] == [expected]


def test_what_was_achieved_stays_in_the_state_for_the_epoch_and_only_for_it():
    agent = agent_for(2, (0, 1, 2))
    record = learn(agent)
    assert [entry.attempt.state for entry in record.trials] == [
        (False, False, False, False),
        (True, False, False, False),
        (True, True, False, False),
    ]
    assert record.trials[-1].attempt.state_after == (True, True, True, False)
    assert learn(agent).trials[0].attempt.state == (False, False, False, False)


def test_a_place_reached_to_no_effect_ends_the_trial_after_three_steps_as_blocked():
    record = learn(agent_for(2, (2,)), allowed=lambda goal, state, epoch: goal != 2)
    assert outcomes(record) == [TrialOutcome.BLOCKED] * 8
    # From the second trial on the tool is there already.
    assert [entry.attempt.n_steps for entry in record.trials[1:]] == [3] * 7


def test_a_blocked_trial_may_be_let_run_to_its_timeout():
    record = learn(agent_for(2, (2,), end_blocked=False), allowed=lambda goal, state, epoch: goal != 2)
    assert outcomes(record) == [TrialOutcome.BLOCKED] * 8
    assert [entry.attempt.n_steps for entry in record.trials] == [70] * 8


def test_passing_a_place_for_fewer_steps_is_not_blocked():
    agent = agent_for(2, (2,), steps=8, blocked_after=9, end_blocked=False)
    record = learn(agent, allowed=lambda goal, state, epoch: goal != 2)
    assert set(outcomes(record)) == {TrialOutcome.NOT_REACHED}


def test_a_goal_reached_by_accident_is_latched_and_ends_the_epoch_after_the_trial():
    experts = ToyExperts(np.random.default_rng(0))
    heads_for_2 = np.zeros((N_GOALS, N_GOALS))
    heads_for_2[:, 2] = 9.0
    experts.load_state_dict({**experts.state_dict(), "worth": heads_for_2})
    record = learn(agent_for(2, (0,), experts=experts))
    assert record.is_achieved
    assert outcomes(record) == [TrialOutcome.NOT_REACHED]
    assert record.trials[0].attempt.state_after == (False, False, True, False)


def test_a_goal_that_was_lost_again_may_be_chosen_again_and_one_that_holds_may_not():
    agent = agent_for(3, (1, 0, 1, 3), judge=FadingJudge())
    record = learn(agent)
    states, available = zip(*agent.subgoal_selector.seen, strict=True)
    assert available == (
        (True, True, True, True),
        (True, False, True, True),
        (False, True, True, True),
        (False, False, True, True),
    )
    assert states[2] == (True, True, False, False)
    assert outcomes(record) == [TrialOutcome.ACHIEVED] * 4


def test_a_void_trial_ends_the_epoch_and_teaches_nothing():
    learner = make_toy_learner(0, Experiment(), void_epochs=(5,))
    agent = learner.agent
    for epoch in range(5):
        agent.learn_epoch(learner.station, epoch=epoch, seed=epoch, goal=agent.choose_goal())
    before = agent.state_dict()
    n_attempts = len(agent.goal_selector.attempts)
    record = agent.learn_epoch(learner.station, epoch=5, seed=5, goal=agent.choose_goal())
    after = agent.state_dict()
    assert record.is_void
    assert not record.is_achieved
    assert outcomes(record) == [TrialOutcome.VOID]
    assert len(agent.goal_selector.attempts) == n_attempts
    for layer in before:
        before[layer].pop("rng"), after[layer].pop("rng")
    assert encode(before) == encode(after)


def pursue(station, subgoals, **protocol):
    """Pursue goal 2 with experts that work at the bottom; return the agent and the epoch's record."""
    agent = agent_for(2, subgoals, experts=skilled(Low), **protocol)
    return agent, agent.learn_epoch(station, epoch=5, seed=3, goal=2)


def test_between_trials_the_tool_rises_straight_up_and_no_further_than_it_must():
    station = LiftingStation()
    _, record = pursue(station, (0, 1, 2))
    assert outcomes(record) == [TrialOutcome.ACHIEVED] * 3
    steps_up = math.ceil((0.1 - RISEN_WITHIN_M) / LiftingStation.RISE_M)
    assert len(station.rises) == 2 * steps_up
    assert {(rise.distance_m, rise.height_m) for rise in station.rises} == {(0.0, 0.1)}


def test_rising_between_trials_is_no_time_step_of_theirs_and_can_be_left_out():
    high, low = LiftingStation(), LiftingStation()
    _, record = pursue(high, (0, 1, 2))
    _, without = pursue(low, (0, 1, 2), retreat=False)
    assert low.rises == []
    assert record.n_steps == without.n_steps


def test_a_void_on_the_way_up_makes_the_epoch_void_and_leaves_what_its_trials_taught():
    agent, record = pursue(LiftingStation(void_on_the_way_up=True), (0, 2))
    assert (record.is_void, record.is_achieved) == (True, False)
    assert outcomes(record) == [TrialOutcome.ACHIEVED]
    assert [attempt.subgoal for attempt in agent.goal_selector.attempts] == [0]
    assert agent.goal_selector.ended == []


def test_a_goal_that_comes_about_on_the_way_up_ends_the_epoch():
    _, record = pursue(LiftingStation(lit_on_the_way_up=2), (0, 1, 2))
    assert (record.is_void, record.is_achieved) == (False, True)
    assert [entry.attempt.subgoal for entry in record.trials] == [0]


def test_what_comes_about_on_the_way_up_is_in_the_next_trials_state():
    _, record = pursue(LiftingStation(lit_on_the_way_up=1), (0, 2))
    assert record.trials[1].attempt.state == (True, True, False, False)


def test_the_goal_selector_hears_of_every_epoch_but_void_ones():
    agent = agent_for(2, (2,))
    learn(agent)
    assert agent.goal_selector.ended == [(2, 9.0, True)]
    learn(agent, void_epochs=(5,))
    assert len(agent.goal_selector.ended) == 1


def test_experts_hear_whether_what_the_hand_holds_left_them_a_fair_try():
    experts = Told(np.random.default_rng(0))
    learn(agent_for(2, (2, 1, 2), experts=experts, judge=HandFull(2), trials=3))
    assert experts.told == [True, False, True]


def test_prediction_and_skill_are_said_before_the_trial():
    agent = agent_for(2, (2,))
    attempt = learn(agent).trials[0].attempt
    assert (attempt.predicted, attempt.skill) == (9.0, 0.5)
    assert agent.experts.skill(2) == 0.6


def test_a_test_epoch_changes_nothing_learnt_and_draws_nothing():
    learner = make_toy_learner(1, Experiment())
    agent = learner.agent
    for epoch in range(20):
        agent.learn_epoch(learner.station, epoch=epoch, seed=epoch, goal=agent.choose_goal())
    before = encode(learner.agent.state_dict())
    records = [learner.agent.test_epoch(learner.station, epoch=3, seed=9, goal=goal) for goal in range(N_GOALS)]
    assert encode(learner.agent.state_dict()) == before
    assert [record.goal for record in records] == [0, 1, 2, 3]
    assert learner.agent.test_epoch(learner.station, epoch=3, seed=9, goal=3) == records[3]


def test_generators_of_different_names_are_different_and_of_one_name_the_same():
    assert named_generator(4, "goals").random() == named_generator(4, "goals").random()
    assert named_generator(4, "goals").random() != named_generator(4, "subgoals").random()
    assert named_generator(4, "goals").random() != named_generator(5, "goals").random()
