"""Tool centre point, payload, gravity: what the controller is told about what it carries."""

from sim_twin.controller.builtins.moving import as_list, as_pose
from sim_twin.controller.machine import Machine
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import number, vector
from sim_twin.controller.script.builtins import pose as as_given

__all__ = ["payload_builtins"]


def payload_builtins(machine: Machine) -> Builtins:
    """Return setters and getters of tool, payload and gravity."""
    return {**_tool(machine), **_payload_setters(machine), **_payload_getters(machine), **_gravity(machine)}


def _tool(machine: Machine) -> Builtins:
    core = machine.drive.core

    def set_tcp(pose: Value, tcp_name: Value = "") -> Value:  # noqa: ARG001 - a name for the pendant
        core.set_tcp(as_given(pose))

    def get_tcp_offset() -> Value:
        return as_pose(core.tcp_offset)

    return {"get_tcp_offset": get_tcp_offset, "set_tcp": set_tcp}


def _payload_setters(machine: Machine) -> Builtins:
    drive = machine.drive

    def known_cog() -> list[float]:
        return list(drive.payload[1])

    def set_payload(m: Value, cog: Value = None) -> Value:
        drive.set_payload(number(m), known_cog() if cog is None else vector(cog, 3))

    def set_payload_mass(m: Value) -> Value:
        drive.set_payload(number(m), known_cog())

    def set_payload_cog(CoG: Value) -> Value:  # noqa: N803 - UR's name
        drive.set_payload(drive.payload[0], vector(CoG, 3))

    def set_target_payload(m: Value, cog: Value, inertia: Value = None, transition_time: Value = 0) -> Value:
        number(transition_time)
        drive.set_payload(number(m), vector(cog, 3))
        machine.payload_inertia = [0.0] * 6 if inertia is None else vector(inertia, 6)

    return {
        "set_payload": set_payload,
        "set_payload_cog": set_payload_cog,
        "set_payload_mass": set_payload_mass,
        "set_target_payload": set_target_payload,
    }


def _payload_getters(machine: Machine) -> Builtins:
    drive = machine.drive

    def get_target_payload() -> Value:
        return drive.payload[0]

    def get_target_payload_cog() -> Value:
        return as_list(drive.payload[1])

    def get_target_payload_inertia() -> Value:
        return list[Value](machine.payload_inertia)

    return {
        "get_target_payload": get_target_payload,
        "get_target_payload_cog": get_target_payload_cog,
        "get_target_payload_inertia": get_target_payload_inertia,
    }


def _gravity(machine: Machine) -> Builtins:
    def set_gravity(d: Value) -> Value:
        machine.gravity = vector(d, 3)

    def get_gravity() -> Value:
        return list[Value](machine.gravity)

    return {"get_gravity": get_gravity, "set_gravity": set_gravity}
