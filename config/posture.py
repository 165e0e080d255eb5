"""Where the points that fences are held for are, for given joints. Slow and plain: checks of files stand on it."""

import math
from collections.abc import Sequence

from config.arm import ArmConfig
from config.limits import ArmPart
from config.values import Point

__all__ = ["elbow_point", "part_points", "tilt_rad"]

ELBOW_LINK = 2


def elbow_point(arm: ArmConfig) -> Point:
    """Return the elbow in the frame of link 2: the end of its capsule that lies nearest that frame's origin."""
    ends = [end for capsule in arm.capsules if capsule.link == ELBOW_LINK for end in (capsule.from_m, capsule.to_m)]
    return min(ends, key=lambda end: math.hypot(*end), default=(0.0, 0.0, 0.0))


def part_points(arm: ArmConfig, q_rad: Sequence[float]) -> dict[ArmPart, Point]:
    """Return each part's place for joint angles, base frame, metres."""
    origin = (0.0, 0.0, 0.0)
    return {
        ArmPart.TCP: _carried(arm, q_rad, arm.tool.tcp_m, len(arm.joints)),
        ArmPart.FLANGE: _carried(arm, q_rad, origin, len(arm.joints)),
        ArmPart.ELBOW: _carried(arm, q_rad, elbow_point(arm), ELBOW_LINK),
    }


def tilt_rad(arm: ArmConfig, q_rad: Sequence[float]) -> float:
    """Return the angle between the tool's approach axis and straight down."""
    n = len(arm.joints)
    down = _carried(arm, q_rad, (0.0, 0.0, 0.0), n)[2] - _carried(arm, q_rad, (0.0, 0.0, 1.0), n)[2]
    return math.acos(max(-1.0, min(1.0, down)))


def _carried(arm: ArmConfig, q_rad: Sequence[float], point_m: Point, n_links: int) -> Point:
    """Return a point of a link's frame in the base frame: p_i-1 = Rz(q_i) Tz(d_i) Tx(a_i) Rx(alpha_i) p_i."""
    x, y, z = point_m
    for joint, q in zip(reversed(arm.joints[:n_links]), reversed(tuple(q_rad)[:n_links]), strict=True):
        c, s, ca, sa = math.cos(q), math.sin(q), math.cos(joint.alpha_rad), math.sin(joint.alpha_rad)
        u, v = x + joint.a_m, ca * y - sa * z
        x, y, z = c * u - s * v, s * u + c * v, sa * y + ca * z + joint.d_m
    return x, y, z
