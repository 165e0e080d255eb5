"""Low over the table the tool itself goes at guarded speed, not only its target."""

import math
from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from config.limited import limited
from config.loader import resolve
from robot.envelope import Envelope
from robot.motion.follower import Follower
from robot.motion.guarding import LEAST_SHARE, SNAP_M_S_N, dragged_speed, guarded_share, is_guarded, share_of_line

RESOLVED = resolve()
PROFILE = RESOLVED.limits.profile("unattended")
ARM = limited(RESOLVED.arm, PROFILE)
GUARD_Z_M, GUARDED_M_S = 0.18, ARM.motion.guarded_speed_m_s
places = st.tuples(*[st.floats(-0.5, 0.5)] * 3)


@given(at=places, to=places, speed=st.floats(0.1, 1.0), guarded=st.floats(0.05, 0.5))
def test_a_straight_way_sinks_and_slides_as_guarded_and_no_slower_than_it_must(at, to, speed, guarded):
    way = [b - a for a, b in zip(at, to, strict=True)]
    longest = max(map(abs, way))
    assume(longest > 1e-6)
    share = guarded_share(at, to, speed, guarded)
    fastest = share * speed * math.hypot(way[0], way[1], min(0.0, way[2])) / longest
    assert fastest <= guarded * (1.0 + 1e-9)
    assert share == 1.0 or fastest >= guarded * (1.0 - 1e-9)


@pytest.mark.parametrize(
    ("at", "to", "is_slow"),
    [
        ((0.0, 0.0, 0.2), (0.0, 0.0, 0.18), False),
        ((0.0, 0.0, 0.2), (0.0, 0.0, math.nextafter(0.18, 0.0)), True),
        ((0.0, 0.0, 0.1), (0.0, 0.0, 0.3), False),
        ((0.0, 0.0, 0.1), (0.001, 0.0, 0.3), True),
        ((0.0, 0.0, 0.1), (0.0, -0.001, 0.1), True),
        ((0.0, 0.0, 0.2), (0.3, 0.0, 0.2), False),
    ],
)
def test_a_way_is_guarded_where_it_is_low_and_does_not_just_rise(at, to, is_slow):
    assert is_guarded(at, to, GUARD_Z_M) is is_slow


@given(at=places, to=places, speed=st.floats(0.1, 1.0), most=st.floats(0.01, 2.0))
def test_a_straight_way_is_gone_as_fast_as_it_may_be_and_no_faster(at, to, speed, most):
    longest = max(abs(b - a) for a, b in zip(at, to, strict=True))
    assume(longest > 1e-6)
    share = share_of_line(at, to, speed, most)
    along = share * speed * math.dist(at, to) / longest
    assert along <= most * (1.0 + 1e-9)
    assert share == 1.0 or along >= most * (1.0 - 1e-9)


@given(force=st.tuples(*[st.floats(-500.0, 500.0)] * 3), most=st.floats(0.05, 1.0))
def test_what_holds_a_tool_slows_it_by_what_it_would_snap_away_with_and_never_to_a_stand(force, most):
    speed, held_n = dragged_speed(force, 15.0, most), math.hypot(*force) - 15.0
    assert LEAST_SHARE * most <= speed <= most
    assert (speed == most) == (held_n <= 0.0) or held_n * SNAP_M_S_N < 1e-12
    assert speed == LEAST_SHARE * most or speed + SNAP_M_S_N * max(0.0, held_n) == pytest.approx(most)


@pytest.mark.parametrize(
    ("force_n", "speed_m_s"),
    [
        ((15.0, 0.0, 0.0), 0.25),
        ((0.0, -15.0, 0.0), 0.25),
        ((0.0, 0.0, math.nextafter(15.0, 16.0) + 1e-6), 0.25 - SNAP_M_S_N * 1e-6),
        ((0.0, 43.0, -25.0), 0.25 - SNAP_M_S_N * (math.hypot(43.0, 25.0) - 15.0)),
        ((0.0, 0.0, 90.0), 0.025),
        ((0.0, 0.0, -1e4), 0.025),
    ],
)
def test_how_fast_a_held_tool_may_go(force_n, speed_m_s):
    assert dragged_speed(force_n, 15.0, 0.25) == pytest.approx(speed_m_s, abs=1e-12)


def made(tick_s):
    follower = Follower(ARM, envelope=Envelope.of(PROFILE, ARM, tick_s=tick_s), tick_s=tick_s, guard_z_m=GUARD_Z_M)
    follower.seed(ARM.home_rad)
    return follower


@pytest.mark.parametrize("tick_s", [0.01, 0.002])
def test_a_tool_whose_target_is_far_ahead_of_it_comes_down_as_guarded_and_rises_at_full_speed(tick_s):
    follower = made(tick_s)
    x, y, z = follower.target_m
    down = run(follower, (x, y, 0.06), tick_s)
    assert z > GUARD_Z_M
    assert max(-v for v in down) == pytest.approx(GUARDED_M_S, rel=0.02)
    assert follower.tcp(follower.q_rad)[2] == pytest.approx(0.06, abs=1e-4)
    assert max(run(follower, (x, y, 0.3), tick_s)) > 1.5 * GUARDED_M_S


@pytest.mark.parametrize("tick_s", [0.01, 0.002])
def test_joints_that_lead_down_bring_the_tool_there_as_guarded(tick_s):
    follower = made(tick_s)
    q = follower.q_rad
    follower.aim_joints((q[0], q[1] + 0.15, q[2] + 0.1, q[3], q[4] + 0.02, q[5]))
    fastest, before = 0.0, follower.tcp(q)
    for _ in range(round(1.5 / tick_s)):
        here = follower.tcp(follower.step())
        fastest, before = max(fastest, math.dist(here, before) / tick_s), here
    assert before[2] < GUARD_Z_M
    assert 0.7 * GUARDED_M_S < fastest <= 1.001 * GUARDED_M_S


def run(follower, place_m, tick_s):
    """Go to a place and return how fast the tool rose, tick by tick."""
    assert follower.aim(place_m, follower.yaw_rad)
    heights = [follower.tcp(follower.q_rad)[2]]
    heights += [follower.tcp(follower.step())[2] for _ in range(round(1.5 / tick_s))]
    return [(b - a) / tick_s for a, b in pairwise(heights)]
