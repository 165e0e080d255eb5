"""The oracle of the upper layers: it believes what Bayes' rule says, and what it tries is worth what it costs."""

from itertools import product

import numpy as np
import pytest

from learning.abstract.learner import as_oracle
from learning.abstract.oracle import Oracle, OracleSubgoals, Told, outcome_chances
from learning.abstract.oracle_belief import RuleBelief
from learning.abstract.oracle_value import after, information, worth_of_information, worth_of_success
from learning.abstract.protocol import is_graph_right, run_abstract
from learning.abstract.rules import bits, chance_of_needs, draw_rules, needs, situation
from learning.abstract.table import AbstractTable, Skills
from learning.checkpoint import decode, encode
from learning.interfaces import Attempt, TrialOutcome

N = 3
TUNING = (100, 101)
CALM = Skills(accident=0.0)


def flags(state, n_goals):
    return tuple(bool(state >> i & 1) for i in range(n_goals))


def told(*, n_goals=N, max_literals=1, hazard=0.0, skills=CALM):
    return Told(n_goals=n_goals, max_literals=max_literals, hazard=hazard, skills=skills)


def trial(goal, *, state=0, outcome=TrialOutcome.BLOCKED, n_goals=N, came_about=()):
    now = state | sum(1 << i for i in (*came_about, *((goal,) if outcome is TrialOutcome.ACHIEVED else ())))
    return Attempt(
        epoch=0, goal=goal, subgoal=goal, state=flags(state, n_goals), state_after=flags(now, n_goals), outcome=outcome,
        predicted=0.5, skill=0.5, n_steps=1,
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------------ what is known


def test_the_class_is_as_probable_as_rules_are_drawn():
    chances = chance_of_needs(4, 0, 2)
    assert sum(chances.values()) == pytest.approx(1.0)
    assert chances[needs()] == pytest.approx(1 / 3)
    assert chances[needs([1])] == pytest.approx(0.6 / 9)
    assert chances[needs([1], [2])] == pytest.approx(0.24 / 9)


def test_one_block_by_hand():
    """Two goals: goal 0 needs nothing (1/2), goal 1 on (0.3), goal 1 off (0.2), and is blocked in the empty state.

    Where it is allowed, in 1/2 + 1/5 of the cases, only an expert that fails (0.05) and is taken for blocked (0.05)
    does that, 0.0025; where it is not, one that does not fail and is seen (0.95 x 0.9), 0.855. So "goal 1 on" comes to
    0.3 x 0.855 / (0.3 x 0.855 + 0.7 x 0.0025) = 0.2565 / 0.25825.
    """
    oracle = Oracle(told(n_goals=2))
    oracle.learn(trial(0, n_goals=2))
    assert oracle.belief.chance_of((needs([1]), needs())) == pytest.approx(0.2565 / 0.25825 * 0.5)
    assert oracle.allowed()[0, 0] == pytest.approx(0.00175 / 0.25825)
    assert oracle.allowed()[0, 2] == pytest.approx((0.2565 + 0.5 * 0.0025) / 0.25825)


def test_two_epochs_with_a_change_between_them_by_hand():
    """Achieved in one epoch (1, s for the two that allow it), blocked in the next one, hazard 1/4.

    Unchanged (3/4): allowed for sure, so the block has 0.0025. Changed (1/4): drawn anew, 0.7 x 0.0025 + 0.3 x 0.855.
    """
    oracle = Oracle(told(n_goals=2, hazard=0.25))
    oracle.begin_epoch()
    oracle.learn(trial(0, outcome=TrialOutcome.ACHIEVED, n_goals=2))
    oracle.begin_epoch()
    oracle.learn(trial(0, n_goals=2))
    kept, changed = 0.75 * 0.0025, 0.25 * 0.25825
    to_on = 0.25 * 0.2565 / (kept + changed)
    assert oracle.belief.chance_of((needs([1]), needs())) == pytest.approx(to_on * 0.5)


def enumerated(trials, *, max_literals, hazard, skills):
    """What every rule set comes to by going through all histories of rule sets, epoch by epoch, one trial each."""
    priors = [chance_of_needs(N, g, max_literals) for g in range(N)]
    sets = list(product(*(prior.items() for prior in priors)))
    rules = [tuple(needed for needed, _ in chosen) for chosen in sets]
    prior = np.array([np.prod([chance for _, chance in chosen]) for chosen in sets])
    chances = prior.copy()
    for epoch, attempt in enumerate(trials):
        if epoch:
            chances = (1 - hazard) * chances + hazard * chances.sum() * prior
        order = (TrialOutcome.ACHIEVED, TrialOutcome.BLOCKED, TrialOutcome.NOT_REACHED)
        allowed, blocked = outcome_chances(0.95, skills)
        here = situation(bits(attempt.state))
        for i, ruled in enumerate(rules):
            chances[i] *= (allowed if ruled[attempt.subgoal].allow(here) else blocked)[order.index(attempt.outcome)]
        chances /= chances.sum()
    return dict(zip(rules, chances, strict=True))


def test_the_mixture_is_the_whole_sum_over_histories_of_rules():
    rng = np.random.default_rng(8)
    trials = [trial(int(rng.integers(N)), state=0, outcome=list(TrialOutcome)[int(rng.integers(3))]) for _ in range(12)]
    oracle = Oracle(told(max_literals=2, hazard=0.2))
    for attempt in trials:
        oracle.begin_epoch()
        oracle.learn(attempt)
    for rules, chance in enumerated(trials, max_literals=2, hazard=0.2, skills=CALM).items():
        assert oracle.belief.chance_of(rules) == pytest.approx(chance, rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_true_rules_are_never_held_to_be_impossible(seed):
    rng = np.random.default_rng(seed)
    skills = Skills(first=0.6, last=0.9, wrongly_blocked=0.3, unseen_block=0.3, accident=0.2)
    table = AbstractTable(n_goals=4, skills=skills, rng=rng)
    learner = as_oracle(told(n_goals=4, max_literals=2, hazard=0.05, skills=skills))(4, rng)
    belief = learner.selector.oracle.belief
    for epoch in range(60):
        if epoch % 20 == 0:
            table.rules = draw_rules(rng, 4, max_literals=2)
        learner.learn_epoch(table, epoch)
        assert belief.chance_of(table.rules) > 0.0
        assert learner.selector.oracle.allowed().min() >= 0.0


def test_what_came_about_by_accident_was_allowed():
    oracle = Oracle(told())
    oracle.learn(trial(0, outcome=TrialOutcome.NOT_REACHED, came_about=(1,)))
    assert oracle.allowed()[1, 0] == pytest.approx(1.0)
    oracle.learn(trial(0, outcome=TrialOutcome.ACHIEVED, came_about=(2,)))
    assert oracle.allowed()[2, 1] == pytest.approx(1.0)


def test_what_no_rules_of_the_class_allow_is_told():
    belief = RuleBelief([chance_of_needs(2, g, 0) for g in range(2)], hazard=0.0)
    with pytest.raises(ValueError, match="expected what rules of the class allow"):
        belief.update(0, 0, if_allowed=0.0, if_not=1.0)


def test_a_void_trial_tells_nothing():
    oracle = Oracle(told())
    before = encode(oracle.state_dict())
    oracle.learn(trial(0, outcome=TrialOutcome.VOID))
    assert encode(oracle.state_dict()) == before


# ------------------------------------------------------------------------------------------------- what is it worth


def test_information_is_one_bit_of_a_fair_coin_seen_clearly_and_none_of_what_is_known():
    clearly = np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]])
    assert information(np.array([[0.5, 0.0, 1.0]]), *clearly)[0] == pytest.approx([np.log(2), 0.0, 0.0])
    alike = np.array([[0.3, 0.7]]), np.array([[0.3, 0.7]])
    assert information(np.array([[0.5]]), *alike)[0] == pytest.approx([0.0])


def test_a_way_to_a_telling_trial_is_worth_what_it_tells_less_all_trials():
    """Goal 1 tells 1 nat once goal 0 is on, nothing before; a trial costs 0.1."""
    told_nats = np.array([[0.0] * 4, [0.0, 1.0, 0.0, 0.0]])
    achieved = np.full((2, 4), 0.5)
    worth = worth_of_information(told_nats, achieved, after(2), price=0.1, goal=None, n_trials=2)
    assert worth[:, 0] == pytest.approx([-0.1 + 0.5 * 0.9, -0.1])
    ended = worth_of_information(told_nats, achieved, after(2), price=0.1, goal=0, n_trials=2)
    assert ended[0, 0] == pytest.approx(-0.1)


def test_a_goal_that_needs_another_is_sought_by_way_of_it():
    achieved = np.array([[0.9] * 4, [0.0, 0.9, 0.0, 0.9]])
    worth = worth_of_success(achieved, after(2), goal=1, n_trials=8)
    assert worth[:, 0].argmax() == 0
    assert worth[:, 1].argmax() == 1
    assert worth[0, 0] < worth[1, 1]


def test_what_is_known_is_not_tried_again_for_its_own_sake_and_what_is_not_is():
    oracle = Oracle(told())
    oracle.begin_epoch()
    assert oracle.search(0, goal=None) is not None
    for goal, state in product(range(N), range(1 << N)):
        if not state >> goal & 1:
            oracle.belief.update(goal, state, if_allowed=1.0, if_not=0.0)
    fresh = Oracle(told())
    fresh.load_state_dict(oracle.state_dict())
    fresh.begin_epoch()
    assert fresh.search(0, goal=None) is None


# ----------------------------------------------------------------------------------------------------- what it does


@pytest.mark.parametrize("seed", TUNING)
def test_it_learns_drawn_rules_and_their_change_and_its_graph_is_right(seed):
    rng = np.random.default_rng(seed)
    eras = [draw_rules(rng, 5, max_literals=2) for _ in range(2)]
    known = told(n_goals=5, max_literals=2, hazard=1 / 300, skills=CALM)
    result = run_abstract(seed=seed, learner=as_oracle(known), eras=eras, epochs=60, skills=CALM)
    assert all(era.mastered is not None and era.mastered <= 30 for era in result.eras)
    assert is_graph_right(result.learner.selector, eras[1])


def test_tests_change_nothing_and_saved_loaded_and_continued_is_identical():
    rules = draw_rules(np.random.default_rng(3), 4, max_literals=2)
    make = as_oracle(told(n_goals=4, max_literals=2, hazard=0.02, skills=Skills()))

    def pair():
        table = AbstractTable(n_goals=4, skills=Skills(), rng=np.random.default_rng(1))
        table.rules = rules
        return table, make(4, np.random.default_rng(2))

    table, learner = pair()
    for epoch in range(10):
        learner.learn_epoch(table, epoch)
    kept = encode(learner.state_dict())
    learner.test_epoch(table, 10, 3)
    assert encode(learner.state_dict()) == kept
    other_table, other = pair()
    other.load_state_dict(decode(kept))
    other_table.__dict__["_rng"].bit_generator.state = table.__dict__["_rng"].bit_generator.state
    first = [learner.learn_epoch(table, epoch) for epoch in range(10, 20)]
    assert [other.learn_epoch(other_table, epoch) for epoch in range(10, 20)] == first


def test_it_refuses_another_number_of_goals_than_it_was_told_of():
    with pytest.raises(ValueError, match="expected the 3 goals"):
        as_oracle(told())(4, np.random.default_rng(0))


def test_a_choice_among_nothing_is_refused():
    with pytest.raises(ValueError, match="at least one available"):
        OracleSubgoals(Oracle(told())).select(
            goal=0, state=flags(0, N), available=(False,) * N, temperature=0.0, explore=True
        )
