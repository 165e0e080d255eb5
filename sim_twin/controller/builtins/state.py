"""What the arm does: measured and asked for."""

from sim_twin.controller.builtins.moving import as_list, as_pose
from sim_twin.controller.machine import Machine
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import integer

__all__ = ["CONTROLLER_C", "JOINT_C", "state_builtins"]

CONTROLLER_C, JOINT_C, TOOL_C = 35.0, 30.0, 30.0
"""Temperatures: the twin has none, these are a quiet robot's."""


def state_builtins(machine: Machine) -> Builtins:
    """Return the getters."""
    return {**_measured(machine), **_asked(machine), **_housekeeping(machine)}


def _measured(machine: Machine) -> Builtins:
    drive = machine.drive

    def get_actual_joint_positions() -> Value:
        return as_list(drive.measured.q_rad)

    def get_actual_joint_speeds() -> Value:
        return as_list(drive.measured.qd_rad_s)

    def get_actual_joint_positions_history(steps: Value = 0) -> Value:
        return as_list(drive.joint_history(integer(steps)))

    def get_actual_tcp_pose() -> Value:
        return as_pose(drive.measured.tcp_pose)

    def get_actual_tcp_speed() -> Value:
        return as_pose(drive.measured.tcp_speed)

    def get_actual_tool_flange_pose() -> Value:
        return as_pose(drive.kinematics.pose(drive.measured.q_rad))

    def get_joint_torques() -> Value:
        # UR takes off what the arm needs for itself; the twin's weight is carried apart from its servos.
        return as_list(machine.world.data.qfrc_actuator[:6])

    def get_tool_accelerometer_reading() -> Value:
        return list[Value](machine.tool_acceleration())

    return {
        "get_actual_joint_positions": get_actual_joint_positions,
        "get_actual_joint_positions_history": get_actual_joint_positions_history,
        "get_actual_joint_speeds": get_actual_joint_speeds,
        "get_actual_tcp_pose": get_actual_tcp_pose,
        "get_actual_tcp_speed": get_actual_tcp_speed,
        "get_actual_tool_flange_pose": get_actual_tool_flange_pose,
        "get_joint_positions": get_actual_joint_positions,
        "get_joint_speeds": get_actual_joint_speeds,
        "get_joint_torques": get_joint_torques,
        "get_tool_accelerometer_reading": get_tool_accelerometer_reading,
    }


def _asked(machine: Machine) -> Builtins:
    core, setpoint = machine.drive.core, machine.drive.motions.setpoint

    def get_target_joint_positions() -> Value:
        return as_list(setpoint.q_target)

    def get_target_joint_speeds() -> Value:
        return as_list(setpoint.qd_target)

    def get_target_joint_accelerations() -> Value:
        return as_list(setpoint.qdd_target)

    def get_target_tcp_pose() -> Value:
        return as_pose(core.target_tool()[0])

    def get_target_tcp_speed() -> Value:
        return as_pose(core.target_tool()[1])

    def get_target_waypoint() -> Value:
        # A move that has returned within its blend still goes on; what another motion leaves has no anchor.
        is_blending = core.tail is not None and core.tail.anchor_rad is not None
        waypoint = machine.waypoint if machine.n_moves or is_blending else None
        return as_pose(core.target_tool()[0] if waypoint is None else waypoint)

    return {
        "get_target_joint_accelerations": get_target_joint_accelerations,
        "get_target_joint_positions": get_target_joint_positions,
        "get_target_joint_speeds": get_target_joint_speeds,
        "get_target_tcp_pose": get_target_tcp_pose,
        "get_target_tcp_speed": get_target_tcp_speed,
        "get_target_waypoint": get_target_waypoint,
    }


def _housekeeping(machine: Machine) -> Builtins:
    def is_steady() -> Value:
        return machine.is_steady

    def get_controller_temp() -> Value:
        return CONTROLLER_C

    def get_joint_temp(j: Value) -> Value:
        if not 0 <= integer(j) < 6:
            raise ValueError(f"expected a joint from 0 to 5, got {j}")
        return JOINT_C

    def get_tool_temp() -> Value:
        return TOOL_C

    def get_tool_current() -> Value:
        return 0.0

    def get_speed_scaling() -> Value:
        return machine.drive.core.pace.scale

    return {
        "get_controller_temp": get_controller_temp,
        "get_joint_temp": get_joint_temp,
        "get_speed_scaling": get_speed_scaling,
        "get_tool_current": get_tool_current,
        "get_tool_temp": get_tool_temp,
        "is_steady": is_steady,
    }
