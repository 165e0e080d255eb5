"""The oracle reads needs of goals out of rule sets."""

import msgspec
import pytest

from config.loader import resolve
from config.rules import Literal, Rule
from robot.oracle import rules_oracle

NONE = (False,) * 6


def state(*on):
    return tuple(i in on for i in range(6))


@pytest.fixture(scope="module")
def paper():
    return resolve(scenario="paper")


@pytest.mark.parametrize(
    ("epoch", "goal", "needs_on", "needs_off"),
    [
        (0, 0, [], []), (0, 1, [], []), (0, 2, [], []), (0, 3, [1], []), (0, 4, [2], []), (0, 5, [4], []),
        (999, 5, [4], []), (1000, 0, [], []), (1000, 3, [], [1]), (1000, 4, [], [2]), (1000, 5, [4, 0], []),
    ],
)  # fmt: skip
def test_the_papers_needs_are_those_of_its_table(paper, epoch, goal, needs_on, needs_off):
    allowed = rules_oracle(paper)
    for bits in range(64):
        now = tuple(bool(bits >> i & 1) for i in range(6))
        expected = all(now[i] for i in needs_on) and not any(now[i] for i in needs_off)
        assert allowed(goal, now, epoch) == expected


def with_rule(paper, output, *when):
    rules = paper.rule_sets[0]
    changed = tuple(Rule(output=r.output, when=tuple(when)) if r.output == output else r for r in rules.rules)
    sets = (msgspec.structs.replace(rules, rules=changed), paper.rule_sets[1])
    return rules_oracle(msgspec.structs.replace(paper, rule_sets=sets))


def test_the_hands_own_flag_is_on_once_anything_was_grabbed(paper):
    allowed = with_rule(paper, "square_box", Literal(input="gripper", is_on=False))
    assert not allowed(5, state(4), 0)
    allowed = with_rule(paper, "red_box", Literal(input="gripper", is_on=True))
    assert not allowed(3, NONE, 0)
    assert allowed(3, state(4), 0)


def test_a_boxs_sensor_is_on_once_something_was_put_into_it(paper):
    allowed = with_rule(paper, "red_box", Literal(input="square_box", is_on=True))
    assert not allowed(3, state(4), 0)
    assert allowed(3, state(4, 5), 0)


def test_an_object_that_no_goal_says_to_grab_needs_its_own_box_open(paper):
    goals = tuple(goal for goal in paper.scenario.goals if goal.name != "blue_grabbed")
    scenario = msgspec.structs.replace(paper.scenario, goals=goals)
    allowed = rules_oracle(msgspec.structs.replace(paper, scenario=scenario))
    assert not allowed(4, (False,) * 5, 0)
    assert allowed(4, (False, False, True, False, False), 0)
