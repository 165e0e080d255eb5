"""The stop after every command: where it ends, what it may pass, and what is refused by how little."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from config.loader import resolve
from robot.chain import ToolChain
from robot.envelope import Envelope
from robot.fences import plane_gap
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics
from robot.safety import Braking, Clearance, GateLimits, Hard, Reason, StopCheck
from robot.safety.stopping import stop_end, stop_span, stop_time_s
from tests.support.stations import arm_state

RESOLVED = resolve()
ARM = RESOLVED.arm
TICK_S = 0.01
LIMITS = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=TICK_S).spec, table_m=0.0, tick_s=TICK_S)
BRAKING = Braking(deceleration_rad_s2=16.0, least_share=0.5)
START = Kinematics(ARM).solve((0.42, 0.0, 0.2), ARM.home_rad)
speeds = st.tuples(*[st.floats(-3.0, 3.0)] * 6)


class Bodies:
    """Gaps as a test wants them, by the turn of the base alone."""

    most_m = 0.07

    def __init__(self, gap_of):
        self._gap_of = gap_of
        self.n_asked = 0

    def gap(self, q_rad):
        self.n_asked += 1
        return min(self.most_m, self._gap_of(q_rad[0] - START[0]))

    def closest(self, q_rad, *, within_m):
        return CLEARANCE.closest(ARM.home_rad, within_m=1.0)


CLEARANCE = Clearance(ARM, RESOLVED.scenario, hard=Hard())


def _check(gap_of, *, limits=LIMITS):
    return StopCheck(ARM, Bodies(gap_of), limits=limits, tick_s=TICK_S, braking=BRAKING)


def _turned(by):
    return (START[0] + by, *START[1:])


STATE = arm_state(START)


@given(qd=speeds)
def test_a_stop_keeps_to_the_way_and_every_joint_rests_at_the_same_time(qd):
    end, time_s = stop_end(START, qd, 16.0), stop_time_s(qd, 16.0)
    assert time_s * 16.0 == pytest.approx(max(abs(v) for v in qd))
    for q, v, e in zip(START, qd, end, strict=True):
        assert e - q == pytest.approx(v * time_s / 2.0, abs=1e-12)


def test_a_joint_at_full_speed_stops_where_the_books_say():
    """v^2 / 2a by hand: 3.2 rad/s at 16 rad/s2 takes 0.2 s and 0.32 rad."""
    end = stop_end((0.0,) * 6, (3.2, 0.0, -1.6, 0.0, 0.0, 0.0), 16.0)
    assert end == pytest.approx((0.32, 0.0, -0.16, 0.0, 0.0, 0.0))


@given(qd=speeds, trail_s=st.floats(0.0, 0.1), share=st.floats(0.5, 1.0))
def test_the_span_holds_every_stop_between_best_and_worst_braking(qd, trail_s, share):
    behind = tuple(q - v * trail_s for q, v in zip(START, qd, strict=True))
    span = stop_span((START, qd), (behind, qd), BRAKING, tick_s=TICK_S)
    for begin in (START, behind):
        end = stop_end(begin, qd, share * BRAKING.deceleration_rad_s2)
        assert all(low - 1e-12 <= e <= high + 1e-12 for e, (low, high) in zip(end, span, strict=True))


@pytest.mark.parametrize(("short_by", "is_refused"), [(1e-6, False), (-1e-6, True)])
def test_a_stop_at_its_worst_may_just_come_up_to_a_body(short_by, is_refused):
    step = 0.01  # rad a tick: 1 rad/s, which 8 rad/s2 stop in 0.0625 rad
    wall = step + 0.0625 + short_by
    refusal = _check(lambda turn: wall - turn).check(_turned(step), START, STATE)
    assert (refusal is not None) is is_refused
    if refusal is not None:
        assert refusal.reason is Reason.CLEARANCE
        assert refusal.amount == pytest.approx(-short_by, rel=0.01)


def test_a_body_in_between_is_found_although_both_ends_are_clear():
    thin = _check(lambda turn: abs(turn - 0.045) - 0.004)
    assert thin.check(_turned(0.01), START, STATE).reason is Reason.CLEARANCE


def test_what_is_too_near_may_part_but_not_come_nearer():
    for sign, is_refused in ((1.0, False), (-1.0, True)):
        refusal = _check(lambda turn, s=sign: -0.01 + s * turn).check(_turned(0.001), START, STATE)
        assert (refusal is not None) is is_refused


def test_far_from_everything_bodies_are_looked_at_now_and_then_only():
    bodies = Bodies(lambda turn: 1.0)
    check = StopCheck(ARM, bodies, limits=LIMITS, tick_s=TICK_S, braking=BRAKING)
    q = START
    for k in range(1, 41):
        now = _turned(0.001 * k)
        assert check.check(now, q, STATE) is None
        q = now
    assert bodies.n_asked <= 4


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize(("by", "is_refused"), [(1e-9, False), (-1e-9, True)])
def test_a_stop_may_end_at_a_joint_s_end_and_not_beyond(joint, by, is_refused):
    step = 0.004
    end = START[joint] + step + (step / TICK_S) ** 2 / 16.0
    high = tuple(end + by if k == joint else q for k, q in enumerate(LIMITS.q_max_rad))
    check = _check(lambda turn: 1.0, limits=replace(LIMITS, q_max_rad=high))
    q = tuple(x + step * (k == joint) for k, x in enumerate(START))
    refusal = check.check(q, START, STATE)
    assert (refusal is not None) is is_refused
    if refusal is not None:
        assert refusal.reason is Reason.STOP_RANGE


@pytest.mark.parametrize(("by_m", "is_refused"), [(-1e-4, True), (1e-4, False)])
def test_a_stop_may_overrun_the_workspace_by_less_than_the_fingertips_clear_the_table(by_m, is_refused):
    step = 0.01
    check = _check(lambda turn: 1.0)
    end = _turned(step + 1.0 / 16.0)
    y = check._chain.tcp(end)[1]
    low, high = LIMITS.workspace_m
    far = (low[0], y + 0.003 - by_m, low[2]) if y < 0 else low
    near = high if y < 0 else (high[0], y - 0.003 + by_m, high[2])
    check = _check(lambda turn: 1.0, limits=replace(LIMITS, workspace_m=(far, near)))
    refusal = check.check(_turned(step), START, STATE)
    assert (refusal is not None) is is_refused
    if refusal is not None:
        assert refusal.reason is Reason.STOP_WORKSPACE


def _fenced(fences):
    envelope = Envelope.of(RESOLVED.profile, ARM, tick_s=TICK_S)
    return StopCheck(
        ARM,
        Bodies(lambda turn: 1.0),
        limits=LIMITS,
        tick_s=TICK_S,
        braking=BRAKING,
        envelope=replace(envelope, fences=fences),
    )


@pytest.mark.parametrize("part", range(3))
@pytest.mark.parametrize(("by_m", "is_refused"), [(-1e-6, True), (1e-6, False)])
def test_no_part_may_overrun_a_fence_of_the_profile_by_more_in_a_stop_at_its_worst(part, by_m, is_refused):
    step = 0.01
    chain = ToolChain(ARM)
    here, end = (chain.points(_turned(by))[0][part] for by in (0.0, step + 1.0 / 16.0))
    away = tuple(a - b for a, b in zip(here, end, strict=True))
    far_m = math.hypot(*away)
    normal = tuple(x / far_m for x in away)
    offset_m = sum(n * x for n, x in zip(normal, end, strict=True)) + 0.003 - by_m
    refusal = _fenced((plane_gap("wall", part, normal, offset_m),)).check(_turned(step), START, STATE)
    assert (refusal is not None) is is_refused
    if refusal is not None:
        assert refusal.reason is Reason.STOP_WORKSPACE
        assert "wall" in refusal.detail
        assert refusal.amount == pytest.approx(1e-6, rel=1e-3)


def test_a_way_that_bends_out_and_in_again_before_it_ends_is_told():
    """Both ends of a long stop of the base are inside a wall beside the arc between them."""
    step = 0.03
    chain, stop_rad = ToolChain(ARM), step + 9.0 / 16.0
    (x, y, _), (u, v, _), (a, b, _) = (chain.tcp(_turned(by)) for by in (0.0, step + stop_rad, (step + stop_rad) / 2))
    normal = (y - v, u - x, 0.0) if (y - v) * (a - x) + (u - x) * (b - y) < 0.0 else (v - y, x - u, 0.0)
    size = math.hypot(*normal)
    normal = (normal[0] / size, normal[1] / size, 0.0)
    wall = plane_gap("wall", 0, normal, normal[0] * x + normal[1] * y - 0.01)
    assert wall.gap(chain.tcp(_turned(step))) > -0.003
    assert wall.gap(chain.tcp(_turned(step + 9.0 / 16.0))) > -0.003
    assert _fenced((wall,)).check(_turned(step), START, STATE).reason is Reason.STOP_WORKSPACE


def test_a_command_that_falls_back_to_the_arm_drives_it_no_faster_than_it_goes():
    check = _check(lambda turn: 0.02 + turn)
    behind = replace(STATE, q_rad=_turned(-0.015), qd_rad_s=(0.0,) * 6)
    assert check.check(_turned(-0.01), START, behind) is None
    assert _check(lambda turn: 0.02 + turn).check(_turned(-0.01), START, STATE) is not None


def test_after_seeding_everything_is_looked_at_afresh():
    bodies = Bodies(lambda turn: 0.05)
    check = StopCheck(ARM, bodies, limits=LIMITS, tick_s=TICK_S, braking=BRAKING)
    for k in range(1, 4):
        assert check.check(_turned(1e-4 * k), _turned(1e-4 * (k - 1)), STATE) is None
    assert bodies.n_asked == 1
    check.seed()
    assert check.known[0, 0] == 0.0
    assert check.check(_turned(4e-4), _turned(3e-4), STATE) is None
    assert bodies.n_asked == 2


def test_the_arm_s_own_table_lets_a_working_posture_move():
    check = StopCheck(ARM, CLEARANCE, limits=LIMITS, tick_s=TICK_S, braking=BRAKING)
    assert check.check(_turned(0.005), START, STATE) is None
    assert not math.isnan(check.known[0, 0])
