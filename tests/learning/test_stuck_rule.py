"""When a model counts as stuck, step by step as the README tells it."""

import msgspec
import numpy as np
import pytest

from config.learning import Expert, LearningConfig
from config.loader import load_scenario
from learning.experts import ExpertSet
from learning.interfaces import TrialOutcome
from robot.messages import Heading
from tests.support.kinematic_table import KinematicTable

N_GOALS = 6
NOTHING = (False,) * N_GOALS
STILL = Heading(heading_rad=0.0, distance_m=0.0, height_m=0.1)


class Scripted:
    """Trials at goal 0 in which every distance is as a script says, whatever is asked."""

    def __init__(self, **expert) -> None:
        self.table = KinematicTable(load_scenario("paper"))
        config = LearningConfig(name="test", expert=Expert(established_after=1, **expert))
        self.experts = ExpertSet(config, self.table.spec, n_goals=N_GOALS, rng=np.random.default_rng(2))
        self.led_away([0.3] * 5, outcome=TrialOutcome.ACHIEVED)

    def led_away(self, distances_m, *, outcome=TrialOutcome.BLOCKED, moving=()):
        """Return the time steps, counted from 1, in which curiosity and not the model moved the arm."""
        percept, led = self._at(self.table.reset(seed=1, epoch=0), distances_m[0], is_moving=1 in moving), []
        self.experts.begin_trial(0, percept, explore=True)
        for step, distance_m in enumerate([*distances_m[1:], distances_m[-1]], start=1):
            self.experts.act(percept)
            led += [step] * self.experts.is_exploring
            result = self.table.step(STILL)
            percept = self._at(result.percept, distance_m, is_moving=step + 1 in moving)
            is_achieved = outcome is TrialOutcome.ACHIEVED and step == len(distances_m)
            self.experts.observe(msgspec.structs.replace(result, percept=percept), (is_achieved, *NOTHING[1:]))
        self.experts.end_trial(outcome)
        return led

    @staticmethod
    def _at(percept, distance_m, *, is_moving):
        grip = msgspec.structs.replace(percept.grip, is_moving=is_moving)
        return msgspec.structs.replace(percept, distances_m=(distance_m,) * len(percept.distances_m), grip=grip)


@pytest.fixture(scope="module")
def scripted() -> Scripted:
    return Scripted()


def creeping(n_steps, *, step_m):
    return [0.3 + k * step_m for k in range(n_steps)]


def test_it_is_led_away_for_fifteen_steps_yet_not_in_the_first_eleven_of_a_trial_or_after_it_was(scripted):
    # Eleven steps of the model's own, fifteen of curiosity's.
    assert scripted.led_away([0.3] * 60) == [*range(12, 27), *range(38, 53)]


def test_a_change_of_less_than_four_millimetres_over_eight_steps_is_stuck(scripted):
    assert scripted.led_away(creeping(20, step_m=0.00049))[:1] == [12]
    assert scripted.led_away(creeping(20, step_m=0.00051)) == []


def test_it_is_stuck_as_soon_as_the_last_move_lies_eight_steps_back(scripted):
    moves = creeping(20, step_m=0.01)
    assert scripted.led_away([*moves, *moves[-1:] * 12])[:1] == [28]


def test_a_hand_at_work_is_not_stuck(scripted):
    assert scripted.led_away([0.3] * 30, moving=range(1, 20))[:1] == [20]


def test_without_a_detour_it_is_left_where_it_is():
    assert Scripted(detour=0).led_away([0.3] * 60) == []
