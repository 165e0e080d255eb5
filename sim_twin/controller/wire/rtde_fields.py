"""Every RTDE field with its type, and the version that brought it (UR's RTDE guide).

Where the guide's version column was not at hand the field is given to every version of the box; the dates in `_SINCE`
marked "about" are from release notes and clients, not from the guide.
"""

from collections.abc import Sequence
from enum import StrEnum

from sim_twin.controller.wire.version import ControllerVersion

__all__ = ["FieldType", "Value", "input_fields", "output_fields"]

_Since = tuple[tuple[int, ...] | None, tuple[int, ...] | None]
Value = bool | int | float | Sequence[int] | Sequence[float]


class FieldType(StrEnum):
    """The types by the names that travel in the reply to a set-up."""

    BOOL = "BOOL"
    UINT8 = "UINT8"
    UINT32 = "UINT32"
    UINT64 = "UINT64"
    INT32 = "INT32"
    DOUBLE = "DOUBLE"
    VECTOR3D = "VECTOR3D"
    VECTOR6D = "VECTOR6D"
    VECTOR6INT32 = "VECTOR6INT32"
    VECTOR6UINT32 = "VECTOR6UINT32"

    @property
    def code(self) -> str:
        """The layout of one value in the language of `struct`."""
        return _CODES[self]

    @property
    def n_items(self) -> int:
        """Numbers in one value: 1, 3 or 6."""
        head = self.code[0]
        return int(head) if head.isdigit() else 1


_CODES = {
    FieldType.BOOL: "?",
    FieldType.UINT8: "B",
    FieldType.UINT32: "I",
    FieldType.UINT64: "Q",
    FieldType.INT32: "i",
    FieldType.DOUBLE: "d",
    FieldType.VECTOR3D: "3d",
    FieldType.VECTOR6D: "6d",
    FieldType.VECTOR6INT32: "6i",
    FieldType.VECTOR6UINT32: "6I",
}

_OUTPUTS = {
    FieldType.DOUBLE: """
        timestamp actual_execution_time target_execution_time speed_scaling target_speed_fraction actual_momentum
        actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1
        standard_analog_output0 standard_analog_output1 io_current euromap67_24V_voltage euromap67_24V_current
        tool_analog_input0 tool_analog_input1 tool_output_current tool_temperature tcp_force_scalar
        actual_robot_energy_consumed actual_robot_braking_energy_dissipated joint_position_deviation_ratio
        collision_detection_ratio payload""",
    FieldType.VECTOR6D: """
        target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current
        actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose actual_TCP_speed
        actual_TCP_force target_TCP_pose target_TCP_speed tcp_offset actual_TCP_acceleration target_TCP_acceleration
        joint_temperatures actual_joint_voltage ft_raw_wrench wrench_calc_from_currents payload_inertia
        target_base_acceleration target_base_wrench""",
    FieldType.VECTOR3D: "actual_tool_accelerometer elbow_position elbow_velocity payload_cog target_gravity",
    FieldType.VECTOR6INT32: "joint_mode",
    FieldType.UINT64: """
        actual_digital_input_bits actual_configurable_digital_input_bits actual_digital_output_bits
        actual_configurable_digital_output_bits control_step""",
    FieldType.UINT32: """
        runtime_state robot_status_bits safety_status_bits analog_io_types euromap67_input_bits euromap67_output_bits
        tool_mode tool_analog_input_types script_control_line output_bit_registers0_to_31
        output_bit_registers32_to_63 input_bit_registers0_to_31 input_bit_registers32_to_63""",
    FieldType.INT32: """
        robot_mode safety_mode safety_status encoder0_raw encoder1_raw tool_output_voltage time_scale_source""",
    FieldType.UINT8: "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode",
}

_INPUTS = {
    FieldType.UINT32: "speed_slider_mask input_bit_registers0_to_31 input_bit_registers32_to_63",
    FieldType.DOUBLE: "speed_slider_fraction standard_analog_output_0 standard_analog_output_1",
    FieldType.UINT8: """
        standard_digital_output_mask standard_digital_output configurable_digital_output_mask
        configurable_digital_output tool_digital_output_mask tool_digital_output standard_analog_output_mask
        standard_analog_output_type""",
    FieldType.VECTOR6D: "external_force_torque",
}

# Name, or a register's family, to the first version of an e-Series and of a CB3 that has it.
_SINCE: dict[str, _Since] = {
    "elbow_position": ((5, 0), (3, 5)),
    "elbow_velocity": ((5, 0), (3, 5)),
    "safety_status": ((5, 4), (3, 10)),
    "payload": ((5, 5, 1), (3, 11)),
    "payload_cog": ((5, 5, 1), (3, 11)),
    "payload_inertia": ((5, 11), (3, 15)),
    "script_control_line": ((5, 9), (3, 14)),
    "ft_raw_wrench": ((5, 9), None),
    "wrench_calc_from_currents": ((5, 9), None),  # about
    "tcp_offset": ((5, 9, 4), (3, 14, 3)),
    "collision_detection_ratio": ((5, 15), None),  # about
    "time_scale_source": ((5, 17), None),  # about
    "actual_current_as_torque": ((5, 23), None),
    "actual_TCP_acceleration": ((5, 20), None),  # about
    "target_TCP_acceleration": ((5, 20), None),  # about
    "target_gravity": ((5, 20), None),  # about
    "target_base_acceleration": ((5, 20), None),  # about
    "target_base_wrench": ((5, 20), None),  # about
    "control_step": ((5, 26), None),  # as UR's client library says
    "actual_robot_energy_consumed": ((5, 15), None),  # about
    "actual_robot_braking_energy_dissipated": ((5, 15), None),  # about
    "tool_output_mode": ((5, 0), None),
    "tool_digital_output0_mode": ((5, 0), None),
    "tool_digital_output1_mode": ((5, 0), None),
    "external_force_torque": ((5, 0), (3, 3)),
    "bit registers 64-127": ((5, 3), (3, 9)),
    "registers 0-23": ((5, 0), (3, 4)),
    "registers 24-47": ((5, 3), (3, 9)),
}
_ALWAYS: _Since = ((5, 0), (3, 2))
_N_REGISTERS = 48
_N_FIELDBUS = 24
_BITS = range(64, 128)


def output_fields(version: ControllerVersion) -> dict[str, FieldType]:
    """Return what a client may ask to be sent, by name; input registers can be read back."""
    return _plain(_OUTPUTS, version) | _registers("output", version) | _registers("input", version)


def input_fields(version: ControllerVersion) -> dict[str, FieldType]:
    """Return what a client may write, by name."""
    return _plain(_INPUTS, version) | _registers("input", version)


def _plain(table: dict[FieldType, str], version: ControllerVersion) -> dict[str, FieldType]:
    return {
        name: kind for kind, names in table.items() for name in names.split() if version.has(*_SINCE.get(name, _ALWAYS))
    }


def _registers(direction: str, version: ControllerVersion) -> dict[str, FieldType]:
    fields: dict[str, FieldType] = {}
    if version.has(*_SINCE["bit registers 64-127"]):
        fields |= {f"{direction}_bit_register_{i}": FieldType.BOOL for i in _BITS}
    for word, kind in (("int", FieldType.INT32), ("double", FieldType.DOUBLE)):
        for i in range(_N_REGISTERS):
            family = "registers 0-23" if i < _N_FIELDBUS else "registers 24-47"
            if version.has(*_SINCE[family]):
                fields[f"{direction}_{word}_register_{i}"] = kind
    return fields
