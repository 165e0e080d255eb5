"""What a trial came to is looked at again where the hand hides it, and where nothing hides it the arm moves nowhere."""

import msgspec
import numpy as np
import pytest

from config.learning import Experiment
from learning.agent import Agent
from learning.interfaces import TrialOutcome
from learning.looking import ways_to_look
from tests.support.toy_learner import N_GOALS, ToyStation, make_toy_learner

PROTOCOL = Experiment(epochs=1, trials=3, steps=30, retreat=False, blocked_after=2)


class HidingStation(ToyStation):
    """A toy table whose lamps cannot be seen from so low, or were last seen some time ago."""

    def __init__(self, *, clear_m=0.1, age_s=0.0, **rest):
        super().__init__(**rest)
        self.height_m, self._clear_m, self._age_s = 0.05, clear_m, age_s
        self.heights = []

    def step(self, intent, *, duration_s=None):
        self.height_m = 0.05 if intent.distance_m else min(self.height_m + 0.02, intent.height_m)
        self.heights.append(self.height_m)
        return super().step(intent, duration_s=duration_s)

    def _percept(self):
        whole = super()._percept()
        is_clear = self.height_m >= self._clear_m
        lit = whole.button_states if is_clear else (0.0,) * N_GOALS
        return msgspec.structs.replace(
            whole, button_states=lit, valid=(True,) * N_GOALS + (is_clear,) * N_GOALS,
            ages_s=(0.0,) * N_GOALS + (self._age_s,) * N_GOALS,
        )  # fmt: skip


def run(station, goal=0):
    learner = make_toy_learner(0, PROTOCOL)
    agent: Agent = learner.agent
    noticed = []
    agent.experts.end_trial = lambda outcome, *, is_fair, late: noticed.append((is_fair, late))
    return agent.test_epoch(station, epoch=0, seed=3, goal=goal), noticed


def test_what_is_always_seen_is_not_looked_at_again():
    record, noticed = run(ToyStation())
    assert record.is_achieved
    assert noticed == [(True, None)] * len(noticed)


def test_a_lamp_under_the_hand_is_seen_on_looking_again_and_is_told_of_the_step_that_lit_it():
    station = HidingStation()
    record, noticed = run(station)
    assert record.is_achieved
    assert record.trials[-1].attempt.outcome is TrialOutcome.ACHIEVED
    is_fair, late = noticed[-1]
    assert is_fair
    assert late.achieved[record.trials[-1].attempt.subgoal]
    assert not any(late.percept.button_states), "what is learnt from is the percept of the place, not of the look"


def test_a_lamp_that_cannot_be_seen_from_anywhere_is_no_proof_of_a_block():
    station = HidingStation(clear_m=9.9)
    record, noticed = run(station)
    assert not record.is_achieved
    assert not any(is_fair for is_fair, _ in noticed), "and no evidence against the skill"
    assert {trial.attempt.outcome for trial in record.trials} == {TrialOutcome.NOT_REACHED}


def test_a_lamp_that_was_seen_before_the_trial_ended_is_waited_for():
    assert run(HidingStation(clear_m=0.0, age_s=0.01))[0].is_achieved


def test_a_look_rises_first_and_ends_above_where_it_began():
    spec = ToyStation().spec
    ways = list(ways_to_look(spec))
    assert all(way.height_m == spec.heights_m[1] for way in ways)
    assert ways[0].distance_m == 0.0
    x, y = 0.0, 0.0
    for way in ways:
        assert way.distance_m <= spec.max_step_m
        x, y = x + way.distance_m * np.cos(way.heading_rad), y + way.distance_m * np.sin(way.heading_rad)
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-12)
