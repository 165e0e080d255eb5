"""Rules that no conjunction says, on a table without physics."""

import numpy as np
import pytest

from learning.abstract import outside_bench
from learning.abstract.outside import KINDS, AnyOf, AtLeast, InOrder, draw_outside, fewest_trials, orders
from learning.abstract.outside_bench import UNRELIABLE, bench_outside
from learning.abstract.rules import ROOM, TRIALS, needs, permits
from learning.abstract.table import AbstractTable, Skills
from learning.interfaces import TrialOutcome

SURE = Skills(first=1.0, last=1.0, accident=0.0, unseen_block=0.0)


@pytest.mark.parametrize(
    ("rule", "met", "unmet"),
    [
        (AnyOf((1, 2)), [(1,), (2,), (0, 2), (1, 2)], [(), (0,), (3,)]),
        (AtLeast(2, (1, 2, 3)), [(1, 2), (3, 1), (1, 2, 3)], [(), (1,), (0, 3)]),
        (InOrder(1, 2), [(1, 2), (1, 0, 2)], [(2, 1), (1,), (2,), ()]),
        (needs([1], [2]), [(1,), (1, 3)], [(1, 2), ()]),
    ],
)
def test_each_kind_of_rule_by_hand(rule, met, unmet):
    assert all(permits(rule, order) for order in met)
    assert not any(permits(rule, order) for order in unmet)


def test_fewest_trials_and_orders_by_hand():
    rules = (needs(), needs(off=[0]), InOrder(1, 0), AtLeast(2, (0, 1, 2)))
    assert fewest_trials(rules) == (1, 1, 3, 3)
    assert orders(rules, n_most=1) == [(), (0,), (1,)]
    assert (0, 1) not in orders(rules, n_most=4)
    assert fewest_trials((needs([1]), needs([0]))) == (TRIALS, TRIALS)


def test_the_table_minds_the_order_and_forgets_it_with_the_epoch():
    table = AbstractTable(n_goals=3, skills=SURE, rng=np.random.default_rng(0))
    table.rules = (needs(), needs(), InOrder(0, 1))

    def tried(*goals):
        table.reset()
        return [table.attempt(goal, practise=False) for goal in goals][-1]

    assert tried(0, 1, 2) is TrialOutcome.ACHIEVED
    assert tried(1, 0, 2) is TrialOutcome.BLOCKED
    assert tried(0, 1, 0, 2) is TrialOutcome.ACHIEVED


@pytest.mark.parametrize("kind", KINDS)
def test_drawn_tables_have_the_kind_and_every_goal_can_be_achieved(kind):
    rng = np.random.default_rng(3)
    for _ in range(5):
        rules = draw_outside(rng, kind, 5)
        assert sum(not hasattr(rule, "allow") for rule in rules) == 2
        assert max(fewest_trials(rules)) <= TRIALS - ROOM


def test_an_unknown_kind_is_refused():
    with pytest.raises(ValueError, match="expected one of or, two_of_three, in_order"):
        draw_outside(np.random.default_rng(0), "xor", 5)


def test_a_table_that_fails_now_and_then_fails_so_often_and_looks_blocked():
    skills = outside_bench._skills(UNRELIABLE)
    table = AbstractTable(n_goals=1, skills=skills, rng=np.random.default_rng(1))
    seen = []
    for _ in range(4000):
        table.reset()
        seen.append(table.attempt(0, practise=False))
    shares = [seen.count(outcome) / len(seen) for outcome in (TrialOutcome.ACHIEVED, TrialOutcome.BLOCKED)]
    assert shares == pytest.approx([0.855, 0.0975], abs=0.02)


def test_the_bench_tells_each_kind_of_each_learner_and_judges_the_first(monkeypatch):
    class Here:
        def __init__(self, **_):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        map = staticmethod(map)

    for name, value in {
        "FEW": 1,
        "ERA_EPOCHS": 10,
        "N_ERAS": 1,
        "OTHERS": ("drop",),
        "ProcessPoolExecutor": Here,
    }.items():
        monkeypatch.setattr(outside_bench, name, value)
    rows = {row.name: row for row in bench_outside(full=False).results}
    assert set(rows) == {
        f"{kind}_{what}" for kind in (*KINDS, UNRELIABLE) for what in ("default_after", "drop_after", "certainly_wrong")
    }
    assert all(bool(row.goal) == name.endswith("default_after") for name, row in rows.items())
    assert all(0.0 <= rows[f"{kind}_certainly_wrong"].value <= 1.0 for kind in KINDS)
