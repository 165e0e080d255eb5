"""Boundary tables: the limit passes, the next float does not, per joint. And properties: what passes is inside."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.loader import load_arm
from robot.chain import ToolChain
from robot.kinematics import Kinematics
from robot.messages import ArmMode, ArmSpec, GripCommand, Heading, Hold, JointTarget, Twist
from robot.safety import GateLimits, Reason
from robot.safety.checks import (
    check_finite,
    check_force,
    check_grip,
    check_intent,
    check_intent_age,
    check_joint_range,
    check_joint_speed,
    check_outputs,
    check_percept_age,
    check_push,
    check_sequence,
    check_state,
    check_tool,
    check_tracking,
)
from tests.support.stations import arm_state, command

ARM = load_arm("ur5e")
TICK = 0.01
SPEC = ArmSpec(
    model="ur5e",
    rate_hz=100.0,
    n_inputs=16,
    n_outputs=16,
    q_min_rad=(-7.0,) * 6,
    q_max_rad=(7.0,) * 6,
    qd_max_rad_s=(4.0,) * 6,
    grip_stroke_m=0.085,
)
LIMITS = GateLimits.of(ARM, SPEC, table_m=0.0, tick_s=TICK)
CHAIN = ToolChain(ARM)
KINEMATICS = Kinematics(ARM)
HOME = tuple(ARM.home_rad)
PLAIN = command(HOME)
JOINTS = range(6)
UP, DOWN = math.inf, -math.inf


def with_joint(q, i, value):
    return tuple(value if k == i else v for k, v in enumerate(q))


def reason(refusal):
    return None if refusal is None else refusal.reason


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("side", ["q_min_rad", "q_max_rad"])
def test_a_joint_at_its_range_passes_and_the_next_float_does_not(i, side):
    limit = getattr(LIMITS, side)[i]
    beyond = math.nextafter(limit, DOWN if side == "q_min_rad" else UP)
    assert check_joint_range(with_joint(HOME, i, limit), LIMITS) is None
    assert reason(check_joint_range(with_joint(HOME, i, beyond), LIMITS)) is Reason.JOINT_RANGE


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_joint_at_its_speed_passes_and_the_next_float_does_not(i, sign):
    rest = (0.0,) * 6
    step = sign * LIMITS.joint_step_rad[i]
    assert step == pytest.approx(sign * ARM.joints[i].speed_rad_s * TICK)
    assert check_joint_speed(with_joint(rest, i, step), rest, LIMITS) is None
    beyond = math.nextafter(step, sign * math.inf)
    assert reason(check_joint_speed(with_joint(rest, i, beyond), rest, LIMITS)) is Reason.JOINT_SPEED


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_joint_at_its_tracking_error_passes_and_the_next_float_does_not(i, sign):
    rest, error = (0.0,) * 6, sign * LIMITS.tracking_error_rad
    assert check_tracking(rest, with_joint(rest, i, error), LIMITS) is None
    beyond = math.nextafter(error, sign * math.inf)
    assert reason(check_tracking(rest, with_joint(rest, i, beyond), LIMITS)) is Reason.TRACKING


@pytest.mark.parametrize("i", JOINTS)
def test_a_measured_joint_that_is_not_a_number_does_not_track(i):
    assert reason(check_tracking(HOME, with_joint(HOME, i, math.nan), LIMITS)) is Reason.TRACKING


@pytest.mark.parametrize("i", JOINTS)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_joint_that_is_not_finite_is_refused(i, value):
    assert reason(check_finite(command(with_joint(HOME, i, value)))) is Reason.NOT_FINITE


@pytest.mark.parametrize("name", ["opening_m", "force_n", "speed_m_s"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_grip_that_is_not_finite_is_refused(name, value):
    grip = GripCommand(**({"opening_m": 0.085, "force_n": 20.0, "speed_m_s": 0.15} | {name: value}))
    assert reason(check_finite(command(HOME, grip=grip))) is Reason.NOT_FINITE


def test_infinities_that_cancel_are_not_finite():
    assert reason(check_finite(command((math.inf, -math.inf, 0.0, 0.0, 0.0, 0.0)))) is Reason.NOT_FINITE


@pytest.mark.parametrize(
    "change",
    [
        {"q_rad": HOME[:5]},
        {"q_rad": (*HOME, 0.0)},
        {"q_rad": ("0",) * 6},
        {"q_rad": None},
        {"grip": None},
        {"digital_out": None},
        {"digital_out": 1.0},
        {"digital_out": True},
    ],
)
def test_a_command_of_the_wrong_make_is_refused_as_malformed(change):
    assert reason(check_finite(command(**({"q_rad": HOME} | change)))) is Reason.MALFORMED


@pytest.mark.parametrize(("previous", "passes"), [(-1, False), (0, True), (1, False), (2, False)])
def test_only_the_next_command_in_the_sequence_passes(previous, passes):
    assert (check_sequence(PLAIN, previous) is None) is passes


AGE = LIMITS.state_max_age_ns


@pytest.mark.parametrize(("age", "passes"), [(-1, False), (0, True), (AGE, True), (AGE + 1, False)])
def test_a_state_passes_up_to_its_age_and_never_from_the_future(age, passes):
    state = arm_state(HOME, stamp_ns=10 * AGE - age)
    refusal = check_state(state, command(HOME, stamp_ns=10 * AGE), 10 * AGE, LIMITS)
    assert reason(refusal) is (None if passes else Reason.STALE_STATE)


@pytest.mark.parametrize(("age", "passes"), [(-1, False), (0, True), (AGE, True), (AGE + 1, False)])
def test_a_command_passes_up_to_the_same_age(age, passes):
    state = arm_state(HOME, stamp_ns=10 * AGE)
    refusal = check_state(state, command(HOME, stamp_ns=10 * AGE - age), 10 * AGE, LIMITS)
    assert reason(refusal) is (None if passes else Reason.STALE_STATE)


@pytest.mark.parametrize("mode", list(ArmMode))
def test_only_a_running_arm_is_commanded(mode):
    refusal = check_state(arm_state(HOME, mode=mode), PLAIN, 0, LIMITS)
    assert reason(refusal) is (None if mode is ArmMode.RUNNING else Reason.ARM_MODE)


INTENT_AGE = LIMITS.intent_max_age_ns


@pytest.mark.parametrize(("age", "passes"), [(-1, False), (0, True), (INTENT_AGE, True), (INTENT_AGE + 1, False)])
def test_motion_passes_up_to_the_intents_deadline_and_the_time_to_come_to_rest(age, passes):
    assert (check_intent_age(0, age, LIMITS) is None) is passes


def test_the_time_to_come_to_rest_is_short():
    assert 0.2e9 < LIMITS.intent_max_age_ns - ARM.motion.intent_max_age_s * 1e9 < 0.5e9


STEADY, BLOW = LIMITS.force_max_n, LIMITS.impact_max_n


@pytest.mark.parametrize(
    ("force", "before", "passes"),
    [
        (STEADY, STEADY, True),
        (STEADY, BLOW, True),
        (math.nextafter(STEADY, UP), STEADY, True),
        (math.nextafter(STEADY, UP), math.nextafter(STEADY, UP), False),
        (BLOW, STEADY, True),
        (math.nextafter(BLOW, UP), 0.0, False),
        (math.nan, 0.0, False),
        (math.inf, 0.0, False),
    ],
)
def test_a_push_passes_up_to_the_steady_limit_and_a_blow_once_up_to_its_own(force, before, passes):
    assert reason(check_force(force, before, LIMITS)) is (None if passes else Reason.FORCE)


@pytest.mark.parametrize("name", ["opening_m", "force_n", "speed_m_s"])
@pytest.mark.parametrize("side", [0, 1])
def test_a_grip_at_the_hands_limits_passes_and_the_next_float_does_not(name, side):
    spans = {"opening_m": LIMITS.opening_m, "force_n": LIMITS.grip_force_n, "speed_m_s": LIMITS.grip_speed_m_s}
    plain = {"opening_m": 0.04, "force_n": 60.0, "speed_m_s": 0.1}
    limit = spans[name][side]
    beyond = math.nextafter(limit, UP if side else DOWN)
    assert check_grip(command(HOME, grip=GripCommand(**(plain | {name: limit}))), LIMITS) is None
    assert reason(check_grip(command(HOME, grip=GripCommand(**(plain | {name: beyond}))), LIMITS)) is Reason.GRIP


@pytest.mark.parametrize(("bits", "passes"), [(0, True), (1, True), (0xFFFF, True), (0x10000, False), (-1, False)])
def test_only_outputs_that_the_arm_has_are_written(bits, passes):
    assert reason(check_outputs(command(HOME, digital_out=bits), LIMITS)) is (None if passes else Reason.OUTPUTS)


# The floor of the workspace lies under the table's clearance, tested below.
@pytest.mark.parametrize(("axis", "side"), [(0, 0), (0, 1), (1, 0), (1, 1), (2, 1)])
def test_the_tool_passes_inside_the_workspace_and_not_a_tenth_of_a_millimetre_beyond(axis, side):
    low, high = LIMITS.workspace_m
    at = [0.44, 0.05, 0.2]
    limit, outwards = (high, 1.0) if side else (low, -1.0)
    for offset, passes in ((-1e-4, True), (1e-4, False)):
        at[axis] = limit[axis] + outwards * offset
        q = KINEMATICS.solve(tuple(at), HOME)
        assert reason(check_tool(*CHAIN.tcp_and_lowest(q), LIMITS)) is (None if passes else Reason.WORKSPACE)


def test_upright_fingertips_pass_at_the_clearance_and_not_a_tenth_of_a_millimetre_lower():
    lowest = ARM.motion.table_clearance_m + ARM.tool.tip_below_tcp_m
    for offset, expected in ((1e-4, None), (-1e-4, Reason.TABLE)):
        q = KINEMATICS.solve((0.44, 0.0, lowest + offset), HOME)
        assert reason(check_tool(*CHAIN.tcp_and_lowest(q), LIMITS)) is expected


def tip_height(q):
    """Height of the point between the fingertips."""
    (tcp, _, _), down = CHAIN.points(q)
    return tcp[2] - down * ARM.tool.tip_below_tcp_m


def test_a_tilted_tool_keeps_its_lower_finger_clear_too():
    def tilted_over(z):
        q = KINEMATICS.solve((0.44, 0.0, z), HOME)
        return with_joint(q, 4, q[4] + 0.35)

    z = 0.05 - (tip_height(tilted_over(0.05)) - LIMITS.tip_min_m - 0.005)
    q = tilted_over(z)
    assert tip_height(q) == pytest.approx(LIMITS.tip_min_m + 0.005, abs=1e-3)
    assert reason(check_tool(*CHAIN.tcp_and_lowest(q), LIMITS)) is Reason.TABLE
    assert check_tool(*CHAIN.tcp_and_lowest(tilted_over(z + 0.05)), LIMITS) is None


@given(st.tuples(*[st.floats(-6.5, 6.5)] * 6))
def test_whatever_passes_is_inside(q):
    if check_joint_range(q, LIMITS) is None:
        assert all(j.range_rad[0] <= v <= j.range_rad[1] for j, v in zip(ARM.joints, q, strict=True))
    if check_tool(*CHAIN.tcp_and_lowest(q), LIMITS) is None:
        x, y, z = KINEMATICS.tcp(q)
        (x0, y0, z0), (x1, y1, z1) = LIMITS.workspace_m
        assert x0 <= x <= x1
        assert y0 <= y <= y1
        assert z0 <= z <= z1
        assert tip_height(q) >= ARM.motion.table_clearance_m


ANYTHING = st.one_of(st.floats(), st.integers(), st.none(), st.text(max_size=3), st.booleans())


@given(ANYTHING, ANYTHING, ANYTHING)
def test_an_admitted_heading_is_finite_and_of_a_size_that_can_be_meant(heading, distance, height):
    if check_intent(Heading(heading_rad=heading, distance_m=distance, height_m=height)) is None:
        assert math.isfinite(heading)
        assert 0.0 <= distance <= 10.0
        assert abs(height) <= 10.0


@pytest.mark.parametrize(
    ("intent", "expected"),
    [
        (Heading(heading_rad=1.0, distance_m=0.02, height_m=0.2), None),
        (Heading(heading_rad=1.0, distance_m=5.0, height_m=-5.0), None),
        (Heading(heading_rad=math.nan, distance_m=0.02, height_m=0.2), Reason.NOT_FINITE),
        (Heading(heading_rad=1.0, distance_m=math.inf, height_m=0.2), Reason.NOT_FINITE),
        (Heading(heading_rad=1.0, distance_m=0.02, height_m=-math.inf), Reason.NOT_FINITE),
        (Heading(heading_rad=1.0, distance_m=1e9, height_m=0.2), Reason.OUT_OF_REASON),
        (Heading(heading_rad=1.0, distance_m=-0.01, height_m=0.2), Reason.OUT_OF_REASON),
        (Heading(heading_rad=1e300, distance_m=0.01, height_m=0.2), Reason.OUT_OF_REASON),
        (Heading(heading_rad="north", distance_m=0.01, height_m=0.2), Reason.MALFORMED),
        (Heading(heading_rad=1.0, distance_m=None, height_m=0.2), Reason.MALFORMED),
        (Heading(heading_rad=1.0, distance_m=0.01, height_m=0.2, grip="open wide"), Reason.MALFORMED),
        (Twist(linear_m_s=(0.1, 0.0, 0.0)), None),
        (Twist(linear_m_s=(math.nan, 0.0, 0.0)), Reason.NOT_FINITE),
        (Twist(linear_m_s=(0.1, 0.0, 0.0), angular_rad_s=(0.0, 0.0, math.inf)), Reason.NOT_FINITE),
        (Twist(linear_m_s=(11.0, 0.0, 0.0)), Reason.OUT_OF_REASON),
        (Twist(linear_m_s=(0.1, 0.0)), Reason.MALFORMED),
        (JointTarget(q_rad=HOME), None),
        (JointTarget(q_rad=HOME[:5]), Reason.MALFORMED),
        (JointTarget(q_rad=with_joint(HOME, 3, math.nan)), Reason.NOT_FINITE),
        (JointTarget(q_rad=with_joint(HOME, 3, 1e9)), Reason.OUT_OF_REASON),
        (JointTarget(q_rad=None), Reason.MALFORMED),
        (Hold(), None),
        (None, Reason.MALFORMED),
        ("left a bit", Reason.MALFORMED),
        ((0.1, 0.2, 0.3), Reason.MALFORMED),
    ],
)
def test_intents_that_are_wrong_are_refused_and_large_ones_are_not(intent, expected):
    assert reason(check_intent(intent)) is expected


PERCEPT_AGE = LIMITS.percept_max_age_ns


@pytest.mark.parametrize(
    ("age", "passes"), [(-1, False), (0, True), (PERCEPT_AGE, True), (PERCEPT_AGE + 1, False), (None, True)]
)
def test_motion_passes_up_to_the_age_of_a_percept_and_never_with_one_of_the_future(age, passes):
    now_ns = 10**10
    refusal = check_percept_age(None if age is None else now_ns - age, now_ns, LIMITS)
    assert (refusal is None) is passes
    assert passes or refusal.reason is Reason.STALE_PERCEPT


def test_a_percept_that_is_too_old_is_told_with_its_age_and_what_was_expected():
    told = check_percept_age(3 * 10**9, 4 * 10**9 + PERCEPT_AGE, LIMITS).detail
    most_s, age_s = (float(x) for x in re.findall(r"[0-9.]+", told))
    assert most_s == pytest.approx(PERCEPT_AGE * 1e-9, rel=1e-5)
    assert age_s == pytest.approx(1.0 + PERCEPT_AGE * 1e-9, rel=1e-5)


SINK, RISE = (0.0, 0.0, -0.001), (0.0, 0.0, 0.001)
JUST_OVER = math.nextafter(LIMITS.contact_n, math.inf)


@pytest.mark.parametrize(
    ("now_n", "before_n", "step", "passes"),
    [
        (STEADY, STEADY, SINK, True),
        (math.nextafter(STEADY, math.inf), STEADY, SINK, False),
        ((STEADY + 200.0) / 2.0, 200.0, SINK, True),
        ((STEADY + 200.0) / 2.0 + 1e-9, 200.0, SINK, False),
        (STEADY + 50.0, STEADY, RISE, True),
        (STEADY + 50.0, STEADY, (0.0, 0.0, 0.0), True),
        (STEADY + 50.0, STEADY, (0.01, 0.0, 0.0), True),
        (STEADY, LIMITS.contact_n, SINK, True),
        (STEADY, JUST_OVER, SINK, False),
        (STEADY - 1.0, 2.0 * STEADY, SINK, True),
    ],
    ids=[
        "at it", "next float", "rising up to it", "rising beyond", "gives way", "holds still", "slides along",
        "a blow", "no blow any more", "falling",
    ],
)  # fmt: skip
def test_a_push_that_lasts_may_not_be_pressed_on_beyond_the_limit(now_n, before_n, step, passes):
    refusal = check_push((0.0, 0.0, now_n), before_n, step, LIMITS)
    assert (refusal is None) is passes
    if refusal is not None:
        assert refusal.reason is Reason.FORCE
        assert refusal.amount == pytest.approx(2.0 * now_n - before_n - STEADY, abs=1e-6)


@pytest.mark.parametrize(
    ("force_n", "passes"),
    [((0.6 * STEADY, 0.0, 0.4 * STEADY), True), ((0.0, -0.6 * STEADY, 0.4 * STEADY + 1e-6), False)],
)
def test_what_presses_from_the_side_counts_beside_what_presses_upright(force_n, passes):
    into = tuple(-1e-6 * f for f in force_n)
    assert (check_push(force_n, STEADY, into, LIMITS) is None) is passes


@given(
    force=st.tuples(*[st.floats(-400.0, 400.0)] * 3), before=st.floats(0.0, 400.0),
    step=st.tuples(*[st.floats(-0.01, 0.01)] * 3),
)  # fmt: skip
def test_whatever_presses_on_and_passes_is_no_harder_by_the_next_tick_than_it_may_be(force, before, step):
    refusal = check_push(force, before, step, LIMITS)
    if refusal is None and sum(f * s for f, s in zip(force, step, strict=True)) < 0.0 and before > LIMITS.contact_n:
        now, both = math.hypot(*force), math.hypot(*force[:2]) + abs(force[2])
        assert both + max(0.0, now - before) <= LIMITS.force_max_n
