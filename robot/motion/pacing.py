"""How far joints may go in one tick by what they did in the ticks before: speed, acceleration and jerk. Pure maths.

Everything is counted in steps: how far a joint goes in a tick, how much that changes from tick to tick, and how much
that changes. A joint gathers speed by its own acceleration and jerk; what it must lose ahead of a limit, it loses by
those of a stop. From every window the next is never empty: braking is always in it.
"""

import math

import msgspec

from robot.envelope import JointEnd

__all__ = ["Window", "braked", "part_way", "window"]

RESERVE = 0.98
"""Share of each limit that motion uses, so that the gate's own is never met by rounding."""

Steps = tuple[float, float, float, float, float, float]


class Window(msgspec.Struct, frozen=True):
    """Least and greatest step of every joint in the tick to come: gently, and at all."""

    low: list[float]
    high: list[float]
    least: list[float]
    most: list[float]


def window(now: Steps, before: Steps, earlier: Steps, ends: tuple[JointEnd, ...]) -> Window:
    """Return how far joints may go from where the last three commands led, the newest first.

    What grows, grows by the joint's own jerk; what braked may let go of it at once, by a stop's.
    """
    low, high, least, most = [], [], [], []
    for c, b, a, end in zip(now, before, earlier, ends, strict=True):
        step = c - b
        rate = step - b + a
        jerk, gain, stop = RESERVE * end.stop_jerk_rad, RESERVE * end.gain_rad, RESERVE * end.stop_rad
        gently = RESERVE * end.jerk_rad
        if step >= 0.0:
            up, down = min(gain, rate + jerk), max(-stop, rate - jerk, -gain - step)
            most.append(step + up)
            high.append(step + min(up, max(min(rate + jerk, 0.0), rate + gently)))
            least.append(step + down)
            low.append(step + (down if step > 0.0 else max(down, min(max(rate - jerk, 0.0), rate - gently))))
        else:
            up, down = min(stop, rate + jerk, gain - step), max(-gain, rate - jerk)
            most.append(step + up)
            high.append(step + up)
            least.append(step + down)
            low.append(step + max(down, min(max(rate - jerk, 0.0), rate - gently)))
    return Window(low, high, least, most)


def braked(now: Steps, before: Steps, earlier: Steps, ends: tuple[JointEnd, ...], within: Window) -> list[float]:
    """Return the steps of joints that brake together as hard as they may, so that the arm keeps to its way.

    The joint that can lose least of its speed sets the share that all lose: by a stop's acceleration and jerk, yet so
    that it can let go of the brake by that jerk as it comes to rest: a, a - j, a - 2 j ... add up to no more than its
    step. What still gathers speed too hard to end that in one tick ends it as soon as it can.
    """
    steps = [b - a for a, b in zip(before, now, strict=True)]
    share = 1.0
    for step, b, a, end in zip(steps, before, earlier, ends, strict=True):
        size, jerk = abs(step), RESERVE * end.stop_jerk_rad
        if size > 0.0:
            gain = step - b + a if step > 0.0 else b - a - step
            loss = min(RESERVE * end.stop_rad, (math.sqrt(jerk * jerk + 8.0 * jerk * size) - jerk) / 2.0, jerk - gain)
            share = min(share, loss / size)
    left = 1.0 - max(0.0, share)
    return [min(max(left * v, a), b) for v, a, b in zip(steps, within.least, within.most, strict=True)]


def part_way(wanted: list[float], base: list[float], low: list[float], high: list[float]) -> float:
    """Return how much of the way from steps that may be taken to those that are wanted stays in between, 0 to 1."""
    share = 1.0
    for w, b, a, z in zip(wanted, base, low, high, strict=True):
        if w > z:
            share = min(share, (z - b) / (w - b) if b < z else 0.0)
        elif w < a:
            share = min(share, (b - a) / (b - w) if b > a else 0.0)
    return share
