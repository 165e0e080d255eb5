"""Forward and inverse kinematics, and whether a place is allowed."""

import numpy as np

from sim_twin.controller.builtins.moving import as_list, as_pose
from sim_twin.controller.machine import Machine
from sim_twin.controller.motion import KinematicsError
from sim_twin.controller.motion.poses import Array
from sim_twin.controller.pose import Pose
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import number, vector
from sim_twin.controller.script.builtins import pose as as_given

__all__ = ["kinematics_builtins"]

_ACTIVE = "active_tcp"


def kinematics_builtins(machine: Machine) -> Builtins:
    """Return the questions about joints and poses; without joints they are those of now."""
    drive = machine.drive
    kinematics, core = drive.kinematics, drive.core

    def tool(tcp: Value) -> Array:
        return core.tcp_offset if tcp is None or tcp == _ACTIVE else np.array(as_given(tcp))

    def get_forward_kin(q: Value = None, tcp: Value = None) -> Value:
        joints = drive.measured.q_rad if q is None else np.array(vector(q, 6))
        return as_pose(kinematics.pose(joints, tool(tcp)))

    def get_inverse_kin(
        x: Value,
        qnear: Value = None,
        maxPositionError: Value = 1e-10,  # noqa: N803 - UR's name
        maxOrientationError: Value = 1e-10,  # noqa: N803 - UR's name
        tcp: Value = _ACTIVE,
    ) -> Value:
        number(maxPositionError)
        number(maxOrientationError)
        near = drive.measured.q_rad if qnear is None else np.array(vector(qnear, 6))
        return as_list(kinematics.inverse(vector(as_given(x), 6), near, tool(tcp)))

    def get_inverse_kin_has_solution(
        pose: Value,
        qnear: Value = None,
        maxPositionError: Value = 1e-10,  # noqa: N803, ARG001 - UR's name
        maxOrientationError: Value = 1e-10,  # noqa: N803, ARG001 - UR's name
        tcp: Value = _ACTIVE,
    ) -> Value:
        near = drive.measured.q_rad if qnear is None else np.array(vector(qnear, 6))
        return kinematics.has_solution(vector(as_given(pose), 6), near, tool(tcp))

    def is_within_safety_limits(position: Value, qNear: Value = None) -> Value:  # noqa: N803 - UR's name
        near = drive.measured.q_rad if qNear is None else np.array(vector(qNear, 6))
        aim = vector(position, 6)
        try:
            joints = kinematics.inverse(aim, near, core.tcp_offset) if type(position) is Pose else np.array(aim)
        except KinematicsError:
            return False
        limits = drive.limits
        tool_m = core.tool_at(joints)[:3, 3]
        is_reached = bool((joints >= limits.q_min_rad).all() and (joints <= limits.q_max_rad).all())
        return is_reached and all(float(np.dot(p.normal, tool_m)) >= p.offset_m for p in limits.planes)

    return {
        "get_forward_kin": get_forward_kin,
        "get_inverse_kin": get_inverse_kin,
        "get_inverse_kin_has_solution": get_inverse_kin_has_solution,
        "is_within_safety_limits": is_within_safety_limits,
    }
