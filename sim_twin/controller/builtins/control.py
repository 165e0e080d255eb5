"""What a program does to the controller itself."""

from sim_twin.controller.machine import Machine
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.states import Event

__all__ = ["control_builtins"]


def control_builtins(machine: Machine) -> Builtins:
    """Return stops and power; they take effect at the end of the slice."""

    def protective_stop() -> Value:
        machine.journal.note("protective_stop() by the program")
        machine.post(Event.PROTECTIVE_STOP)

    def powerdown() -> Value:
        machine.post(Event.POWER_OFF)
        machine.post(Event.STOP)
        machine.is_shut_down = True

    return {"powerdown": powerdown, "protective_stop": protective_stop}
