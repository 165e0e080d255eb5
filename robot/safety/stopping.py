"""Where an arm that is stopped comes to rest: joints that brake together, along the way they go. Pure maths.

A stop takes one share of every joint's speed off at a time, so that the arm keeps to its path: the fastest joint loses
its speed at the stop's deceleration, the others in the same time. What turns at qd then turns on by qd T / 2 with
T = max |qd| / deceleration. A servo that trails its set-points stops short of that by what it trails: it is where a
command before would have left it, and that one was looked at in its turn.
"""

from robot.braking import Braking
from robot.messages import Vec6

__all__ = ["Braking", "stop_end", "stop_span", "stop_time_s"]


def stop_time_s(qd_rad_s: Vec6, deceleration_rad_s2: float) -> float:
    """Return how long a stop takes from these speeds, s.  (6,), () -> ()"""
    return max([abs(v) for v in qd_rad_s]) / deceleration_rad_s2


def stop_end(q_rad: Vec6, qd_rad_s: Vec6, deceleration_rad_s2: float) -> Vec6:
    """Return the joints at rest after a stop from these joints and speeds.  (6,), (6,), () -> (6,)"""
    half_s = stop_time_s(qd_rad_s, deceleration_rad_s2) / 2.0
    x = [q + v * half_s for q, v in zip(q_rad, qd_rad_s, strict=True)]
    return x[0], x[1], x[2], x[3], x[4], x[5]


def stop_span(
    commanded: tuple[Vec6, Vec6], measured: tuple[Vec6, Vec6], braking: Braking, *, tick_s: float
) -> tuple[tuple[float, float], ...]:
    """Return between which angles each joint comes to rest, whether it follows its commands at once or trails them.

    Args:
        commanded: joints and speeds asked of the arm.
        measured: joints and speeds that it has.
        braking: how hard it stops, at best and at worst.
        tick_s: how long a tick is: an arm that brakes in steps loses the first step's speed at once.

    Returns:
        Least and greatest angle of each joint.
    """
    ends: list[Vec6] = []
    for q, qd in (commanded, measured):
        soon = stop_end(q, qd, braking.deceleration_rad_s2)
        a, b, c, d, e, f = [
            x - v * min(tick_s, stop_time_s(qd, braking.deceleration_rad_s2)) / 2.0
            for x, v in zip(soon, qd, strict=True)
        ]
        ends += [(a, b, c, d, e, f), soon, stop_end(q, qd, braking.least_rad_s2)]
    return tuple((min(angles), max(angles)) for angles in zip(*ends, strict=True))
