"""What is plain passes every check: the shortcut may be too strict, never too lax."""

from collections import Counter

import numpy as np
import pytest
from msgspec.structs import replace

from robot.chain import ToolChain
from robot.fences import plane_gap
from robot.hal.fake import FakeArm
from robot.kinematics import Kinematics
from robot.safety.checks import Reason, check_joint_range, check_joint_speed, check_tool, check_tracking
from robot.safety.checks_profile import (
    check_cone,
    check_fences,
    check_joint_acceleration,
    check_joint_jerk,
    check_part_speeds,
    check_soft_margin,
)
from robot.safety.limits import GateLimits
from robot.safety.plain import is_plain, plain_bounds
from tests.support.profiles import ARM, envelope

CHAIN, KINEMATICS = ToolChain(ARM), Kinematics(ARM)
N_DRAWN = 4000


def vec(values):
    return tuple(float(v) for v in values)


KINDS = ("still", "place", "face", "tilt", "end", "speed", "part", "gain", "jerk", "tracking", "wild")


def drawn(rng, limits, held):
    """Return four commands, the newest first, and where the arm is: too much in one way, or nearly, or in all."""
    kind = KINDS[rng.integers(len(KINDS))]
    _, x0, y0, z0, x1, y1, z1, _ = held.fences[0].row
    place = rng.uniform((x0, y0, z0 + 0.02), (x1, y1, z1))
    if kind in ("face", "wild"):
        axis = rng.integers(3)
        place[axis] = (x0, y0, z0, x1, y1, z1)[axis + 3 * rng.integers(2)] + rng.normal() * 0.006
    q = np.array(KINEMATICS.solve(vec(place), ARM.home_rad))
    if kind in ("tilt", "wild"):
        q[3:5] += rng.normal(size=2)
    if kind == "end":
        q[5] = held.joint_rows[5, 1] - rng.uniform(-0.01, 0.2)
    joint = 5 if kind in ("end", "speed", "gain", "jerk") else rng.integers(6)
    one, share = np.eye(6)[joint], rng.uniform(0.5, 1.5) * rng.choice([-1.0, 1.0])
    slow = 0.01 * held.joint_rows[:, 3] * rng.uniform(-1.0, 1.0, 6)
    size = slow + held.joint_rows[:, 3] * share * one * (kind in ("speed", "part", "wild"))
    size += held.joint_rows[:, 3] * rng.uniform(0.0, 0.8) * one * (kind == "end")
    gain = held.joint_rows[:, 4] * (0.02 * rng.uniform(-1.0, 1.0, 6) + share * one * (kind in ("gain", "wild")))
    jerk = held.joint_rows[:, 7] * (0.02 * rng.uniform(-1.0, 1.0, 6) + share * one * (kind in ("jerk", "wild")))
    last = q - size
    before = last - (size - gain)
    earlier = before - (size - gain - (gain - jerk))
    off = rng.normal(size=6) * 0.01 + share * limits.tracking_error_rad * one * (kind in ("tracking", "wild"))
    return tuple(map(vec, (q, last, before, earlier))), vec(q + off)


def refusals(commands, measured, limits, held):
    """Return why each check refuses, by the checks themselves."""
    q, last, before, earlier = commands
    points, down = CHAIN.points(q)
    made = (
        check_joint_range(q, limits), check_joint_speed(q, last, limits),
        check_tool(points[0], CHAIN.lowest_m(points[0], down), limits), check_soft_margin(q, last, held),
        check_joint_acceleration(q, last, before, held), check_joint_jerk(q, last, before, earlier, held),
        check_fences(points, held), check_cone(down, held),
        check_part_speeds(points, CHAIN.points(last)[0], None, held), check_tracking(q, measured, limits),
    )  # fmt: skip
    return {refusal.reason for refusal in made if refusal is not None}


@pytest.mark.parametrize("tick_s", [0.01, 0.002])
@pytest.mark.parametrize("name", ["attended", "unattended"])
def test_what_is_plain_passes_every_check_and_much_that_passes_is_plain(name, tick_s):
    held = envelope(tick_s, name)
    held = replace(held, fences=(*held.fences, plane_gap("wall", 0, (0.0, 1.0, 0.0), -0.3)))
    limits = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=tick_s).spec, table_m=0.0, tick_s=tick_s)
    bounds, rng = plain_bounds(limits, held, CHAIN), np.random.default_rng(0)
    n_plain, n_passed, alone = 0, 0, Counter()
    for _ in range(N_DRAWN):
        commands, measured = drawn(rng, limits, held)
        was = CHAIN.points(commands[1])[0]
        is_within, points = is_plain(
            commands, measured, was, CHAIN.rows, bounds, held.joint_rows, held.fence_rows
        )  # fmt: skip
        why = refusals(commands, measured, limits, held)
        assert not (is_within and why), why
        assert points == CHAIN.points(commands[0])[0]
        n_plain, n_passed = n_plain + is_within, n_passed + (not why)
        if len(why) == 1:
            alone[why.pop()] += 1
    assert n_plain >= 0.8 * n_passed >= 200
    seen = {
        Reason.JOINT_SPEED, Reason.JOINT_ACCELERATION, Reason.JOINT_JERK, Reason.FENCE, Reason.PART_SPEED,
        Reason.SOFT_MARGIN, Reason.CONE, Reason.TRACKING,
    }  # fmt: skip
    assert seen - set(alone) == set(), f"each of them must be seen alone, nothing else told in its place: {alone}"


def test_what_is_not_a_number_is_not_plain():
    held, home = envelope(0.01), ARM.home_rad
    limits = GateLimits.of(ARM, FakeArm(arm=ARM, tick_s=0.01).spec, table_m=0.0, tick_s=0.01)
    bounds, points = plain_bounds(limits, held, CHAIN), CHAIN.points(home)[0]
    rest = (home,) * 4
    assert is_plain(rest, home, points, CHAIN.rows, bounds, held.joint_rows, held.fence_rows)[0]
    for i in range(6):
        odd = tuple(float("nan") if k == i else v for k, v in enumerate(home))
        for commands, measured in (((odd, home, home, home), home), (rest, odd), ((home, odd, home, home), home)):
            assert not is_plain(commands, measured, points, CHAIN.rows, bounds, held.joint_rows, held.fence_rows)[0]
