"""Tool centre point, payload, gravity: what the controller is told about what it carries."""

from sim_twin.controller.builtins.moving import as_list, as_pose
from sim_twin.controller.machine import Machine
from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import number, slices_in, vector
from sim_twin.controller.script.builtins import pose as as_given

__all__ = ["payload_builtins"]


def payload_builtins(machine: Machine) -> Builtins:
    """Return setters and getters of tool, payload and gravity."""
    return {**_tool(machine), **_payload_setters(machine), **_payload_getters(machine), **_gravity(machine)}


MOST_INERTIA_KG_M2 = 133.0
"""Of any component (e-Series script directory)."""


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

    def tell(mass_kg: float, cog_m: list[float], n_transition: int = 0) -> None:
        drive.set_payload(mass_kg, cog_m, n_transition=n_transition)
        machine.payload_inertia = [0.0] * 6

    # The default is a guess: a robot takes the tool centre point, and goes on doing so as that moves.
    def set_payload(m: Value, cog: Value = None) -> Value:
        tell(number(m), known_cog() if cog is None else vector(cog, 3))

    def set_payload_mass(m: Value) -> Value:
        tell(number(m), known_cog())

    def set_payload_cog(CoG: Value) -> Value:  # noqa: N803 - UR's name
        tell(drive.payload[0], vector(CoG, 3))

    def set_target_payload(m: Value, cog: Value, inertia: Value = None, transition_time: Value = 0) -> Value:
        inertia_kg_m2 = [0.0] * 6 if inertia is None else _inertia(inertia)
        tell(number(m), vector(cog, 3), slices_in(number(transition_time), SLICE_S))
        machine.payload_inertia = inertia_kg_m2

    return {
        "set_payload": set_payload,
        "set_payload_cog": set_payload_cog,
        "set_payload_mass": set_payload_mass,
        "set_target_payload": set_target_payload,
    }


def _inertia(value: Value) -> list[float]:
    """Take a payload's inertia: no component beyond UR's limit, none about an axis below zero."""
    found = vector(value, 6)
    if min(found[:3]) < 0.0 or max(map(abs, found)) > MOST_INERTIA_KG_M2:
        raise ValueError(
            f"expected an inertia within {MOST_INERTIA_KG_M2:g} kg m², Ixx, Iyy and Izz of 0 or more, got {found}"
        )
    return found


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
