"""The realtime packet of port 30003: a 32-bit size and a row of 64-bit numbers. Pure.

UR only ever appended numbers, so that an older version's packet is the head of a newer one's.
"""

import struct

import msgspec

from sim_twin.controller.wire.primary_state import Vec6
from sim_twin.controller.wire.version import ControllerVersion

__all__ = ["RealtimeState", "pack_realtime", "realtime_size"]

_ZERO: Vec6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_48_V: Vec6 = (48.0, 48.0, 48.0, 48.0, 48.0, 48.0)
_ZERO3 = (0.0, 0.0, 0.0)
# Size, then the first version of an e-Series and of a CB3 that sends it (UR's "RealTime" pages).
_SIZES = (
    (1220, (5, 10), (3, 15)),
    (1140, (5, 9), (3, 14)),
    (1116, (5, 4), (3, 10)),
    (1108, (5, 0), (3, 5)),
    (1060, None, (3, 2)),
)
_SMALLEST = 1044
_N_BEFORE_INPUTS = 85
_N_BETWEEN = 44


class RealtimeState(msgspec.Struct, frozen=True, kw_only=True):
    """One realtime packet, in its order; poses are metres and rotation vectors, base frame."""

    time_s: float
    q_target_rad: Vec6 = _ZERO
    qd_target_rad_s: Vec6 = _ZERO
    qdd_target_rad_s2: Vec6 = _ZERO
    current_target_a: Vec6 = _ZERO
    moment_target_nm: Vec6 = _ZERO
    q_rad: Vec6 = _ZERO
    qd_rad_s: Vec6 = _ZERO
    current_a: Vec6 = _ZERO
    control_current_a: Vec6 = _ZERO
    tcp_pose: Vec6 = _ZERO
    tcp_speed: Vec6 = _ZERO
    tcp_force_n: Vec6 = _ZERO
    tcp_pose_target: Vec6 = _ZERO
    tcp_speed_target: Vec6 = _ZERO
    digital_inputs: int = 0
    motor_temperature_c: Vec6 = _ZERO
    controller_timer_ms: float = 0.0
    robot_mode: int = 7
    joint_modes: tuple[int, int, int, int, int, int] = (253, 253, 253, 253, 253, 253)
    safety_mode: int = 1
    tool_acceleration_m_s2: tuple[float, float, float] = _ZERO3
    speed_scaling: float = 1.0
    momentum_norm: float = 0.0
    main_voltage_v: float = 48.0
    robot_voltage_v: float = 48.0
    robot_current_a: float = 0.0
    joint_voltage_v: Vec6 = _48_V
    digital_outputs: int = 0
    program_state: int = 1
    elbow_position_m: tuple[float, float, float] = _ZERO3
    elbow_velocity_m_s: tuple[float, float, float] = _ZERO3
    safety_status: int = 1
    payload_kg: float = 0.0
    payload_cog_m: tuple[float, float, float] = _ZERO3
    payload_inertia_kg_m2: Vec6 = _ZERO


def realtime_size(version: ControllerVersion) -> int:
    """Return the packet's size in bytes."""
    return next((size for size, since_e, since_cb3 in _SIZES if version.has(since_e, since_cb3)), _SMALLEST)


def _layout(size: int) -> struct.Struct:
    # The digital inputs and outputs are bits of an integer among numbers that are all floating.
    n_after = (size - 4) // 8 - _N_BEFORE_INPUTS - 1 - _N_BETWEEN
    tail = f"Q{n_after - 1}d" if n_after else ""
    return struct.Struct(f">I{_N_BEFORE_INPUTS}dQ{_N_BETWEEN}d{tail}")


_LAYOUTS = {size: _layout(size) for size in (*(size for size, _, _ in _SIZES), _SMALLEST)}


def pack_realtime(state: RealtimeState, version: ControllerVersion) -> bytes:
    """Return the packet in the announced version's length."""
    size = realtime_size(version)
    n_numbers = (size - 4) // 8
    return _LAYOUTS[size].pack(size, *_numbers(state)[:n_numbers])


def _numbers(s: RealtimeState) -> tuple[float, ...]:
    unused = 0.0
    return (
        s.time_s,
        *s.q_target_rad,
        *s.qd_target_rad_s,
        *s.qdd_target_rad_s2,
        *s.current_target_a,
        *s.moment_target_nm,
        *s.q_rad,
        *s.qd_rad_s,
        *s.current_a,
        *s.control_current_a,
        *s.tcp_pose,
        *s.tcp_speed,
        *s.tcp_force_n,
        *s.tcp_pose_target,
        *s.tcp_speed_target,
        s.digital_inputs,
        *s.motor_temperature_c,
        s.controller_timer_ms,
        unused,
        s.robot_mode,
        *s.joint_modes,
        s.safety_mode,
        *_ZERO,
        *s.tool_acceleration_m_s2,
        *_ZERO,
        s.speed_scaling,
        s.momentum_norm,
        unused,
        unused,
        s.main_voltage_v,
        s.robot_voltage_v,
        s.robot_current_a,
        *s.joint_voltage_v,
        s.digital_outputs,
        s.program_state,
        *s.elbow_position_m,
        *s.elbow_velocity_m_s,
        s.safety_status,
        *_ZERO3,
        s.payload_kg,
        *s.payload_cog_m,
        *s.payload_inertia_kg_m2,
    )
