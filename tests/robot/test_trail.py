"""Where a free tool is, from commands alone."""

import pytest

from config.arm import Servo
from robot.motion.trail import Trail
from robot.servo import lag_s

SERVO = Servo(lookahead_s=0.03, gain=1200.0, dead_time_s=0.004)
LAG_S = lag_s(lookahead_s=0.03, gain=1200.0, dead_time_s=0.004)
REST = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)


@pytest.mark.parametrize("tick_s", [0.002, 0.01, 0.1])
def test_it_trails_a_ramp_by_the_arms_lag_whatever_the_tick(tick_s):
    trail = Trail(SERVO, tick_s=tick_s, q_rad=(0.0,) * 6)
    n_ticks = 100
    for k in range(1, n_ticks + 1):
        trail.add((k * tick_s,) * 6)
    assert trail.q_rad == pytest.approx((n_ticks * tick_s - LAG_S,) * 6)


def test_an_arm_at_rest_is_where_it_was_seeded_and_all_before_is_forgotten():
    trail = Trail(SERVO, tick_s=0.01, q_rad=(0.0,) * 6)
    trail.add((1.0,) * 6)
    trail.seed(REST)
    assert trail.q_rad == REST
