import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.loader import load_arm
from robot.messages import Heading, Twist
from robot.motion.target import Shaped, TargetLimits, advance_heading, advance_twist, fence, is_free

ARM = load_arm("ur5e")
LIMITS = TargetLimits.of(ARM, 0.0)
STEP = ARM.motion.max_step_m
DT = ARM.motion.step_s
SLOW = ARM.motion.guarded_speed_m_s * DT
LOW, TRAVEL = ARM.motion.heights_m
HIGH = (0.42, 0.05, TRAVEL)
DEEP = (0.42, 0.05, 0.08)
ANGLE, DISTANCE, HEIGHT = st.floats(-7.0, 7.0), st.floats(0.0, 1.0), st.floats(-0.5, 0.5)
PLACE = st.tuples(st.floats(0.24, 0.64), st.floats(-0.36, 0.36), st.floats(0.02, 0.32))


def heading(angle=0.0, distance=0.0, height=TRAVEL):
    return Heading(heading_rad=angle, distance_m=distance, height_m=height)


def test_a_heading_at_its_height_moves_the_target_along_the_direction():
    shaped = advance_heading(HIGH, heading(angle=math.pi / 2, distance=0.01), LIMITS, DT)
    assert shaped.position_m == pytest.approx((0.42, 0.06, TRAVEL))
    assert shaped.limiters == ()


def test_a_heading_without_distance_moves_in_height_only():
    shaped = advance_heading(DEEP, heading(angle=1.0), LIMITS, DT)
    assert shaped.position_m == pytest.approx((0.42, 0.05, 0.08 + STEP))


def test_a_far_height_and_a_full_step_go_up_at_45_degrees():
    at = (0.42, 0.0, LIMITS.guard_z_m)
    x, _, z = advance_heading(at, heading(distance=STEP, height=TRAVEL), LIMITS, DT).position_m
    assert x - at[0] == pytest.approx(STEP / math.sqrt(2))
    assert z - at[2] == pytest.approx(STEP / math.sqrt(2))


@given(PLACE, ANGLE, DISTANCE, HEIGHT)
def test_no_heading_moves_the_target_by_more_than_the_longest_step(at, angle, distance, height):
    moved = advance_heading(at, heading(angle, distance, height), LIMITS, DT).position_m
    assert math.dist(at, moved) <= STEP * (1 + 1e-9)


@given(PLACE, st.tuples(*[st.floats(-10.0, 10.0)] * 3))
def test_no_twist_moves_the_target_by_more_than_the_longest_step(at, velocity):
    moved = advance_twist(at, Twist(linear_m_s=velocity), LIMITS, DT).position_m
    assert math.dist(at, moved) <= STEP * (1 + 1e-9)


@given(PLACE, ANGLE, DISTANCE, HEIGHT)
def test_below_the_guard_height_the_target_sinks_and_slides_at_guarded_speed(at, angle, distance, height):
    x, y, z = advance_heading(at, heading(angle, distance, height), LIMITS, DT).position_m
    if z < LIMITS.guard_z_m - 1e-9:
        sunk = max(0.0, min(at[2], LIMITS.guard_z_m) - z)
        assert math.hypot(x - at[0], y - at[1], sunk) <= SLOW + 1e-9


@pytest.mark.parametrize(("height", "share"), [(0.08, 1.0), (0.0, 1.0 / math.sqrt(2.0)), (TRAVEL, 1.0)])
def test_a_target_that_slides_as_it_sinks_does_both_the_slower_and_none_where_it_rises(height, share):
    rise = min(STEP, max(-STEP, height - DEEP[2])) if height else -STEP
    shaped = advance_twist(DEEP, Twist(linear_m_s=(STEP / DT, 0.0, rise / DT)), LIMITS, DT)
    x, _, z = shaped.position_m
    assert shaped.limiters[-1] == "guard"
    assert x - DEEP[0] == pytest.approx(SLOW * share)
    assert (z - DEEP[2] > 0.0) is (height == TRAVEL)


def test_below_the_guard_height_the_target_rises_freely():
    assert advance_heading(DEEP, heading(), LIMITS, DT).position_m[2] == pytest.approx(0.08 + STEP)


@pytest.mark.parametrize(
    ("asked", "came", "names"),
    [(TRAVEL, TRAVEL, ()), (TRAVEL + 0.1, TRAVEL, ("height",)), (LOW, LOW, ()), (0.0, LOW, ("height",))],
)
def test_heights_are_held_within_what_the_arm_offers_and_said(asked, came, names):
    at = (0.42, 0.0, came)
    shaped = advance_heading(at, heading(height=asked), LIMITS, DT)
    assert shaped.position_m == pytest.approx(at)
    assert shaped.limiters == names


def test_a_step_at_the_limit_is_not_called_shortened_and_one_beyond_is():
    assert advance_heading(HIGH, heading(distance=STEP), LIMITS, DT).limiters == ()
    assert advance_heading(HIGH, heading(distance=STEP * 1.01), LIMITS, DT).limiters == ("max_step",)


def test_a_twist_moves_by_velocity_times_duration():
    shaped = advance_twist(HIGH, Twist(linear_m_s=(0.1, -0.2, 0.0)), LIMITS, DT)
    assert shaped.position_m == pytest.approx((0.425, 0.04, TRAVEL))


def test_a_twist_that_would_tilt_the_tool_says_that_it_does_not():
    shaped = advance_twist(HIGH, Twist(linear_m_s=(0.0,) * 3, angular_rad_s=(0.1, 0.0, 0.0)), LIMITS, DT)
    assert shaped.position_m == HIGH
    assert "tool_down" in shaped.limiters


@given(st.tuples(*[st.floats(-2.0, 2.0)] * 3), PLACE)
def test_whatever_is_wanted_the_fence_keeps_the_leash(wanted, measured):
    assert math.dist(fence(wanted, measured, LIMITS).position_m, measured) <= LIMITS.leash_m * (1 + 1e-9)


STRAY = LIMITS.leash_m / 3
NEARBY = st.tuples(*[st.floats(-0.08, 0.08)] * 3)


@given(PLACE, NEARBY, st.tuples(st.floats(0.0, STRAY), st.floats(0.0, math.pi), st.floats(-math.pi, math.pi)))
def test_the_fence_leaves_a_free_target_alone_wherever_the_leash_is_held(tool, away, stray):
    r, a, b = stray
    held = (
        tool[0] + r * math.sin(a) * math.cos(b),
        tool[1] + r * math.sin(a) * math.sin(b),
        tool[2] + r * math.cos(a),
    )
    target = (tool[0] + away[0], tool[1] + away[1], tool[2] + away[2])
    if is_free(target, tool, LIMITS, stray_m=STRAY):
        assert fence(target, held, LIMITS) == Shaped(target)


@pytest.mark.parametrize("short_m", [-1e-6, 1e-6])
def test_a_target_is_free_up_to_the_leash_less_the_stray_and_inside_the_workspace(short_m):
    far = (HIGH[0] + LIMITS.leash_m - STRAY - short_m, *HIGH[1:])
    assert is_free(far, HIGH, LIMITS, stray_m=STRAY) == (short_m > 0)
    edge = LIMITS.workspace_m[1][2]
    assert is_free((*HIGH[:2], edge - short_m), (*HIGH[:2], edge), LIMITS, stray_m=STRAY) == (short_m > 0)


@given(st.tuples(*[st.floats(-2.0, 2.0)] * 3), PLACE)
def test_whatever_is_wanted_the_fence_keeps_the_workspace(wanted, measured):
    (x0, y0, z0), (x1, y1, z1) = LIMITS.workspace_m
    inside = (min(max(measured[0], x0), x1), min(max(measured[1], y0), y1), min(max(measured[2], z0), z1))
    x, y, z = fence(wanted, inside, LIMITS).position_m
    assert x0 - 1e-9 <= x <= x1 + 1e-9
    assert y0 - 1e-9 <= y <= y1 + 1e-9
    assert z0 - 1e-9 <= z <= z1 + 1e-9


def test_the_lowest_target_keeps_the_fingertips_clear_of_the_table():
    floor = LIMITS.workspace_m[0][2]
    assert floor - ARM.tool.tip_below_tcp_m > ARM.motion.table_clearance_m
    assert TargetLimits.of(ARM, 0.3).workspace_m[0][2] == pytest.approx(floor + 0.3)


def test_a_target_inside_is_left_alone():
    shaped = fence(HIGH, (0.43, 0.05, TRAVEL), LIMITS)
    assert shaped.position_m == HIGH
    assert shaped.limiters == ()
