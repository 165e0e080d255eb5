"""Where the studio's camera stands and what its lens is like. Data and maths."""

import numpy as np
from numpy.typing import NDArray

from sim_twin.lens import TrueLens, bent_pixels

__all__ = ["EYE_M", "LENS", "TARGET_M", "looking", "nudged", "seen_at"]

Array = NDArray[np.float64]
EYE_M, TARGET_M = (0.98, 0.04, 1.16), (0.435, 0.0, 0.0)
"""Before the table, opposite the arm, 65 degrees above it: over the leaves of open lids one sees into the boxes."""
LENS = TrueLens(
    width_px=1280, height_px=720, focal_px=(918.0, 921.0), centre_px=(652.3, 351.8),
    radial=(-0.11, 0.06), tangential=(0.0011, -0.0007),
)  # fmt: skip


def looking(eye_m: tuple[float, float, float], target_m: tuple[float, float, float]) -> Array:
    """Return T_bc of a camera that looks at a point, up being up.  -> (4, 4)"""
    ahead = np.subtract(target_m, eye_m)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    down = np.cross(ahead, right)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([axis / np.linalg.norm(axis) for axis in (right, down, ahead)])
    T[:3, 3] = eye_m
    return T


def nudged(T_bc: Array, turn_rad: Array, shift_m: Array) -> Array:
    """Return a camera turned a little about its own axes and shifted.  (4, 4), (3,), (3,) -> (4, 4)"""
    x, y, z = turn_rad
    small = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    left, _, right = np.linalg.svd(np.eye(3) + small)
    T = T_bc.copy()
    T[:3, :3], T[:3, 3] = T_bc[:3, :3] @ (left @ right), T_bc[:3, 3] + shift_m
    return T


def seen_at(T_bc: Array, points_m: Array) -> Array:
    """Return the pixels of points of the base frame that are before the camera.  (n, 3) m -> (n, 2) px"""
    local = (points_m - T_bc[:3, 3]) @ T_bc[:3, :3]
    return bent_pixels(LENS, local[:, :2] / local[:, 2:])
