"""Forward kinematics of the tool's axis, for the loops that run every tick: compiled, and about 1 us from Python.

A point is carried down the Denavit-Hartenberg chain row by row: p_i-1 = Rz(q_i) Tz(d_i) Tx(a_i) Rx(alpha_i) p_i.
"""

import math

import numpy as np

from config.arm import ArmConfig
from config.posture import elbow_point
from robot.compiled import Table, compiled
from robot.messages import Quat, Vec3, Vec6

__all__ = ["Points", "ToolChain", "chain_points", "chain_tcp", "lowest_fingertip"]

N_JOINTS = 6
N_TO_ELBOW = 2
"""Joints that move the elbow."""

Points = tuple[Vec3, Vec3, Vec3]
"""Tool centre point, flange and elbow, base frame, metres."""


@compiled
def carried(point: Vec3, q: float, rows: Table, i: int) -> Vec3:
    """Return a point, or where it is seen from, one row nearer to the base."""
    a, d, ca, sa = rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]
    s, c = math.sin(q), math.cos(q)
    u, v = point[0] + a, ca * point[1] - sa * point[2]
    return c * u - s * v, s * u + c * v, sa * point[1] + ca * point[2] + d


@compiled
def chain_tcp(q_rad: Vec6, rows: Table, tcp_m: Vec3) -> Vec3:
    """Return the tool centre point, base frame, metres."""
    point = tcp_m
    for k in range(N_JOINTS):
        i = N_JOINTS - 1 - k
        point = carried(point, q_rad[i], rows, i)
    return point


@compiled
def chain_points(q_rad: Vec6, rows: Table, tcp_m: Vec3, elbow_m: Vec3) -> tuple[Points, float]:
    """Return tool centre point, flange and elbow, and the cosine between the approach axis and straight down.

    Args:
        q_rad: joint angles.
        rows: (6, 4) of each joint a and d in metres, cosine and sine of alpha.
        tcp_m: the tool centre point in the flange's frame.
        elbow_m: the elbow in its link's frame.
    """
    tcp, flange, above, elbow = tcp_m, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), elbow_m
    for k in range(N_JOINTS):
        i = N_JOINTS - 1 - k
        tcp = carried(tcp, q_rad[i], rows, i)
        flange = carried(flange, q_rad[i], rows, i)
        above = carried(above, q_rad[i], rows, i)
        if i < N_TO_ELBOW:
            elbow = carried(elbow, q_rad[i], rows, i)
    return (tcp, flange, elbow), flange[2] - above[2]


@compiled
def lowest_fingertip(tcp_m: Vec3, down: float, tip_m: float, finger_m: float) -> float:
    """Return the height of the lowest fingertip of an open hand, base frame, metres.

    A tilted tool's lower finger hangs below the point between the tips by its reach times the sine of the tilt.

    Args:
        tcp_m: the tool centre point.
        down: cosine of the angle between the approach axis and straight down.
        tip_m: how far the tips are beyond the tool centre point.
        finger_m: how far aside of it a finger reaches.
    """
    return tcp_m[2] - down * tip_m - finger_m * math.sqrt(max(0.0, 1.0 - down * down))


class ToolChain:
    """One arm's chain.

    Attributes:
        rows: (6, 4) of each joint a and d in metres, cosine and sine of alpha.
        tcp_m: Tool centre point in the flange's frame.
        elbow_m: The elbow in its link's frame.
        tip_m: How far the fingertips are beyond the tool centre point.
        finger_m: How far aside of it a finger of an open hand reaches.
    """

    def __init__(self, arm: ArmConfig) -> None:
        self.rows = np.array([(j.a_m, j.d_m, math.cos(j.alpha_rad), math.sin(j.alpha_rad)) for j in arm.joints])
        self._half_twists = tuple((math.cos(j.alpha_rad / 2), math.sin(j.alpha_rad / 2)) for j in arm.joints)
        self.tcp_m, self.elbow_m = arm.tool.tcp_m, elbow_point(arm)
        self.tip_m = arm.tool.tip_below_tcp_m
        self.finger_m = arm.tool.stroke_m / 2 + arm.tool.pad_size_m[0]

    def tcp(self, q_rad: Vec6) -> Vec3:
        """Return the tool centre point for joint angles, base frame, metres."""
        return chain_tcp(q_rad, self.rows, self.tcp_m)

    def points(self, q_rad: Vec6) -> tuple[Points, float]:
        """Return tool centre point, flange and elbow, and how far the tool points down, -1 to 1 (chain_points)."""
        return chain_points(q_rad, self.rows, self.tcp_m, self.elbow_m)

    def lowest_m(self, tcp_m: Vec3, down: float) -> float:
        """Return the height of the lowest fingertip, metres, from what `points` returns (lowest_fingertip)."""
        return lowest_fingertip(tcp_m, down, self.tip_m, self.finger_m)

    def tcp_and_lowest(self, q_rad: Vec6) -> tuple[Vec3, float]:
        """Return the tool centre point and the height of the lowest fingertip of an open hand, base frame, metres."""
        (tcp, _, _), down = self.points(q_rad)
        return tcp, self.lowest_m(tcp, down)

    def quat(self, q_rad: Vec6) -> Quat:
        """Return the tool's turn, scalar first: the product of Rz(q_i) Rx(alpha_i) as unit quaternions."""
        w, x, y, z = 1.0, 0.0, 0.0, 0.0
        for q, (ca, sa) in zip(q_rad, self._half_twists, strict=True):
            c, s = math.cos(q / 2), math.sin(q / 2)
            w, x, y, z = c * w - s * z, c * x + s * y, c * y - s * x, c * z + s * w
            w, x, y, z = ca * w - sa * x, ca * x + sa * w, ca * y + sa * z, ca * z - sa * y
        return w, x, y, z
