"""An arm that is only looked at must stand: what counts as having moved, and what ends the looking."""

import math
from contextlib import closing

import msgspec
import pytest

from robot.errors import ArmRefusedError, SafetyError, StaleStateError
from robot.hal.sight import Sight
from robot.messages import ArmMode
from robot.watching import STILL_RAD, StandStill, Watcher

AT = Sight(
    seen_ns=0, plant_s=0.0, q_rad=(0.0,) * 6, qd_rad_s=(0.0,) * 6, tcp_m=(0.4, 0.0, 0.2), tcp_speed_m_s=(0.0,) * 3,
    digital_out=0, mode=ArmMode.RUNNING, is_program_running=False,
)  # fmt: skip


def at(joint, q_rad):
    return msgspec.structs.replace(AT, q_rad=tuple(q_rad if i == joint else 0.0 for i in range(6)))


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_joint_within_a_milliradian_of_where_it_was_stands_and_the_next_float_does_not(joint, way):
    still = StandStill()
    still(AT)
    still(at(joint, way * STILL_RAD))
    assert still.farthest_rad == STILL_RAD
    with pytest.raises(SafetyError, match=f"joint {joint + 1} of 6 moved by 1.0 mrad"):
        still(at(joint, way * math.nextafter(STILL_RAD, 1.0)))


def test_a_joint_that_is_not_a_number_does_not_stand():
    still = StandStill()
    still(AT)
    with pytest.raises(SafetyError):
        still(at(2, math.nan))


def test_a_joint_that_came_back_has_moved_all_the_same():
    still = StandStill()
    still(AT)
    with pytest.raises(SafetyError):
        still(at(3, 0.01))
    with pytest.raises(SafetyError):
        still(AT)


@pytest.mark.parametrize(("n_before", "said"), [(0, "one is running"), (1, "one has begun")])
def test_a_program_on_the_arm_is_told_whether_it_ran_before_or_began_meanwhile(n_before, said):
    still = StandStill()
    for _ in range(n_before):
        still(AT)
    with pytest.raises(ArmRefusedError, match=said):
        still(msgspec.structs.replace(AT, is_program_running=True))


class Seer:
    """Sees an arm that stands, then nothing any more."""

    def __init__(self, n_seen):
        self.n_left = n_seen

    def see(self):
        self.n_left -= 1
        if self.n_left < 0:
            raise StaleStateError("silent")
        return AT

    def close(self):
        pass


def test_a_link_that_is_lost_while_nobody_asks_is_told_when_somebody_does():
    seen = []
    with closing(Seer(3)) as seer, Watcher(seer, take=seen.append, period_s=1e-4) as watcher:
        watcher._thread.join(5.0)
        with pytest.raises(StaleStateError, match="silent"):
            watcher.require()
    assert len(seen) == 3


def test_an_arm_that_cannot_be_seen_at_first_is_told_at_once():
    with pytest.raises(StaleStateError), Watcher(Seer(0), take=lambda _: None, period_s=1.0):
        raise AssertionError("nothing may begin")
