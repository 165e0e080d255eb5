"""What a stop check remembers spares it work and changes no verdict: a fresh one at every tick says the same."""

import numpy as np
import pytest
from msgspec.structs import replace

from config.loader import resolve
from robot.chain import ToolChain
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics
from robot.safety import Braking, GateLimits, StopCheck
from robot.safety.sweep import Sweep
from tests.support.stations import arm_state

ARM = resolve().arm
TICK_S = 0.01
START = Kinematics(ARM).solve((0.42, 0.0, 0.2), ARM.home_rad)
STATE = arm_state(START)
PLAIN = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=TICK_S).spec, table_m=0.0, tick_s=TICK_S)
OPEN = replace(
    PLAIN, workspace_m=((-3.0,) * 3, (3.0,) * 3), tip_min_m=-3.0, q_min_rad=(-9.0,) * 6, q_max_rad=(9.0,) * 6
)
TCP, LOWEST_M = ToolChain(ARM).tcp_and_lowest(START)


class Bodies:
    most_m = 0.07

    def __init__(self, wall_rad):
        self._wall_rad = wall_rad

    def gap(self, q_rad):
        return min(self.most_m, self._wall_rad - (q_rad[0] - START[0]))

    def closest(self, q_rad, *, within_m):
        return []


def turned(by, i=0):
    return tuple(q + by * (k == i) for k, q in enumerate(START))


def box(axis, side, by):
    corners = [[-3.0] * 3, [3.0] * 3]
    corners[side][axis] = TCP[axis] + (by if side else -by)
    return replace(OPEN, workspace_m=(tuple(corners[0]), tuple(corners[1])))


def made(limits, wall_rad):
    braking = Braking(deceleration_rad_s2=16.0, least_share=0.5)
    return StopCheck(ARM, Bodies(wall_rad), limits=limits, tick_s=TICK_S, braking=braking)


WALKS = [
    *((0, sign * 2e-3, box(axis, side, 0.02), 9.0) for sign in (-1.0, 1.0) for axis in (0, 1) for side in (0, 1)),
    *((i, 2e-3, replace(OPEN, q_max_rad=turned(0.05, i)), 9.0) for i in range(6)),
    *((i, -2e-3, replace(OPEN, q_min_rad=turned(-0.05, i)), 9.0) for i in range(6)),
    (1, 2e-3, replace(OPEN, tip_min_m=LOWEST_M - 0.03), 9.0),
    (0, 2e-3, OPEN, 0.15),
]


@pytest.mark.parametrize(("i", "step", "limits", "wall_rad"), WALKS)
def test_a_walk_is_refused_at_the_tick_at_which_a_fresh_check_refuses_it(i, step, limits, wall_rad):
    kept, q = made(limits, wall_rad), START
    for k in range(1, 80):
        now = turned(step * k, i)
        refusal, fresh = (check.check(now, q, STATE) for check in (kept, made(limits, wall_rad)))
        assert (refusal and refusal.reason) == (fresh and fresh.reason)
        if refusal is not None:
            break
        q = now


@pytest.mark.parametrize(("i", "step", "limits", "wall_rad"), WALKS[8:])
def test_a_walk_to_a_limit_is_refused_in_the_end(i, step, limits, wall_rad):
    kept, q = made(limits, wall_rad), START
    for k in range(1, 200):
        now = turned(step * k, i)
        if kept.check(now, q, STATE) is not None:
            return
        q = now
    pytest.fail("nothing stopped it")


def test_joints_of_another_number_are_an_error():
    for q, state in ((START[:5], STATE), (turned(0.01), replace(STATE, q_rad=START[:5]))):
        with pytest.raises((TypeError, ValueError, IndexError), match=r"matching|unpack|range"):
            made(OPEN, 0.005).check(q, START, state)


def test_a_way_is_halved_until_nothing_can_hide_between_and_no_further():
    """A body 1 mm thick across the way is found; how often it is looked is bounded."""
    asked = []

    class Thin(Bodies):
        def gap(self, q_rad):
            asked.append(q_rad[0])
            return min(self.most_m, abs(q_rad[0] - START[0] - 0.0401) - 0.0005)

    braking = Braking(deceleration_rad_s2=16.0, least_share=0.5)
    check = StopCheck(ARM, Thin(9.0), limits=OPEN, tick_s=TICK_S, braking=braking)
    assert check.check(turned(0.01), START, STATE) is not None
    assert 3 <= len(asked) <= 130


@pytest.mark.parametrize("i", range(5))
def test_a_body_between_two_clear_ends_is_found_whichever_joint_turns(i):
    reach_m = 0.9 * Sweep(ARM).bound_m(tuple(float(k == i) for k in range(6)))

    class Thin(Bodies):
        def gap(self, q_rad):
            return min(self.most_m, reach_m * abs(q_rad[i] - START[i] - 0.045) - 0.001)

    braking = Braking(deceleration_rad_s2=16.0, least_share=0.5)
    check = StopCheck(ARM, Thin(9.0), limits=OPEN, tick_s=TICK_S, braking=braking)
    assert check.check(turned(0.01, i), START, STATE) is not None


class Wall(Bodies):
    """Comes nearer by all that a turn of the base can bring anything: the bound that is reckoned with is met."""

    reach_m = Sweep(ARM).bound_m((1.0, 0.0, 0.0, 0.0, 0.0, 0.0))

    def __init__(self, wall_rad):
        super().__init__(wall_rad)
        self.n_asked = 0

    def gap(self, q_rad):
        self.n_asked += 1
        return min(self.most_m, self.reach_m * (self._wall_rad - abs(q_rad[0] - START[0])))


def walled(wall_rad):
    braking = Braking(deceleration_rad_s2=16.0, least_share=0.5)
    bodies = Wall(wall_rad)
    return StopCheck(ARM, bodies, limits=OPEN, tick_s=TICK_S, braking=braking), bodies


@pytest.mark.parametrize("seed", range(20))
def test_between_walls_that_come_as_near_as_they_can_a_fresh_check_says_the_same_at_every_tick(seed):
    rng, q, step, n_refused = np.random.default_rng(seed), START, 0.0, 0
    kept, _ = walled(0.03)
    for _ in range(100):
        step = float(np.clip(step + rng.normal() * 2e-3, -9e-3, 9e-3))
        now = (q[0] + step, *q[1:])
        refusal, fresh = (check.check(now, q, STATE) for check in (kept, walled(0.03)[0]))
        assert (refusal and refusal.reason) == (fresh and fresh.reason)
        n_refused += refusal is not None
        if refusal is None:
            q = now
        else:
            step, kept = 0.0, walled(0.03)[0]  # a refusal latches, and whatever comes next begins anew
    assert n_refused


def test_beside_a_wall_at_little_more_than_its_stop_an_arm_looks_at_every_other_tick_at_most():
    """A gap found at the end of one stop bounds those of the next, and with what is left here that suffices."""
    step, n_ticks = 5e-3, 40
    check, bodies = walled(9.0)
    far_m = Wall.reach_m * step * (1.0 + step / (2.0 * 8.0 * TICK_S**2))
    bodies.most_m = 1.05 * far_m
    for k in range(1, n_ticks + 1):
        assert check.check(turned(step * k), turned(step * (k - 1)), STATE) is None
    assert 1 <= bodies.n_asked <= n_ticks // 2


def test_far_from_everything_an_arm_whose_stop_is_longer_than_it_sees_looks_once_a_tick_at_the_most():
    """Of the way to where a stop ends nearly all was proved free in the ticks before."""
    step, n_ticks = 0.02, 40
    check, bodies = walled(9.0)
    assert Wall.reach_m * step * step / (2.0 * 8.0 * TICK_S**2) > 2.0 * bodies.most_m
    for k in range(1, n_ticks + 1):
        n_before = bodies.n_asked
        assert check.check(turned(step * k), turned(step * (k - 1)), STATE) is None
        assert bodies.n_asked - n_before <= (1 if k > 1 else 6)


def test_what_was_seen_of_a_stop_counts_no_more_once_a_thing_is_put_elsewhere():
    step = 2e-3
    check, bodies = walled(9.0)
    bodies.put = lambda blocks: None
    assert check.check(turned(step), START, STATE) is None
    bodies._wall_rad = 0.001
    check.put(())
    assert check.check(turned(2 * step), turned(step), STATE) is not None


def test_what_was_known_counts_no_more_after_commands_that_were_not_asked_about():
    kept, q, now = made(OPEN, 0.15), turned(0.14995), turned(0.15005)
    assert kept.check(turned(1e-4), START, STATE) is None
    refusal, fresh = (check.check(now, q, STATE) for check in (kept, made(OPEN, 0.15)))
    assert refusal is not None
    assert fresh is not None
