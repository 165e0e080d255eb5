"""A hand that does what it was asked and nothing by itself, and a rig that perceives nothing."""

import msgspec
import pytest

from config.loader import resolve
from robot.messages import Grip, GripState, Hold, StationMode
from robot.motion import AskedHand
from robot.own_senses import OwnSenses
from robot.person_reset import PersonLook
from robot.rigs import build_station
from sim_twin.operator import SimulatedOperator
from tests.support.stations import fake_rig, percept

ARM = fake_rig().arm
AT = (0.4, 0.0, 0.1)


def seen(opening_m, *, has_object=False):
    grip = GripState(opening_m=opening_m, is_moving=False, has_object=has_object)
    return percept({"red_cylinder": (0.4, 0.0, 0.09)}, tcp_m=AT, grip=grip)


@pytest.fixture
def hand():
    return AskedHand(ARM)


def test_until_somebody_asks_the_fingers_stay_where_they_are(hand):
    hand.reset(seen(0.031))
    for _ in range(3):
        assert hand.decide(seen(0.031), None).opening_m == 0.031
    assert hand.decide(seen(0.031), Grip.OPEN).opening_m == ARM.tool.stroke_m
    assert hand.decide(seen(0.05), None).opening_m == ARM.tool.stroke_m
    assert hand.decide(seen(0.05), Grip.CLOSE).opening_m == 0.0


@pytest.mark.parametrize(("measured_m", "asked_m"), [(-0.001, 0.0), (0.0852, 0.085)])
def test_what_is_asked_at_the_start_is_within_the_stroke_whatever_is_measured(hand, measured_m, asked_m):
    hand.reset(seen(measured_m))
    assert hand.decide(seen(measured_m), None).opening_m == asked_m


def test_what_it_holds_it_goes_on_holding_and_a_loss_is_told_once(hand):
    hand.reset(seen(0.04, has_object=True))
    command = hand.decide(seen(0.04, has_object=True), None)
    assert (command.opening_m, command.force_n) == (0.0, ARM.tool.grip_force_n)
    lost = [hand.decide(seen(0.0), None) and hand.lost_object for _ in range(3)]
    assert lost == [True, False, False]


def test_no_reflex_closes_on_what_lies_between_the_jaws_and_the_arm_never_waits(hand):
    hand.reset(seen(0.085))
    assert hand.decide(seen(0.085), None).opening_m == pytest.approx(0.085)
    assert hand.wait_at_m is None


def test_a_rig_that_perceives_nothing_can_be_driven_and_says_that_it_sees_nothing():
    resolved = resolve(rig="fake", scenario="paper")
    blind = msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, perception=None))
    station = build_station(blind, is_driven=True)
    SimulatedOperator().arm_once(station)
    result = station.step(Hold(grip=Grip.CLOSE))
    assert station.state.mode is StationMode.ENGAGED
    assert (result.percept.objects, result.percept.distances_m) == ((), ())
    assert result.percept == OwnSenses().perceive(station.measured, None)
    station.close()


def test_where_a_person_sees_to_the_table_the_arm_is_let_go_of_first():
    done = []

    class Loop:
        def stop(self):
            done.append("stop")

        def await_rest(self):
            done.append("rest")

    class Somebody:
        def confirm(self, text):
            done.append(text)

    PersonLook(loop=Loop(), person=Somebody()).reset(seed=1, epoch=0, digital_out=0)
    assert done[:2] == ["stop", "rest"]
    assert "disarmed" in done[2]
