"""Joints of a UR arm whose tool points straight down, in closed form and plain floats.

Of the eight solutions (Hawkins 2013, "Analytic Inverse Kinematics for the Universal Robots UR-5/UR-10 Arms") a tool
that points down leaves simple ones: wrist 2 stands at a right angle, shoulder, elbow and wrist 1 are a triangle in the
arm's plane. At ticks of 2 ms placo finds the code and data of a general solver gone from the caches, and takes five
times as long as in a loop of its own.
"""

import math

from config.arm import ArmConfig
from robot.geometry import unwound
from robot.messages import Vec3, Vec6

__all__ = ["DownwardArm"]

TINY = 1e-9
QUARTER_RAD = math.pi / 2.0
TWISTS_RAD = (QUARTER_RAD, 0.0, 0.0, QUARTER_RAD, -QUARTER_RAD, 0.0)
HAS_LENGTH = (False, True, True, False, False, False)
HAS_OFFSET = (True, False, False, True, True, True)


class DownwardArm:
    """Inverse kinematics of one arm for a tool that points down.

    Args:
        arm: The arm's file; one that `fits`.
    """

    def __init__(self, arm: ArmConfig) -> None:
        rows = arm.joints
        self._a2, self._a3 = rows[1].a_m, rows[2].a_m
        self._d1, self._d4, self._d5, self._d6 = rows[0].d_m, rows[3].d_m, rows[4].d_m, rows[5].d_m
        self._tcp_m = arm.tool.tcp_m

    @staticmethod
    def fits(arm: ArmConfig) -> bool:
        """Return whether an arm's rows are those of the UR family: three parallel axes and a wrist at right angles."""
        return all(
            abs(row.alpha_rad - twist) < TINY and (has_a or not row.a_m) and (has_d or not row.d_m)
            for row, twist, has_a, has_d in zip(arm.joints, TWISTS_RAD, HAS_LENGTH, HAS_OFFSET, strict=True)
        )

    def solve(self, position_m: Vec3, yaw_rad: float, seed_rad: Vec6) -> Vec6 | None:
        """Return the joints that bring the tool, pointing down, to a position; None where none do.

        Args:
            position_m: Tool centre point, base frame.
            yaw_rad: Turn of the tool about the vertical, as in `robot.description.tool_down`.
            seed_rad: Its shoulder, elbow and wrist are kept to the side that they are on, and every joint to its turn.
        """
        if not math.isfinite(sum(position_m) + yaw_rad + sum(seed_rad)):
            return None
        a2, a3, d4 = self._a2, self._a3, self._d4
        tx, ty, tz = self._tcp_m
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        x, y, z = position_m[0] - c * tx - s * ty, position_m[1] - s * tx + c * ty, position_m[2] + tz  # the flange
        away_2 = x * x + y * y - d4 * d4
        if not away_2 > 0.0:
            return None
        away = math.copysign(math.sqrt(away_2), x * math.cos(seed_rad[0]) + y * math.sin(seed_rad[0]))
        q1 = math.atan2(y, x) + math.atan2(d4, away)
        side = math.copysign(1.0, math.sin(seed_rad[4]))
        u, w = away - self._d5 * side, z - self._d1 + self._d6  # of wrist 1, in the arm's plane
        cosine = (u * u + w * w - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
        if not abs(cosine) <= 1.0:
            return None
        q3 = math.copysign(math.acos(cosine), math.sin(seed_rad[2]))
        q2 = math.atan2(w, u) - math.atan2(a3 * math.sin(q3), a2 + a3 * cosine)
        q5 = side * QUARTER_RAD
        # The tool's x axis is ((cos q6) z_3 - (sin q6) e) times the wrist's side; e is where the arm's plane points.
        q6 = math.atan2(-side * math.cos(yaw_rad - q1), side * math.sin(q1 - yaw_rad))
        s1, s2, s3, s4, s5, s6 = seed_rad
        return (
            unwound(q1, s1), unwound(q2, s2), unwound(q3, s3),
            unwound(q5 - q2 - q3, s4), unwound(q5, s5), unwound(q6, s6),
        )  # fmt: skip
