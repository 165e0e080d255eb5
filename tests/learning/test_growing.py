"""What happens to each layer when a goal becomes known: it grows, and what it knew it knows."""

import copy

import numpy as np
import pytest

from config.learning import GoalSelection, SubgoalSelection
from config.loader import load_learning, load_scenario
from learning.abstract.added import run_added
from learning.abstract.learner import as_config_says, as_oracle
from learning.abstract.oracle import Told
from learning.abstract.rules import Rules, draw_more_rules, draw_rules, needs, optimal_trials
from learning.abstract.table import AbstractTable, Skills
from learning.checkpoint import decode, encode
from learning.experts import ExpertSet
from learning.goal_selector import GoalSelector
from learning.interfaces import TrialOutcome
from learning.preconditions import Belief, Evidence, Kind, Needs, Situation, conjunctions
from learning.subgoal_selector import SELECTORS, make_subgoal_selector
from tests.support.kinematic_table import KinematicTable

PRIOR = {"max_literals": 3, "literal_cost": 2.0, "false_positive": 0.02}
RULES: Rules = (needs(), needs(), needs([0], [1]), needs([2]))
LATER: Rules = (*RULES, needs([3], [1]))
PRESETS = ("default", "hindsight", "paper", "mdp", "drop", "direct")


# ------------------------------------------------------------------------------------------------------------- beliefs


def test_a_belief_that_has_seen_nothing_grows_into_one_that_has_seen_nothing():
    grown, fresh = Belief(n_goals=4, goal=1, **PRIOR).grown(6), Belief(n_goals=6, goal=1, **PRIOR)
    assert np.allclose(grown.probabilities, fresh.probabilities)
    assert grown.most_probable == Needs(0, 0)


def learnt_belief():
    belief = Belief(n_goals=4, goal=3, **PRIOR)
    rng = np.random.default_rng(0)
    for i in range(40):
        held = int(rng.integers(8))
        here = Situation(held, held)
        is_on = bool(held & 1) and not held & 2
        belief.expect_change(0.002, local=0.8)
        kind = Kind.ACHIEVED if is_on else Kind.BLOCKED
        belief.update(Evidence(epoch=i, kind=kind, readings=(here,)), block_hit=0.9)
    return belief


def test_what_a_belief_grew_from_is_what_it_says_of_the_goals_of_before():
    belief = learnt_belief()
    grown = belief.grown(6)
    before = list(conjunctions(4, 3, 3))
    after = list(conjunctions(6, 3, 3))
    assert grown.most_probable == belief.most_probable == needs([0], [1])
    weights = dict(zip(before, belief.probabilities, strict=True))
    expected = np.array(
        [weights[Needs(n.on & 15, n.off & 15)] * np.exp(-2.0 * ((n.on | n.off) & ~15).bit_count()) for n in after]
    )
    assert np.allclose(grown.probabilities, expected / expected.sum())
    assert grown.probabilities.sum() == pytest.approx(1.0)


def test_no_belief_of_what_is_allowed_is_turned_round_by_growing():
    belief = learnt_belief()
    grown = belief.grown(6)
    for held in range(8):
        then, now = (b.predict_allowed(Situation(held, held)) for b in (belief, grown))
        assert (then > 0.5) == (now > 0.5)
        assert now == pytest.approx(then, abs=0.25)


def test_a_grown_belief_finds_out_that_the_new_goal_is_in_the_way():
    grown = learnt_belief().grown(5)
    on, both = Situation(1, 1), Situation(0b10001, 0b10001)
    for i in range(8):
        grown.update(Evidence(epoch=50 + i, kind=Kind.ACHIEVED, readings=(on,)), block_hit=0.9)
        grown.update(Evidence(epoch=50 + i, kind=Kind.BLOCKED, readings=(both,)), block_hit=0.9)
    assert grown.most_probable == needs([0], [1, 4])


# -------------------------------------------------------------------------------------------------------- upper layers


def learnt(preset, n_epochs=120, seed=38):
    table = AbstractTable(n_goals=len(LATER), skills=Skills(), rng=np.random.default_rng(seed))
    table.rules = LATER
    learner = as_config_says(load_learning(preset))(len(RULES), np.random.default_rng(seed + 1))
    for epoch in range(n_epochs):
        learner.learn_epoch(table, epoch)
    return table, learner


def states():
    return [tuple(bool(k >> i & 1) for i in range(4)) for k in range(16)]


def chosen(selector, goal, n):
    """What is chosen for a goal wherever it is not on, exploration off; new goals are never on."""
    came = []
    for state in states():
        if not state[goal]:
            whole = (*state, *(False,) * (n - 4))
            came.append(
                selector.select(
                    goal=goal, state=whole, available=tuple(not on for on in whole), temperature=0.1, explore=False
                )
            )
    return came


@pytest.mark.parametrize("preset", PRESETS)
def test_what_is_chosen_for_a_goal_of_before_is_chosen_still(preset):
    _, learner = learnt(preset)
    before = [chosen(learner.selector, goal, 4) for goal in range(4)]
    learner.grow(6)
    after = [chosen(learner.selector, goal, 6) for goal in range(4)]
    same = [a == b for was, now in zip(before, after, strict=True) for a, b in zip(was, now, strict=True)]
    if preset in ("default", "direct"):
        assert all(same)
    else:  # tables of values: where nothing is known of any sub-goal one of the new may come first among equals
        known = [
            max(learner.selector.q_values(g, (*s, False, False))) > 0 for g in range(4) for s in states() if not s[g]
        ]
        assert all(is_same for is_same, is_known in zip(same, known, strict=True) if is_known)
        assert sum(known) > 3


@pytest.mark.parametrize("preset", PRESETS)
def test_saved_and_loaded_across_the_moment_is_identical_whatever_size_it_is_loaded_into(preset):
    table, learner = learnt(preset, n_epochs=40)
    small = decode(encode(learner.state_dict()))
    make = as_config_says(load_learning(preset))
    _, bigger = learnt(preset, n_epochs=10, seed=39)
    bigger.grow(5)
    courses = []
    for other in (learner, make(4, np.random.default_rng(9)), bigger):
        other.load_state_dict(decode(encode(small)))
        own_table = copy.deepcopy(table)
        other.grow(5)
        big = decode(encode(other.state_dict()))
        course = [other.learn_epoch(own_table, 40 + i) for i in range(30)]
        again = make(4, np.random.default_rng(3))
        again.load_state_dict(big)
        own_table = copy.deepcopy(table)
        assert [again.learn_epoch(own_table, 40 + i) for i in range(30)] == course
        courses.append((course, encode(other.state_dict())))
    assert courses[0] == courses[1] == courses[2]


def test_a_new_goal_is_wanted_most_where_goals_are_armed_again_and_elsewhere_like_any_other():
    for rearm in (True, False):
        config = GoalSelection(rearm=rearm, probability_floor=0.2)
        selector = GoalSelector(n_goals=3, config=config, subgoals=SubgoalSelection(), rng=np.random.default_rng(0))
        selector.grow(4)
        chances = selector.probabilities()
        assert bool(chances[3] > 0.8) is rearm
        assert np.allclose(chances[:3], chances[0])
        assert rearm or np.allclose(chances, 0.25)


def test_curiosity_is_awake_again():
    _, learner = learnt("default", n_epochs=5)
    learner.selector._curiosity._interest = 0.2
    learner.grow(5)
    assert learner.selector._curiosity._interest == 1.0


def test_who_cannot_take_in_a_goal_says_so():
    told = Told(n_goals=4, max_literals=2, hazard=0.01, skills=Skills())
    with pytest.raises(TypeError, match="expected layers that take in new goals, OracleGoals does not"):
        as_oracle(told)(4, np.random.default_rng(0)).grow(5)


def test_every_selector_takes_in_goals():
    for kind in SELECTORS:
        selector = make_subgoal_selector(n_goals=3, config=SubgoalSelection(kind=kind), rng=np.random.default_rng(0))
        selector.grow(5)
        free = (True,) * 5
        came = selector.select(goal=4, state=(False,) * 5, available=free, temperature=0.1, explore=True)
        assert 0 <= came < 5


@pytest.mark.parametrize("seed", [38, pytest.param(39, marks=pytest.mark.slow)])
def test_an_added_goal_is_mastered_soon_and_the_others_stay_mastered(seed):
    rng = np.random.default_rng(seed)
    rules = draw_more_rules(rng, draw_rules(rng, 5, max_literals=2), 6, max_literals=2)
    came = run_added(
        seed=seed, learner=as_config_says(load_learning("default")), rules=rules, n_known=5, at=100, epochs=60
    )
    assert came.mastered_after is not None
    assert came.mastered_after <= 40
    assert came.old_least_success >= 0.9


def test_rules_of_more_goals_leave_those_of_the_others_and_can_be_met():
    for seed in (31, 32, 33):
        rng = np.random.default_rng(seed)
        first = draw_rules(rng, 4, max_literals=2)
        whole = draw_more_rules(rng, first, 6, max_literals=2)
        assert whole[:4] == first
        assert len(whole) == 6
        assert max(optimal_trials(whole)) <= 5


# -------------------------------------------------------------------------------------------------------------- experts


@pytest.fixture(scope="module")
def table():
    return KinematicTable(load_scenario("paper"))


def experts_of(table, n_goals, seed=0):
    return ExpertSet(load_learning("default"), table.spec, n_goals=n_goals, rng=np.random.default_rng(seed))


def practise(experts, table, seed):
    percept = table.reset(seed=seed, epoch=0)
    experts.begin_trial(seed % 3, percept, explore=True)
    for _ in range(12):
        result = table.step(experts.act(percept))
        percept = result.percept
        experts.observe(result, (False,) * 6)
    experts.end_trial(TrialOutcome.NOT_REACHED)


def test_the_models_of_before_stay_as_they_are_bit_for_bit(table):
    experts = experts_of(table, 4)
    for seed in range(4):
        practise(experts, table, seed)
    before = [encode({"m": m}) for m in experts.state_dict()["models"]]
    experts.grow(6)
    after = [encode({"m": m}) for m in experts.state_dict()["models"]]
    assert after[:4] == before
    assert len(after) == 6
    assert after[4] != after[5]
    assert experts.skill(5) == experts_of(table, 6).skill(5)


def test_a_resume_before_the_moment_grows_the_same_models(table):
    experts = experts_of(table, 4)
    for seed in range(3):
        practise(experts, table, seed)
    kept = decode(encode(experts.state_dict()))
    resumed = experts_of(table, 4, seed=8)
    resumed.load_state_dict(kept)
    for each in (experts, resumed):
        each.grow(6)
        for seed in range(3, 6):
            practise(each, table, seed)
    assert encode(experts.state_dict()) == encode(resumed.state_dict())
    smaller = experts_of(table, 4, seed=3)
    smaller.load_state_dict(decode(encode(experts.state_dict())))
    assert encode(smaller.state_dict()) == encode(experts.state_dict())
