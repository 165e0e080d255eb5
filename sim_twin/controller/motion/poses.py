"""UR poses: a position in metres and a rotation vector in radians, and the rotations that they stand for.

Rotations are 3x3 arrays inside; a UR pose is six numbers (x, y, z, rx, ry, rz).
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robot.messages import Vec6
from sim_twin.controller.motion.sensed import turn_of

__all__ = [
    "Array",
    "between",
    "inverse",
    "length",
    "matrix_from_pose",
    "pose_from_matrix",
    "pose_inv",
    "pose_trans",
    "rotation",
    "rotation_vector",
    "six",
    "vec6",
]

Array = NDArray[np.floating[Any]]


def vec6(values: Sequence[float] | Array, what: str = "joints") -> Array:
    """Return six finite numbers as an array of their own.  (6,) -> (6,)

    Raises:
        ValueError: not six, or not finite.
    """
    array = np.array(values, dtype=np.float64)
    if array.shape != (6,) or not np.isfinite(array).all():
        raise ValueError(f"{what}: expected six finite numbers, got {values!r}; check the list or pose given")
    return array


def six(values: Sequence[float] | Array) -> Vec6:
    """Return six numbers, finite or not, as machine code takes them.  (6,) -> (6,)"""
    a, b, c, d, e, f = values.tolist() if isinstance(values, np.ndarray) else map(float, values)
    return a, b, c, d, e, f


def length(vector: Array) -> float:
    """Return the Euclidean length, as `np.linalg.norm` does in a fifth of its time.  (n,) -> ()"""
    return math.sqrt(vector.dot(vector))


def rotation(vector: Sequence[float] | Array) -> Array:
    """Return R of a rotation vector (Rodrigues).  (3,) -> (3, 3)"""
    x, y, z = (float(v) for v in vector)
    angle = math.sqrt(x * x + y * y + z * z)
    # Their series near zero keep the tenth digit where the quotients lose it.
    s = math.sin(angle) / angle if angle > 1e-6 else 1.0 - angle * angle / 6.0
    k = 2.0 * math.sin(angle / 2.0) ** 2 / angle**2 if angle > 1e-6 else 0.5
    return np.array(
        [
            [1.0 - k * (y * y + z * z), k * x * y - s * z, k * x * z + s * y],
            [k * x * y + s * z, 1.0 - k * (x * x + z * z), k * y * z - s * x],
            [k * x * z - s * y, k * y * z + s * x, 1.0 - k * (x * x + y * y)],
        ]
    )


def rotation_vector(R: Array) -> Array:
    """Return the rotation vector of R, at most half a turn long.  (3, 3) -> (3,)"""
    return np.array(turn_of(np.ascontiguousarray(R, dtype=np.float64)))


def matrix_from_pose(pose: Sequence[float] | Array) -> Array:
    """Return T of a UR pose.  (6,) -> (4, 4)"""
    T = np.eye(4)
    T[:3, :3] = rotation(pose[3:])
    T[:3, 3] = pose[:3]
    return T


def pose_from_matrix(T: Array) -> Array:
    """Return the UR pose of T.  (4, 4) -> (6,)"""
    return np.array([T[0, 3], T[1, 3], T[2, 3], *turn_of(np.ascontiguousarray(T, dtype=np.float64))])


def pose_trans(a: Sequence[float] | Array, b: Sequence[float] | Array) -> Array:
    """Return pose b, given in the frame of pose a, in the frame that a is given in.  (6,), (6,) -> (6,)"""
    return pose_from_matrix(matrix_from_pose(a) @ matrix_from_pose(b))


def pose_inv(pose: Sequence[float] | Array) -> Array:
    """Return the inverse of a pose.  (6,) -> (6,)"""
    return pose_from_matrix(inverse(matrix_from_pose(pose)))


def inverse(T: Array) -> Array:
    """Return the inverse of a rigid transform.  (4, 4) -> (4, 4)"""
    out = np.eye(4)
    out[:3, :3] = T[:3, :3].T
    out[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return out


def between(T_from: Array, T_to: Array) -> tuple[Array, Array]:
    """Return the translation and the rotation vector, both in base axes, that lead from one to the other."""
    return T_to[:3, 3] - T_from[:3, 3], rotation_vector(T_to[:3, :3] @ T_from[:3, :3].T)
