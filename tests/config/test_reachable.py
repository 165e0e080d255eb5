"""The search for goals that no order of acts can reach."""

import itertools

import pytest

from config.loader import load_wired
from config.reachable import unreachable_goals
from config.rules import Literal, Rule, RuleSet
from config.scenario import Box, Button, Cylinder, Goal, GoalKind, Lid, Reflexes, RuleSpan, Scenario

GREY = (0.5, 0.5, 0.5)


def scenario(*, reflexes=None):
    """Two buttons; a cylinder in the lidded cage, one in the lidded chest; the cage's goes to the lidded safe."""
    boxes = [("cage", 2, None), ("chest", 3, 2), ("safe", 4, 3)]
    return Scenario(
        name="toy",
        buttons=tuple(
            Button(name=name, position_m=(0, 0), colour=GREY, input=i, lamp_output=i) for i, name in enumerate("ab")
        ),
        boxes=tuple(
            Box(name=name, position_m=(0, 0), colour=GREY, lid=Lid(output=bit), presence_input=sensor)
            for name, bit, sensor in boxes
        ),
        cylinders=(
            Cylinder(name="lion", inside="cage", colour=GREY, receptacle="safe"),
            Cylinder(name="gold", inside="chest", colour=GREY),
        ),
        distances=("table",),
        goals=(
            Goal(name="a_pressed", kind=GoalKind.PRESSED, object="a"),
            Goal(name="lion_grabbed", kind=GoalKind.GRABBED, object="lion"),
            Goal(name="gold_grabbed", kind=GoalKind.GRABBED, object="gold"),
            Goal(name="lion_in_safe", kind=GoalKind.IN_BOX, object="lion", box="safe"),
        ),
        schedule=(RuleSpan(from_epoch=0, rules="any"),),
        reflexes=reflexes or Reflexes(),
    )


def rules(**when):
    """Rules from text such as cage="a !b"; a box left out is always open."""
    return RuleSet(
        name="toy",
        rules=tuple(
            Rule(
                output=box,
                when=tuple(
                    Literal(input=word.lstrip("!"), is_on=not word.startswith("!"))
                    for word in when.get(box, "").split()
                ),
            )
            for box in ("cage", "chest", "safe")
        ),
    )


@pytest.mark.parametrize(
    ("when", "missing"),
    [
        ({}, ()),
        ({"cage": "a"}, ()),
        ({"cage": "!a !b", "chest": "a b"}, ()),
        ({"cage": "a !b", "safe": "b"}, ()),
        ({"cage": "a", "safe": "!a"}, ("lion_in_safe",)),
        ({"cage": "a", "chest": "safe", "safe": "b"}, ()),
        ({"cage": "safe", "safe": "b"}, ("lion_grabbed", "lion_in_safe")),
        ({"cage": "gripper", "chest": "gripper"}, ("lion_grabbed", "gold_grabbed", "lion_in_safe")),
        ({"cage": "gripper", "chest": "b"}, ()),
        ({"safe": "!gripper"}, ("lion_in_safe",)),
        ({"cage": "chest"}, ()),
        ({"cage": "!chest"}, ("lion_grabbed", "lion_in_safe")),
        ({"chest": "!safe", "safe": "a"}, ()),
        ({"cage": "!gripper", "chest": "!gripper"}, ()),
    ],
    ids=[
        "all open", "one button", "order matters", "and not", "needs what forbids it", "chain over a sensor",
        "sensor only it can switch", "deadlock of two", "gripper by the other", "never once held",
        "latched from the start", "off never once on", "before the sensor", "either first",
    ],
)  # fmt: skip
def test_a_goal_is_unreachable_exactly_where_no_order_of_acts_leads_to_it(when, missing):
    assert unreachable_goals(scenario(), rules(**when)) == missing


@pytest.mark.parametrize(
    ("reflexes", "missing"),
    [
        (Reflexes(close_on_object=False), ("lion_grabbed", "gold_grabbed", "lion_in_safe")),
        (Reflexes(open_over_receptacle=False), ("lion_in_safe",)),
        (Reflexes(open_on_table=False), ()),
    ],
)
def test_a_hand_without_a_reflex_cannot_reach_what_needs_it(reflexes, missing):
    assert unreachable_goals(scenario(reflexes=reflexes), rules()) == missing


def test_a_search_that_grows_too_large_takes_goals_for_reachable():
    toy = scenario()
    names = [f"b{i}" for i in range(16)]
    buttons = tuple(Button(name=n, position_m=(0, 0), colour=GREY, input=i, lamp_output=i) for i, n in enumerate(names))
    large = Scenario(
        name="large", buttons=buttons, boxes=toy.boxes, cylinders=toy.cylinders, distances=("table",),
        goals=toy.goals[1:], schedule=toy.schedule,
    )  # fmt: skip
    never = rules(cage=f"{' '.join(names)} !b0", safe="!b1")
    assert unreachable_goals(large, never) == ()


@pytest.mark.parametrize("name", ["paper", "workshop"])
def test_every_goal_of_a_shipped_scenario_can_be_reached_under_each_of_its_rule_sets(name):
    shipped, rule_sets = load_wired(name)
    assert [unreachable_goals(shipped, rule_set) for rule_set in rule_sets] == [()] * len(rule_sets)


def test_a_lid_that_needs_more_buttons_is_never_easier_to_open():
    sets = [" ".join(words) for n in range(3) for words in itertools.combinations(["a", "!b", "chest"], n)]
    for fewer, more in itertools.product(sets, sets):
        if set(fewer.split()) <= set(more.split()):
            less = set(unreachable_goals(scenario(), rules(cage=fewer)))
            assert less <= set(unreachable_goals(scenario(), rules(cage=more)))
