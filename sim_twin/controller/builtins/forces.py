"""force_mode, the force sensor, contact."""

import numpy as np

from sim_twin.controller.builtins.moving import as_pose
from sim_twin.controller.machine import Machine
from sim_twin.controller.motion import ForceKind, ForceTask
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import flag, integer, number, numbers, pose, vector

__all__ = ["force_builtins"]


def force_builtins(machine: Machine) -> Builtins:
    """Return what complies with forces and what feels them."""
    drive = machine.drive
    core = drive.core

    def force_mode(task_frame: Value, selection_vector: Value, wrench: Value, type: Value, limits: Value) -> Value:
        core.force_mode(
            ForceTask(
                frame=tuple(pose(task_frame)),
                is_compliant=tuple(axis != 0 for axis in vector(selection_vector, 6)),
                wrench=tuple(vector(wrench, 6)),
                kind=_kind_of(integer(type)),
                limits=tuple(vector(limits, 6)),
                damping=machine.force_damping,
                gain_scaling=machine.force_gain,
            )
        )
        return None

    def end_force_mode() -> Value:
        core.end_force_mode()

    def force_mode_set_damping(damping: Value) -> Value:
        machine.force_damping = _within(number(damping), 0.0, 1.0)

    def force_mode_set_gain_scaling(scaling: Value) -> Value:
        machine.force_gain = _within(number(scaling), 0.0, 2.0)

    def zero_ftsensor() -> Value:
        drive.zero_force()

    def get_tcp_force() -> Value:
        return as_pose(drive.measured.wrench)

    def force() -> Value:
        return float(np.linalg.norm(drive.measured.wrench[:3]))

    def tool_contact(direction: Value = None) -> Value:
        way = None if direction is None else np.array(_direction(direction))
        return drive.contact.slices_since_contact(way)

    def told_of_sensor(
        enable: Value,
        sensor_mass: Value = 0.0,
        sensor_measuring_offset: Value = None,  # noqa: ARG001 - the twin has its own sensor
        sensor_cog: Value = None,  # noqa: ARG001 - as above
    ) -> Value:
        number(sensor_mass)
        machine.journal.note(f"external force sensor: {'on' if flag(enable) else 'off'}; the twin's own goes on")

    return {
        "end_force_mode": end_force_mode,
        "enable_external_ft_sensor": told_of_sensor,
        "force": force,
        "force_mode": force_mode,
        "force_mode_set_damping": force_mode_set_damping,
        "force_mode_set_gain_scaling": force_mode_set_gain_scaling,
        "ft_rtde_input_enable": told_of_sensor,
        "get_tcp_force": get_tcp_force,
        "tool_contact": tool_contact,
        "zero_ftsensor": zero_ftsensor,
    }


def _kind_of(number: int) -> ForceKind:
    kinds = [int(kind) for kind in ForceKind]
    if number not in kinds:
        raise ValueError(f"expected a type from {min(kinds)} to {max(kinds)}, got {number}")
    return ForceKind(number)


def _direction(value: Value) -> list[float]:
    """Take a direction: three numbers, or six of which the rotation is left."""
    return vector(value, 6 if len(numbers(value)) == 6 else 3)[:3]


def _within(value: float, least: float, greatest: float) -> float:
    if not least <= value <= greatest:
        raise ValueError(f"expected {least:g} to {greatest:g}, got {value:g}")
    return value
