"""Joints of a UR arm whose tool points straight down, in closed form and plain floats.

Of the eight solutions (Hawkins 2013, "Analytic Inverse Kinematics for the Universal Robots UR-5/UR-10 Arms") a tool
that points down leaves simple ones: wrist 2 stands at a right angle, shoulder, elbow and wrist 1 are a triangle in the
arm's plane. At ticks of 2 ms placo finds the code and data of a general solver gone from the caches, and takes five
times as long as in a loop of its own.
"""

import math

import numpy as np

from config.arm import ArmConfig
from robot.chain import ToolChain, chain_tcp
from robot.compiled import Table, compiled
from robot.geometry import unwound
from robot.messages import Vec3, Vec6

__all__ = ["TOLERANCE_M", "DownwardArm", "downward_joints", "near_joints"]

TINY = 1e-9
TOLERANCE_M = 1e-5
"""An answer is off by no more than this."""
NEIGHBOUR_RAD = 0.2
"""The closed form keeps to its seed's side of shoulder, elbow and wrist: farther off the nearest may be others."""
QUARTER_RAD = math.pi / 2.0
TWISTS_RAD = (QUARTER_RAD, 0.0, 0.0, QUARTER_RAD, -QUARTER_RAD, 0.0)
HAS_LENGTH = (False, True, True, False, False, False)
HAS_OFFSET = (True, False, False, True, True, True)


Lengths = tuple[float, float, float, float, float, float]
"""a of links 2 and 3, d of links 1, 4, 5 and 6, metres."""


@compiled
def downward_joints(
    position_m: Vec3, yaw_rad: float, seed_rad: Vec6, lengths: Lengths, tcp_m: Vec3
) -> tuple[bool, Vec6]:
    """Return whether joints bring the tool, pointing down, to a position, and which.

    Args:
        position_m: tool centre point, base frame.
        yaw_rad: turn of the tool about the vertical, as in `robot.description.tool_down`.
        seed_rad: its shoulder, elbow and wrist are kept to the side that they are on, and every joint to its turn.
        lengths: the arm's.
        tcp_m: the tool centre point in the flange's frame.
    """
    a2, a3, d1, d4, d5, d6 = lengths
    tx, ty, tz = tcp_m
    s1, s2, s3, s4, s5, s6 = seed_rad
    if not math.isfinite(position_m[0] + position_m[1] + position_m[2] + yaw_rad + s1 + s2 + s3 + s4 + s5 + s6):
        return False, seed_rad
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    x, y, z = position_m[0] - c * tx - s * ty, position_m[1] - s * tx + c * ty, position_m[2] + tz  # the flange
    away_2 = x * x + y * y - d4 * d4
    if not away_2 > 0.0:
        return False, seed_rad
    away = math.copysign(math.sqrt(away_2), x * math.cos(s1) + y * math.sin(s1))
    q1 = math.atan2(y, x) + math.atan2(d4, away)
    side = math.copysign(1.0, math.sin(s5))
    u, w = away - d5 * side, z - d1 + d6  # of wrist 1, in the arm's plane
    cosine = (u * u + w * w - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
    if not abs(cosine) <= 1.0:
        return False, seed_rad
    q3 = math.copysign(math.acos(cosine), math.sin(s3))
    q2 = math.atan2(w, u) - math.atan2(a3 * math.sin(q3), a2 + a3 * cosine)
    q5 = side * QUARTER_RAD
    # The tool's x axis is ((cos q6) z_3 - (sin q6) e) times the wrist's side; e is where the arm's plane points.
    q6 = math.atan2(-side * math.cos(yaw_rad - q1), side * math.sin(q1 - yaw_rad))
    return True, (
        unwound(q1, s1), unwound(q2, s2), unwound(q3, s3),
        unwound(q5 - q2 - q3, s4), unwound(q5, s5), unwound(q6, s6),
    )  # fmt: skip


@compiled
def near_joints(
    position_m: Vec3, yaw_rad: float, seed_rad: Vec6, lengths: Lengths, tcp_m: Vec3, rows: Table, low: Vec6, high: Vec6
) -> tuple[bool, Vec6]:
    """Return the same, proved: within range, near the seed, and leading there by the chain.

    The arguments of `downward_joints`, the rows of the chain, and each joint's least and greatest angle.
    """
    is_found, q_rad = downward_joints(position_m, yaw_rad, seed_rad, lengths, tcp_m)
    if not is_found:
        return False, seed_rad
    for q, seed, least, most in zip(q_rad, seed_rad, low, high):  # noqa: B905 - compiled: of one length by their types
        if not (abs(q - seed) <= NEIGHBOUR_RAD and least <= q <= most):
            return False, seed_rad
    x, y, z = chain_tcp(q_rad, rows, tcp_m)
    dx, dy, dz = x - position_m[0], y - position_m[1], z - position_m[2]
    return dx * dx + dy * dy + dz * dz <= TOLERANCE_M * TOLERANCE_M, q_rad


class DownwardArm:
    """Inverse kinematics of one arm for a tool that points down.

    Args:
        arm: The arm's file; one that `fits`.

    Attributes:
        reach: (3, 6) the arm's lengths, each joint's least angle and its greatest.
    """

    def __init__(self, arm: ArmConfig) -> None:
        rows = arm.joints
        self._lengths = (rows[1].a_m, rows[2].a_m, rows[0].d_m, rows[3].d_m, rows[4].d_m, rows[5].d_m)
        self._tcp_m, self._rows = arm.tool.tcp_m, ToolChain(arm).rows
        a, b, c, d, e, f = (joint.range_rad for joint in rows)
        self._low_rad = (a[0], b[0], c[0], d[0], e[0], f[0])
        self._high_rad = (a[1], b[1], c[1], d[1], e[1], f[1])
        self.reach: Table = np.array([self._lengths, self._low_rad, self._high_rad])

    @staticmethod
    def fits(arm: ArmConfig) -> bool:
        """Return whether an arm's rows are those of the UR family: three parallel axes and a wrist at right angles."""
        return all(
            abs(row.alpha_rad - twist) < TINY and (has_a or not row.a_m) and (has_d or not row.d_m)
            for row, twist, has_a, has_d in zip(arm.joints, TWISTS_RAD, HAS_LENGTH, HAS_OFFSET, strict=True)
        )

    def solve(self, position_m: Vec3, yaw_rad: float, seed_rad: Vec6) -> Vec6 | None:
        """Return the joints that bring the tool, pointing down, to a position; None where none do (downward_joints)."""
        is_found, q_rad = downward_joints(position_m, yaw_rad, seed_rad, self._lengths, self._tcp_m)
        return q_rad if is_found else None

    def near(self, position_m: Vec3, yaw_rad: float, seed_rad: Vec6) -> Vec6 | None:
        """Return the same where they are near the seed, within range and lead there; otherwise None (near_joints)."""
        is_found, q_rad = near_joints(
            position_m, yaw_rad, seed_rad, self._lengths, self._tcp_m, self._rows, self._low_rad, self._high_rad
        )
        return q_rad if is_found else None
