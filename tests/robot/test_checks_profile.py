"""Boundary tables of the limits profile: the limit passes, the next float does not. And what passes is inside."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from config.limits import ArmPart, Fence, KeepOut, Plane
from config.posture import part_points, tilt_rad
from robot.chain import ToolChain
from robot.envelope import braking_step, soft_step
from robot.errors import RobotConfigError
from robot.fences import box_gap, keep_out_gap, plane_gap
from robot.hal.fake import FakeArm
from robot.safety import Gate, GateLimits, Reason, check_profile_fits
from robot.safety.checks_profile import (
    check_cone,
    check_fences,
    check_giving_way,
    check_joint_acceleration,
    check_joint_jerk,
    check_part_speeds,
    check_soft_margin,
)
from tests.support.profiles import ARM, envelope, fenced, profile

DT = 0.01
ENVELOPE = envelope(DT)
HOME = tuple(ARM.home_rad)
JOINTS = range(6)
UP, DOWN = math.inf, -math.inf
ANGLES = st.tuples(*(st.floats(-6.2, 6.2) for _ in JOINTS))
STEPS = st.tuples(*(st.floats(-0.031, 0.031) for _ in JOINTS))
POINT = st.tuples(*(st.floats(-1.0, 1.0) for _ in range(3)))
ALL = (ArmPart.TCP, ArmPart.FLANGE, ArmPart.ELBOW)


def with_joint(q, i, value):
    return tuple(value if k == i else v for k, v in enumerate(q))


def moved(q, steps):
    return tuple(a + b for a, b in zip(q, steps, strict=True))


def reason(refusal):
    return None if refusal is None else refusal.reason


BY_ROUNDING = 1.0 + 1e-9
"""What a step may pass a limit by, and the next float may not."""


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_step_that_gains_all_its_acceleration_passes_and_the_next_float_does_not(i, sign):
    rest = (0.0,) * 6
    most = sign * ENVELOPE.joints[i].gain_rad * BY_ROUNDING
    assert check_joint_acceleration(with_joint(rest, i, most), rest, rest, ENVELOPE) is None
    beyond = with_joint(rest, i, math.nextafter(most, sign * math.inf))
    assert reason(check_joint_acceleration(beyond, rest, rest, ENVELOPE)) is Reason.JOINT_ACCELERATION


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_step_that_loses_all_a_stop_may_passes_and_the_next_float_does_not(i, sign):
    """The last step is so much that the whole of it is the most that may be lost."""
    rest, most = (0.0,) * 6, sign * ENVELOPE.joints[i].stop_rad * BY_ROUNDING
    assert check_joint_acceleration(rest, rest, with_joint(rest, i, -most), ENVELOPE) is None
    beyond = with_joint(rest, i, -math.nextafter(most, sign * math.inf))
    assert reason(check_joint_acceleration(rest, rest, beyond, ENVELOPE)) is Reason.JOINT_ACCELERATION


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_joint_that_turns_round_is_told_by_how_much_it_turned_too_hard(sign):
    end = ENVELOPE.joints[0]
    back, forth = -0.5 * sign * end.gain_rad, sign * end.stop_rad
    now, before = with_joint((0.0,) * 6, 0, back), with_joint((0.0,) * 6, 0, -forth)
    refusal = check_joint_acceleration(now, (0.0,) * 6, before, ENVELOPE)
    assert reason(refusal) is Reason.JOINT_ACCELERATION
    assert refusal.amount == pytest.approx(0.5 * end.gain_rad)


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_change_of_acceleration_at_a_stops_jerk_passes_and_the_next_float_does_not(i, sign):
    """A joint that comes to rest and lets go of all its acceleration."""
    rest, most = (0.0,) * 6, sign * ENVELOPE.joints[i].stop_jerk_rad * BY_ROUNDING
    assert check_joint_jerk(rest, rest, rest, with_joint(rest, i, most), ENVELOPE) is None
    beyond = with_joint(rest, i, math.nextafter(most, sign * math.inf))
    assert reason(check_joint_jerk(rest, rest, rest, beyond, ENVELOPE)) is Reason.JOINT_JERK


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_gain_that_grows_by_the_joints_jerk_passes_and_the_next_float_does_not(i, sign):
    rest, most = (0.0,) * 6, sign * (ENVELOPE.joints[i].jerk_rad * BY_ROUNDING + 1e-12)
    assert check_joint_jerk(with_joint(rest, i, most), rest, rest, rest, ENVELOPE) is None
    beyond = with_joint(rest, i, math.nextafter(most, sign * math.inf))
    assert reason(check_joint_jerk(beyond, rest, rest, rest, ENVELOPE)) is Reason.JOINT_JERK
    braked = with_joint(rest, i, sign * 2.0 * abs(most))  # it let go of a brake, and gathers speed from there
    assert check_joint_jerk(with_joint(rest, i, most), rest, rest, tuple(-v for v in braked), ENVELOPE) is None
    assert check_joint_jerk(beyond, rest, rest, tuple(-v for v in braked), ENVELOPE) is not None
    turning = with_joint(rest, i, sign * 1e-3)  # what turns round does not gather speed yet
    assert check_joint_jerk(beyond, rest, turning, turning, ENVELOPE) is None


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_pushed_a_joint_may_brake_and_give_way_however_hard_but_not_turn_round(i, sign):
    tight = envelope(DT, joints=tuple(replace(j, acceleration_rad_s2=5.0) for j in profile().joints))
    rest, most = (0.0,) * 6, tight.joints[i].gain_rad
    before, at = with_joint(rest, i, -sign * 0.03), with_joint(rest, i, -sign * 0.02)
    assert check_giving_way(rest, rest, before, rest, tight) is None
    assert check_giving_way(at, rest, before, at, tight) is None
    turned = with_joint(rest, i, -sign * 1.001 * most)
    assert reason(check_giving_way(turned, rest, before, rest, tight)) is Reason.JOINT_ACCELERATION
    past = with_joint(rest, i, -sign * (0.02 + 1.001 * most))
    assert reason(check_giving_way(past, rest, before, at, tight)) is Reason.JOINT_ACCELERATION


@given(ANGLES, STEPS, STEPS)
def test_whatever_acceleration_passes_is_within_gain_and_stop(last, before, step):
    q, earlier = moved(last, step), moved(last, [-v for v in before])
    if check_joint_acceleration(q, last, earlier, ENVELOPE) is None:
        for a, b, c, end in zip(q, last, earlier, ENVELOPE.joints, strict=True):
            assert abs((a - b) - (b - c)) <= end.stop_rad * BY_ROUNDING
            assert abs(a - b) <= end.gain_rad * BY_ROUNDING + (abs(b - c) if (a - b) * (b - c) > 0.0 else 0.0) + 1e-15


@given(ANGLES, STEPS, STEPS, STEPS)
def test_whatever_jerk_passes_is_within_a_stops_and_where_it_gains_within_its_own(last, step, before, earlier):
    befores = moved(last, [-v for v in before])
    q, earliers = moved(last, step), moved(befores, [-v for v in earlier])
    if check_joint_jerk(q, last, befores, earliers, ENVELOPE) is None:
        for x, y, z, end in zip(step, before, earlier, ENVELOPE.joints, strict=True):
            now, rate = x - y, y - z
            assert abs(now - rate) <= end.stop_jerk_rad * BY_ROUNDING + 1e-14
            if x * now > 0.0 and y * now >= 0.0:
                assert abs(now) <= max(0.0, math.copysign(rate, rate * now)) + end.jerk_rad * BY_ROUNDING + 2e-12


@given(ANGLES, STEPS, STEPS, STEPS)
def test_whatever_gives_way_gains_nothing_beyond_the_limit(last, before, step, off):
    q, earlier, measured = moved(last, step), moved(last, [-v for v in before]), moved(last, off)
    if check_giving_way(q, last, earlier, measured, ENVELOPE) is None:
        for a, b, c, m, end in zip(q, last, earlier, measured, ENVELOPE.joints, strict=True):
            free = (min(0.0, b - c, m - b), max(0.0, b - c, m - b))
            assert free[0] - end.gain_rad - 1e-12 <= a - b <= free[1] + end.gain_rad + 1e-12


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_in_the_soft_margin_a_joint_goes_slowly_towards_its_end_and_fast_away(i, side, share):
    end = ENVELOPE.joints[i]
    edge = end.high_rad if side > 0 else end.low_rad
    gap = share * end.margin_rad
    q = with_joint(HOME, i, edge - side * gap)
    most = end.step_rad * (0.1 + 0.9 * gap / end.margin_rad)
    most = min(most, math.sqrt(2.0 * end.gain_rad * gap))
    slow, fast = (with_joint(HOME, i, q[i] - side * by) for by in (most * (1.0 - 1e-6), most * (1.0 + 1e-6)))
    assert check_soft_margin(q, slow, ENVELOPE) is None
    assert reason(check_soft_margin(q, fast, ENVELOPE)) is Reason.SOFT_MARGIN
    assert check_soft_margin(q, with_joint(HOME, i, edge), ENVELOPE) is None


@pytest.mark.parametrize("i", JOINTS)
def test_outside_of_the_soft_margin_a_joint_is_as_fast_as_it_may_be(i):
    end = ENVELOPE.joints[i]
    q = with_joint(HOME, i, end.high_rad - end.margin_rad * 1.0001)
    assert check_soft_margin(q, with_joint(q, i, q[i] - end.step_rad), ENVELOPE) is None


@given(st.floats(0.0, 0.3), st.floats(1e-6, 0.05))
def test_a_braking_step_leaves_enough_to_come_to_rest_in(gap, braking):
    n_ticks = 0
    while gap > 1e-9 and n_ticks < 10_000:
        step = braking_step(gap, braking, 0.0)
        assert step <= gap
        assert step * step <= 2.0 * braking * (gap - step) * (1.0 + 1e-6) + 1e-12
        assert step - braking_step(gap - step, braking, 0.0) <= braking * (1.0 + 1e-9)
        gap, n_ticks = gap - step, n_ticks + 1
    assert n_ticks < 10_000


def test_the_soft_step_is_the_whole_at_the_margin_and_a_tenth_at_the_end():
    assert soft_step(0.1 + 0.03, 0.1, 0.03) == pytest.approx(0.03)
    assert soft_step(0.003, 0.1, 0.03) == pytest.approx(0.003, rel=1e-2)
    assert soft_step(0.0, 0.0, 0.03) == 0.03


@pytest.mark.parametrize("part", range(3))
@pytest.mark.parametrize("axis", range(3))
def test_a_part_at_its_speed_passes_and_the_next_float_does_not(part, axis):
    rest = ((0.0, 0.0, 0.0),) * 3
    most = ENVELOPE.part_step_m[part]

    def at(way):
        point = tuple(way if k == axis else 0.0 for k in range(3))
        return tuple(point if k == part else rest[k] for k in range(3))

    assert check_part_speeds(at(most), rest, lambda: rest, ENVELOPE) is None
    beyond = at(math.nextafter(most, UP))
    assert reason(check_part_speeds(beyond, rest, lambda: rest, ENVELOPE)) is Reason.PART_SPEED
    assert check_part_speeds(beyond, rest, lambda: beyond, ENVELOPE) is None  # it gives way
    assert check_part_speeds(at(most), rest, None, ENVELOPE) is None
    assert (
        reason(check_part_speeds(beyond, rest, None, ENVELOPE)) is Reason.PART_SPEED
    )  # there is nothing to give way to
    assert reason(check_part_speeds(at(math.nan), rest, lambda: rest, ENVELOPE)) is Reason.PART_SPEED


FENCES = {
    "box": fenced(boxes=(Fence(name="f", low_m=(-1.0, -2.0, -3.0), high_m=(1.0, 2.0, 3.0), parts=ALL),)),
    "plane": fenced(planes=(Plane(name="f", point_m=(0.0, 0.0, 0.25), normal=(0.0, 0.0, 2.0), parts=ALL),)),
    "keep_out": fenced(
        keep_outs=(KeepOut(name="f", low_m=(0.0, 0.0, 0.0), high_m=(0.5, 0.5, 0.5), radius_m=0.25, parts=ALL),)
    ),
}


@pytest.mark.parametrize("part", range(3))
@pytest.mark.parametrize(
    ("kind", "on_it", "inwards"),
    [
        ("box", (1.0, 0.0, 0.0), (UP, 0, 0)), ("box", (-1.0, 0.0, 0.0), (DOWN, 0, 0)),
        ("box", (0.0, 2.0, 0.0), (0, UP, 0)), ("box", (0.0, -2.0, 0.0), (0, DOWN, 0)),
        ("box", (0.0, 0.0, 3.0), (0, 0, UP)), ("box", (0.0, 0.0, -3.0), (0, 0, DOWN)),
        ("plane", (0.3, 0.1, 0.25), (0, 0, DOWN)),
        ("keep_out", (0.75, 0.2, 0.2), (DOWN, 0, 0)), ("keep_out", (-0.25, 0.2, 0.2), (UP, 0, 0)),
        ("keep_out", (0.2, 0.75, 0.2), (0, DOWN, 0)), ("keep_out", (0.2, -0.25, 0.2), (0, UP, 0)),
        ("keep_out", (0.2, 0.2, 0.75), (0, 0, DOWN)), ("keep_out", (0.2, 0.2, -0.25), (0, 0, UP)),
    ],
)  # fmt: skip
def test_a_part_on_a_fence_passes_and_the_next_float_does_not(part, kind, on_it, inwards):
    held = envelope(DT, workspace=FENCES[kind])
    inside = {"box": (0.0, 0.0, 0.0), "plane": (0.0, 0.0, 1.0), "keep_out": (2.0, 2.0, 2.0)}[kind]
    beyond = tuple(math.nextafter(v, d) if d else v for v, d in zip(on_it, inwards, strict=True))
    points = [inside] * 3
    for place, expected in ((on_it, None), (beyond, Reason.FENCE), ((math.nan,) * 3, Reason.FENCE)):
        points[part] = place
        assert reason(check_fences(tuple(points), held)) is expected


@given(POINT, POINT)
def test_a_gap_changes_by_no_more_than_the_way_and_grows_where_it_says(point, other):
    for fence in (
        box_gap("box", 0, (-0.5, -0.6, -0.7), (0.5, 0.6, 0.7)),
        plane_gap("plane", 0, (0.6, 0.0, 0.8), 0.1),
        keep_out_gap("out", 0, (-0.2, -0.3, -0.4), (0.2, 0.3, 0.4), 0.1),
    ):
        assert abs(fence.gap(point) - fence.gap(other)) <= math.dist(point, other) + 1e-12
        away = fence.away(point)
        assert math.hypot(*away) == pytest.approx(1.0)
        there = tuple(v + 1e-6 * n for v, n in zip(point, away, strict=True))
        is_middle = abs(fence.gap(point)) > 0.2 and fence.name != "plane"
        assert is_middle or fence.gap(there) >= fence.gap(point) - 1e-12


def test_a_tool_at_its_cone_passes_and_the_next_float_does_not():
    edge = ENVELOPE.cone_cosine
    assert check_cone(edge, ENVELOPE) is None
    assert reason(check_cone(math.nextafter(edge, DOWN), ENVELOPE)) is Reason.CONE
    assert reason(check_cone(math.nan, ENVELOPE)) is Reason.CONE


def test_a_gate_tells_the_limits_that_it_holds():
    spec = FakeArm(arm=ARM, tick_s=DT).spec
    limits = GateLimits.of(ARM, spec, table_m=0.0, tick_s=DT)
    gate = Gate(arm=FakeArm(arm=ARM, tick_s=DT), limits=limits, envelope=ENVELOPE, chain=ToolChain(ARM))
    assert gate.limits is limits


@given(ANGLES)
def test_the_loops_points_are_those_that_files_are_checked_with(q):
    (tcp, flange, elbow), down = ToolChain(ARM).points(q)
    plain = part_points(ARM, q)
    for fast, part in ((tcp, ArmPart.TCP), (flange, ArmPart.FLANGE), (elbow, ArmPart.ELBOW)):
        assert math.dist(fast, plain[part]) < 1e-12
    assert abs(down - math.cos(tilt_rad(ARM, q))) < 1e-9


@pytest.mark.parametrize("i", JOINTS)
def test_a_profile_that_allows_more_than_the_arm_says_it_can_is_refused(i):
    spec = FakeArm(arm=ARM, tick_s=DT).spec
    check_profile_fits(profile(), spec)
    with pytest.raises(RobotConfigError, match=rf"joints\[{i}\]\.range_rad.*narrow"):
        check_profile_fits(profile(), replace(spec, q_max_rad=with_joint(spec.q_max_rad, i, 2.9)))
    with pytest.raises(RobotConfigError, match=rf"joints\[{i}\]\.range_rad.*narrow"):
        check_profile_fits(profile(), replace(spec, q_min_rad=with_joint(spec.q_min_rad, i, -2.9)))
    with pytest.raises(RobotConfigError, match=rf"joints\[{i}\]\.speed_rad_s.*lower"):
        check_profile_fits(profile(), replace(spec, qd_max_rad_s=with_joint(spec.qd_max_rad_s, i, 3.0)))
