"""What a push lets a command do that it may not do otherwise, and what counts as the one before it afterwards."""

import pytest

from config.loader import load_arm
from robot.chain import ToolChain
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics
from robot.safety import Gate, GateLimits, Reason
from tests.support.profiles import envelope
from tests.support.stations import arm_state, command

ARM = load_arm("ur5e")
CHAIN = ToolChain(ARM)
START = Kinematics(ARM).solve((0.42, 0.0, 0.2), ARM.home_rad)


class Arm:
    """One that takes whatever it is told."""

    def write(self, sent):
        pass

    def stop(self):
        return True


@pytest.fixture
def arm():
    return Arm()


def _on_the_way(arm, n=40):
    """Return a gate whose base gathers all the speed it may, its last command, how many were sent, and its envelope."""
    limits, held = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=0.01).spec, table_m=0.0, tick_s=0.01), envelope(0.01)
    made = Gate(arm=arm, limits=limits, envelope=held, chain=CHAIN)
    made.seed(arm_state(START))
    end, q, step, rate = held.joints[0], START, 0.0, 0.0
    for k in range(1, n + 1):
        rate = min(rate + 0.5 * end.jerk_rad, 0.5 * end.gain_rad)
        step += rate
        q = (q[0] + step, *q[1:])
        assert made.write(command(q, sequence=k), arm_state(q), now_ns=0) is None
        if step > 1.5 * end.stop_rad:
            return made, q, k
    raise AssertionError("it never went so fast that it may not stand still at once")


@pytest.mark.parametrize(("force_n", "is_sent"), [(0.0, False), (120.0, True)])
def test_who_is_on_the_way_may_stand_still_at_once_where_something_pushes(arm, force_n, is_sent):
    made, q, n = _on_the_way(arm)
    held_up = arm_state(q, force_n=(0.0, 0.0, force_n))
    verdict = made.write(command(q, sequence=n + 1), held_up, now_ns=0)
    assert (verdict is None) is is_sent
    assert is_sent or verdict.reason == Reason.JOINT_ACCELERATION


def test_after_a_push_a_command_may_begin_from_rest_where_it_led(arm):
    made, q, n = _on_the_way(arm)
    back = (q[0] - 0.004, *q[1:])
    pushed = arm_state(back, force_n=(0.0, 0.0, 120.0))
    assert made.write(command(back, sequence=n + 1), pushed, now_ns=0) is None
    assert made.write(command(back, sequence=n + 2), arm_state(back), now_ns=0) is None
