"""What a station perceives reaches motion and gate with each time step: what moved, what is held, what is old."""

import math

import msgspec
import pytest
from msgspec.structs import replace

from robot.hal.fake import FakePlant
from robot.messages import GripState, Twist
from robot.safety.blocks import AWAY
from robot.servo_messages import StrideRequest, pack_intent
from robot.surroundings import Lookout
from tests.support.hand_served import HandServed
from tests.support.stations import engaged, fake_rig, percept

RESOLVED = fake_rig()
SCENARIO, ARM = RESOLVED.scenario, RESOLVED.arm
NAME = SCENARIO.cylinders[0].name
AHEAD = Twist(linear_m_s=(0.0, 0.3, 0.0))
N_STEPS = 30
HEIGHT_M = 0.075
"""From the tool centre point up to the middle of the palm's lower half: a thing up there is in the palm's way."""


class Told:
    """A perception that says what a test wants of one thing, and the truth of all others."""

    def __init__(self, real):
        self._real, self.changes, self.stamp_off_ns = real, {}, 0

    def perceive(self, arm, scene):
        seen = self._real.perceive(arm, scene)
        things = tuple(replace(t, **self.changes) if t.name == NAME else t for t in seen.objects)
        return replace(seen, objects=things, stamp_ns=seen.stamp_ns + self.stamp_off_ns)


@pytest.fixture
def driven():
    station, plant = engaged()
    station._perception = told = Told(station._perception)
    yield station, told, plant
    station.close()


def beside_the_palm(station, away_m):
    """A place so far ahead of the palm, at its height."""
    x, y, z = station.measured.tcp_position_m
    return x, y + away_m, z + ARM.tool.finger_depth_m + 0.03


def drive(station, n=N_STEPS):
    """Go ahead; return how far, and what was said."""
    begin, names, unseen = station.measured.tcp_position_m[1], set(), set()
    for _ in range(n):
        came = station.step(AHEAD)
        assert not came.verdicts
        names |= set(came.executed.limiters)
        unseen |= set(came.executed.unseen)
    return station.measured.tcp_position_m[1] - begin, names, unseen


def test_a_thing_is_kept_clear_of_where_it_is_perceived_and_not_where_it_was(driven):
    station, told, _ = driven
    station.step(Twist(linear_m_s=(0.0, 0.0, 0.0)))
    freely_m, names, _ = drive(station, 12)
    assert "clearance" not in names
    told.changes = {"position_m": beside_the_palm(station, 0.15)}
    station.step(Twist(linear_m_s=(0.0, 0.0, 0.0)))
    before_it_m, names, unseen = drive(station)
    assert "clearance" in names
    assert unseen == set()
    assert before_it_m < 0.15 - 0.032 - SCENARIO.cylinders[0].diameter_m / 2.0
    assert freely_m > 0.1


def test_a_thing_that_is_seen_no_longer_is_kept_clear_of_where_it_was_last_and_said_to_be_unseen(driven):
    station, told, _ = driven
    told.changes = {"position_m": beside_the_palm(station, 0.25)}
    station.step(Twist(linear_m_s=(0.0, 0.0, 0.0)))
    station.step(Twist(linear_m_s=(0.0, 0.0, 0.0)))
    told.changes = {"is_valid": False, "position_m": (0.3, 0.3, 0.0)}
    came_m, names, unseen = drive(station)
    assert "clearance" in names
    assert unseen == {NAME}
    assert came_m < 0.25 - 0.032 - SCENARIO.cylinders[0].diameter_m / 2.0


def test_with_a_percept_that_is_too_old_the_arm_comes_to_rest_and_nothing_latches(driven):
    station, told, _ = driven
    drive(station, 6)
    told.stamp_off_ns = -round(ARM.motion.percept_max_age_s * 1e9) - 1
    station.step(AHEAD)
    for _ in range(8):
        came = station.step(AHEAD)
        assert came.executed.limiters[:1] == ("percept_age",)
        assert not came.verdicts
    assert math.hypot(*came.executed.moved_m) < 1e-4
    told.stamp_off_ns = 0
    station.step(AHEAD)
    moved_m, names, _ = drive(station, 6)
    assert moved_m > 0.02
    assert "percept_age" not in names


def surroundings(at_m, *, tool_m, is_held=False):
    grip = GripState(opening_m=0.044, is_moving=False, has_object=is_held)
    return Lookout(SCENARIO, max_age_s=0.15).see(percept({NAME: at_m}, tcp_m=tool_m, grip=grip))


@pytest.fixture
def served():
    made = HandServed(RESOLVED, FakePlant(arm=ARM, scenario=SCENARIO, rig=RESOLVED.rig))
    made.seed()
    return made


def _gap_m(served):
    """The gap that the gate finds where the arm stands."""
    return served.loop.gate._stops._clearance.gap(served.loop.state.q_rad)


def test_what_is_held_is_no_obstacle_to_palm_and_fingers(served):
    tool_m = served.loop.state.tcp_position_m
    free_m = _gap_m(served)
    in_palm_m = (tool_m[0], tool_m[1], tool_m[2] + 0.02)
    served.loop.perceive(surroundings((tool_m[0], tool_m[1], tool_m[2] + 0.1), tool_m=tool_m))
    assert _gap_m(served) < 0.0
    served.loop.perceive(surroundings(in_palm_m, tool_m=tool_m, is_held=True))
    assert [b.centre_m for b in served.loop._obstacles.blocks if b.name == NAME] == [AWAY]
    assert _gap_m(served) == pytest.approx(free_m, abs=1e-9)


def test_what_is_perceived_crosses_to_the_servo_process_with_its_time_step(served):
    tool_m = served.loop.state.tcp_position_m
    around = surroundings((0.3, 0.3, 0.1), tool_m=tool_m)
    request = StrideRequest(intent=pack_intent(AHEAD), grip=served._grip, n_ticks=5, sequence=1, around=around)
    crossed = msgspec.msgpack.decode(msgspec.msgpack.encode(request), type=StrideRequest)
    assert crossed.around == around
    served.server._answer(crossed)
    assert [b.centre_m for b in served.loop._obstacles.blocks if b.name == NAME] == [(0.3, 0.3, 0.1)]
    assert NAME not in served.loop._obstacles.unseen


def test_a_thing_that_appears_in_the_way_brings_the_tool_to_rest_before_it(served):
    for _ in range(6):
        served.stride(AHEAD, n_ticks=5)
    x, y, z = served.loop.state.tcp_position_m
    at_m = (x, y + 0.14, z + ARM.tool.finger_depth_m + 0.03)
    served.loop.perceive(surroundings(at_m, tool_m=(x, y, z)))
    for _ in range(10):
        verdict = served.stride(AHEAD, n_ticks=5).verdict
        assert verdict is None or verdict.reason == "stale_percept"
        served.loop.perceive(replace(surroundings(at_m, tool_m=(x, y, z)), stamp_ns=served.loop.state.stamp_ns))
    assert 0.0 <= _gap_m(served) < 0.02
