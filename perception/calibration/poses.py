"""Turns and rigid transforms as matrices. T_ab maps coordinates in b to a. Pure maths."""

import numpy as np

from config.values import Point, Section
from perception.calibration.lens import Array
from robot.messages import Quat

__all__ = [
    "Pose",
    "carried",
    "inverse",
    "matrix_of",
    "mean_transform",
    "nearest_turn",
    "pose_of",
    "rigid_fit",
    "rotation",
    "rotation_vector",
    "spread_deg",
    "transform",
]

TINY = 1e-12


class Pose(Section, frozen=True, kw_only=True):
    """Where a frame is and how it is turned, in the frame that it is named in."""

    position_m: Point
    quat: Quat
    """Scalar first, of length 1."""


def rotation(vector: Array) -> Array:
    """Return the turn by a vector's length about its direction (Rodrigues).  (3,) rad -> (3, 3)"""
    angle = float(np.linalg.norm(vector))
    cross = np.array([[0.0, -vector[2], vector[1]], [vector[2], 0.0, -vector[0]], [-vector[1], vector[0], 0.0]])
    if angle < TINY:
        return np.eye(3) + cross
    return np.eye(3) + np.sin(angle) / angle * cross + (1.0 - np.cos(angle)) / angle**2 * (cross @ cross)


def rotation_vector(R: Array) -> Array:
    """Return the vector whose turn a matrix is, of length 0 to pi.  (3, 3) -> (3,) rad"""
    w, x, y, z = _quat(R)
    sine = float(np.sqrt(x * x + y * y + z * z))
    if sine < TINY:
        return 2.0 * np.array([x, y, z])
    return 2.0 * np.arctan2(sine, w) / sine * np.array([x, y, z])


def transform(R: Array, position_m: Array) -> Array:
    """Return turn and position as one matrix.  (3, 3), (3,) -> (4, 4)"""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, position_m
    return T


def inverse(T: Array) -> Array:
    """Return T_ba for T_ab."""
    return transform(T[:3, :3].T, -T[:3, :3].T @ T[:3, 3])


def carried(T_ab: Array, points_b: Array) -> Array:
    """Return points of frame b in frame a.  (4, 4), (n, 3) -> (n, 3)"""
    return points_b @ T_ab[:3, :3].T + T_ab[:3, 3]


def matrix_of(pose: Pose) -> Array:
    """Return a pose as a matrix, its quaternion brought to length 1."""
    w, x, y, z = np.array(pose.quat) / np.linalg.norm(pose.quat)
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return transform(R, np.array(pose.position_m))


def pose_of(T: Array) -> Pose:
    """Return a matrix as a pose."""
    w, x, y, z = _quat(T[:3, :3]).tolist()
    px, py, pz = T[:3, 3].tolist()
    return Pose(position_m=(px, py, pz), quat=(w, x, y, z))


def rigid_fit(points_b: Array, points_a: Array) -> tuple[Array, float]:
    """Return T_ab that brings points of b to those of a in least squares, and by what they would have to be stretched.

    Umeyama, "Least-squares estimation of transformation parameters between two point patterns", IEEE PAMI 13(4), 1991;
    the transform is the rigid one, without the scale.  (n, 3), (n, 3) -> (4, 4), ()
    """
    mean_b, mean_a = points_b.mean(axis=0), points_a.mean(axis=0)
    b, a = points_b - mean_b, points_a - mean_a
    mixed = a.T @ b
    R = nearest_turn(mixed)
    scale = float(np.trace(R.T @ mixed) / max((b * b).sum(), TINY))
    return transform(R, mean_a - R @ mean_b), scale


def mean_transform(transforms: list[Array]) -> Array:
    """Return the transform in the middle of several: mean position, and the turn nearest the mean matrix."""
    R = nearest_turn(np.mean([T[:3, :3] for T in transforms], axis=0))
    return transform(R, np.mean([T[:3, 3] for T in transforms], axis=0))


def nearest_turn(mixed: Array) -> Array:
    """Return the turn nearest a matrix: of its singular vectors, the least one flipped where they make a reflection."""
    left, _, right = np.linalg.svd(mixed)
    return left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right


def spread_deg(directions: Array) -> tuple[float, float]:
    """Return how far unit vectors spread about their mean, rms along the widest and the next direction.  (n, 3)"""
    values = np.linalg.svd(directions - directions.mean(axis=0), compute_uv=False) / np.sqrt(len(directions))
    return float(np.degrees(values[0])), float(np.degrees(values[1]))


def _quat(R: Array) -> Array:
    """Return a turn as a quaternion, scalar first and not negative, from the greatest of its four components."""
    trace = np.trace(R)
    squares = np.array([trace, R[0, 0], R[1, 1], R[2, 2]])
    i = int(np.argmax(squares))
    if i == 0:
        q = np.array([1.0 + trace, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    elif i == 1:
        q = np.array([R[2, 1] - R[1, 2], 1.0 + 2 * R[0, 0] - trace, R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]])
    elif i == 2:
        q = np.array([R[0, 2] - R[2, 0], R[0, 1] + R[1, 0], 1.0 + 2 * R[1, 1] - trace, R[1, 2] + R[2, 1]])
    else:
        q = np.array([R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], 1.0 + 2 * R[2, 2] - trace])
    q /= np.linalg.norm(q)
    return -q if q[0] < 0.0 else q
