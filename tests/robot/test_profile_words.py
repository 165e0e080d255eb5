"""What the checks of a limits profile and of stops say, whole, and their edges on numbers that can be worked out."""

import math

import pytest
from msgspec.structs import replace

from config.loader import resolve
from robot.chain import ToolChain
from robot.envelope import JointEnd
from robot.fences import plane_gap
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics
from robot.safety import Braking, GateLimits, Reason, Refusal, StopCheck
from robot.safety.checks_profile import (
    check_cone,
    check_fences,
    check_giving_way,
    check_joint_acceleration,
    check_joint_jerk,
    check_part_speeds,
    check_soft_margin,
)
from robot.safety.clearance import Closest
from robot.safety.collision_model import Near, Pair
from tests.support.profiles import envelope
from tests.support.stations import arm_state

REST = (0.0,) * 6
END = JointEnd(-1.0, 1.0, 0.5, 0.1, 0.0625, 0.03125, 0.125, 0.1875)
HELD = replace(
    envelope(0.01), joints=(END,) * 6, part_step_m=(0.5, 0.25, 0.125), cone_rad=0.5, cone_cosine=0.75,
    fences=(plane_gap("wall", 1, (0.0, 0.0, 1.0), 0.25),),
)  # fmt: skip
ORIGIN = ((0.0, 0.0, 0.0),) * 3


def joint(i, value):
    return tuple(value if k == i else 0.0 for k in range(6))


def part(i, point):
    return tuple(point if k == i else (0.0, 0.0, 0.0) for k in range(3))


def told(refusal, reason, detail, amount):
    assert isinstance(refusal, Refusal)
    assert (refusal.reason, refusal.detail) == (reason, detail)
    assert refusal.amount == pytest.approx(amount)


@pytest.mark.parametrize(("i", "side"), [(i, side) for i in range(6) for side in (-1.0, 1.0)])
def test_a_joint_too_fast_in_its_soft_margin_is_told_with_its_gap_and_step(i, side):
    at, last = joint(i, side * 0.75), joint(i, side * 0.625)
    detail = f"joint {i + 1}: expected at most 0.055 rad a tick towards an end 0.25 rad away, came 0.125"
    told(check_soft_margin(at, last, HELD), Reason.SOFT_MARGIN, detail, 0.07)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_soft_margin_begins_at_its_edge_and_looks_one_way_only(side):
    """0.5 rad from an end a step of two and a half times the fastest passes; the next float nearer it does not."""
    edge, nearer = side * 0.5, side * math.nextafter(0.5, 1.0)
    assert check_soft_margin(joint(3, edge), joint(3, side * 0.25), HELD) is None
    assert check_soft_margin(joint(3, nearer), joint(3, side * 0.25), HELD).reason is Reason.SOFT_MARGIN
    assert check_soft_margin(joint(3, nearer), joint(3, side), HELD) is None
    assert check_soft_margin(joint(3, side), joint(3, side), HELD) is None


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_joint_may_creep_to_its_very_end_and_must_else_be_able_to_stop(side):
    at_zero = replace(END, low_rad=-2.0, high_rad=0.0) if side > 0.0 else replace(END, low_rad=0.0, high_rad=2.0)
    held = replace(HELD, joints=(at_zero,) * 6)
    assert check_soft_margin(REST, joint(0, side * -1e-6), held) is None
    assert check_soft_margin(REST, joint(0, side * -math.nextafter(1e-6, 1.0)), held).reason is Reason.SOFT_MARGIN
    # 0.03125 rad from the end 2 x 0.0625 x 0.03125 is the square of 0.0625, more than a tenth and a bit may be.
    fast = replace(HELD, joints=(replace(END, step_rad=1.0),) * 6)
    assert check_soft_margin(joint(0, side * 0.96875), joint(0, side * 0.90625), fast) is None
    faster = joint(0, side * math.nextafter(0.90625, 0.0))
    assert check_soft_margin(joint(0, side * 0.96875), faster, fast).reason is Reason.SOFT_MARGIN


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_step_may_pass_the_soft_limit_by_rounding_and_no_more(side):
    most = 0.1 * (0.1 + 0.9 * 0.25 / 0.5)
    for by, passes in ((0.9e-9, True), (1.2e-9, False)):
        last = joint(2, side * (0.75 - most * (1.0 + by)))
        assert (check_soft_margin(joint(2, side * 0.75), last, HELD) is None) is passes


def test_the_first_joint_out_of_its_margin_does_not_hide_the_second():
    at, last = (0.0, 0.75, *REST[2:]), (0.1, 0.5, *REST[2:])
    assert check_soft_margin(at, last, HELD).detail.startswith("joint 2: ")


@pytest.mark.parametrize("i", range(6))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_an_acceleration_too_hard_is_told_with_both_steps(i, sign):
    last = sign * 0.125
    refusal = check_joint_acceleration(joint(i, sign * 0.375), joint(i, last), REST, HELD)
    detail = f"joint {i + 1}: expected a gain of at most 0.0625 rad on the step {last:g}, came {sign * 0.25:g}"
    told(refusal, Reason.JOINT_ACCELERATION, detail, 0.0625)
    refusal = check_joint_acceleration(joint(i, sign * 0.1875), joint(i, sign * 0.1875), REST, HELD)
    detail = f"joint {i + 1}: expected a step within 0.125 rad of the last, {sign * 0.1875:g}, came 0"
    told(refusal, Reason.JOINT_ACCELERATION, detail, 0.0625)


@pytest.mark.parametrize("i", range(6))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_jerk_too_hard_is_told_with_both_changes(i, sign):
    refusal = check_joint_jerk(joint(i, sign * -0.125), REST, REST, joint(i, sign * 0.125), HELD)
    rates = f"{sign * 0.125:g}, they did by {sign * -0.125:g}"
    told(refusal, Reason.JOINT_JERK, f"joint {i + 1}: expected steps to change within 0.1875 rad of {rates}", 0.0625)
    refusal = check_joint_jerk(joint(i, sign * 0.09375), REST, REST, REST, HELD)
    detail = f"joint {i + 1}: expected a gain at most 0.03125 rad beyond the last, 0, came 0.09375"
    told(refusal, Reason.JOINT_JERK, detail, 0.0625)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_joint_that_turns_gains_what_it_has_after_the_turn(sign):
    last, before = REST, joint(0, -sign * 0.03125)
    for step, passes in ((-0.0625, True), (-0.078125, False), (0.09375, True), (0.109375, False)):
        assert (check_joint_acceleration(joint(0, sign * step), last, before, HELD) is None) is passes


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_giving_way_and_braking_end_where_a_gain_begins(sign):
    last, before = joint(0, 0.0), joint(0, -sign * 0.25)
    for step, passes in ((0.3125, True), (-0.0625, True), (0.375, False), (-0.125, False)):
        refusal = check_giving_way(joint(0, sign * step), last, before, last, HELD)
        assert (refusal is None) is passes
    pushed = joint(0, sign * 0.5)
    for step, passes in ((0.5625, True), (0.625, False), (-0.0625, True), (-0.125, False)):
        refusal = check_giving_way(joint(0, sign * step), last, last, pushed, HELD)
        assert (refusal is None) is passes


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_pushed_joint_may_brake_to_rest_however_far_ahead_it_is_measured(sign):
    last, before, ahead = REST, joint(0, -sign * 0.25), joint(0, sign * 0.25)
    for step, passes in ((0.0, True), (-0.0625, True), (-0.125, False)):
        refusal = check_giving_way(joint(0, sign * step), last, before, ahead, HELD)
        assert (refusal is None) is passes
    detail = "joint 1: expected a step within 0.0625 rad of the last, {:g}, came {:g}"
    refusal = check_giving_way(joint(0, sign * -0.125), last, before, ahead, HELD)
    told(refusal, Reason.JOINT_ACCELERATION, detail.format(sign * 0.25, sign * -0.125), 0.0625)


def test_a_joint_that_may_do_what_it_does_does_not_hide_the_next():
    q, last, before = (0.0, 0.5, *REST[2:]), REST, (-0.0625, *REST[1:])
    assert check_joint_acceleration(q, last, before, HELD).detail.startswith("joint 2: ")
    assert check_joint_jerk(q, last, before, before, HELD).detail.startswith("joint 2: ")
    assert check_giving_way(q, last, before, last, HELD).detail.startswith("joint 2: ")


@pytest.mark.parametrize(
    ("i", "name", "most"), [(0, "tool centre point", 0.5), (1, "flange", 0.25), (2, "elbow", 0.125)]
)
def test_a_part_too_fast_is_told_by_name(i, name, most):
    now = part(i, (2.0 * most, 0.0, 0.0))
    detail = f"{name}: expected at most {most:g} m a tick, came {2.0 * most:g}"
    told(check_part_speeds(now, ORIGIN, lambda: ORIGIN, HELD), Reason.PART_SPEED, detail, most)


def test_the_way_of_a_part_is_its_length_in_space():
    for sign in (-1.0, 1.0):
        at = part(1, (sign * 0.15, sign * 0.15, sign * 0.13))
        assert check_part_speeds(at, ORIGIN, lambda: ORIGIN, HELD) is None
        at = part(1, (sign * 0.15, sign * 0.15, sign * 0.14))
        assert check_part_speeds(at, ORIGIN, lambda: ORIGIN, HELD).reason is Reason.PART_SPEED
        last = part(1, (1.0, 1.0, 1.0))
        at = part(1, (1.0 + sign * 0.2, 1.0 - sign * 0.1, 1.0 + sign * 0.1))
        assert check_part_speeds(at, last, lambda: ORIGIN, HELD) is None


def test_a_part_that_gives_way_does_not_hide_the_next_and_as_far_is_as_near():
    now = ((1.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.0, 0.0))
    measured = ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert check_part_speeds(now, ORIGIN, lambda: measured, HELD).detail.startswith("flange: ")
    halfway = part(0, (0.5, 0.0, 0.0))
    assert check_part_speeds(part(0, (1.0, 0.0, 0.0)), ORIGIN, lambda: halfway, HELD) is None


def test_a_fence_and_a_cone_are_told_with_by_how_much():
    points = part(1, (0.0, 0.0, 0.125))
    gap = HELD.fences[0].gap(points[1])
    assert gap < 0.0
    detail = f"wall: expected the flange on its allowed side, came {-gap:g} m beyond"
    told(check_fences(points, HELD), Reason.FENCE, detail, -gap)
    detail = "expected the tool within 0.5 rad of straight down, came a cosine of 0.5"
    told(check_cone(0.5, HELD), Reason.CONE, detail, 0.25)


@pytest.mark.parametrize(
    "check",
    [
        lambda: check_soft_margin(REST[:5], REST, HELD),
        lambda: check_soft_margin(REST, (*REST, 0.0), HELD),
    ],
)
def test_joints_of_another_number_are_an_error_and_never_cut_short(check):
    with pytest.raises(ValueError, match="zip"):
        check()


RESOLVED = resolve()
ARM = RESOLVED.arm
TICK_S = 0.01
CHAIN = ToolChain(ARM)
START = Kinematics(ARM).solve((0.42, 0.0, 0.2), ARM.home_rad)
LIMITS = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=TICK_S).spec, table_m=0.0, tick_s=TICK_S)
STATE = arm_state(START)


class Bodies:
    """Gaps as a test wants them, by the turn of the base; and whom it names."""

    most_m = 0.07

    def __init__(self, gap_of, found=()):
        self._gap_of, self._found, self.asked, self.within_m = gap_of, found, [], None

    def gap(self, q_rad):
        self.asked.append(q_rad[0] - START[0])
        return min(self.most_m, self._gap_of(q_rad[0] - START[0]))

    def closest(self, q_rad, *, within_m):
        self.within_m = within_m
        return [Closest(pair=Pair(*names, Near.OWN), gap_m=gap, slope_m_rad=REST) for names, gap in self._found]


def stop_check(gap_of=lambda turn: 1.0, *, limits=LIMITS, found=(), lead_s=0.0):
    bodies = Bodies(gap_of, found)
    braking = Braking(deceleration_rad_s2=16.0, least_share=0.5)
    return StopCheck(ARM, bodies, limits=limits, tick_s=TICK_S, braking=braking, lead_s=lead_s), bodies


def turned(by, i=0):
    return tuple(q + by * (k == i) for k, q in enumerate(START))


def rounded(values):
    return tuple(round(v, 4) for v in values)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("i", range(6))
@pytest.mark.parametrize("lead_s", [0.0, 0.02])
def test_a_stop_out_of_range_is_told_with_where_it_would_end(i, sign, lead_s):
    step = 0.004
    end = START[i] + sign * (step + (step / TICK_S) ** 2 / 16.0 + step * lead_s / TICK_S)
    name = "q_max_rad" if sign > 0 else "q_min_rad"
    for by, passes in ((1e-9, True), (-1e-9, False)):
        limit = tuple(end + sign * by if k == i else v for k, v in enumerate(getattr(LIMITS, name)))
        check, _ = stop_check(limits=replace(LIMITS, **{name: limit}), lead_s=lead_s)
        refusal = check.check(turned(sign * step, i), START, STATE)
        if passes:
            assert refusal is None
        else:
            ended = rounded(end if k == i else v for k, v in enumerate(START))
            told(refusal, Reason.STOP_RANGE, f"expected a stop within the joints' ranges, it would end at {ended}", 0.0)


@pytest.mark.parametrize(("axis", "side"), [(axis, side) for axis in range(3) for side in (0, 1)])
def test_a_stop_out_of_the_workspace_is_told_with_where_it_would_end(axis, side):
    side_of, step = (1.0 if side else -1.0), 0.001
    step *= 1.0 if side_of * (CHAIN.tcp(turned(step))[axis] - CHAIN.tcp(START)[axis]) >= 0.0 else -1.0
    end = turned(step + math.copysign((step / TICK_S) ** 2 / 16.0, step))
    tcp, lowest_m = CHAIN.tcp_and_lowest(end)
    for by, passes in ((0.0029, True), (0.0031, False)):
        box = [list(corner) for corner in ((-3.0,) * 3, (3.0,) * 3)]
        box[side][axis] = tcp[axis] + (by if side == 0 else -by)
        low, high = (tuple(corner) for corner in box)
        check, _ = stop_check(limits=replace(LIMITS, workspace_m=(low, high), tip_min_m=-1.0))
        refusal = check.check(turned(step), START, STATE)
        if passes:
            assert refusal is None
        else:
            detail = (
                f"expected a stop inside {low} to {high} m with the fingertips at -1 m or higher, "
                f"it would come to {rounded(tcp)} with them at {lowest_m:.4f}"
            )
            told(refusal, Reason.STOP_WORKSPACE, detail, 0.0001)


def test_a_stop_whose_fingertips_would_end_too_low_is_out_of_the_workspace():
    step = 0.001
    _, lowest_m = CHAIN.tcp_and_lowest(turned(step + (step / TICK_S) ** 2 / 16.0))
    for by, passes in ((0.0029, True), (0.0031, False)):
        check, _ = stop_check(limits=replace(LIMITS, tip_min_m=lowest_m + by))
        assert (check.check(turned(step), START, STATE) is None) is passes


def test_a_body_on_the_way_is_told_by_whom_and_how_much_too_near():
    found = ((("elbow", "far thing"), 0.5), (("palm", "thing/box"), -0.01), (("hand", "table"), 0.2))
    check, bodies = stop_check(lambda turn: 0.01 - turn, found=found)
    refusal = check.check(turned(0.01), START, STATE)
    gap_m = 0.01 - (0.01 + 0.0625)
    detail = f"expected palm clear of thing/box on the way to a stop, it would be {-gap_m:.4f} m too near"
    told(refusal, Reason.CLEARANCE, detail, -gap_m)
    assert bodies.within_m == pytest.approx(gap_m + 0.001)
    check, _ = stop_check(lambda turn: 0.01 - turn)
    detail = f"expected bodies apart on the way to a stop, it would be {-gap_m:.4f} m too near"
    told(check.check(turned(0.01), START, STATE), Reason.CLEARANCE, detail, -gap_m)


@pytest.mark.parametrize(("lead_s", "on_rad"), [(0.0, 0.0625), (0.02, 0.0825)])
def test_the_arm_goes_on_for_its_lead_before_it_brakes_at_the_worst(lead_s, on_rad):
    for by, passes in ((1e-6, True), (-1e-6, False)):
        check, _ = stop_check(lambda turn, by=by: 0.01 + on_rad + by - turn, lead_s=lead_s)
        assert (check.check(turned(0.01), START, STATE) is None) is passes


def test_what_is_too_near_by_no_more_than_before_may_stay():
    check, _ = stop_check(lambda turn: -0.01)
    assert check.check(turned(0.001), START, STATE) is None
    check, _ = stop_check(lambda turn: -0.01 - 1e-4 * turn)
    assert check.check(turned(0.001), START, STATE) is None
    check, _ = stop_check(lambda turn: -0.01 - 1e-3 * turn)
    assert check.check(turned(0.001), START, STATE).reason is Reason.CLEARANCE


def test_a_command_that_falls_back_is_looked_at_with_the_speed_that_the_arm_has():
    def check(state):
        made, _ = stop_check(lambda turn: 0.012 + turn)
        return made.check(turned(-0.01), START, state)

    behind = replace(STATE, q_rad=turned(-0.015), qd_rad_s=REST)
    assert check(behind) is None
    assert check(replace(behind, qd_rad_s=joint(0, -1.0))).reason is Reason.CLEARANCE
    assert check(replace(STATE, q_rad=turned(-0.005))).reason is Reason.CLEARANCE
    assert check(replace(STATE, q_rad=turned(0.015))).reason is Reason.CLEARANCE


def test_a_bound_that_was_found_is_used_up_by_what_is_moved():
    room_m = 0.07
    check, bodies = stop_check(lambda turn: room_m)
    q, n_far = START, 0
    for k in range(1, 200):
        now = turned(1e-3 * k)
        assert check.check(now, q, STATE) is None
        q, n_far = now, k
        if len(bodies.asked) == 2:
            break
    per_tick_m = check._sweep.bound_m(joint(0, 1e-3))
    assert n_far == 1 + math.ceil(room_m / per_tick_m)  # found where the first stop ends, it reaches so far beyond
