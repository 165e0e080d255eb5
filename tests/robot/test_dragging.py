"""A tool that something holds fast goes no faster than it may once it comes free."""

import math

import pytest

from config.limited import limited
from config.loader import resolve
from robot.envelope import Envelope
from robot.kinematics import Kinematics
from robot.messages import JointTarget, Twist
from robot.motion import Mover
from robot.motion.guarding import dragged_speed
from tests.support.stations import arm_state

RESOLVED = resolve()
PROFILE = RESOLVED.limits.profile("attended")
ARM = limited(RESOLVED.arm, PROFILE)
KINEMATICS = Kinematics(ARM)
Q_START = KINEMATICS.solve((0.42, 0.0, 0.1), ARM.home_rad)
HUNG_N = (0.0, 43.0, -25.0)
"""On a rim, while it rises."""
STEP_S = 0.05


class Risen:
    """An arm that is where it was told, asked to rise in one way or another."""

    def __init__(self, tick_s):
        self.tick_s, self.q = tick_s, Q_START
        self.mover = Mover(ARM, envelope=Envelope.of(PROFILE, ARM, tick_s=tick_s), table_m=0.0, tick_s=tick_s)
        self.mover.seed(self.state((0.0, 0.0, 0.0)))

    def state(self, force_n):
        return arm_state(self.q, tcp_m=KINEMATICS.tcp(self.q), force_n=force_n)

    def rise(self, intent, force_n, n_steps):
        """Return how fast the tool was at the end of that, m/s."""
        for _ in range(n_steps):
            self.mover.begin_step(intent(self.q), self.state(force_n), duration_s=STEP_S)
            for _ in range(round(STEP_S / self.tick_s)):
                before = KINEMATICS.tcp(self.q)
                self.q = self.mover.tick(self.state(force_n))
        return math.dist(KINEMATICS.tcp(self.q), before) / self.tick_s


def straight(_):
    return Twist(linear_m_s=(0.0, 0.0, 0.3))


def by_joints(q):
    return JointTarget(q_rad=(q[0], q[1] - 0.1, q[2], q[3], q[4] + 0.03, q[5]))


@pytest.mark.parametrize("tick_s", [0.01, 0.002])
@pytest.mark.parametrize("intent", [straight, by_joints])
def test_a_tool_that_hangs_on_something_is_dragged_so_that_it_may_come_off_at_once(intent, tick_s):
    free, hung = Risen(tick_s), Risen(tick_s)
    most = PROFILE.speeds.tcp_m_s
    slow = dragged_speed(HUNG_N, ARM.motion.contact_force_n, most)
    assert slow < 0.6 * most
    assert free.rise(intent, (0.0, 0.0, 0.0), 6) > 0.8 * most
    assert 0.5 * slow < hung.rise(intent, HUNG_N, 6) <= slow * 1.001


def test_once_it_is_free_it_goes_as_fast_as_ever():
    arm = Risen(0.01)
    slowed = arm.rise(straight, HUNG_N, 3)
    assert arm.rise(straight, (0.0, 0.0, 0.0), 5) > 1.5 * slowed
