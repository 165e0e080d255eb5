"""Forward kinematics and Jacobian of a Denavit-Hartenberg table, compiled: every slice asks for both several times.

A slice has 2 ms. In Python a walk down six rows takes 70 us on a busy processor, and there are three of them or more.
"""

import math

import numpy as np

from robot.compiled import Table, compiled
from robot.messages import Vec6

__all__ = ["chain_and_jacobian", "chain_end"]

N_JOINTS = 6


@compiled
def chain_axes(q_rad: Vec6, rows: Table, axes: Table) -> Table:
    """Walk down the rows, write down every joint's axis and origin, and return where the flange is.

    Args:
        q_rad: joint angles.
        rows: (6, 5) of each joint theta (rad), a and d (m), cosine and sine of alpha.
        axes: (6, 6) to be filled with (z, o) of each joint, base axes.

    Returns:
        T_bf, (4, 4).
    """
    xx, xy, xz, yx, yy, yz, zx, zy, zz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    ox, oy, oz = 0.0, 0.0, 0.0
    for i in range(N_JOINTS):
        axes[i, 0], axes[i, 1], axes[i, 2] = zx, zy, zz
        axes[i, 3], axes[i, 4], axes[i, 5] = ox, oy, oz
        angle, a, d, ca, sa = q_rad[i] + rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3], rows[i, 4]
        s, c = math.sin(angle), math.cos(angle)
        ux, uy, uz = c * xx + s * yx, c * xy + s * yy, c * xz + s * yz
        vx, vy, vz = c * yx - s * xx, c * yy - s * xy, c * yz - s * xz
        ox, oy, oz = ox + a * ux + d * zx, oy + a * uy + d * zy, oz + a * uz + d * zz
        xx, xy, xz = ux, uy, uz
        yx, yy, yz = ca * vx + sa * zx, ca * vy + sa * zy, ca * vz + sa * zz
        zx, zy, zz = ca * zx - sa * vx, ca * zy - sa * vy, ca * zz - sa * vz
    T = np.zeros((4, 4))
    T[0, 0], T[0, 1], T[0, 2], T[0, 3] = xx, yx, zx, ox
    T[1, 0], T[1, 1], T[1, 2], T[1, 3] = xy, yy, zy, oy
    T[2, 0], T[2, 1], T[2, 2], T[2, 3] = xz, yz, zz, oz
    T[3, 3] = 1.0
    return T


@compiled
def chain_end(q_rad: Vec6, rows: Table) -> Table:
    """Return T_bf.  (6,), (6, 5) -> (4, 4)"""
    return chain_axes(q_rad, rows, np.empty((6, 6)))


@compiled
def chain_and_jacobian(q_rad: Vec6, rows: Table, T_ft: Table) -> tuple[Table, Table]:
    """Return T_bt and J with (v, w) = J qd at the tool, base axes.  (6,), (6, 5), (4, 4) -> (4, 4), (6, 6)"""
    axes = np.empty((6, 6))
    T_bf = chain_axes(q_rad, rows, axes)
    T, J = np.zeros((4, 4)), np.empty((6, 6))
    for i in range(4):
        for k in range(4):
            for m in range(4):
                T[i, k] += T_bf[i, m] * T_ft[m, k]
    for i in range(N_JOINTS):
        zx, zy, zz = axes[i, 0], axes[i, 1], axes[i, 2]
        rx, ry, rz = T[0, 3] - axes[i, 3], T[1, 3] - axes[i, 4], T[2, 3] - axes[i, 5]
        J[0, i], J[1, i], J[2, i] = zy * rz - zz * ry, zz * rx - zx * rz, zx * ry - zy * rx
        J[3, i], J[4, i], J[5, i] = zx, zy, zz
    return T, J
