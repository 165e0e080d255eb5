"""What moves and holds the twin's joints behind the controller: how far its servos trail, how hard its brakes hold."""

import mujoco
import numpy as np

__all__ = ["BRAKE_NM", "BRAKE_SOLIMP", "HOLD_NM", "servo_lag_s"]

BRAKE_NM = np.array([60.0, 35.0, 20.5, 6.0, 6.0, 6.0])
"""Torque of brakes that stop a moving arm: with the twin's own tool its distances are those that UR publishes for the
CB3 UR5's category 0 stop (see stopping.STOP_RAD_S2)."""
HOLD_NM = np.array([150.0, 150.0, 150.0, 28.0, 28.0, 28.0])
"""Torque of brakes that hold a standing one."""
BRAKE_SOLIMP = (0.9999, 0.9999)
"""A brake that hardly creeps; MuJoCo's own friction gives way in proportion to the load."""


def servo_lag_s(model: mujoco.MjModel, actuator: int, *, tick_s: float) -> float:
    """Return how far a joint of the twin trails a ramp of set-points: damping over stiffness, delay, half a tick."""
    stiffness, damping = -float(model.actuator_biasprm[actuator, 1]), -float(model.actuator_biasprm[actuator, 2])
    return damping / stiffness + float(model.actuator_delay[actuator]) + tick_s / 2.0
