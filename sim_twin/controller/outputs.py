"""RTDE's outputs by name: what each field is read from. What the twin does not have is a quiet robot's constant."""

import math
from collections.abc import Callable

import mujoco
import numpy as np

from sim_twin.controller.builtins.state import JOINT_C
from sim_twin.controller.machine import Machine
from sim_twin.controller.motion import DhRow, Measured
from sim_twin.controller.motion.poses import Array
from sim_twin.controller.program import Programs
from sim_twin.controller.states import RobotMode
from sim_twin.controller.wire import Outputs, Value

__all__ = [
    "BUS_V", "COPIES", "JOINT_V", "elbow", "elbow_velocity", "joint_mode", "make_outputs", "momentum_n_s",
    "robot_current_a",
]  # fmt: skip

Getters = dict[str, Callable[[], Value]]
BUS_V, JOINT_V = 48.0, 48.0
JOINT_RUNNING, JOINT_IDLE, JOINT_POWER_OFF = 253, 255, 239
_BYTE = 0xFF
_STEP_S = 1e-6
_NO_VECTOR = (0.0,) * 6
_NOT_THERE = (
    "target_execution_time",
    "io_current",
    "euromap67_24V_voltage",
    "euromap67_24V_current",
    "tool_output_current",
    "actual_robot_energy_consumed",
    "actual_robot_braking_energy_dissipated",
    "collision_detection_ratio",
)
_NOT_COUNTED = (
    "time_scale_source",
    "euromap67_input_bits",
    "euromap67_output_bits",
    "tool_analog_input_types",
    "encoder0_raw",
    "encoder1_raw",
    "tool_output_mode",
    "tool_digital_output0_mode",
    "tool_digital_output1_mode",
)


COPIES = {
    "ft_raw_wrench": "actual_TCP_force",
    "wrench_calc_from_currents": "actual_TCP_force",
    "target_current": "actual_current",
    "joint_control_output": "actual_current",
    "target_moment": "actual_current_as_torque",
}
"""Fields that the twin has no figure of its own for, and the measured ones that stand in."""


def make_outputs(machine: Machine, programs: Programs) -> Outputs:
    """Return a getter for every output field."""
    found = _own_outputs(machine, programs)
    return {**found, **{name: found[original] for name, original in COPIES.items()}}


def _own_outputs(machine: Machine, programs: Programs) -> Getters:
    return {
        **machine.registers.getters(),
        **_asked(machine),
        **_measured(machine),
        **_forces(machine),
        **_modes(machine, programs),
        **_terminals(machine),
        **_told(machine),
        **_constants(),
    }


def joint_mode(machine: Machine) -> int:
    """Return UR's number for what the joints do."""
    robot = machine.modes.robot
    if robot is RobotMode.RUNNING:
        return JOINT_RUNNING
    return JOINT_IDLE if robot in (RobotMode.IDLE, RobotMode.POWER_ON, RobotMode.BACKDRIVE) else JOINT_POWER_OFF


def elbow(rows: tuple[DhRow, ...], q_rad: Array) -> tuple[float, float, float]:
    """Return where the elbow is, base axes (m): the end of the table's second row.  (6,) -> (3,)"""
    base, shoulder = rows[0], rows[1]
    q_1, q_2 = q_rad[0].item() + base.theta_rad, q_rad[1].item() + shoulder.theta_rad
    c, s, ca, sa = math.cos(q_1), math.sin(q_1), math.cos(base.alpha_rad), math.sin(base.alpha_rad)
    u, v, w = shoulder.a_m * math.cos(q_2), shoulder.a_m * math.sin(q_2), shoulder.d_m
    return (
        base.a_m * c + c * u - s * ca * v + s * sa * w,
        base.a_m * s + s * u + c * ca * v - c * sa * w,
        base.d_m + sa * v + ca * w,
    )


def elbow_velocity(rows: tuple[DhRow, ...], q_rad: Array, qd_rad_s: Array) -> tuple[float, float, float]:
    """Return how fast the elbow moves, base axes (m/s).  (6,), (6,) -> (3,)"""
    x, y, z = elbow(rows, q_rad)
    u, v, w = elbow(rows, q_rad + qd_rad_s * _STEP_S)
    return (u - x) / _STEP_S, (v - y) / _STEP_S, (w - z) / _STEP_S


def robot_current_a(measured: Measured) -> float:
    """Return what the arm draws: the sum of its joints' currents, without their signs (A)."""
    return sum(map(abs, measured.current_a.tolist()))


def momentum_n_s(machine: Machine) -> float:
    """Return the size of arm and hand's momentum (kg m/s), as of the physics' last step; what it holds is left out."""
    model, data = machine.world.model, machine.world.data
    mujoco.mj_subtreeVel(model, data)
    arm = model.body("link_0").id
    return float(np.linalg.norm(data.subtree_linvel[arm]) * model.body_subtreemass[arm])


def _asked(machine: Machine) -> Getters:
    setpoint = machine.drive.motions.setpoint
    return {
        "target_q": lambda: setpoint.q_target.tolist(),
        "target_qd": lambda: setpoint.qd_target.tolist(),
        "target_qdd": lambda: setpoint.qdd_target.tolist(),
        "target_TCP_pose": lambda: machine.target_tool()[0],
        "target_TCP_speed": lambda: machine.target_tool()[1],
    }


def _measured(machine: Machine) -> Getters:
    drive = machine.drive
    kinematics = drive.kinematics
    return {
        "actual_q": lambda: drive.measured.q_rad.tolist(),
        "actual_qd": lambda: drive.measured.qd_rad_s.tolist(),
        "actual_current": lambda: drive.measured.current_a.tolist(),
        "actual_current_as_torque": lambda: drive.measured.torque_nm.tolist(),
        "actual_TCP_pose": lambda: drive.measured.tcp_pose.tolist(),
        "actual_TCP_speed": lambda: drive.measured.tcp_speed.tolist(),
        "actual_tool_accelerometer": machine.tool_acceleration,
        "joint_position_deviation_ratio": lambda: drive.deviation_ratio,
        "actual_robot_current": lambda: robot_current_a(drive.measured),
        "actual_momentum": lambda: momentum_n_s(machine),
        "elbow_position": lambda: elbow(kinematics.rows, drive.measured.q_rad),
        "elbow_velocity": lambda: elbow_velocity(kinematics.rows, drive.measured.q_rad, drive.measured.qd_rad_s),
    }


def _forces(machine: Machine) -> Getters:
    drive = machine.drive

    def wrench() -> list[float]:
        return drive.measured.wrench.tolist()

    return {
        "actual_TCP_force": wrench,
        "tcp_force_scalar": lambda: float(np.linalg.norm(drive.measured.wrench[:3])),
    }


def _modes(machine: Machine, programs: Programs) -> Getters:
    modes, pace = machine.modes, machine.drive.core.pace
    return {
        "timestamp": lambda: machine.time_s,
        "control_step": lambda: machine.drive.n_slices,
        "actual_execution_time": lambda: machine.execution_s * 1e3,
        "speed_scaling": lambda: pace.scale,
        "target_speed_fraction": lambda: pace.slider,
        "robot_mode": lambda: int(modes.robot),
        "safety_mode": lambda: int(modes.safety),
        "safety_status": lambda: int(modes.safety),
        "runtime_state": lambda: int(modes.runtime),
        "robot_status_bits": lambda: modes.robot_status_bits,
        "safety_status_bits": lambda: modes.safety_status_bits,
        "script_control_line": lambda: programs.line,
        "joint_mode": lambda: (joint_mode(machine),) * 6,
        "tool_mode": lambda: joint_mode(machine),
    }


def _terminals(machine: Machine) -> Getters:
    io = machine.io

    def domains() -> int:
        return sum(domain << i for i, domain in enumerate((*io.analog_in_domain, *io.analog_out_domain)))

    return {
        "actual_digital_input_bits": lambda: io.digital_in,
        "actual_digital_output_bits": lambda: io.digital_out,
        "actual_configurable_digital_input_bits": lambda: io.digital_in >> 8 & _BYTE,
        "actual_configurable_digital_output_bits": lambda: io.digital_out >> 8 & _BYTE,
        "analog_io_types": domains,
        "standard_analog_input0": lambda: io.analog_input(0),
        "standard_analog_input1": lambda: io.analog_input(1),
        "standard_analog_output0": lambda: io.analog_output(0),
        "standard_analog_output1": lambda: io.analog_output(1),
        "tool_analog_input0": lambda: io.tool_analog_in[0],
        "tool_analog_input1": lambda: io.tool_analog_in[1],
        "tool_output_voltage": lambda: io.tool_voltage_v,
    }


def _told(machine: Machine) -> Getters:
    drive = machine.drive
    return {
        "tcp_offset": lambda: drive.core.tcp_offset.tolist(),
        "payload": lambda: drive.payload[0],
        "payload_cog": lambda: list(drive.payload[1]),
        "payload_inertia": lambda: machine.payload_inertia,
        "target_gravity": lambda: machine.gravity,
    }


def _constants() -> Getters:
    values: dict[str, Value] = {
        "actual_current_window": (1.0,) * 6,
        "actual_TCP_acceleration": _NO_VECTOR,
        "target_TCP_acceleration": _NO_VECTOR,
        "target_base_acceleration": _NO_VECTOR,
        "target_base_wrench": _NO_VECTOR,
        "joint_temperatures": (JOINT_C,) * 6,
        "actual_joint_voltage": (JOINT_V,) * 6,
        "actual_main_voltage": BUS_V,
        "actual_robot_voltage": BUS_V,
        "tool_temperature": JOINT_C,
    }
    values |= dict.fromkeys(_NOT_THERE, 0.0) | dict.fromkeys(_NOT_COUNTED, 0)
    return {name: lambda value=value: value for name, value in values.items()}
