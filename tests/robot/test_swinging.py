"""After a turn a part is asked for less, so that its servo swings it no faster than from rest."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.limited import limited
from config.loader import resolve
from robot.envelope import Envelope
from robot.motion.follower import Follower
from robot.motion.swinging import swing_step

RESOLVED = resolve()
PROFILE = RESOLVED.limits.profile("attended")
ARM = limited(RESOLVED.arm, PROFILE)
TICK_S, MOST_M_S = 0.01, 0.25
ZERO = (0.0, 0.0, 0.0)
vectors = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@given(to=vectors, old=vectors)
def test_what_passes_swings_no_faster_than_a_start(to, old):
    size, was = math.hypot(*to), math.hypot(*old)
    if was > 1.0:
        old = tuple(x / was for x in old)
    most = swing_step(ZERO, to, (ZERO, old), 1.0)
    assert 0.8 < most <= 1.0
    if size > 0.0:
        step = [most * x / size for x in to]
        assert math.hypot(*[1.22 * s - 0.22 * o for s, o in zip(step, old, strict=True)]) <= 1.22 * (1.0 + 1e-9)


@pytest.mark.parametrize(("old", "most"), [(ZERO, 1.0), ((1.0, 0.0, 0.0), 1.0), ((-1.0, 0.0, 0.0), 1.0 / 1.22)])
def test_after_rest_and_straight_on_all_is_left_and_after_a_turn_round_so_much_less(old, most):
    assert swing_step(ZERO, (1.0, 0.0, 0.0), (ZERO, old), 1.0) == pytest.approx(most)


def test_a_tool_that_turns_round_at_full_speed_swings_on_the_twins_servo_no_faster_than_that_servo_from_a_start():
    """Joints that are led to and fro turn harder than a tool that goes straight."""
    follower = Follower(ARM, envelope=Envelope.of(PROFILE, ARM, tick_s=TICK_S), tick_s=TICK_S)
    follower.seed(ARM.home_rad)
    q, before = follower.q_rad, [follower.points(follower.q_rad)[0]]
    for k in range(6):
        follower.aim_joints((q[0], q[1] + (0.12 if k % 2 == 0 else -0.12), *q[2:]))
        before += [follower.points(follower.step())[0] for _ in range(40)]
    asked = np.diff(np.array(before), axis=0) / TICK_S
    fastest = np.linalg.norm(asked, axis=2).max()
    assert 0.95 * MOST_M_S < fastest <= MOST_M_S
    for part in range(3):
        assert np.linalg.norm(swung(asked[:, part]), axis=1).max() <= 1.22 * MOST_M_S


def swung(speeds, omega=38.0, damping=0.43, n=20):
    """What a second-order servo makes of asked speeds, Euler in fine steps.  (n, 3) -> (n, 3)"""
    v, rate, dt, came = np.zeros(3), np.zeros(3), TICK_S / n, []
    for asked in speeds:
        for _ in range(n):
            rate += dt * (omega * omega * (asked - v) - 2.0 * damping * omega * rate)
            v = v + dt * rate
        came.append(v)
    return np.array(came)
