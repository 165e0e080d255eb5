"""Freedrive and its older name, teach mode."""

from sim_twin.controller.machine import Machine
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import vector

__all__ = ["guiding_builtins"]

_ALL_AXES = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
_NORMAL = 0


def guiding_builtins(machine: Machine) -> Builtins:
    """Return what lets a person lead the arm by hand."""
    core = machine.drive.core

    def freedrive_mode(freeAxes: Value = None, feature: Value = None) -> Value:  # noqa: N803, ARG001 - UR's names; held axes are the base's
        free = _ALL_AXES if freeAxes is None else tuple(vector(freeAxes, 6))
        core.freedrive(free)

    def teach_mode() -> Value:
        core.freedrive()

    def end_freedrive_mode() -> Value:
        core.end_freedrive()

    def get_freedrive_status() -> Value:
        return _NORMAL

    return {
        "end_freedrive_mode": end_freedrive_mode,
        "end_teach_mode": end_freedrive_mode,
        "freedrive_mode": freedrive_mode,
        "get_freedrive_status": get_freedrive_status,
        "teach_mode": teach_mode,
    }
