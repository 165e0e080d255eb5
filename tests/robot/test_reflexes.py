import msgspec
import pytest

from robot.messages import Grip, GripState
from robot.motion import HandReflexes
from tests.support.stations import fake_rig, percept

RESOLVED = fake_rig()
ARM, SCENARIO = RESOLVED.arm, RESOLVED.scenario
STROKE = ARM.tool.stroke_m
STEP_NS = 50_000_000
RED, BLUE = (0.30, 0.10, 0.03), (0.50, 0.25, 0.03)
TABLE = {
    "orange_button": (0.32, -0.21, 0.05),
    "green_button": (0.32, 0.0, 0.05),
    "blue_button": (0.32, 0.21, 0.05),
    "red_box": (0.54, -0.25, 0.0),
    "square_box": (0.54, 0.0, 0.0),
    "blue_box": (0.54, 0.25, 0.0),
    "red_cylinder": RED,
    "blue_cylinder": BLUE,
}
OPEN = GripState(opening_m=STROKE, is_moving=False, has_object=False)
MOVING = GripState(opening_m=0.06, is_moving=True, has_object=False)
HOLDING = GripState(opening_m=0.044, is_moving=False, has_object=True)
EMPTY = GripState(opening_m=0.0, is_moving=False, has_object=False)


class Hand:
    """Drives the reflexes with what a world would show."""

    def __init__(self, scenario=SCENARIO):
        self.reflexes = HandReflexes(arm=ARM, scenario=scenario)
        self.places = dict(TABLE)
        self.n = 0
        self.reflexes.reset(percept(self.places, tcp_m=(0.42, 0.0, 0.2)))

    def show(self, tcp_m, grip=OPEN, *, asked=None, is_in_contact=False):
        """Show the world after one more step and return whether the hand is asked to be shut."""
        self.n += 1
        seen = percept(self.places, tcp_m=tcp_m, grip=grip, stamp_ns=self.n * STEP_NS, is_in_contact=is_in_contact)
        return self.reflexes.decide(seen, asked).opening_m < STROKE

    def carry(self, name, tcp_m, **more):
        """Show the world with an object in the hand, its centre at the tool centre point."""
        self.places[name] = tcp_m
        return self.show(tcp_m, HOLDING, **more)

    def grasp(self, name):
        """Close on an object and lift it to travel height."""
        x, y, z = self.places[name]
        assert self.show((x, y, z + 0.005))
        assert self.show((x, y, z), MOVING)
        assert self.carry(name, (x, y, z))
        assert self.carry(name, (x, y, 0.21))


@pytest.fixture
def hand():
    return Hand()


def at(dx=0.0, dy=0.0, dz=0.0):
    return (RED[0] + dx, RED[1] + dy, RED[2] + dz)


@pytest.mark.parametrize(
    ("tcp", "shuts"),
    [
        (at(), True),
        (at(dz=0.0079), True),
        (at(dz=0.0081), False),
        (at(dz=-0.0224), True),
        (at(dz=-0.0226), False),
        (at(dx=0.0079), True),
        (at(dx=0.0081), False),
        (at(dx=-0.0079), True),
        (at(dx=-0.0081), False),
        (at(dy=0.0204), True),
        (at(dy=0.0206), False),
        (at(dy=-0.0204), True),
        (at(dy=-0.0206), False),
    ],
)
def test_the_hand_shuts_exactly_while_an_objects_centre_lies_between_the_pads(hand, tcp, shuts):
    assert hand.show(tcp) is shuts


def test_the_hand_does_not_shut_on_what_is_not_perceived_now(hand):
    seen = percept(hand.places, tcp_m=at(), stamp_ns=STEP_NS)
    hidden = tuple(msgspec.structs.replace(o, is_valid=o.name != "red_cylinder") for o in seen.objects)
    assert hand.reflexes.decide(msgspec.structs.replace(seen, objects=hidden), None).opening_m == STROKE


def test_the_arm_waits_while_a_reflex_moves_the_fingers(hand):
    hand.show(at(dx=0.004))
    assert hand.reflexes.wait_at_m == at(dx=0.004)
    hand.show(at(dx=0.006), MOVING)
    assert hand.reflexes.wait_at_m == at(dx=0.004)
    hand.show(at(dx=0.004), HOLDING)
    assert hand.reflexes.wait_at_m is None


def test_fingers_that_never_rest_do_not_hold_the_arm_for_ever(hand):
    hand.show(at())
    busy = []
    for _ in range(40):
        hand.show(at(), MOVING)
        busy.append(hand.reflexes.wait_at_m is not None)
    assert busy[0]
    assert not busy[-1]


def test_what_the_intent_asks_wins_over_reflexes_and_does_not_hold_the_arm(hand):
    assert hand.show((0.42, 0.0, 0.2), asked=Grip.CLOSE)
    assert hand.reflexes.wait_at_m is None
    assert not hand.show(at(), asked=Grip.OPEN)


def test_the_held_object_is_let_go_inside_its_receptacle_only(hand):
    hand.places["blue_cylinder"] = (0.36, 0.10, 0.03)
    hand.grasp("blue_cylinder")
    assert hand.carry("blue_cylinder", (0.54, 0.0, 0.21))
    assert hand.carry("blue_cylinder", (0.54, 0.25, 0.05))  # another box
    assert hand.carry("blue_cylinder", (0.54, 0.08, 0.05))  # on the wall
    assert hand.carry("blue_cylinder", (0.54, 0.0, 0.076))  # above the rim
    assert not hand.carry("blue_cylinder", (0.54, 0.0, 0.074))


def test_an_object_without_receptacle_is_not_let_go_in_a_box(hand):
    hand.grasp("red_cylinder")
    assert hand.carry("red_cylinder", (0.54, 0.0, 0.031))


def test_a_lifted_object_driven_down_on_free_table_is_let_go(hand):
    hand.grasp("red_cylinder")
    assert hand.carry("red_cylinder", (0.40, 0.12, 0.06))
    assert hand.carry("red_cylinder", (0.40, 0.12, 0.033))
    assert not hand.carry("red_cylinder", (0.40, 0.12, 0.0315))


def test_an_object_held_up_a_little_above_the_table_is_let_go(hand):
    hand.grasp("red_cylinder")
    assert hand.carry("red_cylinder", (0.40, 0.12, 0.05), is_in_contact=True)
    assert not hand.carry("red_cylinder", (0.40, 0.12, 0.04), is_in_contact=True)


@pytest.mark.parametrize("over", ["orange_button", "red_box", "blue_box"])
def test_an_object_held_up_by_a_box_or_a_button_is_kept(hand, over):
    hand.grasp("red_cylinder")
    x, y, _ = TABLE[over]
    assert hand.carry("red_cylinder", (x, y, 0.031), is_in_contact=True)


def test_an_object_that_was_not_lifted_is_kept(hand):
    x, y, z = RED
    assert hand.show(at())
    hand.show(at(), MOVING)
    for lift in (0.0, 0.01, 0.029, 0.01, 0.0):
        assert hand.carry("red_cylinder", (x, y, z + lift))


def test_a_hand_that_let_go_shuts_again_only_after_it_was_clear(hand):
    hand.grasp("red_cylinder")
    down = (0.40, 0.12, 0.031)
    assert not hand.carry("red_cylinder", down)
    for grip in (MOVING, OPEN, OPEN):
        assert not hand.show(down, grip)
    assert not hand.show((0.40, 0.12, 0.15))
    assert hand.show(down)


def test_a_shut_hand_without_object_opens_again(hand):
    hand.show(at())
    hand.places["red_cylinder"] = (0.30, -0.10, 0.03)
    hand.show(at(), MOVING)
    opened = [not hand.show(at(), EMPTY) for _ in range(5)]
    assert opened == [False, False, True, True, True]


def test_a_moments_doubt_about_the_object_is_not_loss(hand):
    hand.show(at())
    hand.show(at(), MOVING)
    assert hand.show(at(), EMPTY)
    assert hand.show(at(), HOLDING)
    assert hand.show(at(), HOLDING)


def test_an_object_that_slips_out_is_reported_lost_once_and_letting_go_is_not_loss(hand):
    hand.grasp("red_cylinder")
    assert not hand.reflexes.lost_object
    hand.places["red_cylinder"] = (0.40, 0.12, 0.03)
    hand.show((0.40, 0.12, 0.2), EMPTY)
    assert hand.reflexes.lost_object
    hand.show((0.40, 0.12, 0.2), EMPTY)
    assert not hand.reflexes.lost_object
    other = Hand()
    other.grasp("red_cylinder")
    other.carry("red_cylinder", (0.40, 0.12, 0.031))
    other.show((0.40, 0.12, 0.031), OPEN)
    assert not other.reflexes.lost_object


def test_reflexes_that_are_switched_off_do_nothing():
    off = msgspec.structs.replace(
        SCENARIO.reflexes, close_on_object=False, open_over_receptacle=False, open_on_table=False
    )
    hand = Hand(msgspec.structs.replace(SCENARIO, reflexes=off))
    assert not hand.show(at())
    assert hand.show(at(), asked=Grip.CLOSE)
    hand.carry("red_cylinder", at())
    hand.carry("red_cylinder", (0.40, 0.12, 0.21))
    assert hand.carry("red_cylinder", (0.40, 0.12, 0.03))


def test_a_reset_opens_the_hand_and_forgets_what_was_held(hand):
    hand.grasp("red_cylinder")
    hand.reflexes.reset(percept(TABLE, tcp_m=(0.42, 0.0, 0.2)))
    assert not hand.show((0.42, 0.0, 0.2))
    assert not hand.reflexes.lost_object
    assert hand.show((TABLE["blue_cylinder"][0], TABLE["blue_cylinder"][1], 0.03))
