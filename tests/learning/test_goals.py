import msgspec
import pytest

from config.loader import load_scenario
from learning.goals import GoalJudge
from robot.messages import GripState, ObjectPercept, Percept
from tests.support.kinematic_table import KinematicTable

ORANGE, GREEN, BLUE, RED_GRABBED, BLUE_GRABBED, IN_BOX = range(6)
PLACES = {
    "orange_button": (0.3, -0.2, 0.04), "green_button": (0.3, 0.0, 0.04), "blue_button": (0.3, 0.2, 0.04),
    "red_box": (0.54, -0.25, 0.0), "square_box": (0.54, 0.0, 0.0), "blue_box": (0.54, 0.25, 0.0),
    "red_cylinder": (0.54, -0.25, 0.03), "blue_cylinder": (0.54, 0.25, 0.03),
}  # fmt: skip
OPEN = GripState(opening_m=0.085, is_moving=False, has_object=False)
FULL = GripState(opening_m=0.044, is_moving=False, has_object=True)


@pytest.fixture(scope="module")
def judge() -> GoalJudge:
    scenario = load_scenario("paper")
    return GoalJudge(scenario, KinematicTable(scenario).spec)


def percept(*, tool=(0.42, 0.0, 0.2), grip=OPEN, lit=(0, 0, 0), contact=False, **moved) -> Percept:
    places = PLACES | moved
    n = 12
    return Percept(
        stamp_ns=0, distances_m=(0.5,) * 9, button_states=tuple(float(s) for s in lit), ages_s=(0.0,) * n,
        valid=(True,) * n,
        objects=tuple(
            ObjectPercept(name=k, position_m=v, quat=(1.0, 0.0, 0.0, 0.0), age_s=0.0, is_valid=True)
            for k, v in places.items()
        ),
        tcp_position_m=tool, grip=grip, is_in_contact=contact,
    )  # fmt: skip


def unseen(seen: Percept, name: str) -> Percept:
    """The same percept with one thing not valid."""
    objects = tuple(msgspec.structs.replace(o, is_valid=o.is_valid and o.name != name) for o in seen.objects)
    return msgspec.structs.replace(seen, objects=objects)


def test_on_a_fresh_table_no_goal_holds(judge):
    assert judge.achieved(percept()) == (False,) * 6


def test_a_button_is_pressed_while_its_lamp_is_lit(judge):
    assert judge.achieved(percept(lit=(0, 1, 0)))[:3] == (False, True, False)


def test_a_cylinder_is_grabbed_when_a_full_hand_is_around_that_very_one(judge):
    at_blue = percept(tool=(0.54, 0.25, 0.03), grip=FULL)
    assert judge.achieved(at_blue)[RED_GRABBED : BLUE_GRABBED + 1] == (False, True)
    assert not judge.achieved(percept(tool=(0.54, 0.25, 0.03), grip=OPEN))[BLUE_GRABBED]
    assert not judge.achieved(percept(tool=(0.54, 0.25, 0.07), grip=FULL))[BLUE_GRABBED]


def test_in_the_box_counts_only_once_the_hand_let_go(judge):
    inside = {"blue_cylinder": (0.56, 0.02, 0.03)}
    assert judge.achieved(percept(**inside))[IN_BOX]
    assert not judge.achieved(percept(tool=(0.56, 0.02, 0.03), grip=FULL, **inside))[IN_BOX]


@pytest.mark.parametrize("place", [(0.54, 0.1, 0.03), (0.64, 0.0, 0.03), (0.54, 0.0, 0.13)])
def test_beside_the_box_or_on_its_lid_is_not_in_it(judge, place):
    assert not judge.achieved(percept(blue_cylinder=place))[IN_BOX]


def test_held_up_over_a_shut_lid_is_being_at_the_cylinders_place(judge):
    assert judge.is_at_place(RED_GRABBED, percept(tool=(0.55, -0.24, 0.093), contact=True))
    assert not judge.is_at_place(RED_GRABBED, percept(tool=(0.55, -0.24, 0.093), contact=False))
    assert judge.is_at_place(RED_GRABBED, percept(tool=(0.48, -0.24, 0.093), contact=True))
    assert not judge.is_at_place(RED_GRABBED, percept(tool=(0.44, -0.24, 0.093), contact=True))


def test_a_cylinder_out_of_its_box_is_covered_by_nothing_but_what_is_above_it(judge):
    away = {"red_cylinder": (0.40, -0.10, 0.03)}
    assert judge.is_at_place(RED_GRABBED, percept(tool=(0.41, -0.10, 0.093), contact=True, **away))
    assert not judge.is_at_place(RED_GRABBED, percept(tool=(0.54, -0.25, 0.093), contact=True, **away))


def test_held_up_by_the_cylinder_itself_is_a_miss_and_not_a_block(judge):
    assert not judge.is_at_place(RED_GRABBED, percept(tool=(0.55, -0.24, 0.068), contact=True))


def test_a_hand_that_moves_or_holds_something_else_proves_nothing(judge):
    over_red = {"tool": (0.54, -0.25, 0.093), "contact": True}
    moving = msgspec.structs.replace(OPEN, is_moving=True)
    assert not judge.is_at_place(RED_GRABBED, percept(grip=moving, **over_red))
    holding_blue = {"blue_cylinder": (0.54, -0.25, 0.095)}
    assert not judge.is_at_place(RED_GRABBED, percept(grip=FULL, **over_red, **holding_blue))


def test_a_hand_is_free_for_a_goal_if_it_holds_nothing_else(judge):
    holding_blue = percept(tool=(0.54, 0.25, 0.2), grip=FULL, blue_cylinder=(0.54, 0.25, 0.2))
    assert [judge.is_hand_free(goal, holding_blue) for goal in range(6)] == [False] * 4 + [True] * 2
    assert all(judge.is_hand_free(goal, percept()) for goal in range(6))


def test_over_a_box_held_up_with_or_without_the_object_is_at_its_place(judge):
    assert judge.is_at_place(IN_BOX, percept(tool=(0.59, 0.03, 0.1), contact=True))
    carrying = {"blue_cylinder": (0.59, 0.03, 0.105)}
    assert judge.is_at_place(IN_BOX, percept(tool=(0.59, 0.03, 0.1), grip=FULL, contact=True, **carrying))
    assert judge.is_at_place(IN_BOX, percept(tool=(0.54, 0.0, 0.026)))
    assert not judge.is_at_place(IN_BOX, percept(tool=(0.54, 0.0, 0.2)))


def test_the_thing_in_a_full_hand_is_held_up_to_three_centimetres_off(judge):
    inside, outside = (0.54, 0.25, 0.058), (0.54, 0.25, 0.062)
    assert judge.achieved(percept(tool=inside, grip=FULL))[BLUE_GRABBED]
    assert judge.held(percept(tool=inside, grip=FULL)) == "blue_cylinder"
    assert not judge.achieved(percept(tool=outside, grip=FULL))[BLUE_GRABBED]
    assert judge.held(percept(tool=outside, grip=FULL)) is None


@pytest.mark.parametrize(("height", "is_in"), [(0.074, True), (0.076, False)])
def test_a_thing_is_in_a_box_while_its_middle_is_below_the_rim(judge, height, is_in):
    assert judge.achieved(percept(blue_cylinder=(0.54, 0.0, height)))[IN_BOX] is is_in


@pytest.mark.parametrize(("place", "is_in"), [((0.629, 0.089), True), ((0.631, 0.0), False), ((0.54, 0.091), False)])
def test_a_thing_is_in_a_box_while_its_middle_is_between_the_walls(judge, place, is_in):
    assert judge.achieved(percept(blue_cylinder=(*place, 0.03)))[IN_BOX] is is_in


@pytest.mark.parametrize(("tool_m", "is_at"), [(0.069, False), (0.071, True)])
def test_a_centimetre_above_a_cylinder_something_else_holds_the_tool_up(judge, tool_m, is_at):
    assert judge.is_at_place(RED_GRABBED, percept(tool=(0.54, -0.25, tool_m), contact=True)) is is_at


@pytest.mark.parametrize(("off_m", "is_at"), [(0.029, True), (0.031, False)])
def test_a_buttons_place_is_within_the_reach_of_its_middle_and_in_contact(judge, off_m, is_at):
    over = (0.3 + off_m, 0.0, 0.05)
    assert judge.is_at_place(GREEN, percept(tool=over, contact=True)) is is_at
    assert not judge.is_at_place(GREEN, percept(tool=over, contact=False))


@pytest.mark.parametrize(("x", "y", "is_at"), [(0.069, 0.069, True), (0.071, 0.0, False), (0.0, -0.071, False)])
def test_held_up_within_two_centimetres_of_a_wall_is_not_at_the_boxs_place(judge, x, y, is_at):
    assert judge.is_at_place(IN_BOX, percept(tool=(0.54 + x, y, 0.1), contact=True)) is is_at


def test_as_low_as_the_tool_goes_is_within_the_reach_of_its_lowest_height(judge):
    at = KinematicTable(load_scenario("paper")).spec.heights_m[0] + load_scenario("paper").evaluation.reach_height_m
    assert judge.is_at_place(IN_BOX, percept(tool=(0.54, 0.0, at - 0.001)))
    assert not judge.is_at_place(IN_BOX, percept(tool=(0.54, 0.0, at + 0.001)))


@pytest.mark.parametrize("name", ["blue_cylinder", "square_box"])
def test_what_is_in_a_box_is_not_judged_while_either_is_unseen(judge, name):
    seen = percept(blue_cylinder=(0.54, 0.0, 0.03))
    assert judge.achieved(seen)[IN_BOX]
    assert not judge.achieved(unseen(seen, name))[IN_BOX]


@pytest.mark.parametrize(
    ("goal", "name", "tool"),
    [
        (RED_GRABBED, "red_cylinder", (0.54, -0.25, 0.093)),
        (RED_GRABBED, "red_box", (0.48, -0.24, 0.093)),
        (GREEN, "green_button", (0.3, 0.0, 0.05)),
        (IN_BOX, "square_box", (0.54, 0.0, 0.1)),
    ],
)
def test_no_place_is_reached_of_a_thing_that_is_unseen(judge, goal, name, tool):
    there = percept(tool=tool, contact=True)
    assert judge.is_at_place(goal, there)
    assert not judge.is_at_place(goal, unseen(there, name))


def test_what_is_not_valid_is_not_judged(judge):
    lit = percept(lit=(1, 0, 0))
    blind = msgspec.structs.replace(lit, valid=(False,) * 12)
    assert judge.achieved(lit)[ORANGE]
    assert not judge.achieved(blind)[ORANGE]
    at_blue = percept(tool=(0.54, 0.25, 0.03), grip=FULL)
    assert judge.achieved(at_blue)[BLUE_GRABBED]
    assert not judge.achieved(unseen(at_blue, "blue_cylinder"))[BLUE_GRABBED]


def aged(percept, i, age_s):
    """The same with an entry of P(t) so old."""
    return msgspec.structs.replace(percept, ages_s=tuple(age_s if k == i else a for k, a in enumerate(percept.ages_s)))


def test_what_ground_truth_shows_is_known_of_all_goals_by_what_is_seen_now(judge):
    now = percept(tool=(0.54, 0.25, 0.03), grip=FULL)
    assert judge.known(now, since_ns=now.stamp_ns) == (True,) * 6


def test_a_lamp_that_is_hidden_or_was_seen_too_long_ago_leaves_its_goal_unknown(judge):
    now = msgspec.structs.replace(percept(lit=(1, 0, 0)), stamp_ns=1_000_000_000)
    lamp = len(now.distances_m)
    hidden = msgspec.structs.replace(now, valid=tuple(k != lamp for k in range(len(now.valid))))
    assert judge.known(hidden) == (False, True, True, True, True, True)
    old = aged(now, lamp, 0.1)
    assert judge.known(old)[ORANGE]
    assert judge.known(old, since_ns=900_000_000)[ORANGE]
    assert not judge.known(old, since_ns=900_000_001)[ORANGE]


def test_an_empty_hand_is_known_to_hold_nothing_and_a_full_one_holds_what_is_seen(judge):
    empty = unseen(percept(tool=(0.54, 0.25, 0.03), grip=OPEN), "blue_cylinder")
    assert judge.known(empty)[BLUE_GRABBED]
    full = unseen(percept(tool=(0.54, 0.25, 0.03), grip=FULL), "blue_cylinder")
    assert not judge.known(full)[BLUE_GRABBED]
    assert not judge.known(full)[IN_BOX]
    assert judge.known(full)[RED_GRABBED]
