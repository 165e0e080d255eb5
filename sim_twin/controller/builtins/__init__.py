"""URScript's functions that need a robot, by topic; together with those that need none, all that a program can call."""

from sim_twin.controller.builtins.control import control_builtins
from sim_twin.controller.builtins.costs import COSTS
from sim_twin.controller.builtins.dynamics import dynamics_builtins
from sim_twin.controller.builtins.forces import force_builtins
from sim_twin.controller.builtins.guiding import guiding_builtins
from sim_twin.controller.builtins.kinematics import kinematics_builtins
from sim_twin.controller.builtins.moves import move_builtins
from sim_twin.controller.builtins.payload import payload_builtins
from sim_twin.controller.builtins.registers import register_builtins
from sim_twin.controller.builtins.speeds import speed_builtins
from sim_twin.controller.builtins.state import state_builtins
from sim_twin.controller.builtins.terminals import terminal_builtins
from sim_twin.controller.builtins.versions import known_to
from sim_twin.controller.machine import Machine
from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.script import Builtins
from sim_twin.controller.script.builtins import PURE, Sockets, message_builtins, time_builtins

__all__ = ["COSTS", "program_builtins", "robot_builtins"]


def robot_builtins(machine: Machine) -> Builtins:
    """Return what acts on a robot or tells of it."""
    return {
        **move_builtins(machine),
        **speed_builtins(machine),
        **force_builtins(machine),
        **guiding_builtins(machine),
        **kinematics_builtins(machine),
        **dynamics_builtins(machine),
        **state_builtins(machine),
        **payload_builtins(machine),
        **terminal_builtins(machine),
        **register_builtins(machine),
        **control_builtins(machine),
    }


def program_builtins(machine: Machine, sockets: Sockets) -> Builtins:
    """Return everything that one program can call at the announced version; its sockets are its own."""
    timing, messages = time_builtins(slice_s=SLICE_S), message_builtins(machine.journal)
    everything = {**PURE, **timing, **messages, **sockets.builtins, **robot_builtins(machine)}
    return known_to(machine.version, everything)
