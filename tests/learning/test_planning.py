"""Plans over goal-states, against brute force where that is possible."""

from itertools import permutations

import numpy as np
import pytest

from learning.abstract.rules import draw_rules, needs, optimal_trials
from learning.planning import Effort, cheapest_plan, relevant_goals
from learning.preconditions import START, Situation
from tests.support.abstract_table import PAPER_AFTER, PAPER_BEFORE


def effort(n, trials=None, losses=None):
    return Effort(trials=trials or [1.0] * n, losses=losses or [[0.0] * n for _ in range(n)])


def plan(goal, rules, start=START, **kwargs):
    return cheapest_plan(goal, start, rules.__getitem__, effort(len(rules), **kwargs))


def at(*goals):
    bits = sum(1 << g for g in goals)
    return Situation(bits, bits)


def test_the_papers_optimal_trials_are_found():
    assert optimal_trials(PAPER_BEFORE) == (1, 1, 1, 2, 2, 3)
    assert optimal_trials(PAPER_AFTER) == (1, 1, 1, 1, 1, 3)


def test_a_plan_goes_on_from_where_the_epoch_stands():
    assert plan(5, PAPER_BEFORE) == (2, 4, 5)
    assert plan(5, PAPER_BEFORE, at(2)) == (4, 5)
    assert plan(5, PAPER_BEFORE, at(2, 4)) == (5,)


def test_what_must_be_off_is_achieved_after_what_needs_it_off():
    # Goal 2 needs both 0 and 1; 1 needs 0 off: so 1 first.
    rules = (needs(), needs(off=[0]), needs([0, 1]))
    assert plan(2, rules) == (1, 0, 2)
    assert plan(2, rules, at(0)) is None


def test_there_is_no_plan_where_needs_go_in_circles():
    assert plan(0, (needs([1]), needs([0]))) is None


def test_what_gets_lost_on_the_way_is_fetched_last():
    rules = (needs(), needs(), needs([0, 1]))
    losses = [[0.0] * 3 for _ in range(3)]
    losses[0][1] = 0.3
    assert plan(2, rules, losses=losses) == (0, 1, 2)
    losses[0][1], losses[1][0] = 0.0, 0.3
    assert plan(2, rules, losses=losses) == (1, 0, 2)


def test_two_things_that_one_hand_cannot_hold_have_no_plan():
    rules = (needs(), needs(), needs([0, 1]))
    losses = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert plan(2, rules, losses=losses) is None


def test_only_what_must_be_on_is_relevant():
    assert relevant_goals(5, PAPER_BEFORE.__getitem__) == [2, 4, 5]
    assert relevant_goals(3, PAPER_AFTER.__getitem__) == [3]


@pytest.mark.parametrize("seed", range(20))
def test_plans_are_as_short_as_brute_force_finds(seed):
    rules = draw_rules(np.random.default_rng(seed), 5)
    for goal in range(5):
        shortest = min(
            (order.index(goal) for order in permutations(range(5)) if _is_valid(order[: order.index(goal) + 1], rules)),
            default=None,
        )
        found = plan(goal, rules)
        assert found is not None
        assert _is_valid(found, rules)
        assert len(found) - 1 == shortest


def _is_valid(order, rules):
    here = START
    for goal in order:
        if not rules[goal].allow(here):
            return False
        here = here.after(goal)
    return True
