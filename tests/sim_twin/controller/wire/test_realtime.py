"""The realtime packet: sizes by version, places of its numbers."""

import struct

import msgspec
import pytest

from sim_twin.controller.wire import ControllerVersion
from sim_twin.controller.wire.realtime import RealtimeState, pack_realtime, realtime_size

# Columns as UR numbers them for gnuplot: the time is column 1. Vectors are told by their first column.
COLUMNS = {
    "time_s": 1,
    "q_target_rad": 2,
    "qd_target_rad_s": 8,
    "qdd_target_rad_s2": 14,
    "current_target_a": 20,
    "moment_target_nm": 26,
    "q_rad": 32,
    "qd_rad_s": 38,
    "current_a": 44,
    "control_current_a": 50,
    "tcp_pose": 56,
    "tcp_speed": 62,
    "tcp_force_n": 68,
    "tcp_pose_target": 74,
    "tcp_speed_target": 80,
    "digital_inputs": 86,
    "motor_temperature_c": 87,
    "controller_timer_ms": 93,
    "robot_mode": 95,
    "joint_modes": 96,
    "safety_mode": 102,
    "tool_acceleration_m_s2": 109,
    "speed_scaling": 118,
    "momentum_norm": 119,
    "main_voltage_v": 122,
    "robot_voltage_v": 123,
    "robot_current_a": 124,
    "joint_voltage_v": 125,
    "digital_outputs": 131,
    "program_state": 132,
    "elbow_position_m": 133,
    "elbow_velocity_m_s": 136,
    "safety_status": 139,
    "payload_kg": 143,
    "payload_cog_m": 144,
    "payload_inertia_kg_m2": 147,
}
WHOLE = {"digital_inputs", "digital_outputs"}


def at(packet, column, kind="d"):
    return struct.unpack_from(f">{kind}", packet, 4 + 8 * (column - 1))[0]


@pytest.mark.parametrize(
    ("version", "size"),
    [
        ((5, 26, 0), 1220),
        ((5, 10, 0), 1220),
        ((5, 9, 4), 1140),
        ((5, 8, 0), 1116),
        ((5, 4, 0), 1116),
        ((5, 3, 0), 1108),
        ((3, 15, 8), 1220),
        ((3, 10, 0), 1116),
        ((3, 5, 0), 1108),
        ((3, 2, 0), 1060),
        ((3, 0, 0), 1044),
    ],
)
def test_the_size_follows_the_announced_version(version, size):
    announced = ControllerVersion(major=version[0], minor=version[1], bugfix=version[2])
    packet = pack_realtime(RealtimeState(time_s=3.5, digital_inputs=9), announced)
    assert realtime_size(announced) == size
    assert len(packet) == size
    assert struct.unpack_from(">I", packet) == (size,)
    assert at(packet, 1) == 3.5
    assert at(packet, 86, "Q") == 9


def test_every_field_has_a_column():
    assert list(COLUMNS) == [field.name for field in msgspec.structs.fields(RealtimeState)]


@pytest.mark.parametrize("name", COLUMNS)
def test_a_field_lies_in_its_columns_and_nowhere_else(name):
    plain = RealtimeState(time_s=0.0)
    was = getattr(plain, name)
    n = len(was) if isinstance(was, tuple) else 1
    values = tuple(1000 + i for i in range(n))
    changed = msgspec.structs.replace(plain, **{name: values if isinstance(was, tuple) else values[0]})
    before, after = (pack_realtime(state, ControllerVersion()) for state in (plain, changed))
    kind = "Q" if name in WHOLE else "d"
    columns = range(COLUMNS[name], COLUMNS[name] + n)
    assert tuple(at(after, column, kind) for column in columns) == values
    first, last = 4 + 8 * (columns[0] - 1), 4 + 8 * columns[-1]
    assert before[:first] == after[:first]
    assert before[last:] == after[last:]
