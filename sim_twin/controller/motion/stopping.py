"""How the arm stops as fast as it may: every joint in proportion, so that it stays on its line. Pure."""

import numpy as np

from sim_twin.controller.motion.poses import Array

__all__ = ["STOP_RAD_S2", "stop_path", "stop_time_s"]

STOP_RAD_S2 = np.array([25.0, 8.4, 45.0, 45.0, 45.0, 45.0])
"""With 35 ms of the servo's lag a stop from full speed takes what UR publishes for the CB3 UR5 (J0 0.31 rad in 244 ms,
J1 0.70 in 530, J2 0.22 in 164; UR5e has graphs only). The wrists have no figures: they stop as the elbow does."""


def stop_time_s(qd_rad_s: Array) -> float:
    """Return how long a stop from joint speeds takes.  (6,) -> ()"""
    return float((np.abs(qd_rad_s) / STOP_RAD_S2).max())


def stop_path(q_rad: Array, qd_rad_s: Array) -> tuple[Array, Array]:
    """Return where a stop that begins now is half-way and where it ends.  (6,), (6,) -> (6,), (6,)"""
    way = qd_rad_s * (stop_time_s(qd_rad_s) / 2.0)
    return q_rad + way / 2.0, q_rad + way
