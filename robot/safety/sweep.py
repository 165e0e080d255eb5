"""How far anything of the arm can move when its joints turn: a bound that no posture breaks. Pure maths.

Every point goes at most as far as the turns times the reaches, a reach being how far a point that the joint moves can
be from its axis. Where the axes of shoulder, elbow and wrist 1 are parallel, as on every UR, their turns add up link by
link: a tool that is kept pointing down is not turned by them at all, and the bound is three times as tight.
"""

import math

from config.arm import ArmConfig
from robot.compiled import compiled
from robot.messages import Vec6

__all__ = ["Links", "Sweep", "swept_m"]

Links = tuple[float, float]
"""Reach of shoulder and elbow where the three axes are parallel, metres; both negative where they are not."""
SEPARATE: Links = (-1.0, -1.0)


@compiled
def swept_m(turn_rad: Vec6, far_m: Vec6, links_m: Links) -> float:
    """Return how far any point of the arm moves at most, m, when its joints turn so far.

    Args:
        turn_rad: the turns.
        far_m: how far a point that each joint moves can be from its axis.
        links_m: what holds for shoulder and elbow instead where the axes are parallel.
    """
    a, b, c, d, e, f = turn_rad
    upper, fore = links_m
    ends = far_m[0] * abs(a) + far_m[4] * abs(e) + far_m[5] * abs(f)
    if upper < 0.0:
        return ends + far_m[1] * abs(b) + far_m[2] * abs(c) + far_m[3] * abs(d)
    return ends + upper * abs(b) + fore * abs(b + c) + far_m[3] * abs(b + c + d)


class Sweep:
    """The bound for one arm.

    Attributes:
        far_m: How far a point that each joint moves can be from its axis.
        links_m: What holds for shoulder and elbow instead where the axes are parallel.
    """

    def __init__(self, arm: ArmConfig) -> None:
        rows = arm.joints
        thick = max(c.radius_m for c in arm.capsules)
        tool = arm.tool
        aside = max(thick, math.hypot(0.032, 0.06), tool.stroke_m / 2.0 + tool.pad_size_m[0])
        tip = math.hypot(tool.tcp_m[2] + tool.tip_below_tcp_m, aside)
        # Radial from an axis, its own row's offset lies along it; the rows after it may stretch out from it.
        far = [abs(row.a_m) + sum(math.hypot(r.a_m, r.d_m) for r in rows[i + 1 :]) + tip for i, row in enumerate(rows)]
        self.far_m: Vec6 = (far[0], far[1], far[2], far[3], far[4], math.hypot(rows[5].a_m, aside))
        is_parallel = rows[1].alpha_rad == rows[2].alpha_rad == 0.0
        self.links_m = (abs(rows[1].a_m) + thick, abs(rows[2].a_m) + thick) if is_parallel else SEPARATE

    def bound_m(self, turn_rad: Vec6) -> float:
        """Return how far any point of the arm moves at most, m, when its joints turn so far.  (6,) -> ()"""
        return swept_m(turn_rad, self.far_m, self.links_m)
