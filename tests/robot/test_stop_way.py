"""The way to a stop between bodies: what is looked at, whom a refusal names, and what may part."""

import pytest
from msgspec.structs import replace

from robot.geometry import difference, stepped
from robot.safety import Braking, Reason, StopCheck
from robot.safety.blocks import Block
from robot.safety.clearance import Closest
from robot.safety.collision_model import Near, Pair
from robot.safety.stop_check import FINE_M
from robot.safety.sweep import Sweep
from tests.robot.test_stop_memory import ARM, LOWEST_M, OPEN, START, STATE, TICK_S, turned

STEP = 0.02
WORST = 2.0 * STEP / (2.0 * TICK_S * TICK_S * 16.0)
"""At half of 16 rad/s² a stop turns the base on by so many steps."""
HERE, END = turned(STEP), stepped(turned(STEP), difference(turned(STEP), START), WORST)
LONG_M = Sweep(ARM).bound_m(difference(HERE, START)) * WORST


class Way:
    """Gaps before the command, at it, at the end of its stop, and anywhere between."""

    most_m = 9.0

    def __init__(self, before, here, end, between=None):
        self._before, self._here, self._end, self._between = before, here, end, between or (lambda x: 1.0)
        self.asked, self.named, self.blocks = [], [], []

    def gap(self, q_rad):
        self.asked.append(q_rad)
        x = place_of(q_rad)
        if x < -1e-9:
            return self._before
        return self._here if x < 1e-9 else self._end if x > 1.0 - 1e-9 else self._between(x)

    def closest(self, q_rad, *, within_m):
        self.named.append((q_rad, within_m))
        return [Closest(pair=Pair(part="palm", other="wall", near=Near.THING), gap_m=-0.1, slope_m_rad=(0.0,) * 6)]

    def put(self, blocks):
        self.blocks.append(blocks)


def place_of(q_rad):
    """Return where on the way joints are: 0 at the command, 1 where its stop ends."""
    return (q_rad[0] - HERE[0]) / (END[0] - HERE[0])


def checked(way, limits=OPEN):
    braking = Braking(deceleration_rad_s2=16.0, least_share=0.5)
    check = StopCheck(ARM, way, limits=limits, tick_s=TICK_S, braking=braking)
    return check, check.check(HERE, START, STATE)


def dips(depth):
    """Return a gap that falls to a depth half way."""
    return lambda x: depth if abs(x - 0.5) < 1e-6 else 1.0


def test_what_is_too_near_may_pass_through_a_gap_that_is_less_so():
    assert checked(Way(-0.01, 0.001, -0.005))[1] is None
    assert checked(Way(-0.01, -0.005, 0.001))[1] is None
    assert checked(Way(-0.01, 0.001, -0.011))[1].reason is Reason.CLEARANCE


@pytest.mark.parametrize(("here", "end"), [(0.001, 0.001), (0.0, 0.001), (0.001, 0.0)])
def test_a_way_whose_ends_are_clear_is_held_to_clearance_wherever_it_comes_from(here, end):
    assert checked(Way(-0.01, here, end))[1] is None
    assert checked(Way(-0.01, here, end, dips(-0.005)))[1].reason is Reason.CLEARANCE


def test_a_gap_of_nothing_at_both_ends_is_still_one():
    assert checked(Way(1.0, 0.0, 0.0))[1] is None


@pytest.mark.parametrize(("here", "end", "named"), [(-0.02, 0.01, HERE), (0.01, -0.02, END), (-0.02, -0.02, END)])
def test_a_refusal_names_who_is_nearest_where_it_is_too_near(here, end, named):
    way = Way(1.0, here, end)
    refusal = checked(way)[1]
    assert "palm clear of wall" in refusal.detail
    assert refusal.amount == pytest.approx(0.02)
    assert way.named == [(pytest.approx(named), pytest.approx(-0.02 + FINE_M))]


@pytest.mark.parametrize("share", [0.02, 0.3, 0.499, 0.501, 0.8, 1.1])
def test_a_way_that_passes_was_looked_at_until_its_gaps_bound_all_of_it(share):
    way = Way(1.0, share * LONG_M, share * LONG_M, lambda x: 0.6 * share * LONG_M)
    assert checked(way)[1] is None
    free = sorted((place_of(q) - way.gap(q) / LONG_M, place_of(q) + way.gap(q) / LONG_M) for q in tuple(way.asked))
    reached = 0.0
    for low, high in free:
        assert low <= reached + FINE_M / LONG_M
        reached = max(reached, high)
    assert reached >= 1.0


@pytest.mark.parametrize(("dip", "is_refused"), [(0.69, False), (0.75, True)])
def test_what_parts_is_looked_at_between_as_closely_as_what_is_clear(dip, is_refused):
    """Both ends half as deep as it was before, which is 0.7 of the way: something may be deeper between."""
    floor = -0.7 * LONG_M
    refusal = checked(Way(floor, floor / 2.0, floor / 2.0, dips(-dip * LONG_M)))[1]
    assert (refusal is not None) is is_refused


def test_after_things_were_moved_bodies_are_looked_at_again():
    way = Way(9.0, 9.0, 9.0)
    check, refusal = checked(way)
    assert refusal is None
    n = len(way.asked)
    assert check.check(turned(STEP + 1e-3), HERE, STATE) is None
    assert len(way.asked) == n
    blocks = (Block(name="a", centre_m=(0.4, 0.0, 0.1), half_m=(0.1, 0.1, 0.1)),)
    check.put(blocks)
    assert way.blocks == [blocks]
    assert check.check(turned(STEP + 2e-3), turned(STEP + 1e-3), STATE) is None
    assert len(way.asked) > n


@pytest.mark.parametrize("to_end_rad", [0.0, 0.5])
def test_a_stop_outside_the_workspace_is_told_as_that_though_a_joint_comes_near_its_end_or_to_it(to_end_rad):
    end = stepped(HERE, difference(HERE, START), WORST)
    high = tuple(q + to_end_rad + 1e-9 if k == 0 else 9.0 for k, q in enumerate(end))
    refusal = checked(Way(9.0, 9.0, 9.0), replace(OPEN, q_max_rad=high, tip_min_m=LOWEST_M + 0.1))[1]
    assert refusal.reason is Reason.STOP_WORKSPACE
