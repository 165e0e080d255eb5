"""Small pure functions on points, turns and the tool's frame, in plain floats."""

import math
from collections.abc import Sequence

from robot.compiled import compiled
from robot.messages import Quat, Vec3, Vec6

__all__ = [
    "between",
    "difference",
    "inside_box",
    "quat_of_rotation_vector",
    "rotated",
    "stepped",
    "tool_offset",
    "turn_about_vertical",
    "unwound",
    "vec6",
]


def tool_offset(point_m: Vec3, tcp_m: Vec3, yaw_rad: float) -> Vec3:
    """Return where a point lies seen from a tool that points down: (across the pads, along the jaws, below).

    At yaw 0 the first axis is the base's x, the second its -y; the third is positive below the tool centre point.
    """
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    dx, dy = point_m[0] - tcp_m[0], point_m[1] - tcp_m[1]
    return c * dx + s * dy, s * dx - c * dy, tcp_m[2] - point_m[2]


@compiled
def inside_box(point_m: Vec3, low_m: Vec3, high_m: Vec3) -> bool:
    """Return whether a point lies in an axis-aligned box; a point that is not finite does not."""
    return (
        low_m[0] <= point_m[0] <= high_m[0]
        and low_m[1] <= point_m[1] <= high_m[1]
        and low_m[2] <= point_m[2] <= high_m[2]
    )


@compiled
def turn_about_vertical(quat: Quat) -> float:
    """Return the yaw in (-pi, pi] of a unit quaternion, scalar first: the angle of its turned x axis in the plane."""
    w, x, y, z = quat
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def quat_of_rotation_vector(rx: float, ry: float, rz: float) -> Quat:
    """Return the unit quaternion, scalar first, of a turn by the vector's length about its direction."""
    angle = math.sqrt(rx * rx + ry * ry + rz * rz)
    if angle < 1e-12:
        return 1.0, rx / 2.0, ry / 2.0, rz / 2.0
    share = math.sin(angle / 2.0) / angle
    return math.cos(angle / 2.0), rx * share, ry * share, rz * share


def rotated(vector: Vec3, quat: Quat) -> Vec3:
    """Return a vector turned by a unit quaternion, scalar first: v + 2 w (u x v) + 2 u x (u x v)."""
    w, a, b, c = quat
    x, y, z = vector
    p, q, r = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return x + w * p + b * r - c * q, y + w * q + c * p - a * r, z + w * r + a * q - b * p


@compiled
def unwound(angle: float, reference: float) -> float:
    """Return the angle plus the whole turns that bring it nearest a reference."""
    return angle - math.tau * round((angle - reference) / math.tau)


@compiled
def stepped(q: Vec6, step: Vec6, share: float) -> Vec6:
    """Return joints a share of a step farther."""
    (a, b, c, d, e, f), (u, v, w, x, y, z) = q, step
    return a + share * u, b + share * v, c + share * w, d + share * x, e + share * y, f + share * z


@compiled
def difference(a: Vec6, b: Vec6) -> Vec6:
    """Return the step from joints b to joints a."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5]


@compiled
def between(a: Vec6, b: Vec6, share: float) -> Vec6:
    """Return joints a share of the way from a to b, beyond b where it is more than 1."""
    return stepped(a, difference(b, a), share)


def vec6(values: Sequence[float]) -> Vec6:
    """Return six numbers as a tuple.  (6,) -> (6,)"""
    return values[0], values[1], values[2], values[3], values[4], values[5]
