"""How far anything of the arm can move when its joints turn: a bound that no posture breaks. Pure maths.

Every point goes at most as far as the turns times the reaches, a reach being how far a point that the joint moves can
be from its axis. Where the axes of shoulder, elbow and wrist 1 are parallel, as on every UR, their turns add up link by
link: a tool that is kept pointing down is not turned by them at all, and the bound is three times as tight.
"""

import math
from collections.abc import Sequence

from config.arm import ArmConfig

__all__ = ["Sweep"]


class Sweep:
    """The bound for one arm."""

    def __init__(self, arm: ArmConfig) -> None:
        rows = arm.joints
        thick = max(c.radius_m for c in arm.capsules)
        tool = arm.tool
        aside = max(thick, math.hypot(0.032, 0.06), tool.stroke_m / 2.0 + tool.pad_size_m[0])
        tip = math.hypot(tool.tcp_m[2] + tool.tip_below_tcp_m, aside)
        # Radial from an axis, its own row's offset lies along it; the rows after it may stretch out from it.
        far = [abs(row.a_m) + sum(math.hypot(r.a_m, r.d_m) for r in rows[i + 1 :]) + tip for i, row in enumerate(rows)]
        far[5] = math.hypot(rows[5].a_m, aside)
        self._far = tuple(far)
        self._links = (abs(rows[1].a_m) + thick, abs(rows[2].a_m) + thick)
        self._is_parallel = rows[1].alpha_rad == rows[2].alpha_rad == 0.0

    def bound_m(self, turn_rad: Sequence[float]) -> float:
        """Return how far any point of the arm moves at most, m, when its joints turn so far.  (6,) -> ()"""
        a, b, c, d, e, f = turn_rad
        far = self._far
        if not self._is_parallel:
            turns = (abs(a), abs(b), abs(c), abs(d), abs(e), abs(f))
            return sum([r * t for r, t in zip(far, turns, strict=True)])
        upper, fore = self._links
        bc = b + c
        return (
            far[0] * abs(a) + upper * abs(b) + fore * abs(bc) + far[3] * abs(bc + d) + far[4] * abs(e) + far[5] * abs(f)
        )
