import json
import math

import msgspec
import numpy as np
import pytest

from config.learning import LearningConfig
from config.loader import load_learning, load_scenario
from learning.checkpoint import decode, encode
from learning.experts import ExpertSet
from learning.interfaces import TrialOutcome
from tests.support.kinematic_table import KinematicTable

STEPS = 70
N_GOALS = 6
NEEDS_IN_HAND = {5: "blue_cylinder"}


@pytest.fixture(scope="module")
def config() -> LearningConfig:
    return load_learning("default")


class Practice:
    """Trials at goals drawn at random, each on a newly drawn table with open lids."""

    def __init__(self, config: LearningConfig, seed: int, *, column_order: tuple[int, ...] | None = None) -> None:
        self.table = KinematicTable(load_scenario("paper"), column_order=column_order)
        self.experts = ExpertSet(config, self.table.spec, n_goals=N_GOALS, rng=np.random.default_rng(seed))
        self.rng = np.random.default_rng(seed + 1000)

    def trial(self, goal: int, seed: int, *, explore: bool) -> bool:
        percept = self.table.reset(seed=seed, epoch=0)
        if goal in NEEDS_IN_HAND:
            self.table.hold(NEEDS_IN_HAND[goal])
        self.experts.begin_trial(goal, percept, explore=explore)
        before = self.table.achieved()
        outcome = TrialOutcome.NOT_REACHED
        for _ in range(STEPS):
            result = self.table.step(self.experts.act(percept))
            percept, now = result.percept, self.table.achieved()
            self.experts.observe(result, tuple(b and not a for a, b in zip(before, now, strict=True)))
            before = now
            if now[goal]:
                outcome = TrialOutcome.ACHIEVED
                break
        self.experts.end_trial(outcome)
        return outcome is TrialOutcome.ACHIEVED

    def practise(self, n_trials: int) -> None:
        for _ in range(n_trials):
            self.trial(int(self.rng.integers(N_GOALS)), int(self.rng.integers(1 << 30)), explore=True)

    def success(self, n_tests: int = 10) -> list[float]:
        return [
            float(np.mean([self.trial(goal, 10_000 + 97 * k + goal, explore=False) for k in range(n_tests)]))
            for goal in range(N_GOALS)
        ]


def frozen(experts: ExpertSet) -> bytes:
    return encode(experts.state_dict())


ORDERS = [
    pytest.param((8, 3, 0, 7, 5, 1, 2, 6, 4), id="permuted"),
    pytest.param(None, id="as listed", marks=pytest.mark.slow),
]


@pytest.mark.parametrize("column_order", ORDERS)
def test_all_skills_are_learnt_whatever_the_order_of_the_distances(config, column_order):
    practice = Practice(config, seed=21, column_order=column_order)
    practice.practise(300)
    success = practice.success()
    assert np.mean(success) >= 0.9, success
    assert min(success) >= 0.6, success


@pytest.mark.slow
def test_most_skills_are_learnt_with_a_learned_forward_model():
    """In one trial each; a thing approached in a straight line may be taken for its mirror image beside the line."""
    practice = Practice(load_learning("learned"), seed=21)
    practice.practise(300)
    success = practice.success()
    assert np.mean(success) >= 0.7, success


def test_nothing_works_before_anything_was_learnt(config):
    assert np.mean(Practice(config, seed=21).success(5)) < 0.2


@pytest.fixture(scope="module")
def practised(config) -> Practice:
    practice = Practice(config, seed=4)
    practice.practise(40)
    return practice


def test_a_tested_trial_draws_nothing_and_changes_nothing(practised):
    before = frozen(practised.experts)
    first = [practised.trial(g, 500 + g, explore=False) for g in range(N_GOALS)]
    assert frozen(practised.experts) == before
    assert [practised.trial(g, 500 + g, explore=False) for g in range(N_GOALS)] == first


def test_saved_loaded_and_continued_is_as_if_it_had_never_stopped(config):
    whole, first = Practice(config, seed=6), Practice(config, seed=6)
    whole.practise(24)
    first.practise(12)
    resumed = Practice(config, seed=99)
    resumed.rng = first.rng
    resumed.experts.load_state_dict(decode(frozen(first.experts)))
    resumed.practise(12)
    assert frozen(resumed.experts) == frozen(whole.experts)


def test_a_blocked_trial_says_nothing_against_the_skill_and_a_void_one_nothing_at_all(config):
    practice = Practice(config, seed=8)
    percept = practice.table.reset(seed=1, epoch=0)
    for outcome in (TrialOutcome.BLOCKED, TrialOutcome.VOID):
        skill = practice.experts.skill(0)
        practice.experts.begin_trial(0, percept, explore=True)
        result = practice.table.step(practice.experts.act(percept))
        practice.experts.observe(result, (False,) * N_GOALS)
        practice.experts.end_trial(outcome)
        assert practice.experts.skill(0) == skill


def test_utility_is_a_probability(practised):
    percept = practised.table.reset(seed=3, epoch=0)
    utilities = [practised.experts.utility(g, percept) for g in range(N_GOALS)]
    assert all(0.0 <= u <= 1.0 for u in utilities), json.dumps(utilities)


def blinded(percept):
    """The same P(t) and the same word on the fingers; everything else is garbage."""
    nowhere = (math.nan, math.nan, math.nan)
    grip = msgspec.structs.replace(percept.grip, opening_m=math.nan, has_object=not percept.grip.has_object)
    return msgspec.structs.replace(
        percept, objects=(), tcp_position_m=nowhere, grip=grip, is_in_contact=not percept.is_in_contact
    )


def test_with_a_learned_forward_model_experts_see_p_and_whether_the_fingers_move_and_nothing_else():
    table = KinematicTable(load_scenario("paper"))
    seeing, blind = (
        ExpertSet(load_learning("learned"), table.spec, n_goals=N_GOALS, rng=np.random.default_rng(3)) for _ in range(2)
    )
    for trial in range(6):
        percept = table.reset(seed=trial, epoch=0)
        dark = blinded(percept)
        seeing.begin_trial(trial % N_GOALS, percept, explore=True)
        blind.begin_trial(trial % N_GOALS, dark, explore=True)
        for _ in range(STEPS):
            intent = seeing.act(percept)
            assert blind.act(dark) == intent
            result = table.step(intent)
            percept, dark = result.percept, blinded(result.percept)
            executed = msgspec.structs.replace(result.executed, target_m=(math.nan, math.nan, math.nan))
            seeing.observe(result, table.achieved())
            blind.observe(msgspec.structs.replace(result, percept=dark, executed=executed), table.achieved())
        outcome = TrialOutcome.ACHIEVED if table.achieved()[trial % N_GOALS] else TrialOutcome.NOT_REACHED
        seeing.end_trial(outcome)
        blind.end_trial(outcome)
    assert frozen(seeing) == frozen(blind)
