"""From what a driver asks to an intent."""

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.geometry import rotated
from robot.messages import Grip, Hold, Twist
from robot.teleop.device import DriverInput, Frame
from robot.teleop.jog import Jog, JogLimits

LIMITS = JogLimits(full_m_s=0.2, full_rad_s=0.5, ramp_s=0.2, deadline_s=0.1, step_s=0.02)
DOWN = (0.0, 1.0, 0.0, 0.0)
AHEAD = DriverInput(stamp_ns=0, linear=(1.0, 0.0, 0.0), is_held=True)


def changed(**changes):
    return msgspec.structs.replace(AHEAD, **changes)


def settled(jog, asked, n=20):
    for _ in range(n):
        intent = jog.decide(asked, now_ns=0, tcp_quat=DOWN)
    return intent


@pytest.fixture
def jog():
    return Jog(LIMITS)


def test_motion_ramps_up_from_rest_in_equal_steps(jog):
    speeds = [jog.decide(AHEAD, now_ns=0, tcp_quat=DOWN).linear_m_s[0] for _ in range(12)]
    assert speeds == pytest.approx([0.02 * k for k in range(1, 11)] + [0.2, 0.2])


@pytest.mark.parametrize(
    ("asked", "why"),
    [
        (changed(is_held=False), "released"),
        (changed(linear=(0.0, 0.0, 0.0)), "released"),
        (changed(is_clutched=True), "clutch"),
        (changed(linear=(math.nan, 0.0, 0.0)), "wrong input"),
        (changed(angular=(0.0, 0.0, math.inf)), "wrong input"),
        (changed(speed_share=math.nan), "wrong input"),
        (changed(stamp_ns=-100_000_001), "silent"),
        (changed(stamp_ns=100_000_001), "silent"),
    ],
)
def test_what_is_no_wish_to_move_holds_at_once_and_the_ramp_begins_anew(jog, asked, why):
    settled(jog, AHEAD)
    assert isinstance(jog.decide(asked, now_ns=0, tcp_quat=DOWN), Hold)
    assert jog.resting == why
    assert jog.decide(AHEAD, now_ns=0, tcp_quat=DOWN).linear_m_s[0] == pytest.approx(0.02)


@pytest.mark.parametrize("age_ns", [-100_000_000, 0, 100_000_000])
def test_an_input_at_its_deadline_still_counts(jog, age_ns):
    assert isinstance(jog.decide(changed(stamp_ns=-age_ns), now_ns=0, tcp_quat=DOWN), Twist)


def test_the_share_scales_the_speed(jog):
    assert settled(jog, changed(speed_share=0.5)).linear_m_s[0] == pytest.approx(0.1)
    assert settled(jog, changed(speed_share=7.0)).linear_m_s[0] == pytest.approx(0.2)


def test_another_frame_begins_from_rest(jog):
    settled(jog, AHEAD)
    assert jog.decide(changed(frame=Frame.TOOL), now_ns=0, tcp_quat=DOWN).linear_m_s[0] == pytest.approx(0.02)


def test_along_the_tools_axis_is_down_for_a_tool_that_points_down(jog):
    intent = settled(jog, changed(frame=Frame.TOOL, linear=(0.0, 0.0, 1.0), angular=(0.0, 0.0, 1.0)))
    assert intent.linear_m_s == pytest.approx((0.0, 0.0, -0.2), abs=1e-12)
    assert intent.angular_rad_s == pytest.approx((0.0, 0.0, -0.5), abs=1e-12)


def test_the_hand_goes_on_with_what_it_was_asked_last(jog):
    assert jog.decide(AHEAD, now_ns=0, tcp_quat=DOWN).grip is None
    assert jog.decide(changed(grip=Grip.CLOSE), now_ns=0, tcp_quat=DOWN).grip is Grip.CLOSE
    assert jog.decide(AHEAD, now_ns=0, tcp_quat=DOWN).grip is Grip.CLOSE
    assert jog.decide(changed(grip=Grip.OPEN, is_held=False), now_ns=0, tcp_quat=DOWN).grip is Grip.OPEN
    assert jog.decide(AHEAD, now_ns=0, tcp_quat=DOWN).grip is Grip.OPEN
    jog.reset()
    assert jog.decide(AHEAD, now_ns=0, tcp_quat=DOWN).grip is None


SHARE = st.floats(-1e6, 1e6)
VECTOR = st.tuples(SHARE, SHARE, SHARE)


@given(VECTOR, VECTOR, st.floats(0, 10), st.sampled_from(Frame), st.integers(1, 30))
def test_whatever_is_asked_no_intent_is_faster_than_full_speed(linear, angular, share, frame, n):
    asked = changed(linear=linear, angular=angular, speed_share=share, frame=frame)
    intent = settled(Jog(LIMITS), asked, n)
    if isinstance(intent, Twist):
        assert math.hypot(*intent.linear_m_s) <= LIMITS.full_m_s * (1 + 1e-9)
        assert math.hypot(*intent.angular_rad_s) <= LIMITS.full_rad_s * (1 + 1e-9)


@given(st.tuples(*[st.floats(-1, 1)] * 4), VECTOR)
def test_turning_a_vector_keeps_its_length_and_turning_it_back_brings_it_back(quat, vector):
    length = math.hypot(*quat)
    if length < 0.1:
        return
    w, x, y, z = (part / length for part in quat)
    turned = rotated(vector, (w, x, y, z))
    size = max(1.0, math.hypot(*vector))
    assert math.hypot(*turned) == pytest.approx(math.hypot(*vector), abs=1e-9 * size)
    assert rotated(turned, (w, -x, -y, -z)) == pytest.approx(vector, abs=1e-9 * size)
