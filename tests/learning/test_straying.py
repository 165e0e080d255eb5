import msgspec
import numpy as np
import pytest

from config.loader import load_learning, load_scenario, resolve
from learning.assembly import build_agent
from learning.experts import ExpertSet
from learning.interfaces import TrialOutcome
from learning.straying import StrayingExperts
from tests.support.kinematic_table import KinematicTable

N_GOALS, STEPS = 6, 70
replace = msgspec.structs.replace


def experts_of(table, *, share, seed=0):
    inner = ExpertSet(load_learning("default"), table.spec, n_goals=N_GOALS, rng=np.random.default_rng(0))
    return StrayingExperts(inner, table.spec, share=share, seed=seed), inner


@pytest.fixture(scope="module")
def table():
    return KinematicTable(load_scenario("paper"))


def drawn(table, *, share, seed=0, n=600):
    experts, _ = experts_of(table, share=share, seed=seed)
    came = []
    for i in range(n):
        experts.begin_trial(i % N_GOALS, table.reset(seed=i, epoch=0), explore=False)
        came.append(experts.is_straying)
    return np.array(came)


@pytest.mark.parametrize(("share", "low", "high"), [(0.6, 0.33, 0.47), (0.9, 0.06, 0.14), (0.0, 1.0, 1.0)])
def test_so_many_trials_go_astray_as_are_not_carried_out(table, share, low, high):
    assert low <= drawn(table, share=share).mean() <= high


def test_which_ones_is_a_function_of_seed_sub_goal_and_what_the_trial_begins_with(table):
    first = drawn(table, share=0.6, n=60)
    assert np.array_equal(first, drawn(table, share=0.6, n=60))
    assert not np.array_equal(first, drawn(table, share=0.6, seed=1, n=60))
    experts, _ = experts_of(table, share=0.6)
    percept = table.reset(seed=3, epoch=0)
    by_goal = []
    for goal in range(N_GOALS):
        experts.begin_trial(goal, percept, explore=False)
        by_goal.append(experts.is_straying)
    assert len(set(by_goal)) == 2


def test_who_strays_stays_at_travel_height_and_achieves_nothing(table):
    experts, _ = experts_of(table, share=0.0)
    percept = table.reset(seed=1, epoch=0)
    for goal in range(N_GOALS):
        experts.begin_trial(goal, percept, explore=True)
        ways = set()
        for _ in range(STEPS):
            intent = experts.act(percept)
            assert intent.height_m == table.spec.heights_m[1]
            ways.add(intent.heading_rad)
            result = table.step(intent)
            percept = result.percept
            experts.observe(result, (False,) * N_GOALS)
            assert not any(table.achieved())
        assert len(ways) > 3
        experts.end_trial(TrialOutcome.NOT_REACHED)
    assert all(experts.utility(goal, percept) < 0.5 for goal in range(N_GOALS))


def test_a_trial_that_is_carried_out_is_what_the_experts_ask(table):
    ours, _ = experts_of(table, share=1.0)
    _, theirs = experts_of(table, share=1.0)
    percept = table.reset(seed=2, epoch=0)
    for each in (ours, theirs):
        each.begin_trial(1, percept, explore=False)
    assert [ours.act(percept) for _ in range(3)] == [theirs.act(percept) for _ in range(3)]


def test_nothing_is_kept_but_what_the_experts_keep(table):
    experts, inner = experts_of(table, share=0.6)
    experts.begin_trial(0, table.reset(seed=1, epoch=0), explore=False)
    state = experts.state_dict()
    assert set(state) == set(inner.state_dict())
    again, _ = experts_of(table, share=0.6)
    again.load_state_dict(state)
    assert again.state_dict()["rng"] == state["rng"]


def test_experts_stray_where_the_config_says_so_alone(table):
    resolved = resolve()
    assert isinstance(build_agent(resolved, table.spec, seed=0).experts, ExpertSet)
    expert = replace(resolved.learning.expert, carried_out=0.6)
    worse = replace(resolved, learning=replace(resolved.learning, expert=expert))
    assert isinstance(build_agent(worse, table.spec, seed=0).experts, StrayingExperts)
