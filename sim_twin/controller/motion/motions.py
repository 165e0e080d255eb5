"""All motions of one arm behind one door."""

import numpy as np

from config.arm import ArmConfig
from sim_twin.controller.motion.core import MotionCore
from sim_twin.controller.motion.kinematics import ArmKinematics
from sim_twin.controller.motion.moves import Moves
from sim_twin.controller.motion.poses import Array
from sim_twin.controller.motion.servoing import Servoing
from sim_twin.controller.motion.setpoint import USED_SPEED, SetPoint
from sim_twin.controller.motion.speeds import Speeds

__all__ = ["Motions"]


class Motions:
    """What a program may ask of the arm's motion.

    Args:
        arm: The arm's file.
        kinematics: The arm's; may be calibrated.
        q_rad: Where it stands.
        servo_lag_s: How far the servo behind the set-point trails a ramp.

    Attributes:
        core: Set-point, pace, tool, force mode, freedrive, stops; ends each slice.
        setpoint: The set-point.
        moves: movej, movel, movep, movec, servoc.
        servoing: servoj.
        speeds: speedj, speedl, stopj, stopl.
    """

    def __init__(self, arm: ArmConfig, *, kinematics: ArmKinematics, q_rad: Array, servo_lag_s: float) -> None:
        self.setpoint = SetPoint(q_rad)
        self.core = MotionCore(
            kinematics=kinematics,
            setpoint=self.setpoint,
            speed_rad_s=USED_SPEED * np.array([j.speed_rad_s for j in arm.joints]),
            acceleration_rad_s2=np.array([j.acceleration_rad_s2 for j in arm.joints]),
            servo_lag_s=servo_lag_s,
            dead_time_s=arm.servo.dead_time_s,
        )
        self.core.set_tcp((*arm.tool.tcp_m, 0.0, 0.0, 0.0))
        self.moves = Moves(self.core)
        self.servoing = Servoing(self.core)
        self.speeds = Speeds(self.core)
