"""What encoders tell of the tool every slice, compiled: pose, speed and the flange's acceleration in one go."""

import math

import numpy as np

from robot.compiled import Table, compiled
from robot.messages import Vec3, Vec6
from sim_twin.controller.motion.chain import chain_and_jacobian

__all__ = ["PER_SLICE", "tool_motion", "turn_of"]

PER_SLICE = 500.0
"""Slices a second."""
TINY = 1e-12


@compiled
def turn_of(R: Table) -> Vec3:
    """Return the rotation vector of R, at most half a turn long, by way of its quaternion.  (n, n), n >= 3 -> (3,)"""
    a, b, c, d, e, f, g, h, i = R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2], R[2, 0], R[2, 1], R[2, 2]
    # Shepperd: divide by the greatest component of the quaternion.
    of_w, of_x, of_y, of_z = 1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i
    largest = max(of_w, of_x, of_y, of_z)
    scale = 0.5 / math.sqrt(largest)
    if of_w == largest:
        w, x, y, z = of_w, h - f, c - g, d - b
    elif of_x == largest:
        w, x, y, z = h - f, of_x, d + b, c + g
    elif of_y == largest:
        w, x, y, z = c - g, d + b, of_y, h + f
    else:
        w, x, y, z = d - b, c + g, h + f, of_z
    x, y, z = scale * x, scale * y, scale * z
    sine, cosine = math.sqrt(x * x + y * y + z * z), scale * w
    if sine < TINY:
        return 2.0 * x, 2.0 * y, 2.0 * z
    # A quaternion and its negative are the same turn: take the shorter way.
    k = 2.0 * (math.atan2(sine, cosine) if cosine >= 0.0 else math.atan2(-sine, -cosine)) / sine
    return k * x, k * y, k * z


@compiled
def tool_motion(q_rad: Vec6, qd_rad_s: Vec6, rows: Table, T_ft: Table, before: Table) -> Table:
    """Return how the tool and the flange move.

    Args:
        q_rad: joint angles.
        qd_rad_s: their speeds.
        rows: (6, 5) of the arm's chain, as `chain_end` takes them.
        T_ft: (4, 4) the tool.
        before: what this returned a slice ago.

    Returns:
        (3, 6): the tool's UR pose; its (v, w); the flange's acceleration and its velocity. Base axes.
    """
    T, J = chain_and_jacobian(q_rad, rows, T_ft)
    out = np.zeros((3, 6))
    turn = turn_of(T)
    for k in range(3):
        out[0, k], out[0, 3 + k] = T[k, 3], turn[k]
    for k in range(6):
        for i in range(6):
            out[1, k] += J[k, i] * qd_rad_s[i]
    # From the tool back to the flange, p = -R_bf t_ft.
    own = np.zeros(3)
    for i in range(3):
        for k in range(3):
            own[i] += T_ft[k, i] * T_ft[k, 3]
    p = np.zeros(3)
    for i in range(3):
        for k in range(3):
            p[i] -= T[i, k] * own[k]
    wx, wy, wz = out[1, 3], out[1, 4], out[1, 5]
    out[2, 3] = out[1, 0] + (wy * p[2] - wz * p[1])
    out[2, 4] = out[1, 1] + (wz * p[0] - wx * p[2])
    out[2, 5] = out[1, 2] + (wx * p[1] - wy * p[0])
    for k in range(3):
        out[2, k] = (out[2, 3 + k] - before[2, 3 + k]) * PER_SLICE
    return out
