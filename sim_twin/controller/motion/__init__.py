"""Motion of the virtual controller: set-points 500 times a second, and the twin that follows them."""

from sim_twin.controller.motion.contact import ContactWatch
from sim_twin.controller.motion.core import Motion, MotionConflictError, MotionCore
from sim_twin.controller.motion.drive import TwinDrive
from sim_twin.controller.motion.force import ForceKind, ForceTask
from sim_twin.controller.motion.kinematics import (
    ArmKinematics,
    DhRow,
    KinematicsError,
    NoSolutionError,
    SingularError,
    calibrated,
    dh_rows,
)
from sim_twin.controller.motion.limits import Breach, Cause, Plane, SafetyLimits, default_limits
from sim_twin.controller.motion.measured import Measured
from sim_twin.controller.motion.motions import Motions
from sim_twin.controller.motion.paths import PathError
from sim_twin.controller.motion.poses import pose_inv, pose_trans
from sim_twin.controller.motion.setpoint import SLICE_S, Pace, SetPoint

__all__ = [
    "SLICE_S",
    "ArmKinematics",
    "Breach",
    "Cause",
    "ContactWatch",
    "DhRow",
    "ForceKind",
    "ForceTask",
    "KinematicsError",
    "Measured",
    "Motion",
    "MotionConflictError",
    "MotionCore",
    "Motions",
    "NoSolutionError",
    "Pace",
    "PathError",
    "Plane",
    "SafetyLimits",
    "SetPoint",
    "SingularError",
    "TwinDrive",
    "calibrated",
    "default_limits",
    "dh_rows",
    "pose_inv",
    "pose_trans",
]
