"""A stop as the judge of processes sees it, on joints whose course is known."""

import numpy as np
import pytest

from config.limits import Stopping
from config.loader import load_arm
from robot.kinematics import ToolChain
from sim_twin.processes.judge import RAMP_S, judge_ramp, predicted_m

ARM = load_arm("ur5e")
CHAIN = ToolChain(ARM)
STOPPING = Stopping(distance_m=0.3, time_s=0.6, deceleration_m_s2=6.0)
SPEED_RAD_S, BRAKE_S, SLICE_S, SENT_S = 0.8, 0.1, 0.002, 1.0


def course(*, ramp_s=0.05, back_rad=0.0, creep_rad=0.0, is_endless=False):
    """Return times, joints and speeds of a base that turns, brakes evenly, and perhaps comes back or creeps."""
    t = np.arange(0.8, 2.0, SLICE_S)
    speed = SPEED_RAD_S * np.clip(1.0 - (t - SENT_S - ramp_s) / BRAKE_S, 0.0, 1.0)
    if is_endless:
        speed[:] = SPEED_RAD_S
    q = np.tile(np.array(ARM.home_rad), (len(t), 1))
    q[:, 0] += np.cumsum(speed) * SLICE_S
    rest = SENT_S + ramp_s + BRAKE_S
    q[:, 0] -= back_rad * np.clip((t - rest) / 0.02, 0.0, 1.0)
    q[:, 0] += creep_rad * np.clip((t - rest - 0.3) / 0.3, 0.0, 1.0)
    return t, q, np.gradient(q, SLICE_S, axis=0)


def judged(**how):
    t, q, qd = course(**how)
    return judge_ramp(t, q, qd, last_s=SENT_S, chain=CHAIN, stopping=STOPPING)


@pytest.mark.parametrize("ramp_s", [0.0, 0.05, 0.119, 0.2])
def test_a_ramp_is_seen_to_begin_when_it_does(ramp_s):
    seen = judged(ramp_s=ramp_s)
    assert seen.ramp_s == pytest.approx(ramp_s, abs=0.012)
    assert seen.rest_s == pytest.approx(ramp_s + BRAKE_S, abs=0.006)
    radius_m = np.linalg.norm(CHAIN.tcp(ARM.home_rad)[:2])
    assert seen.speed_m_s == pytest.approx(SPEED_RAD_S * radius_m, rel=0.02)
    assert seen.way_m == pytest.approx(SPEED_RAD_S * radius_m * (ramp_s + BRAKE_S / 2), rel=0.06)
    assert seen.overshoot_rad < 1e-6
    assert seen.after_rad < 1e-3


def test_a_joint_that_comes_back_has_overshot_by_as_much():
    assert judged(back_rad=0.004).overshoot_rad == pytest.approx(0.004, abs=3e-4)


def test_what_creeps_at_rest_has_moved():
    assert judged(creep_rad=0.002).after_rad == pytest.approx(0.002, abs=3e-4)


def test_what_never_slows_down_has_no_ramp_and_no_rest():
    seen = judged(is_endless=True)
    assert (seen.ramp_s, seen.rest_s, seen.way_m) == (float("inf"),) * 3


def test_a_tool_may_go_on_until_the_ramp_and_then_as_the_limits_file_says():
    assert predicted_m(0.0, STOPPING) == 0.0
    assert predicted_m(0.6, STOPPING) == pytest.approx(0.6 * (RAMP_S + 0.036) + 0.03)
