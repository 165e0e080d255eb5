"""A free step is one that nothing holds back: the shortcut may be too strict, never too lax."""

from itertools import pairwise
from operator import le

import numpy as np
import pytest
from msgspec.structs import replace

from robot.chain import ToolChain
from robot.fences import plane_gap
from robot.geometry import between
from robot.kinematics import Kinematics
from robot.motion.follower import Follower
from robot.motion.free import free_bounds, is_free_step
from robot.motion.holding import (
    MARGIN_M,
    OVERRUN_M,
    brake_share,
    stops_outside,
    stretch,
    tips_too_fast,
    too_fast,
)
from robot.motion.pacing import window
from robot.motion.swinging import of_swings
from tests.support.profiles import ARM, envelope

CHAIN, KINEMATICS = ToolChain(ARM), Kinematics(ARM)
N_DRAWN = 3000
TIP_MIN_M = 0.01


def vec(values):
    return tuple(float(v) for v in values)


def drawn(rng, held):
    """Return where a step leads and the three commands before, from slow to too fast in any way."""
    _, x0, y0, z0, x1, y1, z1, _ = held.fences[0].row
    q = np.array(KINEMATICS.solve(vec(rng.uniform((x0, y0, z0), (x1, y1, z1))), ARM.home_rad))
    if rng.random() < 0.3:
        q += rng.normal(size=6) * rng.choice([0.05, 0.5])
    if rng.random() < 0.2:
        q[5] = held.joint_rows[5, 1] - rng.uniform(0.0, 0.3)
    size = held.joint_rows[:, 3] * rng.choice([0.0, 0.01, 0.05, 0.2, 0.8]) * rng.uniform(-1.3, 1.3, 6)
    gain = held.joint_rows[:, 4] * rng.choice([0.0, 0.3, 1.0]) * rng.uniform(-1.1, 1.1, 6)
    jerk = held.joint_rows[:, 5] * rng.choice([0.0, 0.3, 1.0]) * rng.uniform(-1.1, 1.1, 6)
    before = q - (size - gain)
    return vec(q + size), vec(q), vec(before), vec(before - (size - gain - (gain - jerk)))


def resting(places):
    return places[1][0], places[1][0]


def swung(rng, places, held):
    """Return points before and after a step a while ago: none, or one as fast as it may be in any direction."""
    now = np.array(places[1][0])
    far = rng.normal(size=(3, 3))
    far *= rng.choice([0.0, 0.5, 1.0]) * np.array(held.part_step_m)[:, None] / np.linalg.norm(far, axis=1)[:, None]
    return tuple(map(vec, now)), tuple(map(vec, now + far))


def is_held(steps, held, *, is_straight):
    """Return whether pacing or any limit holds a step back, by themselves."""
    wanted, now, before, earlier = steps
    step = [a - b for a, b in zip(wanted, now, strict=True)]
    within = window(now, before, earlier, held.joints)
    if not all(map(le, within.low, step)) or not all(map(le, step, within.high)):
        return True
    lost = brake_share(max(map(abs, step)), held)
    rest = between(now, wanted, stretch(lost, held))
    end = None if is_straight else CHAIN.points(rest)[0]
    least_m = -OVERRUN_M if is_straight else MARGIN_M
    if stops_outside(CHAIN.points(rest), CHAIN.tcp_and_lowest(rest)[1], TIP_MIN_M, least_m, held):
        return True
    places = (CHAIN.points(before)[0], CHAIN.points(now), CHAIN.points(wanted))
    heights = tuple(CHAIN.tcp_and_lowest(q)[1] for q in (now, wanted, rest))
    tips = [] if is_straight else tips_too_fast(heights, TIP_MIN_M, lost, held)
    return bool(too_fast(now, step, places, end, lost, held) or tips)


@pytest.mark.parametrize("is_straight", [True, False])
@pytest.mark.parametrize("tick_s", [0.01, 0.002])
@pytest.mark.parametrize("name", ["attended", "unattended"])
def test_nothing_holds_a_free_step_back(name, tick_s, is_straight):
    held = envelope(tick_s, name)
    held = replace(held, fences=(*held.fences, plane_gap("wall", 0, (0.0, 1.0, 0.0), -0.3)))
    bounds, rng = free_bounds(held, CHAIN, tip_min_m=TIP_MIN_M), np.random.default_rng(1)
    n_free = n_left = 0
    for _ in range(N_DRAWN):
        steps = drawn(rng, held)
        if steps[0] == steps[1]:
            continue
        places = (CHAIN.points(steps[2])[0], CHAIN.points(steps[1]))
        past = swung(rng, places, held)
        is_free, there = is_free_step(
            steps, *places, past, CHAIN.rows, bounds, held.joint_rows, held.fence_rows, is_straight
        )  # fmt: skip
        is_left = not (is_held(steps, held, is_straight=is_straight) or of_swings(places[1][0], there[0], past, held))
        assert is_left or not is_free
        assert there == CHAIN.points(steps[0])
        n_free, n_left = n_free + is_free, n_left + is_left
    assert n_left > n_free >= 40


def test_a_tool_on_its_way_over_the_table_is_nearly_always_free():
    """What is drawn above is wild; on an honest way the shortcut must save its time."""
    follower, n_free = Follower(ARM, envelope=envelope(0.01), tick_s=0.01), 0
    bounds = free_bounds(envelope(0.01), CHAIN, tip_min_m=TIP_MIN_M)
    held, x, y = envelope(0.01), *follower.target_m[:2]
    assert follower.aim((x, y + 0.2, 0.2), follower.yaw_rad)
    trail = [ARM.home_rad] * 3
    for _ in range(100):
        trail.append(follower.step())
        earlier, before, now, wanted = trail[-4:]
        places = (CHAIN.points(before)[0], CHAIN.points(now))
        n_free += is_free_step(
            (wanted, now, before, earlier),
            *places,
            resting(places),
            CHAIN.rows,
            bounds,
            held.joint_rows,
            held.fence_rows,
            True,
        )[0]
    n_moved = sum(a != b for a, b in pairwise(trail))
    assert n_moved > 30
    assert n_free >= 0.8 * n_moved


def test_joints_on_their_way_near_a_fence_and_low_over_the_table_are_nearly_always_free():
    held = envelope(0.01)
    start = KINEMATICS.solve((0.42, 0.05, 0.06), ARM.home_rad)
    gap_of = plane_gap("wall", 0, (0.0, 1.0, 0.0), 0.0)
    held = replace(held, fences=(*held.fences, gap_of))
    follower = Follower(ARM, envelope=held, tick_s=0.01, tip_min_m=TIP_MIN_M)
    follower.seed(start)
    follower.aim_joints(vec(q + d for q, d in zip(start, (0.05, 0.05, -0.05, 0.1, 0.2, 0.1), strict=True)))
    bounds, trail, n_free, n_near = free_bounds(held, CHAIN, tip_min_m=TIP_MIN_M), [start] * 3, 0, 0
    for _ in range(40):
        trail.append(follower.step())
        earlier, before, now, wanted = trail[-4:]
        places = (CHAIN.points(before)[0], CHAIN.points(now))
        n_free += is_free_step(
            (wanted, now, before, earlier),
            *places,
            resting(places),
            CHAIN.rows,
            bounds,
            held.joint_rows,
            held.fence_rows,
            False,
        )[0]
        n_near += now != wanted and gap_of.gap(CHAIN.tcp(now)) < held.fence_far_m
    assert n_near > 12
    assert n_free >= 0.8 * n_near


def test_an_arm_that_holds_still_and_what_is_not_a_number_are_not_free():
    held, home = envelope(0.01), ARM.home_rad
    bounds, place = free_bounds(held, CHAIN, tip_min_m=TIP_MIN_M), CHAIN.points(ARM.home_rad)
    near = vec(v + 1e-4 for v in home)
    args = (place[0], place, (place[0], place[0]), CHAIN.rows, bounds, held.joint_rows, held.fence_rows, True)
    assert is_free_step((near, home, home, home), *args)[0]
    assert not is_free_step((home, home, home, home), *args)[0]
    for i in range(6):
        odd = vec(float("nan") if k == i else v for k, v in enumerate(near))
        assert not is_free_step((odd, home, home, home), *args)[0]
        assert not is_free_step((near, odd, home, home), *args)[0]
