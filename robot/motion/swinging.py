"""How fast a part may be asked to go that has just turned: an arm swings on its servo. Pure.

It goes past each change of its speed by SWING of it, SWING_S later: a shoulder that holds the stretched arm has 0.43
of the critical damping, at 38 rad/s. From rest that is SWING of the speed; after a turn at full speed twice as much.
"""

import math

from robot.compiled import compiled
from robot.envelope import Envelope
from robot.messages import Vec3
from robot.motion.holding import PART, PART_NAMES, SPEED_RESERVE, Met, Points

__all__ = ["SWING_S", "of_swings", "swing_step"]

SWING, SWING_S = 0.22, 0.09


@compiled
def swing_step(now: Vec3, to: Vec3, past: tuple[Vec3, Vec3], most_m: float) -> float:
    """Return how far a part may go in a tick, in a direction, lest its servo bring it to more than after a start.

    With steps s and, a while ago, o the arm goes s + SWING (s - o), which may be (1 + SWING) most_m: what turned round
    at full speed may come back at 0.82 of it until it has swung.

    Args:
        now: where it is.
        to: where it would go.
        past: where it was before and after the step a while ago.
        most_m: how far it may go at all.
    """
    (x, y, z), (u, v, w), ((a, b, c), (d, e, f)) = now, to, past
    dx, dy, dz, ox, oy, oz = u - x, v - y, w - z, d - a, e - b, f - c
    size, most = math.sqrt(dx * dx + dy * dy + dz * dz), (1.0 + SWING) * most_m
    if size <= 0.0:
        return most_m
    along, whole = SWING * (dx * ox + dy * oy + dz * oz) / size, SWING * SWING * (ox * ox + oy * oy + oz * oz)
    left = along * along - whole + most * most
    return min(most_m, (along + math.sqrt(left)) / (1.0 + SWING)) if left > 0.0 else 0.0


def of_swings(now: Points, to: Points, past: tuple[Points, Points], envelope: Envelope) -> list[Met]:
    """Return the parts whose servo would swing too fast.

    Args:
        now: points at the last command.
        to: where the step leads.
        past: points before and after the step SWING_S ago.
        envelope: the limits.
    """
    met: list[Met] = []
    for i, most in enumerate(envelope.part_step_m):
        size = math.dist(now[i], to[i])
        bound = swing_step(now[i], to[i], (past[0][i], past[1][i]), SPEED_RESERVE * most)
        if size > bound:
            met.append(Met(PART_NAMES[i], PART, i, size, bound))
    return met
