"""What the controller says of its tool against our model: the bound passes, the next float does not; it must last."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from config.loader import load_arm
from robot.hal.fake import FakePlant
from robot.kinematics import ToolChain
from robot.messages import Hold, StationMode, Twist
from robot.rigs import build_station
from robot.safety import CrossCheck, Reason
from robot.safety.cross_check import (
    FREE_N,
    LASTING_NS,
    SHARE,
    SPEED_M_S,
    check_free,
    check_tool_speed,
    tool_speed,
)
from sim_twin.operator import SimulatedOperator
from tests.support.stations import arm_state, engaged, fake_rig

ARM = load_arm("ur5e")
CHAIN = ToolChain(ARM)
HOME = tuple(ARM.home_rad)
AXES = [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)]
STILL = (0.0, 0.0, 0.0)


def along(axis, length):
    return tuple(length * a for a in axis)


@pytest.mark.parametrize("axis", AXES)
def test_a_reported_speed_at_the_bound_passes_and_the_next_float_does_not(axis):
    assert check_tool_speed(STILL, along(axis, SPEED_M_S)) is None
    refusal = check_tool_speed(STILL, along(axis, math.nextafter(SPEED_M_S, math.inf)))
    assert refusal.reason is Reason.KINEMATICS
    assert 0.0 < refusal.amount < 1e-15
    assert "tool centre point" in refusal.detail


@pytest.mark.parametrize("axis", AXES)
def test_the_bound_grows_by_a_share_of_our_own_speed(axis):
    ours = along(axis, 1.0)
    most = SPEED_M_S + SHARE
    assert check_tool_speed(ours, along(axis, 1.0 + most - 1e-12)) is None
    assert check_tool_speed(ours, along(axis, 1.0 + most + 1e-12)).reason is Reason.KINEMATICS
    assert check_tool_speed(ours, along(axis, 1.0 - most - 1e-12)).reason is Reason.KINEMATICS


def test_a_force_at_the_bound_passes_and_the_next_float_does_not():
    assert check_free(FREE_N) is None
    refusal = check_free(math.nextafter(FREE_N, math.inf))
    assert refusal.reason is Reason.PAYLOAD
    assert 0.0 < refusal.amount < 1e-12
    assert check_free(math.nan).reason is Reason.PAYLOAD


def test_refusals_say_what_was_expected_what_came_and_what_to_look_at():
    assert check_free(23.456).detail == (
        "expected at most 20 N on a tool that has not moved yet, came 23.5: is the payload that of the hand, was the "
        "sensor zeroed under load, does something push?"
    )
    assert check_tool_speed((0.1234567, 0.0, 0.0), (0.0, -0.0123456, 0.5)).detail == (
        "expected the controller's tool speed within 0.0362 m/s of ours, came 0.515: ours (0.123, 0.0, 0.0), its own "
        "(0.0, -0.012, 0.5) m/s; are its tool centre point and calibration the file's?"
    )


JOINT = st.floats(-1.0, 1.0)


@settings(max_examples=60, deadline=None)
@given(st.lists(JOINT, min_size=6, max_size=6), st.lists(JOINT, min_size=6, max_size=6))
def test_our_speed_is_the_models_jacobian_times_the_joints(offsets, qd):
    q = tuple(h + o for h, o in zip(HOME, offsets, strict=True))
    step = 1e-6
    columns = []
    for i in range(6):
        ahead, back = ([v + (s if k == i else 0.0) for k, v in enumerate(q)] for s in (step, -step))
        columns.append((np.array(CHAIN.tcp(tuple(ahead))) - CHAIN.tcp(tuple(back))) / (2 * step))
    expected = np.array(columns).T @ qd
    assert tool_speed(CHAIN, arm_state(q, qd_rad_s=tuple(qd))) == pytest.approx(expected, abs=2e-5)


@settings(max_examples=60, deadline=None)
@given(st.lists(JOINT, min_size=6, max_size=6), st.lists(st.floats(), min_size=3, max_size=3))
def test_whatever_passes_for_long_is_within_the_bound(qd, reported):
    state = arm_state(HOME, qd_rad_s=tuple(qd), speed_m_s=tuple(reported))
    cross = CrossCheck(CHAIN)
    refused = [cross.check(replace(state, stamp_ns=k * LASTING_NS)) for k in range(2)]
    ours = tool_speed(CHAIN, state)
    if refused == [None, None]:
        assert math.dist(ours, reported) <= SPEED_M_S + SHARE * math.hypot(*ours)


@pytest.mark.parametrize(("last_ns", "is_refused"), [(LASTING_NS - 1, False), (LASTING_NS, True)])
def test_a_difference_is_refused_when_it_has_lasted_and_not_a_nanosecond_before(last_ns, is_refused):
    cross = CrossCheck(CHAIN)
    off = arm_state(HOME, speed_m_s=(0.1, 0.0, 0.0), stamp_ns=7)
    assert cross.check(off) is None
    assert (cross.check(replace(off, stamp_ns=7 + last_ns)) is not None) is is_refused


def test_a_difference_that_ends_or_a_seed_begins_the_count_anew():
    off, well = arm_state(HOME, speed_m_s=(0.1, 0.0, 0.0)), arm_state(HOME)
    for between in (lambda c: c.check(well), lambda c: c.seed()):
        cross = CrossCheck(CHAIN)
        assert cross.check(off) is None
        between(cross)
        assert cross.check(replace(off, stamp_ns=LASTING_NS)) is None
        assert cross.check(replace(off, stamp_ns=2 * LASTING_NS)).reason is Reason.KINEMATICS


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_speed_that_is_no_number_is_refused_at_once(bad):
    assert CrossCheck(CHAIN).check(arm_state(HOME, speed_m_s=(0.0, bad, 0.0))).reason is Reason.KINEMATICS


def test_a_force_is_asked_about_before_anything_has_moved_and_not_after():
    cross = CrossCheck(CHAIN)
    pushed = arm_state(HOME, force_n=(0.0, 0.0, FREE_N + 1.0))
    assert cross.check(pushed).reason is Reason.PAYLOAD
    assert cross.check(pushed) is None, "a push under way is check_force's"
    cross.seed()
    assert cross.check(pushed).reason is Reason.PAYLOAD


def test_a_controller_with_another_tool_latches_a_station_that_moves():
    station, plant = engaged()
    up = Twist(linear_m_s=(0.0, 0.0, 0.1))
    for _ in range(4):
        assert not station.step(up).verdicts
    plant.arm.tcp_speed_m_s = (0.1, 0.0, 0.1)
    results = [station.step(up) for _ in range(2)]
    assert results[-1].verdicts[0].reason == "kinematics"
    assert station.state.mode is StationMode.LATCHED
    station.close()


def test_a_wrong_payload_latches_before_anything_moves():
    resolved = fake_rig()
    plant = FakePlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    plant.arm.force_n = (0.0, 0.0, -FREE_N - 1.0)
    station = build_station(resolved, plant=plant)
    SimulatedOperator().arm_once(station)
    before = plant.arm.read().q_rad
    assert station.step(Hold()).verdicts[0].reason == "payload"
    assert plant.arm.read().q_rad == before
    station.close()
