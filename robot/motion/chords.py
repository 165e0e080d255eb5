"""How fast joints may go straight to others, by how fast that takes the parts of the arm. Pure."""

from itertools import pairwise
from math import dist

from robot.chain import ToolChain
from robot.messages import Vec3, Vec6

__all__ = ["share_of_speed"]

N_SPANS = 4
"""So many chords of the way to a joint target tell how fast the parts would go along it."""
PATH_SHARE, LEAST_SHARE = 0.96, 0.01
"""Of the parts' greatest speeds: chords are a little shorter than the way, and joints swing in from others."""


def share_of_speed(now: Vec6, q_rad: Vec6, chain: ToolChain, step_rad: Vec6, part_step_m: Vec3) -> float:
    """Return the share of their greatest speeds at which joints may go straight to others, by the parts' speeds.

    Args:
        now: where they are.
        q_rad: where they go.
        chain: where that takes the parts.
        step_rad: how far each joint may go in a tick.
        part_step_m: how far tool centre point, flange and elbow may.
    """
    turns = max([abs(b - a) / most for a, b, most in zip(now, q_rad, step_rad, strict=True)])
    if turns <= 0.0:
        return 1.0
    places = [chain.points(_between(now, q_rad, k / N_SPANS))[0] for k in range(N_SPANS + 1)]
    fastest = max(
        dist(a, b) / most
        for before, after in pairwise(places)
        for a, b, most in zip(before, after, part_step_m, strict=True)
    )
    return min(1.0, max(LEAST_SHARE, PATH_SHARE * turns / (N_SPANS * fastest))) if fastest > 0.0 else 1.0


def _between(a: Vec6, b: Vec6, share: float) -> Vec6:
    x = [u + share * (v - u) for u, v in zip(a, b, strict=True)]
    return x[0], x[1], x[2], x[3], x[4], x[5]
