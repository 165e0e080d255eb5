"""Joints gather speed by their own acceleration and jerk and lose it by a stop's, whatever is asked of them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.motion.pacing import RESERVE, braked, part_way, window
from tests.support.profiles import envelope

REST = (0.0,) * 6
WANTED = st.lists(st.lists(st.floats(-0.1, 0.1), min_size=6, max_size=6), min_size=1, max_size=25)
TICKS = pytest.mark.parametrize("dt", [0.002, 0.01])


def moved(q, steps):
    return tuple(a + b for a, b in zip(q, steps, strict=True))


def on(path, wanted, ends):
    """Take one step towards what is wanted, as far as the joints may."""
    earlier, before, now = path[-3:]
    within = window(now, before, earlier, ends)
    base = braked(now, before, earlier, ends, within)
    share = part_way(wanted, base, within.low, within.high)
    path.append(moved(now, [b + share * (w - b) for w, b in zip(wanted, base, strict=True)]))


def steps_of(path, ends):
    """Yield the joints' ends and their last three steps, the newest first, over a path."""
    for a, b, c, d in zip(path, path[1:], path[2:], path[3:], strict=False):
        for i, end in enumerate(ends):
            yield end, d[i] - c[i], c[i] - b[i], b[i] - a[i]


def rest(path, ends, n):
    for _ in range(n):
        on(path, [0.0] * 6, ends)


@TICKS
@given(wanted=WANTED)
def test_whatever_is_wanted_gains_and_losses_stay_inside(dt, wanted):
    ends, path = envelope(dt).joints, [REST] * 3
    for steps in wanted:
        on(path, [v * dt / 0.01 for v in steps], ends)
    for end, d2, d1, d0 in steps_of(path, ends):
        rate, before = d2 - d1, d1 - d0
        assert abs(rate) <= end.stop_rad
        assert abs(d2) <= end.gain_rad + (abs(d1) if d1 * d2 > 0.0 else 0.0)
        assert abs(rate - before) <= end.stop_jerk_rad
        way = 1.0 if rate > 0.0 else -1.0
        if d2 * way > 0.0 and d1 * way >= 0.0:
            assert rate * way - max(before * way, 0.0) <= end.jerk_rad


@TICKS
@given(wanted=WANTED)
def test_from_wherever_it_was_led_a_braking_arm_comes_to_rest_without_turning_back(dt, wanted):
    ends, path = envelope(dt).joints, [REST] * 3
    for steps in wanted:
        on(path, [v * dt / 0.01 for v in steps], ends)
    n = len(path)
    fastest = max(abs(b - a) for a, b in zip(path[-2], path[-1], strict=True))
    end = ends[0]
    ramp = (end.gain_rad + end.stop_rad) / end.stop_jerk_rad
    within = fastest / (RESERVE * end.stop_rad) + 2.0 * ramp + 4.0
    rest(path, ends, round(1.5 * within) + 2)
    assert max(abs(b - a) for a, b in zip(path[-2], path[-1], strict=True)) < 1e-9
    assert n < len(path)


def test_steady_joints_brake_by_one_share():
    ends = envelope(0.01).joints
    path = [moved(REST, [k * v for v in (0.01, 0.02, -0.005, 0.0, 0.001, 0.03)]) for k in range(3)]
    base = braked(path[2], path[1], path[0], ends, window(path[2], path[1], path[0], ends))
    shares = {round(b / v, 9) for b, v in zip(base, (0.01, 0.02, -0.005, 1.0, 0.001, 0.03), strict=True) if b}
    assert shares == {round(1.0 - RESERVE * ends[5].stop_rad / 0.03, 9)}


def test_what_is_within_is_taken_whole_and_what_is_not_as_far_as_it_may():
    assert part_way([1.0, -1.0], [0.0, 0.0], [-1.0, -1.0], [1.0, 1.0]) == 1.0
    assert part_way([2.0, -1.0], [0.0, 0.0], [-1.0, -1.0], [1.0, 1.0]) == 0.5
    assert part_way([0.5, -3.0], [0.0, -1.0], [-1.0, -1.5], [1.0, 1.0]) == 0.25
    assert part_way([0.5, -3.0], [0.0, -2.0], [-1.0, -1.5], [1.0, 1.0]) == 0.0
    assert part_way([3.0, 0.0], [2.0, 0.0], [-1.0, -1.0], [1.0, 1.0]) == 0.0
