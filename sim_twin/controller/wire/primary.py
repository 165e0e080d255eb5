"""The robot state message of ports 30001 and 30002 as bytes. Pure.

A package is a big-endian 32-bit size that counts itself, an 8-bit type and the rest; a robot state is type 16 and holds
sub-packages framed the same way. Layouts from UR's client interface pages, cross-checked against the parsers of
Universal_Robots_Client_Library.
"""

import struct

from sim_twin.controller.wire.primary_state import (
    AdditionalInfo,
    CartesianInfo,
    ConfigurationData,
    ForceModeData,
    JointData,
    KinematicsInfo,
    MasterboardData,
    PrimaryState,
    RobotModeData,
    ToolData,
)
from sim_twin.controller.wire.version import ControllerVersion

__all__ = ["pack_package", "pack_state"]

_ROBOT_STATE = 16
_HEADER = struct.Struct(">iB")
_MODE = struct.Struct(">Q7?bB3d")
_JOINT = struct.Struct(">3d4fB")
_TOOL = struct.Struct(">2B2dfB2fB")
_MASTERBOARD = struct.Struct(">2i2B2d2b2d4fB?bI")
_CARTESIAN = struct.Struct(">12d")
_KINEMATICS = struct.Struct(">6I24dI")
_CONFIGURATION = struct.Struct(">53d4i")
_FORCE_MODE = struct.Struct(">7d")
_ADDITIONAL = struct.Struct(">B2?")


def pack_package(kind: int, body: bytes) -> bytes:
    """Return a package, or a sub-package, with its header."""
    return _HEADER.pack(_HEADER.size + len(body), kind) + body


def pack_state(state: PrimaryState, version: ControllerVersion) -> bytes:
    """Return a robot state message with the parts that are given, in the order of their types."""
    packed = (
        _mode(state.mode, version),
        state.joints and _joints(state.joints),
        state.tool and _tool(state.tool),
        state.masterboard and _masterboard(state.masterboard, version),
        state.cartesian and _cartesian(state.cartesian),
        state.kinematics and _kinematics(state.kinematics),
        state.configuration and _configuration(state.configuration),
        state.force_mode and _force_mode(state.force_mode),
        state.additional and _additional(state.additional, version),
    )
    return pack_package(
        _ROBOT_STATE, b"".join(pack_package(kind, body) for kind, body in enumerate(packed) if body is not None)
    )


def _mode(part: RobotModeData, version: ControllerVersion) -> bytes:
    body = _MODE.pack(
        part.timestamp_us,
        part.is_real_robot_connected,
        part.is_real_robot_enabled,
        part.is_power_on,
        part.is_emergency_stopped,
        part.is_protective_stopped,
        part.is_program_running,
        part.is_program_paused,
        part.robot_mode,
        part.control_mode,
        part.target_speed_fraction,
        part.speed_scaling,
        part.target_speed_fraction_limit,
    )
    return body + (b"\0" if version.has((5, 0), (3, 2)) else b"")


def _joints(part: JointData) -> bytes:
    no_micro_temperature = (0.0,) * 6
    columns = (
        part.q_rad,
        part.q_target_rad,
        part.qd_rad_s,
        part.current_a,
        part.voltage_v,
        part.motor_temperature_c,
        no_micro_temperature,
        part.mode,
    )
    return b"".join(_JOINT.pack(*row) for row in zip(*columns, strict=True))


def _tool(part: ToolData) -> bytes:
    return _TOOL.pack(
        *part.analog_input_ranges,
        *part.analog_inputs,
        part.voltage_48v_v,
        part.output_voltage_v,
        part.current_a,
        part.temperature_c,
        part.mode,
    )


def _masterboard(part: MasterboardData, version: ControllerVersion) -> bytes:
    no_euromap, reserved = 0, 0
    body = _MASTERBOARD.pack(
        part.digital_inputs,
        part.digital_outputs,
        *part.analog_input_ranges,
        *part.analog_inputs,
        *part.analog_output_domains,
        *part.analog_outputs,
        part.temperature_c,
        part.voltage_48v_v,
        part.robot_current_a,
        part.io_current_a,
        part.safety_mode,
        part.is_reduced,
        no_euromap,
        reserved,
    )
    if version.has((5, 0), None):
        body += bytes((part.operational_mode_selector, part.three_position_enabling))
    # The version that brought this byte is a guess; urcl expects it today.
    return body + (b"\0" if version.has((5, 5), None) else b"")


def _cartesian(part: CartesianInfo) -> bytes:
    return _CARTESIAN.pack(*part.tcp_pose, *part.tcp_offset)


def _kinematics(part: KinematicsInfo) -> bytes:
    return _KINEMATICS.pack(
        *part.checksum, *part.dh_theta_rad, *part.dh_a_m, *part.dh_d_m, *part.dh_alpha_rad, part.calibration_status
    )


def _configuration(part: ConfigurationData) -> bytes:
    motion = zip(part.qd_limits_rad_s, part.qdd_limits_rad_s2, strict=True)
    return _CONFIGURATION.pack(
        *(limit for pair in part.q_limits_rad for limit in pair),
        *(limit for pair in motion for limit in pair),
        part.joint_speed_default_rad_s,
        part.joint_acceleration_default_rad_s2,
        part.tool_speed_default_m_s,
        part.tool_acceleration_default_m_s2,
        part.equivalent_radius_m,
        *part.dh_a_m,
        *part.dh_d_m,
        *part.dh_alpha_rad,
        *part.dh_theta_rad,
        part.masterboard_version,
        part.controller_box_type,
        part.robot_type,
        part.robot_sub_type,
    )


def _force_mode(part: ForceModeData) -> bytes:
    return _FORCE_MODE.pack(*part.wrench, part.dexterity)


def _additional(part: AdditionalInfo, version: ControllerVersion) -> bytes:
    body = _ADDITIONAL.pack(part.button_state, part.is_freedrive_enabled, part.is_io_freedrive_enabled)
    return body + (b"\0" if version.has((5, 0), None) else b"")
