"""Poses as the controller has them: a place in metres and a rotation vector in radians.

A rotation vector points along the axis and is as long as the angle. Rotations are composed as unit quaternions
(w, x, y, z), which stay exact at half a turn, where the logarithm of a matrix does not.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

__all__ = [
    "Matrix3",
    "Pose",
    "Vec3",
    "interpolate_pose",
    "point_dist",
    "pose_add",
    "pose_dist",
    "pose_inv",
    "pose_of",
    "pose_sub",
    "pose_trans",
    "rotation_matrix",
    "rotation_vector",
    "rotvec_from_rpy",
    "rpy_from_rotvec",
    "wrench_trans",
]

Vec3: TypeAlias = tuple[float, float, float]
Matrix3: TypeAlias = tuple[Vec3, Vec3, Vec3]
Vec6: TypeAlias = tuple[float, float, float, float, float, float]
_Quaternion: TypeAlias = tuple[float, float, float, float]


class Pose(NamedTuple):
    """Where a frame stands in another: x, y, z in metres, then the rotation vector in radians."""

    x: float
    y: float
    z: float
    rx: float
    ry: float
    rz: float


def pose_of(six: Sequence[float]) -> Pose:
    """Make a pose of six numbers.  (6,) -> Pose

    Raises:
        ValueError: They are not six.
    """
    if len(six) != 6:
        raise ValueError(f"expected the six numbers of a pose, got {len(six)}")
    return Pose(*(float(number) for number in six))


def pose_trans(T_ab: Pose, T_bc: Pose) -> Pose:
    """Return T_ac = T_ab T_bc."""
    q_ab = _quaternion(T_ab[3:])
    moved = _rotated(q_ab, T_bc[:3])
    at = (T_ab.x + moved[0], T_ab.y + moved[1], T_ab.z + moved[2])
    return Pose(*at, *_log(_product(q_ab, _quaternion(T_bc[3:]))))


def pose_inv(T_ab: Pose) -> Pose:
    """Return T_ba."""
    q_ba = _conjugate(_quaternion(T_ab[3:]))
    x, y, z = _rotated(q_ba, T_ab[:3])
    return Pose(-x, -y, -z, *_log(q_ba))


def pose_add(first: Pose, second: Pose) -> Pose:
    """Add the places and compose the rotations, R = R_first R_second, each in the base frame."""
    q = _product(_quaternion(first[3:]), _quaternion(second[3:]))
    return Pose(first.x + second.x, first.y + second.y, first.z + second.z, *_log(q))


def pose_sub(to: Pose, start: Pose) -> Pose:
    """Return the change from start to `to` in the base frame: places subtracted, R = R_to R_start⁻¹."""
    q = _product(_quaternion(to[3:]), _conjugate(_quaternion(start[3:])))
    return Pose(to.x - start.x, to.y - start.y, to.z - start.z, *_log(q))


def point_dist(first: Pose, second: Pose) -> float:
    """Return the distance between the two places.  -> m"""
    return math.dist(first[:3], second[:3])


def pose_dist(first: Pose, second: Pose) -> float:
    """Return the length of the change of pose, with a radian counted as a metre."""
    return math.hypot(*pose_sub(second, first))


def interpolate_pose(start: Pose, to: Pose, alpha: float) -> Pose:
    """Go the share alpha of the way: places along the line, rotation about one fixed axis. Goes past the ends too."""
    q_start = _quaternion(start[3:])
    turn = _log(_product(_conjugate(q_start), _quaternion(to[3:])))
    q = _product(q_start, _quaternion([alpha * angle for angle in turn]))
    at = [a + alpha * (b - a) for a, b in zip(start[:3], to[:3], strict=True)]
    return Pose(at[0], at[1], at[2], *_log(q))


def rotation_matrix(rotvec: Sequence[float]) -> Matrix3:
    """Return the matrix of a rotation vector, rows first.  (3,) -> (3, 3)"""
    q = _quaternion(rotvec)
    columns = [_rotated(q, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    rows = tuple((columns[0][i], columns[1][i], columns[2][i]) for i in range(3))
    return rows[0], rows[1], rows[2]


def rotation_vector(R: Sequence[Sequence[float]]) -> Vec3:
    """Return the rotation vector of a matrix, at most half a turn long (Shepperd's choice of pivot).  (3, 3) -> (3,)"""
    trace = R[0][0] + R[1][1] + R[2][2]
    if trace > 0.0:
        q = [1.0 + trace, R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]]
    else:
        i = max(range(3), key=lambda k: R[k][k])
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [R[k][j] - R[j][k], 0.0, 0.0, 0.0]
        q[1 + i] = 1.0 + R[i][i] - R[j][j] - R[k][k]
        q[1 + j] = R[j][i] + R[i][j]
        q[1 + k] = R[k][i] + R[i][k]
    norm = math.hypot(*q)
    return _log((q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm))


def rpy_from_rotvec(rotvec: Sequence[float]) -> Vec3:
    """Return roll, pitch, yaw with R = Rz(yaw) Ry(pitch) Rx(roll); at the poles the roll is zero.  (3,) -> (3,)"""
    R = rotation_matrix(rotvec)
    cos_pitch = math.hypot(R[0][0], R[1][0])
    pitch = math.atan2(-R[2][0], cos_pitch)
    if cos_pitch < 1e-9:
        return 0.0, pitch, math.atan2(-R[0][1], R[1][1])
    return math.atan2(R[2][1], R[2][2]), pitch, math.atan2(R[1][0], R[0][0])


def rotvec_from_rpy(rpy: Sequence[float]) -> Vec3:
    """Return the rotation vector of roll, pitch, yaw, R = Rz(yaw) Ry(pitch) Rx(roll).  (3,) -> (3,)"""
    roll, pitch, yaw = rpy
    q_zy = _product(_quaternion((0.0, 0.0, yaw)), _quaternion((0.0, pitch, 0.0)))
    return _log(_product(q_zy, _quaternion((roll, 0.0, 0.0))))


def wrench_trans(T_ab: Pose, wrench_a: Sequence[float]) -> Vec6:
    """Express in frame b, about b's origin, a force and torque given in frame a.  (6,) -> (6,)"""
    fx, fy, fz, tx, ty, tz = wrench_a
    x, y, z = T_ab[:3]
    about_b = (tx - (y * fz - z * fy), ty - (z * fx - x * fz), tz - (x * fy - y * fx))
    q_ba = _conjugate(_quaternion(T_ab[3:]))
    return (*_rotated(q_ba, (fx, fy, fz)), *_rotated(q_ba, about_b))


def _quaternion(rotvec: Sequence[float]) -> _Quaternion:
    x, y, z = rotvec
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < 1e-150:  # below this the squares vanish
        return 1.0, 0.5 * x, 0.5 * y, 0.5 * z
    scale = math.sin(0.5 * angle) / angle
    return math.cos(0.5 * angle), scale * x, scale * y, scale * z


def _log(q: _Quaternion) -> Vec3:
    """Return the rotation vector of a unit quaternion, at most half a turn long."""
    w, x, y, z = q
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < 1e-150:
        return 2.0 * x, 2.0 * y, 2.0 * z
    if w < 0.0:
        w, sine_sign = -w, -1.0
    else:
        sine_sign = 1.0
    scale = sine_sign * 2.0 * math.atan2(sine, w) / sine
    return scale * x, scale * y, scale * z


def _product(p: _Quaternion, q: _Quaternion) -> _Quaternion:
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def _conjugate(q: _Quaternion) -> _Quaternion:
    return q[0], -q[1], -q[2], -q[3]


def _rotated(q: _Quaternion, v: Sequence[float]) -> Vec3:
    x, y, z = v
    _, a, b, c = _product(_product(q, (0.0, x, y, z)), _conjugate(q))
    return a, b, c
